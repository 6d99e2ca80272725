"""Expected uncertainties of a plan before anyone measures: what every touch that it could make is worth.

A candidate touch is a target at an indexation. Its three residuals depend on the parameters, the stylus tip and
the target's own place, which no other target shares; with the places eliminated, the information on parameters
and tip is a sum over the targets (a block elimination of the normal equations). So thousands of plans are
weighed in a second, from one walk through the chain. First order, at a machine without errors: errors of 100 µrad
change the Jacobian, and with it an uncertainty, by some 1e-4 of itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.effects import Context
from monitor.exceptions import DataError
from monitor.machine import evaluate, touching_positions
from monitor.methods.chain.least_squares import MEMBER_SHARE, RANK_TOLERANCE
from monitor.methods.chain.touch import TouchProblem
from monitor.records import Array

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Bar:
    """A calibrated distance between two targets (places in ``Touches.targets``), and its standard uncertainty."""

    first: int
    second: int
    direction: Array
    standard_uncertainty: float


@dataclass(frozen=True)
class Touches:
    """Everything that could be touched: T targets at P indexations.

    ``poses`` (P, J) rotary positions, rad; ``positions`` (P, T, J) where the axes stand; ``rows`` (P, T, 3, q)
    derivatives of the vectors by the q parameters ``names``, in standard uncertainties ``sigma`` (mm) of a
    coordinate; ``reachable`` (P, T). The tip's coordinates are the last three parameters unless it is known.
    """

    targets: tuple[str, ...]
    poses: Array
    positions: Array
    rows: Array
    reachable: Mask
    names: tuple[str, ...]
    reported: int
    sigma: float
    bars: tuple[Bar, ...]

    @cached_property
    def squares(self) -> Array:
        """The sum of squares (P, T, q, q) of every touch's rows."""
        return np.asarray(np.einsum("ptai,ptaj->ptij", self.rows, self.rows))


@dataclass(frozen=True)
class Expected:
    """What a plan promises: standard uncertainties ``u`` (k,) in internal units, NaN where it gives no number.

    ``alone`` (k,) is what would be left if everything else were known. ``separation`` compares the two.
    ``covariance`` (k, k) is that of the parameters ``names``.
    """

    names: tuple[str, ...]
    u: Array
    alone: Array
    covariance: Array

    @property
    def separation(self) -> Array:
        """From 0 (the plan cannot tell the parameter from others) to 1 (nothing is lost to them), (k,)."""
        return np.asarray(
            np.where(np.isfinite(self.u), self.alone / np.where(np.isfinite(self.u), self.u, 1.0), 0.0)
        )

    @property
    def determined(self) -> Mask:
        """Which parameters get a number (k,)."""
        return np.isfinite(self.u)


def planned_context(
    template: Context, positions: Array, targets: Sequence[str], nominal: Array, pose: npt.NDArray[np.int64]
) -> Context:
    """The context of touches (n,) of one run that nobody made: recorded columns stand at their means."""
    count = len(positions)
    mean = {
        name: np.full(
            count, float(np.mean(values[np.isfinite(values)])) if np.isfinite(values).any() else np.nan
        )
        for name, values in template.columns.items()
    }
    for place, joint in enumerate(template.chain.joints):
        name = f"{joint.name.lower()}_{'deg' if joint.turns else 'mm'}"
        if name in mean:
            readings = joint.sign * positions[:, place]
            mean[name] = np.rad2deg(readings) if joint.turns else readings
    return replace(
        template,
        positions=positions,
        expected=None,
        run=np.full(count, int(template.run[0])),
        sequence=np.arange(1, count + 1),
        time=pose.astype(float),
        day_time=pose.astype(float),
        run_time=np.linspace(0.0, 1.0, count),
        target=np.array(targets),
        nominal=nominal,
        columns=mean,
    )


def candidate_touches(
    problem: TouchProblem,
    poses: Array,
    targets: Sequence[str],
    places: Array,
    strokes: dict[str, tuple[float, float]],
    *,
    tip_known: bool = False,
) -> Touches:
    """Every touch of ``targets`` (T,) at ``places`` (T, 3) mm, at the rotary ``poses`` (P, J) in rad.

    ``strokes`` gives the range of positions of linear axes in mm; axes without one reach everything. The base
    effects, the mean standard uncertainty of a coordinate and the distances are those of ``problem``. Raises
    DataError for a distance whose targets are not there.
    """
    chain = problem.context.chain
    count = len(poses) * len(targets)
    nominal = np.tile(np.asarray(places, dtype=np.float64), (len(poses), 1))
    errors = np.zeros((count, len(chain.joints), 2, 6))
    tip = np.array(problem.tip)
    positions = touching_positions(chain, np.repeat(poses, len(targets), axis=0), errors, nominal, tip)
    seen = evaluate(chain, positions, errors, nominal, tip, jacobian=True)
    assert seen.by_error is not None
    context = planned_context(
        problem.context,
        positions,
        list(targets) * len(poses),
        nominal,
        np.repeat(np.arange(len(poses)), len(targets)),
    )
    parts = [effect.basis(context).displacement(seen.by_error) for effect in problem.base]
    names = problem.base_names
    if not tip_known:
        parts.append(seen.by_tip)
        names = (*names, "tip x", "tip y", "tip z")
    sigma = float(np.sqrt(np.mean(problem.sigma[np.isfinite(problem.sigma)] ** 2)))
    inside = np.ones(count, dtype=bool)
    for place, joint in enumerate(chain.joints):
        if not joint.turns and joint.name in strokes:
            low, high = strokes[joint.name]
            inside &= (positions[:, place] >= low - 1e-9) & (positions[:, place] <= high + 1e-9)
    shape = (len(poses), len(targets))
    return Touches(
        targets=tuple(targets),
        poses=poses,
        positions=positions.reshape(*shape, -1),
        rows=(np.concatenate(parts, axis=-1) / sigma).reshape(*shape, 3, len(names)),
        reachable=inside.reshape(shape),
        names=names,
        reported=len(problem.base_names),
        sigma=sigma,
        bars=tuple(
            _bar(distance.between, distance.standard_uncertainty, targets, places)
            for distance in problem.distances
        ),
    )


def _bar(between: tuple[str, str], u: float, targets: Sequence[str], places: Array) -> Bar:
    lacking = [name for name in between if name not in targets]
    if lacking:
        raise DataError(
            f"the calibrated distance needs {' and '.join(lacking)}, but the targets are {', '.join(targets)}"
        )
    first, second = (list(targets).index(name) for name in between)
    along = np.asarray(places[first] - places[second], dtype=np.float64)
    return Bar(first, second, along / np.linalg.norm(along), u)


@dataclass(frozen=True)
class Sums:
    """What plans add up to: ``squares`` (..., q, q) of all rows, ``rows`` (..., T, 3, q) of each target and how many
    ``touches`` (..., T) it has. The sums of two plans without a common touch add."""

    squares: Array
    rows: Array
    touches: Array

    def __add__(self, other: Sums) -> Sums:
        return Sums(self.squares + other.squares, self.rows + other.rows, self.touches + other.touches)


def sums_of(touches: Touches, touched: Mask) -> Sums:
    """The sums of plans ``touched`` (..., P, T)."""
    weight = touched.astype(float)
    return Sums(
        np.einsum("...pt,ptij->...ij", weight, touches.squares),
        np.einsum("...pt,ptai->...tai", weight, touches.rows),
        weight.sum(axis=-2),
    )


def sums_by_pose(touches: Touches, touched: Mask) -> Sums:
    """The sums (P, ...) of each pose of the plan ``touched`` (P, T) by itself."""
    weight = touched.astype(float)
    return Sums(
        np.einsum("pt,ptij->pij", weight, touches.squares), weight[:, :, None, None] * touches.rows, weight
    )


def information(touches: Touches, sums: Sums) -> Array:
    """Information (..., q, q) of plans on parameters and tip, the targets' places free."""
    paired = [place for bar in touches.bars for place in (bar.first, bar.second)]
    single = [place for place in range(len(touches.targets)) if place not in paired]
    rows = sums.rows[..., single, :, :]
    weight = 1.0 / np.sqrt(np.maximum(sums.touches[..., single], 1.0))
    rows = (rows * weight[..., None, None]).reshape(*rows.shape[:-3], -1, rows.shape[-1])
    lost = np.swapaxes(rows, -1, -2) @ rows
    for bar in touches.bars:
        lost = lost + _lost_to_bar(touches, bar, sums.rows, sums.touches)
    return np.asarray(sums.squares - lost)


def _lost_to_bar(touches: Touches, bar: Bar, sums: Array, counts: Array) -> Array:
    """What the six coordinates of the bar's ends take of the information, the calibrated length known."""
    ends = [bar.first, bar.second]
    cross = np.concatenate(
        [sums[..., end, :, :] for end in ends], axis=-2
    )  # (..., 6, q), sign of -1/sigma left out
    inner = np.zeros((*counts.shape[:-1], 6, 6))
    for number, end in enumerate(ends):
        block = slice(3 * number, 3 * number + 3)
        inner[..., block, block] = np.eye(3) * np.maximum(counts[..., end, None, None], 1e-12)
    # In units of sigma, as the rows: the length row has the weight (sigma / u)².
    row = np.concatenate([bar.direction, -bar.direction]) * touches.sigma / bar.standard_uncertainty
    inner = inner + np.outer(row, row)
    return np.asarray(np.swapaxes(cross, -1, -2) @ np.linalg.solve(inner, cross))


def expected(touches: Touches, touched: Mask) -> Expected:
    """Expected uncertainties of the plan ``touched`` (P, T)."""
    matrix = information(touches, sums_of(touches, touched))
    raw = np.sqrt(np.diag(np.einsum("pt,ptij->ij", touched.astype(float), touches.squares)))
    scale = np.where(raw > 0.0, raw, 1.0)
    values, vectors = np.linalg.eigh(matrix / scale[:, None] / scale)
    # Of singular values the limit is RANK_TOLERANCE, of eigenvalues its square.
    keep = values > RANK_TOLERANCE**2 * max(float(values[-1]), np.finfo(float).tiny)
    lost = np.max(np.abs(vectors[:, ~keep]), axis=1, initial=0.0) >= MEMBER_SHARE
    half = vectors[:, keep] / np.sqrt(values[keep]) / scale[:, None]
    covariance = half @ half.T
    covariance[lost, :] = covariance[:, lost] = np.nan
    own = slice(0, touches.reported)
    diagonal = np.diag(matrix)[own]
    return Expected(
        names=touches.names[own],
        u=np.sqrt(np.diag(covariance)[own]),
        alone=np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), np.inf),
        covariance=covariance[own, own],
    )
