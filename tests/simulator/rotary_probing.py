"""Touching a test piece at indexed angles: a touch is solved exactly for the distance travelled along the approach.

The tip's centre starts where the ideal machine would touch the ideal piece and travels along the stated normal until
it is a tip's radius from the true surface of the true piece: a plane wherever the piece stands and however its faces
are tilted, or a sphere. Errors of the linear axes shift the tip as a function of the readings. Nothing is linearised,
and nothing of `monitor` is imported. `paper_machine` is Eqs. (1) and (2) of Ibaraki et al. 2012 in their own symbols.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np

from .chain import Chain, branch_matrix, carried, small_motion

Linear = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Feature:
    """A point of the piece: nominal place on the surface, outward normal; the ball's centre where it is a sphere."""

    target: str
    place: tuple[float, float, float]
    normal: tuple[float, float, float]
    centre: tuple[float, float, float] | None = None
    radius: float = 0.0


@dataclass(frozen=True)
class Piece:
    """What is really clamped: shift (mm) and turn (rad) of it all, tilt of faces (rad), form of points (mm)."""

    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tilt: Mapping[tuple[float, float, float], tuple[float, float, float]] = field(default_factory=dict)
    form: Mapping[str, float] = field(default_factory=dict)


def block(
    top: tuple[float, float, float] = (0.0, -200.0, 170.0),
    half: float = 50.0,
    along: Sequence[float] = (-34.0, -12.0, 12.0, 34.0),
    height: float = 160.0,
    grid: float = 35.0,
) -> list[Feature]:
    """The paper's block: four points on each side face at one height, twelve round the top face, 28 in all."""
    x0, y0, z0 = top
    found = []
    for number, (nx, ny) in enumerate(((0, -1), (1, 0), (0, 1), (-1, 0))):
        for k, s in enumerate(along):
            place = (x0 + nx * half - ny * s, y0 + ny * half + nx * s, height)
            found.append(Feature(f"side{number + 1}-{k + 1}", place, (float(nx), float(ny), 0.0)))
    steps = (grid, grid / 3, -grid / 3, -grid)
    around = [(x, y) for x in steps for y in steps if max(abs(x), abs(y)) == grid]
    found += [
        Feature(f"top-{k + 1}", (x0 + x, y0 + y, z0), (0.0, 0.0, 1.0)) for k, (x, y) in enumerate(around)
    ]
    return found


def sphere(target: str, centre: tuple[float, float, float], radius: float = 12.5) -> list[Feature]:
    """A sphere touched at its pole, at four points of the equator's upper side and one between each two."""
    directions = [(0.0, 0.0, 1.0)]
    for k in range(8):
        up = 0.2 if k % 2 else 0.6
        level = np.sqrt(1.0 - up**2)
        directions.append((level * np.cos(k * np.pi / 4), level * np.sin(k * np.pi / 4), up))
    return [
        Feature(target, tuple(np.array(centre) + radius * np.array(n)), tuple(map(float, n)), centre, radius)
        for n in directions
    ]


PAPER_POSES = [
    (0.0, 0.0),
    (0.0, 90.0),
    (0.0, 180.0),
    (0.0, 270.0),
    (-90.0, 90.0),
    (-90.0, 180.0),
    (-90.0, 270.0),
]


def paper_plan(features: Sequence[Feature] | None = None) -> list[tuple[Feature, dict[str, float]]]:
    """154 touches: all 28 points at A = 0; at A = -90 degrees the 14 that a stylus of 50 mm reaches from above."""
    plan = []
    for a, c in PAPER_POSES:
        turned = _rotation("A", -np.radians(a)) @ _rotation("C", -np.radians(c))
        for one in block() if features is None else features:
            place, normal = turned @ np.array(one.place), turned @ np.array(one.normal)
            middle = (turned @ np.array([0.0, -200.0, 95.0]))[2]
            reached = normal[2] > 0.9 or (normal[2] > -0.9 and place[2] > middle + 1e-6)
            if a == 0.0 or reached:
                plan.append((one, {"A": a, "C": c}))
    return plan


def every_pose(
    features: Sequence[Feature], angles: Sequence[dict[str, float]]
) -> list[tuple[Feature, dict[str, float]]]:
    """Every point at every pose, whatever would stand in the way."""
    return [(one, dict(at)) for at in angles for one in features]


def _rotation(letter: str, angle: float) -> np.ndarray:
    from .chain import turn

    return turn(letter, np.array([angle]))[0, :3, :3]


def _axes_of(chain: Chain) -> np.ndarray:
    return np.array([["XYZ".index(axis.name[0])] for axis in chain.linear]).ravel()


def touch(
    chain: Chain,
    plan: Sequence[tuple[Feature, Mapping[str, float]]],
    location: Mapping[str, np.ndarray],
    rng: np.random.Generator,
    *,
    piece: Piece | None = None,
    noise_mm: float = 0.0,
    tip: tuple[float, float, float] = (0.0, 0.0, 0.0),
    tip_radius: float = 3.0,
    linear: Callable[[np.ndarray], np.ndarray] | None = None,
    motion: Mapping[str, np.ndarray] | None = None,
    pre_travel: Callable[[np.ndarray], np.ndarray] | None = None,
) -> dict[str, np.ndarray]:
    """Readings (n,) of every axis (mm, degrees) of one run. ``location`` holds (6,) X Y Z A B C of axes by name,
    ``motion`` their error motions (n, 6) at every touch, which act behind the axis's own turn.

    ``linear`` maps readings (n, 3) X Y Z to the shift (n, 3) mm of the tip against the work side that the errors of
    the linear axes cause, in the machine's directions. ``pre_travel`` maps outward normals (n, 3) in the machine's
    directions to what the probe, which does not turn, travels on (n,) mm before it triggers.
    """
    piece = piece or Piece()
    count = len(plan)
    place = np.array([one.place for one, _ in plan])
    normal = np.array([one.normal for one, _ in plan])
    readings = {axis.name: np.zeros(count) for axis in chain.axes}
    for axis in chain.rotary:
        readings[axis.name] = np.radians([at.get(axis.name, 0.0) for _, at in plan])
    errors = {name: np.broadcast_to(np.asarray(six, float), (count, 6)) for name, six in location.items()}
    tips = np.broadcast_to(np.asarray(tip, float), (count, 3))

    def tip_in_work(now: dict[str, np.ndarray], wrong: dict[str, np.ndarray]) -> np.ndarray:
        """The tip's centre (n, 3) in the table's frame."""
        moving = (motion or {}) if wrong is errors else {}
        work = branch_matrix(chain.work, now, wrong, moving, count)
        at = carried(branch_matrix(chain.tool, now, wrong, moving, count), tips)
        if linear is not None and wrong is errors:
            xyz = np.column_stack([now[axis.name] for axis in chain.linear])
            bent = linear(xyz)
            # Errors of linear axes on the work side act against the piece: the same shift in the machine's directions.
            at = at + bent
        return np.einsum("nji,nj->ni", work[:, :3, :3], at - work[:, :3, 3])

    # Ideal machine: the tip's centre a radius off the ideal surface. Linear in the readings, so one step is exact.
    wanted = place + tip_radius * normal
    start = tip_in_work(readings, {})
    slopes = []
    for axis in chain.linear:
        slopes.append(tip_in_work(readings | {axis.name: readings[axis.name] + 1.0}, {}) - start)
    matrix = np.stack(slopes, axis=2)
    commanded = np.linalg.solve(matrix, (wanted - start)[:, :, None])[:, :, 0]
    approach = np.linalg.solve(matrix, normal[:, :, None])[:, :, 0]

    turn = small_motion(np.array([[*piece.shift, *piece.turn]]))[0]
    distance = _distance(plan, piece, turn, tip_radius)
    travel = np.zeros(count)
    for _ in range(20):
        gap = [
            distance(tip_in_work(_moved(readings, chain, commanded, approach, travel + h), errors))
            for h in (0.0, 1e-3)
        ]
        step = gap[0] / ((gap[1] - gap[0]) / 1e-3)
        travel = travel - step
        if np.abs(step).max() < 1e-11:
            break
    else:
        raise RuntimeError("a touch was not found")
    if pre_travel is not None:
        turned = branch_matrix(chain.work, readings, {}, {}, count)[:, :3, :3]
        travel = travel - pre_travel(np.einsum("nij,nj->ni", turned, normal))
    travel = travel + noise_mm * rng.standard_normal(count)
    seen = _moved(readings, chain, commanded, approach, travel)
    return {name: np.degrees(v) if name[0] in "ABC" else v for name, v in seen.items()}


def _moved(
    readings: dict[str, np.ndarray],
    chain: Chain,
    commanded: np.ndarray,
    approach: np.ndarray,
    travel: np.ndarray,
) -> dict[str, np.ndarray]:
    moved = {axis.name: commanded[:, k] + travel * approach[:, k] for k, axis in enumerate(chain.linear)}
    return readings | moved


def _distance(
    plan: Sequence[tuple[Feature, Mapping[str, float]]], piece: Piece, turn: np.ndarray, tip_radius: float
) -> Callable[[np.ndarray], np.ndarray]:
    """Distance of the tip's ball from the true surface, for centres (n, 3) in the table's frame."""
    form = np.array([piece.form.get(one.target, 0.0) for one, _ in plan])
    is_ball = np.array([one.centre is not None for one, _ in plan])
    centre = np.array([one.centre if one.centre is not None else one.place for one, _ in plan])
    middle = np.mean([one.place for one, _ in plan], axis=0)
    anchor = (centre - middle) @ turn[:3, :3].T + turn[:3, 3] + middle
    facing = []
    anchors = anchor.copy()
    faces: dict[tuple[float, float, float], list[int]] = {}
    for k, (one, _) in enumerate(plan):
        faces.setdefault(one.normal, []).append(k)
    for normal, rows in faces.items():
        # A tilted face turns about the middle of its points.
        own = small_motion(np.array([[0.0, 0.0, 0.0, *piece.tilt.get(normal, (0.0, 0.0, 0.0))]]))[0][:3, :3]
        about = anchor[rows].mean(axis=0)
        anchors[rows] = np.where(is_ball[rows, None], anchor[rows], (anchor[rows] - about) @ own.T + about)
        facing += [(k, turn[:3, :3] @ own @ np.array(normal)) for k in rows]
    out = np.array([n for _, n in sorted(facing, key=lambda pair: pair[0])])
    radius = np.array([one.radius for one, _ in plan])

    def distance(tips: np.ndarray) -> np.ndarray:
        plane = np.sum((tips - anchors) * out, axis=1) - form - tip_radius
        ball = np.linalg.norm(tips - anchor, axis=1) - radius - form - tip_radius
        return np.where(is_ball, ball, plane)

    return distance


def paper_machine(symbols: Mapping[str, float], a: float, c: float) -> np.ndarray:
    """The transform (4, 4) from the table to the machine coordinates, Eq. (1); mm, rad; alpha_CA = gamma_CA = 0."""

    def d(letter: str, amount: float) -> np.ndarray:
        from .chain import shift, turn

        return (turn if letter in "ABC" else shift)(letter, np.array([amount]))[0]

    s = symbols.get
    y_a = d("X", s("dx_AY", 0.0)) @ d("Y", s("dy_AY", 0.0)) @ d("Z", s("dz_AY", 0.0))
    y_a = (
        y_a @ d("A", s("alpha_AY", 0.0)) @ d("B", s("beta_AY", 0.0)) @ d("C", s("gamma_AY", 0.0)) @ d("A", -a)
    )
    return y_a @ d("Y", s("dy_CA", 0.0)) @ d("B", s("beta_CA", 0.0)) @ d("C", -c)


def write_rotary_campaign(
    folder: Path,
    name: str,
    topology: str,
    plan: Sequence[tuple[Feature, Mapping[str, float]]],
    runs: Sequence[dict[str, np.ndarray]],
    *,
    machine_id: str = "5A-001",
    probe_um: float = 0.7,
    tip: tuple[float, float, float] | None = (0.0, 0.0, 0.0),
    first: datetime = datetime(2026, 3, 2, 9, 0, tzinfo=timezone(timedelta(hours=9))),
    spacing_min: float = 25.0,
    days: Sequence[int] | None = None,
    starts: Sequence[datetime] | None = None,
    tolerances: Mapping[str, float] | None = None,
    serial: str | None = None,
    period_s: float = 7.8,
    ambient: Sequence[float] | None = None,
) -> Path:
    """A campaign folder of ``rotary-probing``: ``runs`` are what ``touch`` returned."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["format = 1", f'campaign = "{name}"', 'method = "rotary-probing"', "", "[machine]"]
    lines += [f'id = "{machine_id}"', f'topology = "{topology}"']
    lines += [f'serial_number = "{serial}"'] if serial else []
    if tolerances:
        lines += ["", "[machine.tolerances]", *(f"{key} = {value}" for key, value in tolerances.items())]
    lines += ["", "[probe]", 'id = "probe-1"', 'model = "touch-trigger probe"']
    lines += [f"standard_uncertainty_um = {probe_um}"]
    lines += [f"tip_mm = {[float(v) for v in tip]}"] if tip is not None else []
    lines += ["", "[artefact]", 'id = "test piece"']
    balls = {one.target: one for one, _ in plan if one.centre is not None}
    for ball in balls.values():
        lines += ["", "[[artefact.balls]]", f'id = "{ball.target}"']
        lines += [f"nominal_mm = {[float(v) for v in ball.centre]}", f"diameter_mm = {2 * ball.radius}"]
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with (folder / "runs.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["run", "started_at", "day", "warm_up", "ambient_degC"])
        for k in range(len(runs)):
            start = starts[k] if starts is not None else first + timedelta(minutes=spacing_min * k)
            degrees = 22.0 if ambient is None else ambient[k]
            out.writerow(
                [k + 1, start.isoformat(), 1 if days is None else days[k], "false", f"{degrees:.1f}"]
            )
    linear = [axis for axis in runs[0] if axis[0] in "XYZUVW"]
    rotary = [axis for axis in runs[0] if axis[0] in "ABC"]
    with (folder / "probings.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        columns = [
            *(f"{axis.lower()}_mm" for axis in sorted(linear)),
            *(f"{axis.lower()}_deg" for axis in sorted(rotary)),
        ]
        out.writerow(["run", "sequence", "time_s", "target", *columns, "normal_x", "normal_y", "normal_z"])
        for run, seen in enumerate(runs, 1):
            for k, (one, _) in enumerate(plan):
                row = [run, k + 1, f"{k * period_s:.1f}", one.target]
                row += [f"{seen[axis][k]:.4f}" for axis in sorted(linear)]
                row += [f"{seen[axis][k]:.9g}" for axis in sorted(rotary)]
                out.writerow([*row, *(f"{v:.9g}" for v in one.normal)])
    return folder
