"""Poses that would separate effects which this plan cannot.

T-optimal (Atkinson and Fedorov, Biometrika 62 (1975) 57): the poses are selected, one after the other, for which
what the best of the rivals still leaves of the effect, everything else free, is largest. Only poses that the
machine reaches are offered, and only where they decide.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import MachineEffect
from monitor.discovery.machine.separation.alike import moves_alike
from monitor.discovery.machine.separation.distances import Pair, PlanRows, pairs_of, select_poses
from monitor.discovery.machine.separation.orders import runs_in_reversed_order
from monitor.discovery.machine.separation.second_ball import second_ball
from monitor.discovery.machine.separation.setups import Moved, runs_that_decide, setups_of
from monitor.effects import ChainEffect, Context
from monitor.effects.drivers import Always, EachRun, RunTime
from monitor.effects.drivers.gravity import Gravity
from monitor.exceptions import DataError
from monitor.machine import Chain, Joint, evaluate, touching_positions
from monitor.methods.chain.touch import TouchProblem
from monitor.records import Array, SecondSetup

# The grid of rotary positions; finer ones change the choice, not what it achieves.
STEP_RAD = np.pi / 6.0
# Half a degree beside a pose is that pose.
SAME_RAD = np.radians(0.5)
# A spindle is oriented to any angle: quarters of a turn for its base parameters, eighths for its harmonics.
QUARTERS, EIGHTHS = 4, 8
# Effects of a group that are separated from each other, the most convincing ones: groups of 5 300 campaigns had ten at
# most, and of one that is left out it would be said that poses break its tie, whether any do or not.
MOST_EFFECTS = 10
# A second set-up of which the machine reaches less than this part of the poses is no plan.
SMALLEST_PART = 0.5
# Linear axes without a stroke in the machine file may go this much further than they went.
STRETCH = 1.25


@dataclass(frozen=True)
class Separation:
    """Positions of the rotary axes (name to rad) to add, and how many standard deviations apart the two closest of
    the effects are ``before`` and ``after`` that, over all runs of the campaign. ``together`` are pairs that no pose
    separates; they do not count beside others. ``setups`` are second set-ups that separate such pairs, with how many
    runs in them do, None where none does. ``by_order`` are rivals that the plan in the reversed order tells, with how
    many runs of it do."""

    poses: tuple[dict[str, float], ...]
    before: float
    after: float
    together: tuple[tuple[str, str], ...] = ()
    setups: tuple[tuple[SecondSetup, int] | None, ...] = ()
    by_order: tuple[tuple[str, int], ...] = ()


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


def _is_measured(grid: Array, context: Context) -> npt.NDArray[np.bool_]:
    """Mark the rotary positions (P, J) of a grid at which the plan already touches; more runs repeat those."""
    turning = [index for index, joint in enumerate(context.chain.joints) if joint.turns]
    present = np.unique(np.round(context.positions[:, turning], 6), axis=0)
    apart = np.abs(grid[:, None, turning] - present).max(axis=2, initial=0.0)
    return np.asarray(apart.min(axis=1) < SAME_RAD)


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
            time=np.full(count, float(np.mean(present.time))),
            day_time=np.full(count, float(np.mean(present.day_time))),
            run_time=np.full(count, 0.5),
            target=self.target,
            nominal=self.nominal,
            columns=columns,
            set_up=None,
            approach=None,
            measured=present,
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
    the method is not one of touching balls: of those shifts that are one at every pose are ``together``, and what a
    second set-up of an R-test tells apart. Of effects with the same driver the poses count at its mean value.
    """
    problem, context, strokes = fit.problem, fit.problem.context, strokes or {}
    alike = [rival for rival in rivals if _have_same_driver(effect, rival)]
    if not isinstance(problem, TouchProblem):
        return _by_other_means(fit, effect, coefficients, alike, strokes)
    if not alike:
        return NO_POSES
    group = [member for member in (effect, *alike) if isinstance(member, ChainEffect)][:MOST_EFFECTS]
    turned = any(member.joint.kind == "spindle" for member in group)
    grid = _grid(context.chain, context.positions, strokes, EIGHTHS if turned else QUARTERS)
    tip = problem.own_of(fit.solution.local)[0, -3:]
    touches = _reachable_touches(problem, grid, tip, strokes)
    if touches is None:
        return NO_POSES
    new = touches.context(context)
    first = context.run == problem.runs[0]
    present = _rows(fit, group, np.flatnonzero(first))
    pairs = pairs_of(present, _rows_of_new(fit, new, tip, group), new.run, coefficients)
    numbers = np.unique(new.run)
    selection = select_poses(pairs, len(problem.runs), _is_measured(grid[numbers], context))
    together = tuple((group[first].text, group[second].text) for first, second in selection.alike)
    setups = _second_setups(fit, group, present, coefficients, selection.alike, strokes)
    turning = [(index, joint.name) for index, joint in enumerate(context.chain.joints) if joint.turns]
    poses = tuple(
        {name: float(grid[numbers[pose], index]) for index, name in turning} for pose in selection.poses
    )
    return Separation(poses, selection.before, selection.after, together, setups)


def _by_other_means(
    fit: Fit,
    effect: MachineEffect,
    coefficients: Array,
    rivals: Sequence[MachineEffect],
    strokes: Mapping[str, tuple[float, float]],
) -> Separation:
    """What is known of rivals where no poses are selected: which nothing tells, which a second set-up of an R-test
    does, and which of the rest another order."""
    context = fit.problem.context
    setups: dict[tuple[str, str], tuple[SecondSetup, int] | None] = {}
    orders: dict[str, int | None] = {}
    for index, rival in enumerate(rivals):
        pair, setup = (effect.text, rival.text), None
        if moves_alike(context, effect, coefficients, rival, strokes):
            setups[pair] = None
            continue
        if index < MOST_EFFECTS - 1 and isinstance(effect, ChainEffect) and isinstance(rival, ChainEffect):
            setup = second_ball(fit, effect, coefficients, rival, strokes)
        if setup is not None:
            setups[pair] = setup
        else:
            orders[rival.text] = runs_in_reversed_order(fit, effect, coefficients, rival)
    return replace(
        NO_POSES,
        together=tuple(setups),
        setups=tuple(setups.values()),
        by_order=tuple((name, runs) for name, runs in orders.items() if runs is not None),
    )


def _second_setups(
    fit: Fit,
    group: Sequence[ChainEffect],
    present: PlanRows,
    coefficients: Array,
    alike: Sequence[tuple[int, int]],
    strokes: Mapping[str, tuple[float, float]],
) -> tuple[tuple[SecondSetup, int] | None, ...]:
    """For each pair that no pose separates the easiest second set-up that does, at the poses of the present plan, and
    in how many runs."""
    told_apart: dict[tuple[int, int], tuple[SecondSetup, int]] = {}
    if not alike:
        return ()
    tip = fit.problem.own_of(fit.solution.local)[0, -3:]
    for moved in setups_of(fit.problem.context.chain, tip):
        pairs = _pairs_in(moved, fit, group, present, coefficients, strokes)
        for pair in pairs:
            if pair.effects not in alike or pair.effects in told_apart:
                continue
            runs = runs_that_decide(pair, present.nuisance.shape[-1], len(fit.problem.runs))
            if runs is not None:
                told_apart[pair.effects] = (moved.setup, runs)
        if len(told_apart) == len(alike):
            break
    return tuple(told_apart.get(pair) for pair in alike)


def _pairs_in(
    moved: Moved,
    fit: Fit,
    group: Sequence[ChainEffect],
    present: PlanRows,
    coefficients: Array,
    strokes: Mapping[str, tuple[float, float]],
) -> list[Pair]:
    """The pairs of a group with what a run in a second set-up adds; none where the machine reaches too little of it."""
    problem, context = fit.problem, fit.problem.context
    assert isinstance(problem, TouchProblem)
    turning = np.array([joint.turns for joint in context.chain.joints])
    visited = np.unique(np.where(turning, np.round(context.positions, 6), 0.0), axis=0)
    touches = _reachable_touches(problem, visited, moved.tip, strokes, moved.targets)
    if touches is None or len(touches.positions) < SMALLEST_PART * len(visited) * len(set(touches.target)):
        return []
    new = touches.context(context)
    new = replace(new, run=np.full(len(new), problem.runs[0]))
    rows = _rows_of_new(fit, new, moved.tip, group)
    return pairs_of(present, rows, np.zeros(len(new), dtype=np.int64), coefficients)


def _have_same_driver(effect: MachineEffect, rival: MachineEffect) -> bool:
    """Whether poses may tell two effects apart: both are of the chain, and they depend on where the axes stand alone or
    on the same driver."""
    if not isinstance(effect, ChainEffect) or not isinstance(rival, ChainEffect):
        return False
    if isinstance(effect.driver, EachRun) or (isinstance(effect.driver, RunTime) and effect.driver.run):
        return False
    plain = [isinstance(each.driver, (Always, Gravity)) for each in (effect, rival)]
    return all(plain) or (not any(plain) and effect.driver_text == rival.driver_text)


def _reachable_touches(
    problem: TouchProblem,
    grid: Array,
    tip: Array,
    strokes: Mapping[str, tuple[float, float]],
    standing: Callable[[Array], Array] = np.asarray,
) -> _Touches | None:
    """Touches of all balls, where they are ``standing``, at those poses of a grid where the machine reaches every ball;
    None where they cannot be computed, or the machine reaches none."""
    context, chain = problem.context, problem.context.chain
    first = context.run == problem.runs[0]
    balls = [target for target in problem.targets if int(np.sum(context.target[first] == target)) >= 3]
    pose = np.repeat(np.arange(len(grid)), len(balls))
    centres = {str(t): context.nominal[np.flatnonzero(context.target == t)[0]] for t in balls}
    targets = list(balls) * len(grid)
    nominal = standing(np.array([centres[target] for target in targets]))
    errors = np.zeros((len(nominal), len(chain.joints), 2, 6))
    try:
        positions = touching_positions(chain, np.repeat(grid, len(balls), axis=0), errors, nominal, tip)
    except DataError:
        return None
    reachable = _reachable(chain, positions, context.positions, strokes)
    good = np.array([reachable[pose == index].all() for index in range(len(grid))])
    return _Touches(positions, pose, np.array(targets), nominal).among(good[pose]) if good.any() else None


def _reachable(
    chain: Chain, positions: Array, visited: Array, strokes: Mapping[str, tuple[float, float]]
) -> Array:
    """Mark the positions (n, J) that the linear axes reach (n,)."""
    inside = np.ones(len(positions), dtype=bool)
    for index, joint in enumerate(chain.joints):
        if joint.turns:
            continue
        low, high = visited[:, index].min(), visited[:, index].max()
        middle, half = (low + high) / 2.0, (high - low) / 2.0 * STRETCH
        low, high = strokes.get(joint.name, (middle - half, middle + half))
        inside &= (positions[:, index] >= low) & (positions[:, index] <= high)
    return inside


def _rows(fit: Fit, effects: Sequence[ChainEffect], rows: npt.NDArray[np.int64]) -> PlanRows:
    """Whitened rows (N, p) of the first run, calibrated lengths included."""
    last = fit.solution.last.local[0]
    columns = []
    for effect in effects:
        raw = effect.basis(fit.problem.context).displacement(fit.by_error)[rows]
        white = (raw / fit.problem.sigma[rows][..., None]).reshape(3 * len(rows), -1)
        padded = np.zeros((len(last), white.shape[1]))
        padded[: len(white)] = white
        columns.append(padded)
    return PlanRows(last, columns)


def _rows_of_new(fit: Fit, new: Context, tip: Array, effects: Sequence[ChainEffect]) -> PlanRows:
    """Whitened rows (n, 3, p) of touches at new poses."""
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
    return PlanRows(nuisance / sigma, columns)
