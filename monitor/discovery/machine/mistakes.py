"""Mistakes of the file where the residual is far beyond any effect: exchanged targets or columns, signs, units.

What a machine hides is micrometres to tenths of a millimetre; a residual of millimetres is first of all a column or a
target in the wrong place. The simple mistakes are undone one at a time and the campaign is fitted again: where one
of them lets the residual fall to the noise, it is told, and nothing else is. Nothing is changed in the data.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.records import Array, Campaign

#: So many mm are left by no effect that a search should begin with, whatever the stated standard uncertainty.
GROSS_MM = 0.3
#: Undone, a mistake leaves less than this part of the residual, and no more than so many standard uncertainties:
#: beside the mistake a machine still has its effects.
CURED_SHARE, CURED_TIMES = 0.05, 20.0
#: What is left at the noise is a cure as well, where the residual was little more to begin with.
NOISE_TIMES, WORTH_SHARE = 1.3, 0.5
#: Rows are relabelled where another target leaves less than this part of their residual.
BETTER_SHARE = 0.3
MOST_ROUNDS = 6
#: Every target is tried at every row up to so many; a part with a hundred points has a name for each.
MOST_TARGETS = 12
#: Readings that fit converge in some eight steps; a trial that does not is none.
MOST_STEPS = 15
#: Rows that are named one by one.
MOST_NAMED = 4

#: Makes the problem of a campaign.
Maker = Callable[[Campaign], ChainProblem]


@dataclass(frozen=True)
class Mistake:
    """What looks wrong in the file: ``what`` in words, and the RMS of all coordinates in mm with it and without."""

    what: str
    rms_as_recorded: float
    rms_undone: float


def is_gross(campaign: Campaign, found: Fit) -> bool:
    """Whether a residual is beyond what effects of a machine leave."""
    return found.rms > campaign_method(campaign).gross_times * found.sigma or found.rms > GROSS_MM


def find_mistakes(campaign: Campaign, problem_of: Maker, found: Fit | None) -> tuple[Mistake, ...]:
    """The mistakes that undone let the residual fall to the noise, the smallest remainder first.

    ``found`` is the fit of the campaign as recorded, None where it does not converge. Several are told where data
    cannot say which it was. Empty where none of those tried is enough.
    """
    before = float("inf") if found is None else found.rms
    # Quick, and what it finds no exchange of whole columns would bring to the noise.
    relabelled = _relabelled(campaign, problem_of, found)
    if relabelled is not None:
        return (relabelled,)
    part = _part(campaign, found)
    trials: list[tuple[str, Campaign, float]] = []
    for what, undo in _systematic(campaign):
        rms = _cured(undo(part), problem_of, before)
        if rms is not None:
            trials.append((what, undo(campaign), rms))
    best = min((rms for *_, rms in trials), default=0.0)
    told = [
        Mistake(what, before, after)
        for what, corrected, rms in trials
        if rms <= 2.0 * best and (after := _cured(corrected, problem_of, before)) is not None
    ]
    return tuple(sorted(told, key=lambda one: one.rms_undone))


def _fitted(campaign: Campaign, problem_of: Maker) -> Fit | None:
    try:
        with np.errstate(all="ignore"):
            problem = problem_of(campaign)
            solution = solve_problem(problem, most=MOST_STEPS)
            return Fit(problem, solution, np.zeros(len(problem.context), dtype=bool))
    except (MonitorError, np.linalg.LinAlgError):
        # This is no machine of that file either.
        return None


def _cured(campaign: Campaign, problem_of: Maker, before: float) -> float | None:
    """The residual of a corrected campaign in mm, None where it is still too large."""
    found = _fitted(campaign, problem_of)
    if found is None or not np.isfinite(found.rms):
        return None
    return found.rms if _is_cure(found, before) else None


def _is_cure(found: Fit, before: float) -> bool:
    enough = max(CURED_SHARE * before, min(NOISE_TIMES * found.sigma, WORTH_SHARE * before))
    return found.rms < min(enough, CURED_TIMES * found.sigma)


def _part(campaign: Campaign, found: Fit | None) -> Campaign:
    """The run that is fitted worst, and of very many poses some, spread over the run."""
    probings = campaign.probings
    run = probings.run[0]
    if found is not None:
        squares = np.sum(found.vectors**2, axis=1)
        runs = np.unique(probings.run)
        run = runs[int(np.argmax([squares[found.problem.context.run == one].mean() for one in runs]))]
    rows = np.flatnonzero(probings.run == run)
    most_rows = campaign_method(campaign).trial_rows
    if most_rows is not None and len(rows) > most_rows:
        joints = np.column_stack(list(probings.readings.values()))[rows]
        _, pose = np.unique(joints, axis=0, return_inverse=True)
        pose = pose.reshape(-1)
        step = int(np.ceil(len(rows) / most_rows))
        rows = rows[pose % step == 0]
    return replace(
        campaign,
        runs=tuple(one for one in campaign.runs if one.run == run),
        probings=probings.rows(rows),
    )


def _systematic(campaign: Campaign) -> Iterator[tuple[str, Callable[[Campaign], Campaign]]]:
    """Mistakes of whole columns and of names throughout, and what undoes each."""
    machine, probings = campaign.machine, campaign.probings
    linear = [axis for axis in probings.readings if machine.is_linear(axis)]
    turning = [
        axis
        for axis in probings.readings
        if not machine.is_linear(axis) and np.ptp(probings.readings[axis]) > 0
    ]
    for group in (linear, turning):
        for one, other in combinations(group, 2):
            columns = f"the columns {_column(one, one in linear)} and {_column(other, other in linear)}"
            yield f"{columns} were exchanged", _exchange("readings", [(one, other)])
    for axis in turning:
        yield (
            f"the sign of {axis} were the other way round (`sign` of {axis} in campaign.toml)",
            _scale("readings", (axis,), -1.0),
        )
    for axis in linear:
        yield f"the sign of {axis} were the other way round", _scale("readings", (axis,), -1.0)
    measured = [name for name in probings.channels if name.startswith(("tracker_", "plane_", "paraboloid_"))]
    for one, other in combinations(measured, 2):
        yield f"the columns {one} and {other} were exchanged", _exchange("channels", [(one, other)])
    spots = [("plane_u_um", "plane_v_um"), ("paraboloid_u_um", "paraboloid_v_um")]
    if all(name in measured for pair in spots for name in pair):
        yield "u and v of the sensor were exchanged in both pairs of columns", _exchange("channels", spots)
        across = [("plane_u_um", "paraboloid_u_um"), ("plane_v_um", "paraboloid_v_um")]
        yield "the columns of plane and paraboloid were exchanged", _exchange("channels", across)
    for name in measured:
        yield f"the sign of {name} were the other way round", _scale("channels", (name,), -1.0)
    for axes, unit, factor in (
        (linear, "in metres", 1e3),
        (linear, "in inches", 25.4),
        (turning, "in radians", 180.0 / np.pi),
    ):
        for some in [*([tuple(axes)] if len(axes) > 1 else []), *((axis,) for axis in axes)]:
            columns = ", ".join(_column(axis, axis in linear) for axis in some)
            yield f"{columns} {'was' if len(some) == 1 else 'were'} {unit}", _scale("readings", some, factor)
    if measured and measured[0].startswith("tracker_"):
        yield f"{', '.join(measured)} were in metres", _scale("channels", tuple(measured), 1e3)
    names = [str(name) for name in np.unique(probings.target)]
    if len(names) <= MOST_TARGETS:
        for one, other in combinations(names, 2):
            if not _told_apart(campaign).intersection((one, other)):
                continue
            yield (
                f"{_word(campaign)}s {one} and {other} were exchanged throughout",
                _exchange_targets(one, other),
            )


def _told_apart(campaign: Campaign) -> set[str]:
    """Targets that are more than a name: exchanged throughout, others only get each other's unknown place."""
    artefact = campaign.artefact
    if artefact.l_shape is not None:
        return {module.id for module in artefact.l_shape.modules}
    fixed = {reflector.id for reflector in artefact.reflectors if reflector.fixed}
    return fixed | set(() if artefact.scale_bar is None else artefact.scale_bar.balls)


def _column(axis: str, linear: bool) -> str:
    return f"{axis.lower()}_{'mm' if linear else 'deg'}"


def _word(campaign: Campaign) -> str:
    return campaign_method(campaign).nouns.target


def _exchange(
    numbers: Literal["readings", "channels"], pairs: Sequence[tuple[str, str]]
) -> Callable[[Campaign], Campaign]:
    """Exchanges pairs of columns."""

    def undo(campaign: Campaign) -> Campaign:
        found = dict(getattr(campaign.probings, numbers))
        for one, other in pairs:
            found[one], found[other] = found[other], found[one]
        changed: dict[str, Any] = {numbers: found}
        return replace(campaign, probings=replace(campaign.probings, **changed))

    return undo


def _scale(
    numbers: Literal["readings", "channels"], names: Sequence[str], factor: float
) -> Callable[[Campaign], Campaign]:
    """Multiplies some columns."""

    def undo(campaign: Campaign) -> Campaign:
        given = getattr(campaign.probings, numbers)
        found = {name: values * (factor if name in names else 1.0) for name, values in given.items()}
        changed: dict[str, Any] = {numbers: found}
        return replace(campaign, probings=replace(campaign.probings, **changed))

    return undo


def _exchange_targets(one: str, other: str) -> Callable[[Campaign], Campaign]:
    def undo(campaign: Campaign) -> Campaign:
        target = campaign.probings.target
        swapped = np.where(target == one, other, np.where(target == other, one, target))
        return replace(campaign, probings=replace(campaign.probings, target=swapped))

    return undo


def _relabelled(campaign: Campaign, problem_of: Maker, found: Fit | None) -> Mistake | None:
    """Some probings under the name of another target: those that another target explains far better.

    Held against the fit, or the nominal machine and places where none converges, and fitted again with their new
    names, since the wrong ones pulled at the fit, until no name changes.
    """
    before = float("inf") if found is None else found.rms
    now, fitted = campaign, found
    try:
        problem = problem_of(campaign) if found is None else found.problem
    except MonitorError:
        return None
    names = np.array(problem.targets)
    if not 2 <= len(names) <= MOST_TARGETS:
        return None
    for _ in range(MOST_ROUNDS):
        problem = problem_of(now) if fitted is None else fitted.problem
        if len(problem.targets) < len(names):
            return None
        local, common = problem.start, problem.common_start
        if fitted is not None:
            local, common = fitted.solution.local, fitted.solution.common
        squares = _under_every_name(problem, local, common)
        own = squares[np.searchsorted(names, problem.context.target), np.arange(squares.shape[1])]
        best = np.argmin(squares, axis=0)
        better = squares[best, np.arange(len(own))] < BETTER_SHARE**2 * own
        better &= np.sqrt(own) > CURED_TIMES * problem.sigma.max()
        if not better.any():
            break
        target = np.where(better, names[best], now.probings.target)
        now = replace(now, probings=replace(now.probings, target=target))
        fitted = _fitted(now, problem_of)
    changed = np.flatnonzero(now.probings.target != campaign.probings.target)
    # Where most rows would have another name, it is the fit that moved, not the names.
    if fitted is None or not 0 < len(changed) <= len(now.probings) / 2 or not _is_cure(fitted, before):
        return None
    return Mistake(_in_words(campaign, now.probings.target, changed), before, fitted.rms)


def _under_every_name(problem: ChainProblem, local: Array, common: Array) -> Array:
    """Squares (T, n) of the residuals in mm² at (R, p) and (c,), were every row one of each of the T targets."""
    context = problem.context
    names = np.array(problem.targets)
    own = np.searchsorted(names, context.target)
    squares = np.empty((len(names), len(own)))
    for shift in range(len(names)):
        # All names go round together, so that every target keeps its unknowns.
        told = (own + shift) % len(names)
        moved = replace(problem, context=replace(context, target=names[told]))
        squares[told, np.arange(len(own))] = np.sum(moved.vectors(local, common) ** 2, axis=1)
    return squares


def _in_words(campaign: Campaign, target: npt.NDArray[np.str_], changed: npt.NDArray[np.int64]) -> str:
    before = campaign.probings.target
    pairs = {tuple(sorted((str(before[row]), str(target[row])))) for row in changed}
    rows = [
        f"run {campaign.probings.run[row]}, sequence {campaign.probings.sequence[row]}" for row in changed
    ]
    shown = "; ".join(rows[:MOST_NAMED]) + "; ..." * (len(rows) > MOST_NAMED)
    count = f"{len(changed)} probing{'s' * (len(changed) > 1)} ({shown})"
    if len(pairs) == 1 and len(changed) > 1:
        one, other = next(iter(pairs))
        return f"{_word(campaign)}s {one} and {other} were exchanged in {count}"
    row = int(changed[0])
    if len(changed) == 1:
        return f"{_word(campaign)} {target[row]} was recorded as {before[row]} in {count}"
    return f"the names of {_word(campaign)}s were mixed up in {count}"
