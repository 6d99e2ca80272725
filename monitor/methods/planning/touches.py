"""Everything that a plan could touch: targets at indexations, and the derivatives of each touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.effects import Context
from monitor.exceptions import DataError
from monitor.machine import evaluate, touching_positions
from monitor.methods.chain.touch import TouchProblem
from monitor.records import Array

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Bar:
    """A calibrated distance between two targets (indices in ``Touches.targets``), and its standard uncertainty."""

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


def planned_context(
    template: Context, positions: Array, targets: Sequence[str], nominal: Array, pose: npt.NDArray[np.int64]
) -> Context:
    """The context of touches (n,) of one run that is only planned: recorded columns stand at their means."""
    count = len(positions)
    mean = {
        name: np.full(
            count, float(np.mean(values[np.isfinite(values)])) if np.isfinite(values).any() else np.nan
        )
        for name, values in template.columns.items()
    }
    for index, joint in enumerate(template.chain.joints):
        name = f"{joint.name.lower()}_{'deg' if joint.turns else 'mm'}"
        if name in mean:
            readings = joint.sign * positions[:, index]
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
        set_up=None,
        approach=None,
    )


def candidate_touches(
    problem: TouchProblem,
    poses: Array,
    targets: Sequence[str],
    places: Array,
    strokes: Mapping[str, tuple[float, float]],
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
    pose = evaluate(chain, positions, errors, nominal, tip, jacobian=True)
    assert pose.by_error is not None
    context = planned_context(
        problem.context,
        positions,
        list(targets) * len(poses),
        nominal,
        np.repeat(np.arange(len(poses)), len(targets)),
    )
    parts = [effect.basis(context).displacement(pose.by_error) for effect in problem.base]
    names = problem.base_names
    if not tip_known:
        parts.append(pose.by_tip)
        names = (*names, "tip x", "tip y", "tip z")
    sigma = float(np.sqrt(np.mean(problem.sigma[np.isfinite(problem.sigma)] ** 2)))
    inside = np.ones(count, dtype=bool)
    for index, joint in enumerate(chain.joints):
        if not joint.turns and joint.name in strokes:
            low, high = strokes[joint.name]
            inside &= (positions[:, index] >= low - 1e-9) & (positions[:, index] <= high + 1e-9)
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
