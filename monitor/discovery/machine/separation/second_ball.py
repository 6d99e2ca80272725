"""A second set-up of instruments that tells two effects apart: the ball of an R-test elsewhere, or the tool longer.

At the angles of the present plan the linear axes then stand at other places, so that what goes with these no longer
goes with the angles. It is another run: the place of the ball, and the tool point where that is not known, are its own
again, and only the effect is common to both.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.separation.aliases import whitened
from monitor.discovery.machine.separation.distances import DECIDES, PlanRows, distance_of, pairs_of
from monitor.discovery.machine.separation.setups import Moved, of_effects, runs_that_decide, setups_of
from monitor.discovery.search.candidate import Variant
from monitor.effects import ChainEffect, Context
from monitor.effects.shapes.free import Free, parts_of_axis
from monitor.exceptions import DataError
from monitor.machine import ChainPose, evaluate, touching_positions
from monitor.methods.instruments.part import TOOL_POINT, Part
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.readings.vector import VectorReading
from monitor.records import Array, SecondSetup

#: Another length of the tool and another place of the ball; a star stylus no R-test has.
TRIED = (SecondSetup.LONGER_STYLUS, SecondSetup.FURTHER, SecondSetup.HIGHER)
# A second set-up of which the machine reaches less than this part of the poses is no plan; without a stroke in the
# machine file linear axes may go this much further than they went.
SMALLEST_PART, STRETCH = 0.5, 1.25


def second_ball(
    fit: Fit,
    effect: ChainEffect,
    coefficients: Array,
    rival: ChainEffect,
    strokes: Mapping[str, tuple[float, float]],
) -> tuple[SecondSetup, int] | None:
    """The easiest second set-up of a campaign's R-test that tells an effect of the given coefficients (k,) from a rival
    which the present plan leaves close, and how many runs in it do; None where none does, or where the campaign has no
    R-test.

    ``strokes`` gives the range of axes in mm or rad where the machine file has one. Drifts and scales of the second
    set-up are taken as known.
    """
    problem = fit.problem
    if not isinstance(problem, InstrumentProblem):
        return None
    part = next((part for part in problem.parts if isinstance(part.reading, VectorReading)), None)
    if part is None:
        return None
    group = [effect, _in_any_shape(rival, problem.context)]
    candidates = scene_of(fit, [Variant(each.text, each) for each in group]).candidates
    present = PlanRows(fit.solution.last.local[0], [whitened(fit, each) for each in candidates])
    unknowns, runs = present.nuisance.shape[1], len(problem.runs)
    for moved, new, pose in _moved(fit, problem, part, strokes):
        fresh = _rows(problem, part, new, pose, group)
        (pair,) = pairs_of(present, fresh, np.zeros(len(new), dtype=np.int64), coefficients)
        if distance_of(of_effects(pair.present, unknowns), runs) >= DECIDES:
            return None
        more = runs_that_decide(pair, unknowns, runs)
        if more is not None:
            return moved.setup, more
    return None


def _in_any_shape(rival: ChainEffect, context: Context) -> ChainEffect:
    """A rival of free shape with all parts that follow its axis alone beside its own: elsewhere it may follow by others
    what it follows here by some."""
    if not isinstance(rival.shape, Free):
        return rival
    parts = {*rival.shape.parts, *parts_of_axis(context, rival.term.joint)}
    return replace(rival, shape=Free(tuple(sorted(parts))))


def _moved(
    fit: Fit, problem: InstrumentProblem, part: Part, strokes: Mapping[str, tuple[float, float]]
) -> Iterator[tuple[Moved, Context, ChainPose]]:
    """The set-ups that the machine reaches, the easiest first, with the rows of the first run there."""
    context, chain = problem.context, problem.context.chain
    rows = part.at[context.run[part.at] == problem.runs[0]]
    if not len(rows):
        return
    work, tool = (ends[rows] for ends in problem.ends(problem.own_of(fit.solution.local)))
    errors = np.zeros((len(rows), len(chain.joints), 2, 6))
    for moved in setups_of(chain, tool[0]):
        if moved.setup not in TRIED:
            continue
        target = moved.targets(work)
        try:
            positions = touching_positions(chain, context.positions[rows], errors, target, moved.tip)
        except DataError:
            continue
        reached = _reached(context, positions, strokes)
        if np.mean(reached) < SMALLEST_PART:
            continue
        new = _context(context, rows[reached], positions[reached], target[reached])
        yield (
            moved,
            new,
            evaluate(chain, new.positions, errors[reached], target[reached], moved.tip, jacobian=True),
        )


def _reached(
    context: Context, positions: Array, strokes: Mapping[str, tuple[float, float]]
) -> npt.NDArray[np.bool_]:
    """Mark the positions (n, J) that the linear axes reach (n,)."""
    reached = np.ones(len(positions), dtype=bool)
    for index, joint in enumerate(context.chain.joints):
        visited = context.positions[:, index]
        if joint.turns or (joint.name not in strokes and not np.ptp(visited)):
            continue
        middle, half = (visited.max() + visited.min()) / 2.0, np.ptp(visited) / 2.0 * STRETCH
        low, high = strokes.get(joint.name, (middle - half, middle + half))
        reached &= (positions[:, index] >= low) & (positions[:, index] <= high)
    return reached


def _context(context: Context, rows: npt.NDArray[np.int64], positions: Array, target: Array) -> Context:
    """The context of some rows at other positions, with the target elsewhere."""
    return replace(
        context,
        positions=positions,
        expected=None,
        run=context.run[rows],
        sequence=context.sequence[rows],
        time=context.time[rows],
        day_time=context.day_time[rows],
        run_time=context.run_time[rows],
        target=context.target[rows],
        nominal=target,
        columns={name: values[rows] for name, values in context.columns.items()},
        sight=None,
        instruments=None,
        stretch=None,
        set_up=None,
        approach=None,
        measured=context,
    )


def _rows(
    problem: InstrumentProblem, part: Part, new: Context, pose: ChainPose, effects: list[ChainEffect]
) -> PlanRows:
    """Whitened rows (n, 3, p) of a second set-up, with the unknowns of the first one's where they belong."""
    assert pose.by_error is not None
    sigma = float(np.mean(problem.sigma[part.at, :3]))
    nuisance = np.zeros((len(new), 3, len(problem.local_names)))
    for base, columns in zip(problem.base, problem.base_columns, strict=True):
        if isinstance(base, ChainEffect):
            nuisance[:, :, columns] = base.basis(new).displacement(pose.by_error)
    of_setup = len(problem.base_names) + problem.own_columns[problem.parts.index(part)]
    nuisance[:, :, of_setup[:3]] = -np.eye(3)
    if part.tool_point is not None:
        nuisance[:, :, of_setup[-len(TOOL_POINT) :]] = pose.by_tip
    columns_of_effects = [each.basis(new).displacement(pose.by_error) / sigma for each in effects]
    return PlanRows(nuisance / sigma, columns_of_effects)
