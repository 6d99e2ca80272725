"""How far do two sides of an event lie apart beyond the drift of the machine?

What a machine drifts by is no scatter: between two campaigns it is expected, and what is beyond it is the step. The
means of the campaigns lie on lines, one for each piece of the history between events, all of one rate; about the lines
they scatter independently, or wander from campaign to campaign (a random walk whose steps grow with the time between),
or both. Few campaigns do not show which: of all mixtures that their restricted likelihood leaves open the one is taken
under which the step is least sure. For each mixture the test is generalised least squares with Student's law, which is
exact. Fewer campaigns than ``ENOUGH`` degrees of freedom need say nothing of both drift and scatter: of them
``moves`` says whether the machine also moves where no event is. Compare the days alone with ``before_after``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array
from monitor.statistics.days.rival_scatter import factor
from monitor.statistics.groups import group_columns, independent_columns
from monitor.statistics.sums import label_groups

#: Variance of what a machine wanders by between neighbouring campaigns, in that of their independent scatter.
MIXTURES = (0.0, 0.1, 0.3, 1.0, 3.0, 30.0)
#: A mixture is left out where the logarithm of its likelihood is so far below the highest.
REFUTED = 2.0
#: So many campaigns of each side, those next to the event, are on its line: a drift of years is no line.
NEAREST = 24
#: Campaigns whose mean times differ by less, in days, show no rate.
SAME_TIME = 1e-3
#: Degrees of freedom beside the lines from which on these judge a step.
ENOUGH = 2


@dataclass(frozen=True, eq=False)
class Campaigns:
    """Campaigns (c,) in the order of time: their ``mean``, ``t`` in days, and ``piece``, the number of the stretch
    between two events or changes that they lie in, with their ``label``; ``days`` (c,) are the means of their days.

    ``era`` (c,) numbers the stretches between events alone: what the machine does in one, it does without an event.
    A campaign that an event cuts in two is two. Campaigns of one ``group`` (c,) are off together, as those that one
    instrument measured; 0 where nobody says them.
    """

    mean: Array
    t: Array
    piece: npt.NDArray[np.intp]
    era: npt.NDArray[np.intp]
    label: npt.NDArray[Any]
    days: tuple[Array, ...]
    group: npt.NDArray[np.intp]

    @property
    def of_day(self) -> tuple[float, int]:
        """Variance of the mean of a day within its campaign, with its degrees of freedom."""
        dof = sum(len(days) - 1 for days in self.days)
        squares = sum(float(((days - days.mean()) ** 2).sum()) for days in self.days)
        return (squares / dof if dof else 0.0), dof


def campaigns_of(
    values: Array,
    days: npt.ArrayLike,
    t: Array,
    piece: npt.NDArray[np.intp],
    campaign: npt.ArrayLike,
    era: npt.NDArray[np.intp] | None = None,
    group: npt.NDArray[np.intp] | None = None,
) -> Campaigns:
    """Return the means of the means of days of each campaign, from runs (n,) with the labels of theirs; without ``era``
    the pieces are between events alone."""
    labels = np.asarray(campaign)
    by_campaign, by_day = (label_groups(of, len(values))[1] for of in (labels, days))
    parts, part = np.unique(np.column_stack([piece, by_campaign]), axis=0, return_inverse=True)
    # Sorted by part first, so that the days of one follow each other.
    day, of_day = np.unique(np.column_stack([part.ravel(), by_day]), axis=0, return_inverse=True)
    runs, count = np.bincount(of_day.ravel()), np.bincount(day[:, 0])
    mean_of_day, day_at = (
        np.bincount(of_day.ravel(), column - column[0]) / runs + column[0] for column in (values, t)
    )
    mean, at = (
        np.bincount(day[:, 0], column - column[0]) / count + column[0] for column in (mean_of_day, day_at)
    )
    first = np.unique(part.ravel(), return_index=True)[1]
    era = parts[:, 0] if era is None else era[first]
    group = np.zeros(len(first), dtype=np.intp) if group is None else group[first]
    order = np.lexsort((at, parts[:, 0]))
    of_days = np.split(mean_of_day, np.cumsum(count)[:-1])
    return Campaigns(
        mean[order], at[order], parts[order, 0], era[order], labels[first][order],
        tuple(of_days[index] for index in order), group[order],
    )  # fmt: skip


@dataclass(frozen=True)
class SteppedLine:
    """``step`` of one side against the other beyond the drift, with ``u`` and ``dof``, and ``rate`` a day of the drift
    with ``u_rate``, by the mixture under which the step is least sure.

    ``expected`` is what the drift makes of the compared means, ``wander`` the mixture, ``campaigns`` how many are on
    the lines.
    """

    step: float
    u: float
    dof: int
    expected: float
    rate: float
    u_rate: float
    wander: float
    campaigns: int

    def p_value(self, besides: float = 0.0) -> float:
        """The probability of a step as large as this one where there is none; with a variance ``besides``, of a side
        that scatters more than the others."""
        return float(2.0 * scipy.special.stdtr(self.dof, -abs(self.step) / np.sqrt(self.u**2 + besides)))

    @property
    def k(self) -> float:
        """The coverage factor for 95 %."""
        return factor(self.dof)

    @property
    def drifts(self) -> bool:
        """Whether the rate is larger than its expanded uncertainty for 95 %."""
        return abs(self.rate) > self.k * self.u_rate


def stepped_line(campaigns: Campaigns, before: int, after: int, *, levels: bool) -> SteppedLine | None:
    """Return the step between the campaigns ``before`` and ``after`` (indices), the last and the first of two pieces.

    With ``levels`` it is that of the two lines, otherwise that of these two campaigns alone. Groups may be off by any
    amount each. None where the campaigns leave fewer than ``ENOUGH`` degrees of freedom beside these, do not differ, or
    show no rate: those of each piece and group are of one time. None as well where no group says how far the two lines
    lie apart, since none was measured on both sides.
    """
    inside = _near(campaigns, before, after)
    before, after = int(inside[:before].sum()), int(inside[:after].sum())
    y, t = campaigns.mean[inside], campaigns.t[inside]
    piece, group = campaigns.piece[inside], campaigns.group[inside]
    levels_of, _ = _levels(piece, group)
    dof = len(y) - levels_of.shape[1] - 1
    if dof < ENOUGH or np.ptp(y) == 0.0 or not _is_told(t, piece, group, before, after, levels):
        return None
    y = y - y[before]
    results, likelihoods = [], []
    plan = tuple(t.tolist()), tuple(piece.tolist()), tuple(group.tolist())
    for form in _forms(*plan, before, after, levels):
        white = form.whiten @ y
        squares = float(white @ white - np.sum((form.basis.T @ white) ** 2))
        # Points on a line to the last digit have no scatter at all.
        variance = max(squares / dof, float(np.ptp(y)) ** 2 * 1e-24)
        likelihoods.append(-0.5 * dof * np.log(variance) - form.logs)
        rate = float(form.rate @ y)
        scatter = float(np.sqrt(variance))
        results.append(
            SteppedLine(
                float(form.step @ y), scatter * form.spread, dof, rate * float(t[after] - t[before]), rate,
                scatter * form.spread_rate, form.wander, len(y),
            )
        )  # fmt: skip
    highest = max(likelihoods)
    open_ = [line for line, value in zip(results, likelihoods, strict=True) if value >= highest - REFUTED]
    return min(open_, key=lambda line: abs(line.step) / line.u)


def _levels(piece: npt.NDArray[np.intp], group: npt.NDArray[np.intp]) -> tuple[Array, npt.NDArray[np.intp]]:
    """Columns (c, k) of the levels of pieces and of what groups are off by, as many as say different things, and the
    number (c,) of the column of each piece."""
    of = np.unique(piece, return_inverse=True)[1]
    columns = np.column_stack([np.eye(int(of.max()) + 1)[of], group_columns(group)])
    return columns[:, independent_columns(columns)], of


def _is_told(
    t: Array, piece: npt.NDArray[np.intp], group: npt.NDArray[np.intp], before: int, after: int, levels: bool
) -> bool:
    """Whether the times show a rate beside the levels, and a group how far the pieces of two campaigns lie apart."""
    columns, of = _levels(piece, group)
    away = t - t.mean()
    rest = away - columns @ np.linalg.lstsq(columns, away, rcond=None)[0]
    if np.ptp(rest) < SAME_TIME:
        return False
    if not levels:
        return bool(group[before] == group[after])
    # Pieces are of one part where a chain of groups leads from one to the other.
    reached = np.zeros(len(t), dtype=np.bool_)
    grown = of == of[before]
    while (grown & ~reached).any():
        reached |= grown
        grown = np.isin(group, group[reached]) | np.isin(of, of[reached])
    return bool(reached[after])


def moves(campaigns: Campaigns, before: int, after: int, *, levels: bool) -> tuple[float, int]:
    """Return the largest difference of two campaigns that follow each other in one era, and how many there are.

    Those nearer to each other than the two sides count for as much more time as lies between the sides: between the
    means of their campaigns with ``levels``, else between the two campaigns.
    """
    inside = _near(campaigns, before, after)
    ends = [np.array([end]) for end in (before, after)]
    if levels:
        ends = [np.flatnonzero(inside & (campaigns.piece == campaigns.piece[end])) for end in (before, after)]
    first, second = (float(campaigns.t[side].mean()) for side in ends)
    gap = second - first
    largest, pairs = 0.0, 0
    for group in np.unique(campaigns.group[inside]):
        # Of each group by itself: what two of them are apart is no move.
        those = np.flatnonzero(inside & (campaigns.group == group))
        era, t, mean = (np.diff(column[those]) for column in (campaigns.era, campaigns.t, campaigns.mean))
        together = (era == 0) & (t > 0.0)
        longer = np.maximum(1.0, gap / t[together])
        largest = max(largest, float(np.max(np.abs(mean[together]) * longer, initial=0.0)))
        pairs += int(together.sum())
    return largest, pairs


def _near(campaigns: Campaigns, before: int, after: int) -> npt.NDArray[np.bool_]:
    """The campaigns (c,) on the lines: the nearest before and after the event, whatever pieces they lie in."""
    index = np.arange(len(campaigns.mean))
    return np.asarray((index > before - NEAREST) & (index < after + NEAREST))


@dataclass(frozen=True, eq=False)
class _Form:
    """What generalised least squares makes of the means (c,) under the mixture ``wander``.

    ``whiten`` (c, c) makes them independent, ``basis`` (c, p) spans what the lines explain of the whitened. ``step``
    and ``rate`` (c,) are sums over the means, ``spread`` and ``spread_rate`` their standard deviations in scatters of a
    campaign; ``logs`` is what the likelihood loses.
    """

    wander: float
    whiten: Array
    basis: Array
    step: Array
    rate: Array
    spread: float
    spread_rate: float
    logs: float


@lru_cache(maxsize=128)
def _forms(
    t: tuple[float, ...],
    piece: tuple[int, ...],
    group: tuple[int, ...],
    before: int,
    after: int,
    levels: bool,
) -> tuple[_Form, ...]:
    """The forms of all mixtures for campaigns at times in pieces and groups; the parameters of a machine share them."""
    at = np.array(t)
    columns, of = _levels(np.array(piece, dtype=np.intp), np.array(group, dtype=np.intp))
    gaps = np.diff(at)[np.diff(at) > 0.0]
    unit = float(np.median(gaps)) if len(gaps) else 1.0
    gap = float(at[after] - at[before])
    design = np.column_stack([columns, (at - at[before]) / unit])
    walked = (np.minimum.outer(at, at) - at.min()) / unit
    forms = []
    for wander in MIXTURES:
        half = np.linalg.cholesky(np.eye(len(at)) + wander * walked)
        whiten = scipy.linalg.solve_triangular(half, np.eye(len(at)), lower=True)
        basis, upper = np.linalg.qr(whiten @ design)
        rows = whiten.T @ basis @ np.linalg.inv(upper).T
        rate = rows[:, -1] / unit
        if levels:
            step = rows[:, of[after]] - rows[:, of[before]]
        else:
            step = -gap * rate
            step[after] += 1.0
            step[before] -= 1.0
        spread, spread_rate = (float(np.linalg.norm(half.T @ form)) for form in (step, rate))
        logs = float(np.log(np.diag(half)).sum() + np.log(np.abs(np.diag(upper))).sum())
        forms.append(_Form(wander, whiten, basis, step, rate, spread, spread_rate, logs))
    return tuple(forms)
