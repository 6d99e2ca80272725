"""Poses that would separate effects which this plan cannot.

T-optimal (Atkinson and Fedorov, Biometrika 62 (1975) 57): the poses are selected, one after the other, for which
what the best of the rivals still leaves of the effect, everything else free, is largest. Only poses that the
machine reaches are offered, and only where they decide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import MachineEffect
from monitor.discovery.search.candidate import SMALLEST_SHARE
from monitor.effects import ChainEffect, Context
from monitor.effects.drivers import Always
from monitor.exceptions import DataError
from monitor.machine import Chain, Joint, evaluate, touching_positions
from monitor.methods.chain.least_squares import RANK_TOLERANCE
from monitor.methods.chain.touch import TouchProblem
from monitor.records import Array

# The grid of rotary positions; finer ones change the choice, not what it achieves.
STEP_RAD = np.pi / 6.0
# A spindle is oriented to any angle: quarters of a turn for its base parameters, eighths for its harmonics.
QUARTERS, EIGHTHS = 4, 8
# Effects of a group that are separated from each other, the most convincing ones.
MOST_EFFECTS = 6
MOST_POSES = 3
# Linear axes without a stroke in the machine file may go this much further than they went.
STRETCH = 1.25
# A decision with five standard deviations is as good as certain.
DECIDES = 5.0
# Poses that bring less than half as much again are not worth the time.
WORTHWHILE = 1.5
RIDGE = 1e-10


@dataclass(frozen=True)
class Separation:
    """Positions of the rotary axes (name to rad) to add, and how many standard deviations apart the two closest of
    the effects are ``before`` and ``after`` that, over all runs of the campaign. ``together`` are pairs that no pose
    separates; they do not count."""

    poses: tuple[dict[str, float], ...]
    before: float
    after: float
    together: tuple[tuple[str, str], ...] = ()


NO_POSES = Separation((), 0.0, 0.0)


def _grid(chain: Chain, visited: Array, strokes: Mapping[str, tuple[float, float]], spindle: int) -> Array:
    """Rotary positions (P, J) to select from, ``spindle`` ones of the spindle; linear axes at zero."""
    values = [
        _positions(joint, visited[:, index], strokes, spindle) for index, joint in enumerate(chain.joints)
    ]
    return np.array(list(product(*values)))


def _positions(
    joint: Joint, visited: Array, strokes: Mapping[str, tuple[float, float]], spindle: int
) -> Array:
    """The positions of one joint on the grid."""
    if not joint.turns:
        return np.zeros(1)
    if joint.kind == "spindle":
        return np.linspace(0.0, 2.0 * np.pi, spindle, endpoint=False)
    low, high = strokes.get(joint.name, (visited.min(), visited.max()))
    low, high = (low, high) if high - low < 2.0 * np.pi else (low, low + 2.0 * np.pi - STEP_RAD)
    if high <= low:
        return np.array([low])
    return np.linspace(low, high, max(int((high - low) / STEP_RAD) + 1, 2))


@dataclass(frozen=True)
class _Touches:
    """Touches at new poses: positions (n, J), the pose (n,), the target (n,) and its nominal position (n, 3)."""

    positions: Array
    pose: npt.NDArray[np.int64]
    target: npt.NDArray[np.str_]
    nominal: Array

    def among(self, rows: npt.NDArray[np.bool_]) -> _Touches:
        """Some of the touches."""
        return _Touches(self.positions[rows], self.pose[rows], self.target[rows], self.nominal[rows])

    def context(self, present: Context) -> Context:
        """The context of these touches, everything else as in the present plan."""
        count = len(self.positions)
        columns = {
            name: np.full(count, float(np.nanmean(values))) for name, values in present.columns.items()
        }
        return replace(
            present,
            positions=self.positions,
            expected=None,
            run=self.pose,
            sequence=np.arange(count),
            time=np.zeros(count),
            day_time=np.full(count, float(np.mean(present.day_time))),
            run_time=np.full(count, 0.5),
            target=self.target,
            nominal=self.nominal,
            columns=columns,
        )


def separating_poses(
    fit: Fit,
    effect: MachineEffect,
    coefficients: Array,
    rivals: Sequence[MachineEffect],
    strokes: Mapping[str, tuple[float, float]] | None = None,
) -> Separation:
    """Select poses that separate an effect of the given coefficients from its rivals, and these from each other.

    ``strokes`` gives the range of axes in mm or rad where the machine file has one. No poses are offered where
    effects differ by their driver (other times and temperatures separate those), where no pose decides, or where
    the method is not one of touching balls.
    """
    problem, context = fit.problem, fit.problem.context
    plain = [rival for rival in rivals if _is_plain(rival)]
    if not isinstance(problem, TouchProblem) or not plain or not _is_plain(effect):
        return NO_POSES
    group = [member for member in (effect, *plain) if isinstance(member, ChainEffect)][:MOST_EFFECTS]
    turned = any(member.joint.kind == "spindle" for member in group)
    grid = _grid(context.chain, context.positions, strokes or {}, EIGHTHS if turned else QUARTERS)
    tip = problem.own_of(fit.solution.local)[0, -3:]
    touches = _reachable_touches(problem, grid, tip, strokes or {})
    if touches is None:
        return NO_POSES
    new = touches.context(context)
    first = context.run == problem.runs[0]
    rows_before = _rows(fit, group, np.flatnonzero(first))
    pairs = _pairs(rows_before, _rows_of_new(fit, new, tip, group), new.run, coefficients)
    selected, start, reached, alike = _choose(pairs, len(problem.runs))
    together = tuple((group[first].text, group[second].text) for first, second in alike)
    turning = [(index, joint.name) for index, joint in enumerate(context.chain.joints) if joint.turns]
    numbers = np.unique(new.run)
    poses = tuple({name: float(grid[numbers[pose], index]) for index, name in turning} for pose in selected)
    return Separation(poses, start, reached, together)


def _is_plain(effect: MachineEffect) -> bool:
    """Whether an effect is one of the chain without a driver."""
    return isinstance(effect, ChainEffect) and isinstance(effect.driver, Always)


def _reachable_touches(
    problem: TouchProblem, grid: Array, tip: Array, strokes: Mapping[str, tuple[float, float]]
) -> _Touches | None:
    """Touches of all balls at those poses of a grid where the machine reaches every ball; None where they cannot be
    computed."""
    context, chain = problem.context, problem.context.chain
    first = context.run == problem.runs[0]
    balls = [target for target in problem.targets if int(np.sum(context.target[first] == target)) >= 3]
    pose = np.repeat(np.arange(len(grid)), len(balls))
    centres = {str(t): context.nominal[np.flatnonzero(context.target == t)[0]] for t in balls}
    targets = list(balls) * len(grid)
    nominal = np.array([centres[target] for target in targets])
    errors = np.zeros((len(nominal), len(chain.joints), 2, 6))
    try:
        positions = touching_positions(chain, np.repeat(grid, len(balls), axis=0), errors, nominal, tip)
    except DataError:
        return None
    reachable = _reachable(chain, positions, context.positions, strokes)
    good = np.array([reachable[pose == index].all() for index in range(len(grid))])
    return _Touches(positions, pose, np.array(targets), nominal).among(good[pose])


def _reachable(
    chain: Chain, positions: Array, visited: Array, strokes: Mapping[str, tuple[float, float]]
) -> Array:
    """Which positions (n, J) the linear axes reach (n,)."""
    inside = np.ones(len(positions), dtype=bool)
    for index, joint in enumerate(chain.joints):
        if joint.turns:
            continue
        low, high = visited[:, index].min(), visited[:, index].max()
        middle, half = (low + high) / 2.0, (high - low) / 2.0 * STRETCH
        low, high = strokes.get(joint.name, (middle - half, middle + half))
        inside &= (positions[:, index] >= low) & (positions[:, index] <= high)
    return inside


def _rows(fit: Fit, effects: Sequence[ChainEffect], rows: npt.NDArray[np.int64]) -> tuple[Array, list[Array]]:
    """Whitened nuisance (N, p) and effect columns (N, k) of the first run, calibrated lengths included."""
    last = fit.solution.last.local[0]
    columns = []
    for effect in effects:
        raw = effect.basis(fit.problem.context).displacement(fit.by_error)[rows]
        white = (raw / fit.problem.sigma[rows][..., None]).reshape(3 * len(rows), -1)
        padded = np.zeros((len(last), white.shape[1]))
        padded[: len(white)] = white
        columns.append(padded)
    return last, columns


def _rows_of_new(
    fit: Fit, new: Context, tip: Array, effects: Sequence[ChainEffect]
) -> tuple[Array, list[Array]]:
    problem = fit.problem
    names = problem.local_names
    sigma = float(np.mean(problem.sigma[~fit.left_out]))
    errors = np.zeros((len(new), len(new.chain.joints), 2, 6))
    pose = evaluate(new.chain, new.positions, errors, new.nominal, tip, jacobian=True)
    assert pose.by_error is not None
    nuisance = np.zeros((len(new), 3, len(names)))
    start = 0
    for base_effect in problem.base:
        moved = base_effect.basis(new).displacement(pose.by_error)
        nuisance[:, :, start : start + moved.shape[-1]] = moved
        start += moved.shape[-1]
    for row, target in enumerate(new.target):
        for axis in range(3):
            nuisance[row, axis, names.index(f"ball {target} {'xyz'[axis]}")] = -1.0
    nuisance[:, :, -3:] = pose.by_tip
    columns = [effect.basis(new).displacement(pose.by_error) / sigma for effect in effects]
    return nuisance / sigma, columns


@dataclass(frozen=True)
class _Pair:
    """Two effects: products (q, q) of [everything free, the second effect, the first one at its size] over the
    present plan of one run, and what every pose adds to them (P, q, q)."""

    effects: tuple[int, int]
    present: Array
    additions: Array


def _pairs(
    present: tuple[Array, list[Array]],
    new: tuple[Array, list[Array]],
    pose: npt.NDArray[np.int64],
    coefficients: Array,
) -> list[_Pair]:
    """All pairs of a group whose first effect has the given coefficients, the others those that mimic it best."""
    poses = np.unique(pose)
    wanted = present[1][0] @ coefficients
    sizes = [coefficients]
    for columns in present[1][1:]:
        both = np.concatenate([columns, present[0]], axis=1)
        scale = np.linalg.norm(both, axis=0)
        scale[scale == 0] = 1.0
        mimic = np.linalg.lstsq(both / scale, wanted, rcond=1e-6)[0] / scale
        sizes.append(mimic[: columns.shape[1]])
    pairs = []
    for first in range(len(sizes)):
        for second in range(first + 1, len(sizes)):
            at_size, new_at_size = present[1][first] @ sizes[first], new[1][first] @ sizes[first]
            # What the present plan does not see of the first effect may have any size.
            unseen = _unseen(present[0], present[1][first])
            whole = np.concatenate(
                [present[0], present[1][second], present[1][first] @ unseen, at_size[:, None]], axis=1
            )
            fresh = np.concatenate(
                [new[0], new[1][second], new[1][first] @ unseen, new_at_size[..., None]], axis=-1
            )
            scale = np.sqrt(np.sum(whole**2, axis=0) + np.mean(np.sum(fresh**2, axis=1), axis=0))
            scale[-1] = 1.0
            scale[scale == 0] = 1.0
            whole, fresh = whole / scale, fresh / scale
            each = np.swapaxes(fresh, 1, 2) @ fresh
            starts = np.searchsorted(pose, poses)
            pairs.append(_Pair((first, second), whole.T @ whole, np.add.reduceat(each, starts, axis=0)))
    return pairs


def _unseen(nuisance: Array, columns: Array) -> Array:
    """Directions (k, u) of an effect's coefficients of which the nuisance leaves nothing."""
    scale = np.linalg.norm(nuisance, axis=0)
    basis, values, _ = np.linalg.svd(nuisance / np.where(scale == 0, 1.0, scale), full_matrices=False)
    basis = basis[:, values > RANK_TOLERANCE * values.max(initial=0.0)]
    remainder = columns - basis @ (basis.T @ columns)
    size = max(float(np.linalg.norm(columns, axis=0).max(initial=0.0)), 1e-300)
    values, directions = np.linalg.eigh(remainder.T @ remainder / size**2)
    hidden: Array = directions[:, values <= SMALLEST_SHARE**2]
    return hidden


def _choose(pairs: Sequence[_Pair], runs: int) -> tuple[list[int], float, float, tuple[tuple[int, int], ...]]:
    """Indices of the selected poses, standard deviations between the closest pair before and after, pairs that no pose
    separates."""

    def apart(grams: Array) -> Array:
        return np.sqrt(runs * _remainder(grams))

    alike, open_pairs = [], []
    for pair in pairs:
        before = float(apart(pair.present[None])[0])
        best = float(apart((pair.present + pair.additions.sum(axis=0))[None])[0])
        if before > DECIDES:
            continue
        if best < DECIDES or best < WORTHWHILE * before:
            alike.append(pair.effects)
        else:
            open_pairs.append(pair)
    if not open_pairs:
        return [], 0.0, 0.0, tuple(alike)
    grams = [pair.present for pair in open_pairs]
    start = min(float(apart(gram[None])[0]) for gram in grams)
    picked: list[int] = []
    reached = start
    for _ in range(MOST_POSES):
        each = [apart(gram + pair.additions) for gram, pair in zip(grams, open_pairs, strict=True)]
        # The pair that is closest counts; what lies far enough apart already does not.
        worst = np.min(np.minimum(each, 2.0 * DECIDES), axis=0)
        best_pose = int((worst + 1e-9 * np.sum(np.minimum(each, 1e3 * DECIDES), axis=0)).argmax())
        picked.append(best_pose)
        grams = [gram + pair.additions[best_pose] for gram, pair in zip(grams, open_pairs, strict=True)]
        reached = min(float(distances[best_pose]) for distances in each)
        if reached > 2.0 * DECIDES:
            break
    if reached < DECIDES or reached < WORTHWHILE * start:
        return [], start, reached, tuple(alike)
    return picked, start, reached, tuple(alike)


def _remainder(grams: Array) -> Array:
    """What of the last column the others cannot do, squared, for every Gram matrix (P, q, q)."""
    inner = grams[:, :-1, :-1] + RIDGE * np.eye(grams.shape[-1] - 1)
    onto = grams[:, :-1, -1:]
    solved = np.linalg.solve(inner, onto)
    remainder: Array = np.maximum(grams[:, -1, -1] - np.einsum("pij,pij->p", onto, solved), 0.0)
    return remainder
