"""The 21 errors step by step, as the paper of the L-shaped piece finds them, and how they compare with all at once.

Angles first, each a cubic through its values against the corner module (Eqs. 21, 22, 25 to 28); then squareness from
the straight lines through the paths of both arms (Eqs. 23, 24, 29); then translations with the angles' lever taken
out (Eqs. 33 to 36). Of an angle that two placements show, the first is used. X. Li et al., Appl. Sci. 9 (2019) 2701;
Eq. (32) with the indices that Eq. (1) gives.

It differs from the fit of all at once in three ways: a straight line through a curved path is no tangent, so the
squareness contains the bend of the paths and the lever of the angles; the first order of a straightness contains how
the piece was laid down; and what one step leaves of the noise is not corrected by the next, so it is less certain.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.methods.chain.identification import StepwiseCoefficient
from monitor.methods.chain.least_squares import RANK_TOLERANCE, Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.l_shape.base import ORDERS
from monitor.methods.l_shape.problem import LShapeProblem
from monitor.records import Array

STRAIGHT_LINES = "straight lines through curved paths instead of tangents where the axes read zero"
ALIGNMENT = "its first order holds how the piece was laid down"
Rows = npt.NDArray[np.int64]
NOISE = "noise that one step hands on to the next"


@dataclass(frozen=True)
class _Arm:
    """The rows of one arm of one placement, the corner first; ``axis`` is the machine axis that moves along it."""

    rows: Rows
    axis: str


def squareness(slope_first: float, slope_second: float) -> float:
    """Eq. (29): the angle from the first path to the second less a right angle, both slopes in the same sense.

    ``slope_first`` is how the first arm's path turns from its line towards the second arm, ``slope_second`` how that
    of the second arm turns away from the first. The paper's 878.009 and 534.5027 µm/m differ by 343.506 µrad or
    70.85 seconds of arc; the 71.6 that it prints are one step of its sensor more.
    """
    return float(np.arctan(slope_second) - np.arctan(slope_first))


def _arms(problem: LShapeProblem, rows: Rows) -> dict[str, tuple[_Arm, _Arm]]:
    arms_of_plane = {}
    for index, placement in enumerate(problem.piece.placements):
        placed = rows[problem.placement[rows] == index]
        if len(placed) == 0:
            continue
        flat = problem.in_plane[placed]
        arms = []
        for along in (0, 1):
            on = placed[np.abs(flat[:, 1 - along]) < 1e-3 * np.ptp(flat)]
            order = np.argsort(np.abs(problem.in_plane[on][:, along]), kind="stable")
            arms.append(_Arm(on[order], placement.plane[along]))
        arms_of_plane[placement.plane] = (arms[0], arms[1])
    return arms_of_plane


def _cubic(position: Array, value: Array) -> Array:
    """Coefficients (3,) of the cubic without constant, from values against the first row (Eq. 33)."""
    powers = np.stack([position**order for order in ORDERS], axis=1)
    scale = np.abs(powers).max(axis=0)
    columns = (powers - powers[0]) / scale
    deviation = value - value[0]
    coefficients: Array = np.linalg.lstsq(columns, deviation, rcond=None)[0] / scale
    return coefficients


def _steps(problem: LShapeProblem, rows: Rows, spots: Array) -> dict[str, float]:
    """All coefficients of one run (rows) from its spots (n, 4) in mm."""
    piece, chain = problem.piece, problem.context.chain
    tilts = -spots[:, :2] / (2.0 * piece.focal_length)
    lengths = -piece.paraboloid * (spots[:, 2:] / (2.0 * piece.focal_length) + tilts)
    tilts = tilts + np.array([module.tilt for module in piece.modules])[problem.module]
    arms = _arms(problem, rows)
    cubics: dict[str, Array] = {}
    # Step 1: u, v and w are right-handed, so a tilt along u is a turn about v, one along v a turn about -u.
    for plane, both in arms.items():
        for arm in both:
            q = problem.context.positions[arm.rows, chain.index(arm.axis)]
            for about, column in ((plane[1], tilts[arm.rows, 0]), (plane[0], -tilts[arm.rows, 1])):
                cubics.setdefault(f"E{'ABC'['XYZ'.index(about)]}{arm.axis}", _cubic(q, column))
    # Step 2.
    angles: dict[str, float] = {}
    for plane, (first_arm, second_arm) in arms.items():
        slopes = []
        for arm, along in ((first_arm, 0), (second_arm, 1)):
            path = problem.in_plane[arm.rows] + lengths[arm.rows]
            slopes.append(float(np.polyfit(path[:, along], path[:, 1 - along], 1)[0]))
        # The second path turns away from the first where it leans against its direction.
        right = squareness(slopes[0], -slopes[1])
        angles[_square_name(plane)] = right * (-1.0 if plane == "XZ" else 1.0)
    # Step 3: displacement less what the axis' own angles do at the sensor.
    for plane, both in arms.items():
        u, v = (np.eye(3)["XYZ".index(axis)] for axis in plane)
        for arm in both:
            q = problem.context.positions[arm.rows, chain.index(arm.axis)]
            lever = _lever(problem, arm)
            turned = np.stack([_at(cubics.get(f"E{c}{arm.axis}"), q) for c in "ABC"], axis=1)
            moved = np.cross(turned, lever)
            # Where the sensor is in the piece's plane, less how far the axis went by its readings.
            at = problem.in_plane[arm.rows] + lengths[arm.rows]
            at[:, plane.index(arm.axis)] -= q - q[0]
            for direction, axis, column in ((u, plane[0], at[:, 0]), (v, plane[1], at[:, 1])):
                cubics.setdefault(f"E{axis}{arm.axis}", _cubic(q, column - moved @ direction))
    numbers = dict(angles)
    for name, coefficients in cubics.items():
        for order, value in zip(ORDERS, coefficients, strict=True):
            numbers[f"{name}:poly{order}"] = float(value)
    return numbers


def _square_name(plane: str) -> str:
    """The location error between the two axes of a plane, for the chain X, Y, Z of the paper."""
    return {"XY": "EC0Y", "XZ": "EB0Z", "YZ": "EA0Z"}[plane]


def _at(coefficients: Array | None, q: Array) -> Array:
    if coefficients is None:
        return np.zeros(len(q))
    total: Array = sum(
        (c * q**order for order, c in zip(ORDERS, coefficients, strict=True)), np.zeros(len(q))
    )
    return total


def _lever(problem: LShapeProblem, arm: _Arm) -> Array:
    """From the axis' own frame to the sensor (n, 3) mm: the motion of the axes beyond it, and the tip."""
    chain = problem.context.chain
    lever = np.tile(np.array(problem.tip), (len(arm.rows), 1))
    index = chain.index(arm.axis)
    for beyond in range(index + 1, len(chain.joints)):
        direction = np.array(chain.joints[beyond].direction)
        lever += problem.context.positions[arm.rows, beyond, None] * direction
    return lever


def stepwise(problem: ChainProblem, solution: Solution, run: int) -> tuple[StepwiseCoefficient, ...]:
    """One run by both ways. ``solution`` is that of all at once.

    Raises DataError where the machine is not the paper's, X carrying Y carrying Z carrying the sensor, or the run has
    fewer than four modules on an arm.
    """
    assert isinstance(problem, LShapeProblem)
    chain = problem.context.chain
    if chain.work or [joint.name for joint in chain.tool] != ["X", "Y", "Z"]:
        raise DataError(
            "the stepwise identification is written for a machine 'w b X Y Z t'; use the fit of all at once"
        )
    rows = np.flatnonzero(problem.context.run == run)
    for plane, both in _arms(problem, rows).items():
        for arm in both:
            if len(np.unique(problem.module[arm.rows])) <= len(ORDERS):
                raise DataError(
                    f"run {run} scanned {len(arm.rows)} modules along {arm.axis} in the {plane} plane; "
                    "a cubic needs four"
                )
    index = int(np.flatnonzero(problem.runs == run)[0])
    measured = _steps(problem, rows, problem.spots)
    # Without noise: the spots that the fit predicts, with the modules as they were calibrated.
    as_calibrated = solution.local.copy()
    as_calibrated[:, -4 * len(problem.calibrated) :] = 0.0
    clean = _steps(problem, rows, problem.spots + problem.vectors(as_calibrated, solution.common))
    names = list(measured)
    slopes, at_once = _sensitivities(problem, solution, rows, index, measured)
    base = {
        effect.text: column
        for column, effect in enumerate(problem.base)
        if solution.local_free[index, column]
    }
    units = {effect.text: effect.unit for effect in problem.all_orders()}
    coefficients = []
    for row, name in enumerate(names):
        column = base.get(name)
        once = float(solution.local[index, column]) if column is not None else float("nan")
        coefficients.append(
            StepwiseCoefficient(
                parameter=name,
                unit=units[name],
                stepwise=measured[name],
                u_stepwise=float(np.linalg.norm(slopes[row])),
                at_once=once,
                u_at_once=float(np.linalg.norm(at_once[row])) if column is not None else float("nan"),
                by_method=clean[name] - once if column is not None else 0.0,
                u_noise=float(np.linalg.norm(slopes[row] - at_once[row])),
                why=_why(name),
            )
        )
    return tuple(coefficients)


def _why(name: str) -> str:
    if name[1] in "XYZ" and name[1] != name[2] and name.endswith(":poly1"):
        return ALIGNMENT
    return STRAIGHT_LINES if ":" not in name else NOISE


def _sensitivities(
    problem: LShapeProblem, solution: Solution, rows: Rows, index: int, measured: dict[str, float]
) -> tuple[Array, Array]:
    """How the coefficients of both ways follow every input, each in its standard uncertainty: (k, N) twice.

    The inputs are the run's spots, then the calibrated places and tilts of the modules.
    """
    sigma = problem.sigma[rows]
    columns = []
    for number, row in enumerate(rows):
        for axis in range(4):
            columns.append(_change(_shifted(problem, row, axis, float(sigma[number, axis])), rows, measured))
    piece = problem.piece
    for module in problem.calibrated:
        for axis in range(4):
            u = piece.place_uncertainty if axis < 2 else piece.tilt_uncertainty
            columns.append(_change(_recalibrated(problem, module, axis, u), rows, measured))
    last = solution.last.local[index]
    scale = np.linalg.norm(last, axis=0)
    scale[scale == 0.0] = 1.0
    inverse = np.linalg.pinv(last / scale, rcond=RANK_TOLERANCE) / scale[:, None]
    # Rows of a run are padded; its spots come first, the calibrations last.
    extras = len(problem.extra_names)
    used = [*range(4 * len(rows)), *range(len(last) - extras, len(last))]
    base = {effect.text: at for at, effect in enumerate(problem.base)}
    once = np.zeros((len(measured), len(used)))
    for row, name in enumerate(measured):
        if name in base:
            once[row] = inverse[base[name], used]
    # Both derivatives have one sign: a spot enters as predicted less measured, a calibration as unknown less
    # calibrated.
    return np.array(columns).T, once


def _change(moved: LShapeProblem, rows: Rows, measured: dict[str, float]) -> list[float]:
    # The steps are linear in their inputs but for the arctangent of a slope of some 1e-4.
    coefficients = _steps(moved, rows, moved.spots)
    return [coefficients[name] - measured[name] for name in measured]


def _shifted(problem: LShapeProblem, row: int, axis: int, by: float) -> LShapeProblem:
    spots = problem.spots.copy()
    spots[row, axis] += by
    return replace(problem, spots=spots)


def _recalibrated(problem: LShapeProblem, module: int, axis: int, by: float) -> LShapeProblem:
    calibrated = problem.piece.modules[module]
    centre, tilt = list(calibrated.centre), list(calibrated.tilt)
    (centre if axis < 2 else tilt)[axis % 2] += by
    modules = list(problem.piece.modules)
    modules[module] = replace(calibrated, centre=(centre[0], centre[1]), tilt=(tilt[0], tilt[1]))
    return replace(problem, piece=replace(problem.piece, modules=tuple(modules)))
