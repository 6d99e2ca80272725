"""Mistakes of the readings of one setup, or of all setups of one instrument: undone, they agree with the others.

Another sign of a bar, three of its planes in mm, or two exchanged components of an R-test contradict what the other
instruments say of the same machine: an effect that is sought for that takes them for a worn bearing. So who contradicts
whom is asked first, and of whoever does the mistakes are undone one at a time.

A real error of the machine or of an instrument contradicts too, by so many standard uncertainties in so many
directions. That a mistake undone would bring it near the others by chance is as likely as that a point falls into the
smaller of two balls: the ratio of their radii to the power of the directions. A mistake is named where that is next to
impossible.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.mistakes.column_mistakes import (
    Trial,
    Undo,
    all_signs,
    exchanged_axes,
    measured_columns,
    reading_mistakes,
    sign_turned,
    turned_axes,
    unit_mistakes,
)
from monitor.discovery.machine.mistakes.cures import (
    NOISE_TIMES,
    Maker,
    Mistake,
    cured_rms,
    fitted,
    fitted_problem,
    problem_with,
    sum_after_one_step,
    without_gross,
)
from monitor.discovery.machine.mistakes.fewer_rows import MOST_RUNS, fewer_rows
from monitor.discovery.machine.mistakes.plays import beside_shown_plays
from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.suspects import DOUBTFUL, who_contradicts
from monitor.methods.method import Contrast, ContrastKind, Instruments, SetupScatter
from monitor.records import Array, Branch, Campaign, Probings

#: So likely a real error may be to look like a mistake, all mistakes together that are tried.
BY_CHANCE = 0.01
#: A setup whose own readings scatter so many times as it states contradicts itself; within the last two it is in order.
#: No owner states a hundred times what his instrument scatters: it is in a larger unit.
SCATTERS, TOO_STILL, IN_ORDER = 3.0, 0.01, (0.5, 1.3)
#: Setups that scatter less than this part of what they state do so by chance, or by the caution of their owners, in so
#: many cases: that they are in order with a mistake undone counts.
QUIET, QUIETS = 0.3, 0.05
#: Mistakes that do the same leave sums of squares that differ by less: odds of a thousand to one.
AS_WELL = 13.8
#: What cures a setup that contradicts itself takes away what that scatters beyond; one step foresees half of it.
FORESEEN = 0.5
#: A setup with less than this part of all rows is fitted alone in less time than one step of all takes.
SMALL = 1 / 15
#: The sign of all that was read is the likeliest of mistakes: half of ``BY_CHANCE`` is its own, where what is turned so
#: agrees with the others altogether.
OF_SIGN = 2
#: Beside plays all rows are looked at, which of more than this takes too long.
MOST_ROWS_OF_PLAYS = 2000
#: What one step foresees of exchanged axes, whose centres lie elsewhere, may be so many times worse than what is left.
OF_AXES = 100.0
#: So many of those that contradict are tried where none is a suspect alone, and of those that contradict themselves.
MOST_TRIED = 3
#: A mistake explains the readings where chance leaves so much, or where it leaves less than this part of the excess
#: over what is stated: beside it a machine still has its effects. Else it comes nearest.
BY_EFFECTS, MOST_LEFT = 1e-6, 0.1
OTHER_FRAME: dict[Branch, Branch] = {"work": "tool", "tool": "work"}


@dataclass(frozen=True)
class _Doubted:
    """A setup or an instrument by ``name`` with its ``setups``: it contradicts others by ``size`` in so many
    ``directions``; or, where there are none, what it states of itself; ``is_still`` or
    ``is_quiet`` where all of them scatter far less."""

    name: str
    setups: tuple[str, ...]
    size: float = 0.0
    directions: int = 0
    excess: float = 0.0
    is_still: bool = False
    is_quiet: bool = False

    @property
    def in_words(self) -> str:
        """Where a mistake of it stands."""
        return f"in setup {self.name}" if self.setups == (self.name,) else f"in all setups of {self.name}"


@dataclass(frozen=True)
class _Cure:
    """A mistake in words, what undoes it in a campaign, the fit of the rows that were tried with it undone, and whether
    it explains them."""

    what: str
    undone: Undo
    fit: Fit
    explains: bool


def find_setup_mistakes(campaign: Campaign, problem_of: Maker, first: Fit) -> tuple[Mistake, ...]:
    """The mistakes of a single setup or of all setups of one instrument; several where the readings cannot say which it
    was, the smallest remainder first.

    ``first`` is the fit of the campaign as recorded, whose gross readings take no part; of very many rows some are
    tried. Empty where nobody contradicts others or itself, or where no mistake explains it.
    """
    ability = campaign_method(campaign).instruments
    if not isinstance(ability, Instruments):
        return ()
    campaign = without_gross(campaign, first)
    mistakes = _mistakes(campaign, problem_of, first)
    if mistakes or first.rms < NOISE_TIMES * first.sigma or len(campaign.probings) > MOST_ROWS_OF_PLAYS:
        return mistakes
    # What plays and lags leave hides whether who is doubted agrees; and who reads them otherwise contradicts by them.
    beside = beside_shown_plays(campaign, problem_of)
    fit = None if beside is None else fitted(campaign, beside)
    if beside is None or fit is None:
        return ()
    plays = fit.problem.added[len(first.problem.added) :]
    in_model = f" (with {' and '.join(effect.text for effect in plays)} in the model)"
    mistakes = _mistakes(campaign, beside, fit, beside_plays=True)
    return tuple(replace(mistake, what=mistake.what + in_model) for mistake in mistakes)


def _mistakes(
    campaign: Campaign, problem_of: Maker, first: Fit, *, beside_plays: bool = False
) -> tuple[Mistake, ...]:
    """The mistakes of a campaign without gross readings, of which of very many rows some are tried; beside plays all
    rows, since between some of them the moves would be others, and signs alone."""
    ability = campaign_method(campaign).instruments
    assert isinstance(ability, Instruments)
    tried, of_tried = campaign, first
    if not beside_plays and len(rows := fewer_rows(campaign.probings)) < len(campaign.probings):
        tried = replace(campaign, probings=campaign.probings.rows(rows))
        refitted = fitted(tried, problem_of)
        if refitted is None:
            return ()
        of_tried = refitted
    for run in islice(reversed(of_tried.problem.runs), MOST_RUNS):
        doubted, untried = _doubted(
            ability.contrasts(of_tried.problem, of_tried.solution, int(run)),
            ability.scatters(of_tried.problem, of_tried.solution, int(run)),
        )
        if doubted:
            cures = [
                cure
                for each in doubted
                for cure in _cures(tried, problem_of, of_tried, int(run), each, only_sign=beside_plays)
            ]
            least = min((cure.fit.sum_of_squares for cure in cures), default=0.0)
            alike = [cure for cure in cures if cure.fit.sum_of_squares <= least + AS_WELL]
            mistakes = []
            for cure in sorted(alike, key=lambda cure: cure.fit.sum_of_squares):
                fit = cure.fit if tried is campaign else fitted(cure.undone(campaign), problem_of)
                if fit is not None:
                    mistakes.append(Mistake(cure.what, first.rms, fit.rms, cure.explains, untried))
            return tuple(mistakes)
    return ()


def only_misread(campaign: Campaign, problem_of: Maker) -> str | None:
    """The one setup that reads something else than it is set up for, where all others agree without it: no column that
    they read too is wrong. None where there is none, or more."""
    ability = campaign_method(campaign).instruments
    if not isinstance(ability, Instruments):
        return None
    try:
        misread = ability.misread(problem_of(campaign))
    except MonitorError:
        return None
    rest = campaign.probings.rows(~_rows_of(campaign, misread))
    if len(misread) != 1 or not len(rest):
        return None
    agrees = cured_rms(replace(campaign, probings=rest), problem_of, np.inf) is not None
    return misread[0] if agrees else None


def _doubted(every: Sequence[Contrast], scatters: Sequence[SetupScatter]) -> tuple[list[_Doubted], int]:
    """Whose mistakes are tried: the suspects of those that contradict all others, else all that do; and the setups that
    contradict themselves. And of how many more, which contradict less, none is tried."""
    contradiction = who_contradicts(every)
    against: Sequence[Contrast] = ()
    if contradiction is not None:
        of_many = [each for each in contradiction.every if each.p * contradiction.comparisons <= DOUBTFUL]
        against = sorted(contradiction.suspects or of_many, key=lambda each: (each.p, -each.size))
    still, quiet = ({each.setup for each in scatters if each.times < limit} for limit in (TOO_STILL, QUIET))
    doubted = [
        _Doubted(
            each.name,
            each.setups,
            each.size,
            each.directions,
            is_still=still.issuperset(each.setups),
            is_quiet=quiet.issuperset(each.setups),
        )
        for each in against[:MOST_TRIED]
        if each.kind is not ContrastKind.STATED
    ]
    tried = {setup for each in doubted for setup in each.setups}
    rest = [each for each in scatters if each.setup not in tried]
    too_still = [
        _Doubted(each.setup, (each.setup,), is_still=True) for each in rest if each.times <= TOO_STILL
    ]
    scattering = [
        _Doubted(each.setup, (each.setup,), excess=each.numbers * (each.times**2 - IN_ORDER[1] ** 2))
        for each in rest
        if each.times >= SCATTERS
    ]
    # Where many do, it is the machine that the model does not describe: a mistake would be the largest.
    scattering.sort(key=lambda each: -each.excess)
    untried = max(len(against) - MOST_TRIED, 0) + max(len(scattering) - MOST_TRIED, 0)
    return [*doubted, *too_still, *scattering[:MOST_TRIED]], untried


def _cures(
    campaign: Campaign, problem_of: Maker, first: Fit, run: int, doubted: _Doubted, *, only_sign: bool
) -> list[_Cure]:
    """The mistakes of who is doubted that undone let it agree; signs and columns of axes where none of its readings is
    one; or the sign of all that it reads alone."""
    rows = _rows_of(campaign, doubted.setups)
    is_small = doubted.excess > 0.0 and np.count_nonzero(rows) < SMALL * len(rows)
    part = _part(campaign, rows)
    of_sign = _of_sign(part)
    of_readings, of_axes = _trials(part, doubted)
    if only_sign:
        of_readings, of_axes = [trial for trial in of_readings if trial[0] == of_sign], []
    count = max(len(of_readings) + len(of_axes), OF_SIGN)
    if _by_chance(doubted, 0.0, min(count, OF_SIGN), is_quiet=doubted.is_quiet) >= BY_CHANCE:
        # It contradicts by so little that even who agrees in full, with a mistake undone, may do so by chance.
        return []
    total = first.sum_of_squares
    of_one_step = total - FORESEEN * doubted.excess, OF_AXES * total
    for trials, limit in zip((of_readings, of_axes), of_one_step, strict=True):
        cures = []
        for what, undo in trials:
            undone_in = partial(_undone, setups=doubted.setups, undo=undo)
            if is_small and _contradicts_itself(_part(undone_in(campaign), rows), problem_of, run):
                continue
            problem = _worth_fitting(undone_in(campaign), problem_of, np.inf if doubted.is_still else limit)
            fit = None if problem is None else fitted_problem(problem)
            if fit is not None and _is_cured(
                campaign, first, fit, run, doubted, count, is_sign=what == of_sign
            ):
                what = f"{what.split(' (`')[0]} {doubted.in_words}"
                explains = doubted.is_still or _explains(
                    max(fit.degrees_of_freedom, 1), first.sum_of_squares, fit.sum_of_squares
                )
                cures.append(_Cure(what, undone_in, fit, explains))
        if cures:
            return cures
    return []


def _of_sign(part: Campaign) -> str:
    """The words of the sign of all that was measured in some rows."""
    measured = measured_columns(part)
    return next((what for what, _ in all_signs(measured)), sign_turned(", ".join(measured)))


def _trials(part: Campaign, doubted: _Doubted) -> tuple[list[Trial], list[Trial]]:
    """The mistakes that are tried in the rows of who is doubted: of its readings, and of the axes."""
    measured = measured_columns(part)
    # Readings in a smaller unit would be next to nothing once that is undone, which contradicts nothing.
    of_units = [*unit_mistakes(measured, 1.0)]
    of_readings = of_units
    if not doubted.is_still:
        frames = _mistaken_frames(part, doubted.setups)
        of_readings = [*reading_mistakes(part), *all_signs(measured), *of_units, *frames]
    # The axes of several setups of one instrument are those of the machine, which all others move too.
    of_axes = [] if doubted.is_still or len(doubted.setups) > 1 else [*_mistaken_axes(part)]
    return of_readings, of_axes


def _contradicts_itself(alone: Campaign, problem_of: Maker, run: int) -> bool:
    """Whether the rows of a setup scatter in a run even when they are fitted without all others, who can but add to
    that: few rows say so sooner than all. False where they have no fit of their own."""
    fit = fitted(alone, problem_of)
    ability = campaign_method(alone).instruments
    if fit is None or not isinstance(ability, Instruments):
        return False
    return any(each.times >= SCATTERS for each in ability.scatters(fit.problem, fit.solution, run))


def _worth_fitting(undone: Campaign, problem_of: Maker, limit: float) -> ChainProblem | None:
    """The problem of a campaign; None where one step of a fit foresees a sum of squares above a limit."""
    problem = problem_with(undone, problem_of)
    return problem if problem is not None and sum_after_one_step(problem) <= limit else None


def _is_cured(
    campaign: Campaign, first: Fit, fit: Fit, run: int, doubted: _Doubted, count: int, *, is_sign: bool
) -> bool:
    """Whether who is doubted agrees in a ``fit`` with one of ``count`` mistakes undone, the sign of all that it reads
    where it ``is_sign``."""
    if fit.sum_of_squares >= first.sum_of_squares and not doubted.is_still:
        return False
    ability = campaign_method(campaign).instruments
    assert isinstance(ability, Instruments)
    contrast = ability.contrast(fit.problem, fit.solution, run, doubted.name)
    is_in_order = _is_in_order(ability.scatters(fit.problem, fit.solution, run), doubted)
    if not doubted.directions or doubted.is_still:
        return is_in_order and (contrast is None or contrast.p > DOUBTFUL)
    if contrast is None or contrast.directions < doubted.directions:
        return False
    is_quiet = doubted.is_quiet and is_in_order
    if is_sign and contrast.p > DOUBTFUL:
        count = min(count, OF_SIGN)
    return _by_chance(doubted, contrast.size, count, is_quiet=is_quiet) < BY_CHANCE


def _by_chance(doubted: _Doubted, size: float, count: int, *, is_quiet: bool) -> float:
    """How often chance brings one of so many mistakes undone to contradict others by no more than a ``size``; 0 where
    who is doubted contradicts itself alone, or is still."""
    if not doubted.directions or doubted.is_still:
        return 0.0
    return count * (QUIETS if is_quiet else 1.0) * (max(size, 1.0) / doubted.size) ** doubted.directions


def _explains(free: int, recorded: float, undone: float) -> bool:
    """Whether of a sum of squares as ``recorded`` so much is left with a mistake ``undone`` as effects of the machine
    may leave; ``free`` are the degrees of freedom."""
    is_next_to_all = undone - free < MOST_LEFT * (recorded - free)
    return is_next_to_all or float(scipy.special.chdtrc(free, undone)) > BY_EFFECTS


def _is_in_order(scatters: Sequence[SetupScatter], doubted: _Doubted) -> bool:
    """Whether all setups of who is doubted scatter as they state."""
    times = [each.times for each in scatters if each.setup in doubted.setups]
    return len(times) == len(doubted.setups) and IN_ORDER[0] < min(times) and max(times) < IN_ORDER[1]


def _mistaken_axes(part: Campaign) -> Iterator[Trial]:
    readings = part.probings.readings
    moved = [axis for axis in readings if np.ptp(readings[axis]) > 0]
    linear = [axis for axis in readings if part.machine.is_linear(axis)]
    turning = [axis for axis in moved if axis not in linear]
    return chain(
        turned_axes([axis for axis in linear if axis in moved], turning),
        exchanged_axes(linear, turning, moved),
    )


def _mistaken_frames(part: Campaign, of: Sequence[str]) -> Iterator[Trial]:
    """The other frame of setups whose vectors are read on the side of the work, or of the tool."""
    frames = {(setup.reading, setup.frame) for setup in part.artefact.setups if setup.id in of}
    for frame, other in OTHER_FRAME.items():
        if frames == {("vector", frame)}:
            yield f'`frame = "{other}"` were right', partial(_with_frame, of, other)


def _with_frame(of: Sequence[str], frame: Branch, part: Campaign) -> Campaign:
    """The campaign with some setups read in another frame."""
    setups = (replace(setup, frame=frame) if setup.id in of else setup for setup in part.artefact.setups)
    return replace(part, artefact=replace(part.artefact, setups=tuple(setups)))


def _undone(campaign: Campaign, setups: tuple[str, ...], undo: Undo) -> Campaign:
    """The campaign with a mistake undone in the rows of some setups."""
    mask = _rows_of(campaign, setups)
    return _with_rows(campaign, mask, undo(_part(campaign, mask)))


def _rows_of(campaign: Campaign, setups: tuple[str, ...]) -> npt.NDArray[np.bool_]:
    """Which rows (n,) are of some setups."""
    number = campaign.probings.channels["setup"].astype(np.int64) - 1
    return np.isin(np.array([setup.id for setup in campaign.artefact.setups])[number], setups)


def _part(campaign: Campaign, mask: npt.NDArray[np.bool_]) -> Campaign:
    """Some rows of a campaign, with the columns that they have."""
    return replace(campaign, probings=_with_its_columns(campaign.probings.rows(mask)))


def _with_its_columns(probings: Probings) -> Probings:
    """The rows of a setup without the columns that it does not have."""
    recorded = {name: values for name, values in probings.channels.items() if np.isfinite(values).any()}
    return replace(probings, channels=recorded)


def _with_rows(campaign: Campaign, mask: npt.NDArray[np.bool_], undone: Campaign) -> Campaign:
    """The campaign with some rows, and the setups, as undone."""
    probings = campaign.probings
    readings = _merged(probings.readings, mask, undone.probings.readings)
    channels = _merged(probings.channels, mask, undone.probings.channels)
    probings = replace(probings, readings=readings, channels=channels)
    return replace(campaign, artefact=undone.artefact, probings=probings)


def _merged(
    columns: Mapping[str, Array], mask: npt.NDArray[np.bool_], undone: Mapping[str, Array]
) -> dict[str, Array]:
    merged = {name: np.array(values) for name, values in columns.items()}
    for name, values in undone.items():
        merged[name][mask] = values
    return merged
