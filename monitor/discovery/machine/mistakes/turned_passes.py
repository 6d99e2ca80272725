"""Passes of a setup whose readings stand in the opposite order beside their positions.

A circle that was driven the other way round than its file says, or the way back of a laser that was exported with
rising positions: the first reading then belongs to the last position. Undoing it has no size that could be fitted, so
that it brings the residual down by chance nearly never; it is judged beside plays and lags, which make a way back
unlike a way there as well.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.mistakes.column_mistakes import measured_columns
from monitor.discovery.machine.mistakes.cures import NOISE_TIMES, Maker, Mistake, fitted
from monitor.discovery.machine.mistakes.plays import beside_plays
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.method import Instruments
from monitor.records import Array, Campaign

#: Rows of a pass: of fewer the order says little.
FEWEST_ROWS = 8
#: A pass ends where the axes turn by more than a right angle and a half of one; a circle is closed where its last
#: position is as near to its first one as so many steps.
TURNED, CLOSED = -0.5, 1.5
#: A pass put right takes away this part of what exceeds the statement, or it is none; so many are put right together,
#: after which less than this part is left of it: beside them a machine still has its effects.
WORTH_SHARE, MOST_LEFT = 0.2, 0.25
MOST_TOGETHER = 8
#: So many that are foreseen to leave least are fitted, where that is less than so many times what is left as recorded:
#: a play that is put right in one pass adds to it until it is fitted.
MOST_TRIED, FORESEEN = 6, 2.0
#: Passes that do the same leave sums of squares that differ by less: odds of a thousand to one.
AS_WELL = 13.8


@dataclass(frozen=True)
class _Pass:
    """The ``rows`` of a pass of a setup, and the ``source`` of each were the order the other one."""

    setup: str
    rows: npt.NDArray[np.int64]
    source: npt.NDArray[np.int64]

    @property
    def keeps_first(self) -> bool:
        """Whether its first row keeps its place."""
        return bool(self.source[0] == self.rows[0])

    def in_words(self, campaign: Campaign) -> str:
        """Which readings stand in the opposite order."""
        probings, first, last = campaign.probings, self.rows[0], self.rows[-1]
        return (
            f"the readings of sequence {probings.sequence[first]} to {probings.sequence[last]} of run "
            f"{probings.run[first]} (setup {self.setup}) stood in the opposite order beside their positions"
        )

    def undone(self, campaign: Campaign) -> tuple[Campaign, ...]:
        """The campaign with the readings in the other order, and with the positions so: which of the two is wrong says
        from which side the axes came."""
        probings = campaign.probings
        channels = self._turned(probings.channels, measured_columns(campaign))
        readings = self._turned(probings.readings, probings.readings)
        return (
            replace(campaign, probings=replace(probings, channels=channels)),
            replace(campaign, probings=replace(probings, readings=readings)),
        )

    def _turned(self, columns: Mapping[str, Array], names: Collection[str]) -> dict[str, Array]:
        """Columns of which some have the rows of the pass in the other order."""
        turned = dict(columns)
        for name in names:
            turned[name] = columns[name].copy()
            turned[name][self.rows] = columns[name][self.source]
        return turned


@dataclass(frozen=True)
class _Latest:
    """A campaign with what was put right, its problem with plays as fitted, and its fit without them."""

    campaign: Campaign
    fit: Fit
    without_plays: Fit


def find_turned_passes(campaign: Campaign, problem_of: Maker, first: Fit) -> tuple[Mistake, ...]:
    """The mistake that readings of passes stand in the opposite order; several where the readings cannot say of which
    pass. ``first`` is the fit of the campaign as recorded. Empty where that leaves noise, or no pass put right explains
    nearly all of what is left beside plays and lags."""
    if not isinstance(campaign_method(campaign).instruments, Instruments):
        return ()
    if first.rms < NOISE_TIMES * first.sigma:
        return ()
    passes = [*_passes(campaign, first.problem)]
    problem_with_plays = beside_plays(problem_of)
    as_recorded = fitted(campaign, problem_with_plays) if passes else None
    if as_recorded is None or as_recorded.rms < NOISE_TIMES * as_recorded.sigma:
        return ()
    latest = _Latest(campaign, as_recorded, first)
    turned: list[_Pass] = []
    alike: tuple[_Pass, ...] = ()
    while len(turned) < MOST_TOGETHER:
        rest = [each for each in passes if not _overlaps(each, turned)]
        better = _best_of(latest, problem_of, problem_with_plays, rest)
        if better is None:
            break
        latest, best, alike = better
        turned.append(best)
    if not turned or not _excess(latest.fit) < MOST_LEFT * _excess(as_recorded):
        return ()
    rms = latest.without_plays.rms
    mistakes = [Mistake(_in_words(campaign, turned), first.rms, rms)]
    if len(turned) == 1:
        mistakes += [Mistake(each.in_words(campaign), first.rms, rms) for each in alike]
    return tuple(mistakes)


def _excess(fit: Fit) -> float:
    """What a sum of squares exceeds its statement by."""
    return fit.sum_of_squares - max(fit.degrees_of_freedom, 1)


def _best_of(
    latest: _Latest, problem_of: Maker, problem_with_plays: Maker, passes: Sequence[_Pass]
) -> tuple[_Latest, _Pass, tuple[_Pass, ...]] | None:
    """What follows of the pass that put right leaves least, and those that do as well; None where none takes enough
    away."""
    foreseen = sorted(
        (remains, number, way)
        for number, remains in enumerate(_foreseen(latest, problem_of, passes))
        for way in range(2)
    )
    excess = _excess(latest.fit)
    cures: list[tuple[float, int, Campaign, Fit]] = []
    for remains, number, way in foreseen[:MOST_TRIED]:
        if remains > FORESEEN * latest.without_plays.sum_of_squares:
            break
        undone = passes[number].undone(latest.campaign)[way]
        fit = fitted(undone, problem_with_plays)
        if fit is not None and _excess(fit) < (1.0 - WORTH_SHARE) * excess:
            cures.append((fit.sum_of_squares, number, undone, fit))
    if not cures:
        return None
    cures.sort(key=lambda cure: cure[:2])
    least, best, undone, fit = cures[0]
    without_plays = fitted(undone, problem_of)
    if without_plays is None:
        return None
    # Where errors of the machine are left, they make one of two that do the same seem better.
    alike_up_to = least + AS_WELL * max(least / max(fit.degrees_of_freedom, 1), 1.0)
    as_well = {number: None for squares, number, *_ in cures if number != best and squares < alike_up_to}
    said = {passes[best].rows[0]}
    alike = []
    for number in as_well:
        if passes[number].rows[0] not in said:
            said.add(passes[number].rows[0])
            alike.append(passes[number])
    return _Latest(undone, fit, without_plays), passes[best], tuple(alike)


def _foreseen(latest: _Latest, problem_of: Maker, passes: Sequence[_Pass]) -> Iterator[float]:
    """The sum of squares that is foreseen with each pass put right, by the derivatives of the fit without plays."""
    fit = latest.without_plays
    solution, basis = fit.solution, fit.nuisance.basis
    # Passes share no rows but with their own other order: two problems say what all of them read.
    changes: dict[bool, Array] = {}
    for keeps_first in {each.keeps_first for each in passes}:
        turned = latest.campaign
        for each in passes:
            if each.keeps_first is keeps_first:
                turned = each.undone(turned)[0]
        change = problem_of(turned).vectors(solution.local, solution.common) - fit.vectors
        changes[keeps_first] = np.where(fit.has_weight, change / fit.problem.sigma, 0.0)
    for each in passes:
        white = np.zeros_like(changes[each.keeps_first])
        white[each.rows] = changes[each.keeps_first][each.rows]
        white = fit.problem.padded(white)
        rest = solution.last.residual.copy()
        rest[:, : white.shape[1]] += white
        rest -= np.einsum("rnp,rp->rn", basis, np.einsum("rnp,rn->rp", basis, rest))
        yield float(np.sum(rest**2))


def _passes(campaign: Campaign, problem: ChainProblem) -> Iterator[_Pass]:
    """Every pass of a setup between two turns of the axes, with the two ways in which its order may be turned."""
    setup = campaign.probings.channels["setup"].astype(np.int64) - 1
    positions = problem.context.positions
    extent = np.ptp(positions, axis=0)
    scaled = positions / np.where(extent > 0.0, extent, 1.0)
    for stretch in problem.context.stretches:
        changes = np.flatnonzero((np.diff(setup[stretch]) != 0) | (np.diff(stretch) != 1)) + 1
        for block in np.split(stretch, changes):
            name = campaign.artefact.setups[setup[block[0]]].id
            for rows in np.split(block, _turns(scaled[block])):
                if len(rows) < FEWEST_ROWS:
                    continue
                yield _Pass(name, rows, rows[::-1])
                if _is_closed(scaled[rows]):
                    # A circle that does not come back to its first position begins there either way.
                    yield _Pass(name, rows, np.concatenate([rows[:1], rows[:0:-1]]))


def _turns(places: Array) -> npt.NDArray[np.int64]:
    """The rows (k,) before which the axes stood still or turned back."""
    moves = np.diff(places, axis=0)
    length = np.linalg.norm(moves, axis=1)
    stands = np.flatnonzero(length == 0.0) + 1
    unit = moves / np.where(length > 0.0, length, 1.0)[:, None]
    turns = np.flatnonzero(np.sum(unit[1:] * unit[:-1], axis=1) < TURNED) + 1
    # The row at which the axes turn back ends the pass that came to it.
    return np.unique(np.concatenate([stands, turns + 1]))


def _is_closed(places: Array) -> bool:
    """Whether one step more would come back to the first of places."""
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    gap = float(np.linalg.norm(places[-1] - places[0]))
    return 0.0 < gap < CLOSED * float(np.median(steps))


def _overlaps(each: _Pass, turned: Sequence[_Pass]) -> bool:
    """Whether rows of a pass are among those that were put right."""
    return any(each.rows[0] <= other.rows[-1] and other.rows[0] <= each.rows[-1] for other in turned)


def _in_words(campaign: Campaign, turned: Sequence[_Pass]) -> str:
    """What stands in the opposite order, in the order of the file."""
    return ", and ".join(
        each.in_words(campaign) for each in sorted(turned, key=lambda each: int(each.rows[0]))
    )
