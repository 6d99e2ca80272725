"""Columns of axes that stand some rows too late or too early beside the readings, from some row on.

A cell that was lost or put in twice moves all cells below it in a spreadsheet, and a log may be one value behind. The
readings then belong to the positions of other rows. That is asked of what a fit leaves, by what the readings would be
at the positions of the rows before or behind, for every row from which on that may be so: a shift has no size that
could be fitted, so it brings the residual down by chance nearly never. Where it does, the rows are fitted again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.mistakes.cures import (
    CURED_TIMES,
    MOST_STEPS,
    NOISE_TIMES,
    Maker,
    Mistake,
    fitted,
    problem_with,
    sum_after_one_step,
)
from monitor.exceptions import MonitorError
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.records import Array, Campaign

#: Rows by which a column may stand too late, or too early where less than zero.
SHIFTS = (1, -1, 2, -2, 3, -3)
#: Foreseen from the derivatives of the fit, a shift leaves less than this part of the sum of squares to be tried.
WORTH_TRYING = 0.5
#: So many that are foreseen to leave least are tried, each fitted so often while the row from which on it holds moves.
MOST_TRIED, MOST_ROUNDS = 2, 3
#: A shift explains the readings where it leaves less than this part of what they exceed their statement by: beside it a
#: machine still has its effects.
MOST_LEFT = 0.1
#: Where no fit holds, the last part of a run, or of a setup in it, is looked at, of so many rows at least, and so many
#: of these at most; so many shifts are fitted that are foreseen to leave about the same.
PARTS, FEWEST_ROWS, MOST_BLOCKS = (3, 6), 40, 12
MOST_ALIKE, ALIKE = 6, 10.0


@dataclass(frozen=True)
class LateRows:
    """The columns of ``axes`` stand ``late`` rows too late from ``row`` of the file on up to the row before ``end``."""

    axes: tuple[str, ...]
    late: int
    row: int
    end: int

    def undone(self, campaign: Campaign) -> Campaign:
        """The campaign with the columns beside their readings, without the rows for which there is none any more."""
        probings = campaign.probings
        source, has_position = self.source(len(probings))
        readings = {
            axis: values[source] if axis in self.axes else values
            for axis, values in probings.readings.items()
        }
        return replace(campaign, probings=replace(probings, readings=readings).rows(has_position))

    def source(self, count: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
        """The row (n,) whose position belongs to each row, and whether (n,) the file has it."""
        rows = np.arange(count)
        source = np.where((rows >= self.row) & (rows < self.end), rows + self.late, rows)
        has_position = (source == rows) | ((source >= self.row) & (source < self.end))
        return np.clip(source, 0, count - 1), has_position

    def columns(self, campaign: Campaign) -> tuple[str, ...]:
        """The names of the columns in the file."""
        return tuple(
            f"{axis.lower()}_{'mm' if campaign.machine.is_linear(axis) else 'deg'}" for axis in self.axes
        )

    def in_words(self, campaign: Campaign) -> str:
        """What is wrong, with the first row of which it is."""
        probings = campaign.probings
        named = f"{', '.join(self.columns(campaign))} {'stood' if len(self.axes) == 1 else 'all stood'}"
        last = "" if self.end == len(probings) else f" to sequence {probings.sequence[self.end - 1]}"
        begin = f"from about sequence {probings.sequence[self.row]} of run {probings.run[self.row]} on{last}"
        rows = f"{abs(self.late)} row{'s' * (abs(self.late) > 1)} too {'late' if self.late > 0 else 'early'}"
        return f"{begin} {named} {rows} beside the readings"


def find_late_rows(campaign: Campaign, problem_of: Maker, first: Fit) -> tuple[Mistake, ...]:
    """The mistake that columns of axes are shifted against the readings; ``first`` is the fit of the campaign as
    recorded. Empty where that leaves noise, or no shift explains nearly all of what is left."""
    best = late_rows(campaign, problem_of, first)
    return () if best is None else (Mistake(best[1].in_words(campaign), first.rms, best[0].rms),)


def late_rows(campaign: Campaign, problem_of: Maker, first: Fit) -> tuple[Fit, LateRows] | None:
    """The shift of columns behind that mistake, and the fit with it undone; None where there is none."""
    if first.rms < NOISE_TIMES * first.sigma:
        return None
    best: tuple[Fit, LateRows] | None = None
    for shift in _worth_trying(campaign, first):
        settled = _settled(campaign, first, shift)
        fit = None if settled is None else fitted(settled.undone(campaign), problem_of)
        if settled is None or fit is None or not _explains(first, fit):
            continue
        if best is None or fit.sum_of_squares < best[0].sum_of_squares:
            best = fit, settled
    return best


def _explains(first: Fit, fit: Fit) -> bool:
    """Whether of what a first fit leaves beyond what is stated a second one leaves next to nothing."""
    excess = fit.sum_of_squares - max(fit.degrees_of_freedom, 1)
    return excess < MOST_LEFT * (first.sum_of_squares - max(first.degrees_of_freedom, 1))


def _worth_trying(campaign: Campaign, first: Fit) -> list[LateRows]:
    """The shifts that are foreseen to leave little, that which leaves least first."""
    problem = first.problem.with_products()
    residual = first.solution.last.residual
    before = float(np.sum(residual**2))
    foreseen: list[tuple[float, LateRows]] = []
    for axes, positions in _moving(campaign, problem):
        for late in SHIFTS:
            moved, has_position = _moved(problem, first, positions, late)
            shift_found = _best_row(first, moved, has_position)
            if shift_found is not None and shift_found[0] < WORTH_TRYING * before:
                remains, row, end = shift_found
                foreseen.append((remains, LateRows(axes, late, row, end)))
    foreseen.sort(key=lambda pair: pair[0])
    return [shift for _, shift in foreseen[:MOST_TRIED]]


def _moving(campaign: Campaign, problem: ChainProblem) -> Iterator[tuple[tuple[str, ...], list[int]]]:
    """The axes whose columns may be shifted, each that moves, and all of several, with their joints' indices."""
    names = [joint.name for joint in problem.context.chain.joints]
    moving = [
        axis for axis, values in campaign.probings.readings.items() if axis in names and np.ptp(values) > 0.0
    ]
    for axis in moving:
        yield (axis,), [names.index(axis)]
    if len(moving) > 1:
        yield tuple(moving), [names.index(axis) for axis in moving]


def _moved(
    problem: ChainProblem, first: Fit, joints: Sequence[int], late: int
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """How the numbers (n, d) of the rows in mm change with the positions of some joints taken from so many rows behind,
    and whether (n,) there is such a row in the run."""
    context = problem.context
    rows = np.arange(len(context))
    source = np.clip(rows + late, 0, len(rows) - 1)
    has_position = (rows + late == source) & (context.run[source] == context.run)
    positions = context.positions.copy()
    positions[:, joints] = np.where(has_position[:, None], positions[source][:, joints], positions[:, joints])
    shifted = replace(problem, context=replace(context, positions=positions))
    solution = first.solution
    return shifted.vectors(solution.local, solution.common) - first.vectors, has_position


def _best_row(first: Fit, moved: Array, has_position: npt.NDArray[np.bool_]) -> tuple[float, int, int] | None:
    """What would be left, from which row on and up to which, were the numbers (n, d) ``moved`` by that from one row on:
    up to the end of the run, or of the file. Rows without a position count nothing from there on. None where the rows
    of runs do not follow each other in the file."""
    problem = first.problem
    residual, basis = first.solution.last.residual, first.nuisance.basis
    numbers = problem.sigma.shape[1]
    white = np.where(first.has_weight, moved / problem.sigma, 0.0)
    white = np.where(has_position[:, None], white, -problem.by_rows(residual))
    run = np.searchsorted(problem.runs, problem.context.run)
    if np.any(np.diff(run) < 0):
        return None
    change = problem.padded(white)
    depth = change.shape[1] // numbers
    remains = np.empty((len(residual), depth + 1))
    for index, (rest, by, unknowns) in enumerate(zip(residual, change, basis, strict=True)):
        squares = ((2.0 * rest[: len(by)] + by) * by).reshape(depth, numbers).sum(axis=1)
        taken = (unknowns[: len(by)] * by[:, None]).reshape(depth, numbers, -1).sum(axis=1)
        taken = rest @ unknowns + np.concatenate(
            [np.cumsum(taken[::-1], axis=0)[::-1], np.zeros((1, taken.shape[1]))]
        )
        squares = np.concatenate([np.cumsum(squares[::-1])[::-1], [0.0]])
        remains[index] = rest @ rest + squares - np.sum(taken**2, axis=1)
    as_recorded, whole = remains[:, -1], remains[:, 0]
    counts = np.bincount(run, minlength=len(residual))
    begins = np.concatenate([[0], np.cumsum(counts)])
    least: tuple[float, int, int] | None = None
    for index in range(len(residual)):
        row = int(np.argmin(remains[index, : counts[index]]))
        others = float(as_recorded[:index].sum()) + float(remains[index, row])
        to_end = others + float(whole[index + 1 :].sum()), int(begins[index]) + row, int(begins[-1])
        in_run = (
            others + float(as_recorded[index + 1 :].sum()),
            int(begins[index]) + row,
            int(begins[index + 1]),
        )
        least = min([to_end, in_run, *([] if least is None else [least])])
    return least


def _settled(campaign: Campaign, first: Fit, shift: LateRows) -> LateRows | None:
    """The shift from the row on that it explains best, by fits with it undone; None where these do not converge."""
    problem = first.problem.with_products()
    names = [joint.name for joint in problem.context.chain.joints]
    joints = [names.index(axis) for axis in shift.axes]
    begin = int(np.argmax(problem.context.run == problem.context.run[shift.row]))
    local, common = first.solution.local, first.solution.common
    for _ in range(MOST_ROUNDS):
        try:
            solution = solve_problem(_at_rows_of(problem, joints, shift), local, common, MOST_STEPS)
        except (MonitorError, np.linalg.LinAlgError):
            return None
        local, common = solution.local, solution.common
        whole = _at_rows_of(problem, joints, replace(shift, row=begin))
        as_recorded = _squares(problem, local, common)[begin : shift.end]
        undone = np.where(np.isfinite(whole.sigma).any(axis=1), _squares(whole, local, common), 0.0)
        # Where a column is early, the first rows of it have positions that the file has nowhere else.
        behind = np.cumsum(undone[begin : shift.end][::-1])[::-1][max(-shift.late, 0) :]
        before = np.concatenate([[0.0], np.cumsum(as_recorded)])[: len(behind)]
        row = begin + int(np.argmin(before + behind))
        if row == shift.row:
            break
        shift = replace(shift, row=row)
    return shift


def _at_rows_of(problem: ChainProblem, joints: Sequence[int], shift: LateRows) -> ChainProblem:
    """The problem with a shift of some joints undone; rows whose positions the file does not have get no weight."""
    context = problem.context
    source, has_position = shift.source(len(context))
    positions = context.positions.copy()
    positions[:, joints] = positions[source][:, joints]
    sigma = np.where(has_position[:, None], problem.sigma, np.inf)
    return replace(problem, context=replace(context, positions=positions), sigma=sigma)


def _squares(problem: ChainProblem, local: Array, common: Array) -> Array:
    """The whitened squares (n,) of the rows at (R, p) and (c,)."""
    return np.asarray(np.sum((problem.vectors(local, common) / problem.sigma) ** 2, axis=1))


def find_late_rows_without_fit(campaign: Campaign, problem_of: Maker) -> tuple[Mistake, ...]:
    """The same of readings that as recorded fit no machine, or leave millimetres: the last rows of a run are fitted by
    themselves with each shift undone, and then as many before them as that holds for."""
    best = late_rows_without_fit(campaign, problem_of)
    return () if best is None else (Mistake(best[1].in_words(campaign), float("inf"), best[0].rms),)


def late_rows_without_fit(campaign: Campaign, problem_of: Maker) -> tuple[Fit, LateRows] | None:
    """The shift of columns behind that mistake, and the fit with it undone; None where there is none."""
    end = len(campaign.probings)
    for last in _last_rows(campaign, problem_of):
        for shift in _late_at_end(_rows(campaign, last), problem_of):
            at_end = replace(shift, row=int(last[0]), end=int(last[-1]) + 1)
            shift_found = _first_row_of(campaign, problem_of, at_end)
            for tried in (replace(shift_found, end=end), shift_found):
                fit = fitted(tried.undone(campaign), problem_of)
                if fit is not None and _is_sound(fit):
                    return fit, tried
    return None


def _last_rows(campaign: Campaign, problem_of: Maker) -> Iterator[npt.NDArray[np.int64]]:
    """The last rows of the last run, or setup in a run, of which they do not fit as recorded, each fewer than before:
    elsewhere an axis may stand still."""
    probings = campaign.probings
    setup = probings.channels.get("setup", np.zeros(len(probings)))
    changes = np.flatnonzero((np.diff(probings.run) != 0) | (np.diff(setup) != 0)) + 1
    blocks = np.split(np.arange(len(probings)), changes)
    for rows in blocks[::-1][:MOST_BLOCKS]:
        for part in PARTS:
            last = rows[-max(len(rows) // part, min(len(rows), FEWEST_ROWS)) :]
            as_recorded = fitted(_rows(campaign, last), problem_of)
            if as_recorded is not None and as_recorded.rms < CURED_TIMES * as_recorded.sigma:
                break
            yield last
        else:
            return


def _late_at_end(tail: Campaign, problem_of: Maker) -> Iterator[LateRows]:
    """The shifts that each let some last rows fit, of those that are foreseen to leave about the least."""
    names = [axis for axis, values in tail.probings.readings.items() if np.ptp(values) > 0.0]
    trials: list[tuple[float, LateRows]] = []
    for axes in [*((axis,) for axis in names), *([tuple(names)] if len(names) > 1 else [])]:
        for late in SHIFTS:
            shift = LateRows(axes, late, 0, len(tail.probings))
            problem = problem_with(shift.undone(tail), problem_of)
            if problem is not None:
                trials.append((sum_after_one_step(problem) / len(problem.context), shift))
    trials.sort(key=lambda pair: pair[0])
    for foreseen, shift in trials[:MOST_ALIKE]:
        if foreseen > ALIKE * trials[0][0]:
            return
        fit = fitted(shift.undone(tail), problem_of)
        if fit is not None and _is_sound(fit):
            yield shift


def _first_row_of(campaign: Campaign, problem_of: Maker, shift: LateRows) -> LateRows:
    """The shift from the first row on from which all rows behind it fit with it undone."""
    good, bad = shift.row, -1
    while good - bad > 1:
        middle = (good + bad) // 2
        tried = replace(shift, row=0, end=shift.end - middle)
        fit = fitted(tried.undone(_rows(campaign, np.arange(middle, shift.end))), problem_of)
        if fit is not None and _is_sound(fit):
            good = middle
        else:
            bad = middle
    return replace(shift, row=good)


def _rows(campaign: Campaign, rows: npt.NDArray[np.int64]) -> Campaign:
    """Some rows of a campaign, with the columns that have numbers there."""
    probings = campaign.probings.rows(rows)
    recorded = {name: values for name, values in probings.channels.items() if np.isfinite(values).any()}
    runs = tuple(run for run in campaign.runs if run.run in probings.run)
    return replace(campaign, runs=runs, probings=replace(probings, channels=recorded))


def _is_sound(fit: Fit) -> bool:
    """Whether a fit leaves no more than effects of a machine may, of readings of which most are not used up by it."""
    return 2 * fit.degrees_of_freedom > fit.readings and fit.rms < CURED_TIMES * fit.sigma
