"""Poses that would tell effects apart which this plan cannot.

T-optimal (Atkinson and Fedorov, Biometrika 62 (1975) 57): the poses are chosen, one after the other, for which
what the best of the rivals still leaves of the effect, everything else free, is largest. Only poses that the
machine reaches are offered, and only where they decide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.visible import SMALLEST_SHARE
from monitor.effects import ArtefactEffect, ChainEffect, Context
from monitor.effects.drivers import Always
from monitor.exceptions import DataError
from monitor.machine import Chain, evaluate, touching_positions
from monitor.methods.chain.least_squares import RANK_TOLERANCE
from monitor.methods.chain.touch import TouchProblem
from monitor.records import Array

# The grid of rotary positions; finer ones change the choice, not what it achieves.
STEP_RAD = np.pi / 6.0
# A spindle is oriented to any angle: quarters of a turn for its base parameters, eighths for its harmonics.
QUARTERS, EIGHTHS = 4, 8
# Effects of a group that are told apart from each other, the most convincing ones.
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
    the effects then are, against now, over all runs of the campaign. ``together`` are pairs that no pose separates;
    they do not count."""

    poses: tuple[dict[str, float], ...]
    now: float
    then: float
    together: tuple[tuple[str, str], ...] = ()


def _grid(chain: Chain, visited: Array, strokes: dict[str, tuple[float, float]], spindle: int) -> Array:
    """Rotary positions (P, J) to choose from, ``spindle`` ones of the spindle; linear axes at zero."""
    values: list[Array] = []
    for place, joint in enumerate(chain.joints):
        if not joint.turns:
            values.append(np.zeros(1))
            continue
        if joint.kind == "spindle":
            values.append(np.linspace(0.0, 2.0 * np.pi, spindle, endpoint=False))
            continue
        low, high = strokes.get(joint.name, (visited[:, place].min(), visited[:, place].max()))
        low, high = (low, high) if high - low < 2.0 * np.pi else (low, low + 2.0 * np.pi - STEP_RAD)
        values.append(
            np.linspace(low, high, max(int((high - low) / STEP_RAD) + 1, 2))
            if high > low
            else np.array([low])
        )
    return np.array(list(product(*values)))


def _context(
    context: Context,
    chain: Chain,
    positions: Array,
    pose: npt.NDArray[np.int64],
    targets: Sequence[str],
    nominal: Array,
) -> Context:
    count = len(positions)
    return replace(
        context,
        positions=positions,
        expected=None,
        run=pose,
        sequence=np.arange(count),
        time=np.zeros(count),
        day_time=np.full(count, float(np.mean(context.day_time))),
        run_time=np.full(count, 0.5),
        target=np.array(targets),
        nominal=nominal,
        columns={name: np.full(count, float(np.nanmean(values))) for name, values in context.columns.items()},
    )


def separating_poses(
    fit: Fit,
    effect: ChainEffect | ArtefactEffect,
    coefficients: Array,
    rivals: Sequence[ChainEffect | ArtefactEffect],
    strokes: dict[str, tuple[float, float]] | None = None,
) -> Separation:
    """Poses that separate an effect of the given coefficients from its rivals, and these from each other.

    ``strokes`` gives the range of axes in mm or rad where the machine file has one. No poses are offered where
    effects differ by their driver (other times and temperatures separate those), where no pose decides, or where
    the method is not one of touching balls.
    """
    problem, context = fit.problem, fit.problem.context
    chain = context.chain
    if not isinstance(problem, TouchProblem):
        return Separation((), 0.0, 0.0)
    plain = [one for one in rivals if isinstance(one, ChainEffect) and isinstance(one.driver, Always)]
    if not plain or not isinstance(effect, ChainEffect) or not isinstance(effect.driver, Always):
        return Separation((), 0.0, 0.0)
    group = [effect, *plain][:MOST_EFFECTS]
    first = context.run == problem.runs[0]
    counts = {t: int(np.sum(context.target[first] == t)) for t in problem.targets}
    balls = [target for target, times in counts.items() if times >= 3]
    turned = any(one.joint.kind == "spindle" for one in group)
    grid = _grid(chain, context.positions, strokes or {}, EIGHTHS if turned else QUARTERS)
    pose = np.repeat(np.arange(len(grid)), len(balls))
    targets = list(balls) * len(grid)
    places = {str(t): context.nominal[np.flatnonzero(context.target == t)[0]] for t in balls}
    nominal = np.array([places[target] for target in targets])
    tip = problem.own_of(fit.solution.local)[0, -3:]
    errors = np.zeros((len(nominal), len(chain.joints), 2, 6))
    try:
        positions = touching_positions(chain, np.repeat(grid, len(balls), axis=0), errors, nominal, tip)
    except DataError:
        return Separation((), 0.0, 0.0)
    reachable = _reachable(chain, positions, context.positions, strokes or {})
    good = np.array([reachable[pose == one].all() for one in range(len(grid))])
    keep = good[pose]
    new = _context(
        context, chain, positions[keep], pose[keep], np.array(targets)[keep].tolist(), nominal[keep]
    )
    rows_now = _rows(fit, group, np.flatnonzero(first))
    rows_new = _rows_of_new(fit, new, tip, group)
    pairs = _pairs(rows_now, rows_new, new.run, coefficients)
    chosen, start, reached, alike = _choose(pairs, len(problem.runs))
    together = tuple((group[first].text, group[second].text) for first, second in alike)
    turning = [(place, joint.name) for place, joint in enumerate(chain.joints) if joint.turns]
    numbers = np.unique(new.run)
    poses = tuple({name: float(grid[numbers[one], place]) for place, name in turning} for one in chosen)
    return Separation(poses, start, reached, together)


def _reachable(
    chain: Chain, positions: Array, visited: Array, strokes: dict[str, tuple[float, float]]
) -> Array:
    inside = np.ones(len(positions), dtype=bool)
    for place, joint in enumerate(chain.joints):
        if joint.turns:
            continue
        low, high = visited[:, place].min(), visited[:, place].max()
        middle, half = (low + high) / 2.0, (high - low) / 2.0 * STRETCH
        low, high = strokes.get(joint.name, (middle - half, middle + half))
        inside &= (positions[:, place] >= low) & (positions[:, place] <= high)
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
    seen = evaluate(new.chain, new.positions, errors, new.nominal, tip, jacobian=True)
    assert seen.by_error is not None
    nuisance = np.zeros((len(new), 3, len(names)))
    place = 0
    for effect in problem.base:
        moved = effect.basis(new).displacement(seen.by_error)
        nuisance[:, :, place : place + moved.shape[-1]] = moved
        place += moved.shape[-1]
    for row, target in enumerate(new.target):
        for axis in range(3):
            nuisance[row, axis, names.index(f"ball {target} {'xyz'[axis]}")] = -1.0
    nuisance[:, :, -3:] = seen.by_tip
    columns = [effect.basis(new).displacement(seen.by_error) / sigma for effect in effects]
    return nuisance / sigma, columns


@dataclass(frozen=True)
class _Pair:
    """Two effects: products (q, q) of [everything free, the second effect, the first one at its size] over the
    present plan of one run, and what every pose adds to them (P, q, q)."""

    effects: tuple[int, int]
    now: Array
    additions: Array


def _pairs(
    now: tuple[Array, list[Array]],
    new: tuple[Array, list[Array]],
    pose: npt.NDArray[np.int64],
    coefficients: Array,
) -> list[_Pair]:
    """All pairs of a group whose first effect has the given coefficients, the others those that mimic it best."""
    poses = np.unique(pose)
    wanted = now[1][0] @ coefficients
    sizes = [coefficients]
    for columns in now[1][1:]:
        both = np.concatenate([columns, now[0]], axis=1)
        scale = np.linalg.norm(both, axis=0)
        scale[scale == 0] = 1.0
        found = np.linalg.lstsq(both / scale, wanted, rcond=1e-6)[0] / scale
        sizes.append(found[: columns.shape[1]])
    pairs = []
    for first in range(len(sizes)):
        for second in range(first + 1, len(sizes)):
            one_now, one_new = now[1][first] @ sizes[first], new[1][first] @ sizes[first]
            # What the present plan does not see of the first effect may have any size.
            unseen = _unseen(now[0], now[1][first])
            whole = np.concatenate([now[0], now[1][second], now[1][first] @ unseen, one_now[:, None]], axis=1)
            fresh = np.concatenate(
                [new[0], new[1][second], new[1][first] @ unseen, one_new[..., None]], axis=-1
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
    left = columns - basis @ (basis.T @ columns)
    size = max(float(np.linalg.norm(columns, axis=0).max(initial=0.0)), 1e-300)
    values, directions = np.linalg.eigh(left.T @ left / size**2)
    hidden: Array = directions[:, values <= SMALLEST_SHARE**2]
    return hidden


def _choose(pairs: Sequence[_Pair], runs: int) -> tuple[list[int], float, float, tuple[tuple[int, int], ...]]:
    """Places of the chosen poses, standard deviations between the closest pair now and then, hopeless pairs."""

    def apart(grams: Array) -> Array:
        return np.sqrt(runs * _left(grams))

    alike, open_pairs = [], []
    for pair in pairs:
        before = float(apart(pair.now[None])[0])
        best = float(apart((pair.now + pair.additions.sum(axis=0))[None])[0])
        if before > DECIDES:
            continue
        if best < DECIDES or best < WORTHWHILE * before:
            alike.append(pair.effects)
        else:
            open_pairs.append(pair)
    if not open_pairs:
        return [], 0.0, 0.0, tuple(alike)
    grams = [pair.now for pair in open_pairs]
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
        reached = min(float(one[best_pose]) for one in each)
        if reached > 2.0 * DECIDES:
            break
    if reached < DECIDES or reached < WORTHWHILE * start:
        return [], start, reached, tuple(alike)
    return picked, start, reached, tuple(alike)


def _left(grams: Array) -> Array:
    """What of the last column the others cannot do, squared, for every Gram matrix (P, q, q)."""
    inner = grams[:, :-1, :-1] + RIDGE * np.eye(grams.shape[-1] - 1)
    onto = grams[:, :-1, -1:]
    solved = np.linalg.solve(inner, onto)
    left: Array = np.maximum(grams[:, -1, -1] - np.einsum("pij,pij->p", onto, solved), 0.0)
    return left
