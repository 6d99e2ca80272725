"""Did a quantity change between two stretches of runs by the same method, before and after an event?

Whatever both share, as the scale of the bar or the form of the probe, drops out of their difference and has no part in
its uncertainty: what is left is the scatter of the means of days, whatever makes days differ. It is estimated from the
days of both sides and, where these are few, from other days of the same machine. One day a side and no other day cannot
tell a change from days that differ, however many runs there are: then nothing is decided. Judged by E_n with the
expanded uncertainty at 95 % for the degrees of freedom that there are, so that of machines that did not change one in
twenty is said to have. Days of a campaign may also resemble those before them, which few days do not show: what is
beyond independent days of one scatter but not beyond such (``following_days``), two sides that scatter differently, a
side of few days that scatters more than the others, or campaigns that differ by more than their days
(``rival_scatter``), is not decided either. Compare results of different methods, which share less, with
``normalised_error``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_vector
from monitor.statistics.days.following_days import following_days
from monitor.statistics.days.rival_scatter import (
    Allowance,
    Rival,
    factor,
    satterthwaite,
    two_scatters,
    wider_side,
)
from monitor.statistics.sums import label_groups

#: With fewer degrees of freedom of their own days than this, both sides lean on the machine's other days. It depends on
#: the plan alone, so that no rate moves by the choice.
ENOUGH = 8
#: From so many degrees of freedom on, the means of the machine's other campaigns say how campaigns differ, which days
#: that follow each other do not show; a change then has to exceed that, too.
CAMPAIGNS_THAT_SAY = 3


@dataclass(frozen=True)
class OtherDays:
    """Runs (k,) of the machine's other days: ``values``, their ``days``, the ``stretches`` between its changes, and
    their ``campaigns``.

    The days of a stretch scatter about the mean of that stretch; what differs between stretches is no scatter.
    """

    values: npt.ArrayLike
    days: npt.ArrayLike
    stretches: npt.ArrayLike
    campaigns: npt.ArrayLike


@dataclass(frozen=True)
class BeforeAfter:
    """``difference`` of the means of the days, after less before, in the unit of the values; ``u`` with ``dof``, ``k``
    for 95 %.

    ``u_before`` and ``u_after`` are those of the two means. ``between`` is the standard deviation of the days beyond
    their runs, None where no two days are alike: then the difference of the machine and that of two days are one, ``u``
    is of runs alone, and nothing is ``decided``. ``other_days`` of the machine took part in the estimate; of so many
    ``other_campaigns`` the means differ by more than that, and ``u``, ``dof`` and ``k`` are theirs (0: they do not).
    ``rivals`` are what the days do not exclude: days that resemble those before them by ``correlation`` (None where
    other campaigns say how campaigns differ), sides of different scatter (Welch; where no other days took part and both
    have two), a side of few days that scatters more, and campaigns that differ; none where nothing is known of days.
    """

    before: float
    after: float
    u_before: float
    u_after: float
    difference: float
    u: float
    dof: float
    k: float
    between: float | None
    other_days: int
    days_before: int
    days_after: int
    other_campaigns: int = 0
    rivals: tuple[Rival, ...] = ()
    correlation: float | None = None

    @property
    def decided(self) -> bool:
        """Whether the days say what a change has to exceed."""
        return self.between is not None

    @property
    def expanded(self) -> float:
        """Expanded uncertainty of the difference; where nothing is decided, by the runs alone and so too small."""
        return self.k * self.u

    @property
    def cautious(self) -> float | None:
        """The largest expanded uncertainty of the rivals, at least ``expanded``; None without rivals."""
        return max(self.expanded, *(rival.expanded for rival in self.rivals)) if self.rivals else None

    def p_value(self) -> float:
        """Return the probability of a difference as large as this one where nothing changed, days independent."""
        return float(2.0 * scipy.special.stdtr(self.dof, -abs(self.difference) / self.u))

    def p_value_of_rivals(self) -> float:
        """Return the largest p-value of the difference by what the days do not exclude; 0 without rivals."""
        return max((rival.p_value(self.difference) for rival in self.rivals), default=0.0)

    def limit(self, level: float) -> float:
        """Return what a difference has to exceed at a ``level`` of false calls, with all that the days leave open."""
        pairs = [(self.u, self.dof), *((rival.u, rival.dof) for rival in self.rivals)]
        return max(-float(scipy.special.stdtrit(dof, level / 2.0)) * u for u, dof in pairs)

    @property
    def e_n(self) -> float | None:
        """The difference in units of its expanded uncertainty; None where nothing is decided."""
        return self.difference / self.expanded if self.decided else None

    @property
    def agree(self) -> bool | None:
        """Whether the difference is no larger than its expanded uncertainty; None where nothing is decided: nothing is
        known of the days, or it is larger for independent days of one scatter only."""
        if self.e_n is None:
            return None
        if abs(self.e_n) <= 1.0:
            return True
        return None if self.cautious is not None and abs(self.difference) <= self.cautious else False


@dataclass(frozen=True)
class _Means:
    """Means of d days with their numbers of runs, the stretch of each from 0 (before), 1 (after) on, the sum of
    squares within the days, and the campaign of each."""

    mean: Array
    runs: Array
    stretch: npt.NDArray[np.intp]
    within: float
    campaign: npt.NDArray[np.intp]

    @property
    def dof_days(self) -> int:
        return len(self.mean) - len(np.unique(self.stretch))

    @property
    def dof_runs(self) -> int:
        return int(self.runs.sum()) - len(self.mean)


def _means(
    values: Array, day: npt.NDArray[np.intp], stretch: npt.NDArray[np.intp], campaign: npt.NDArray[np.intp]
) -> _Means:
    runs = np.bincount(day).astype(np.float64)
    # About one of the values: a large value common to all would cost digits.
    away = values - values[0]
    mean = np.bincount(day, away) / runs
    of_day, by_campaign = np.zeros((2, len(runs)), dtype=np.intp)
    of_day[day], by_campaign[day] = stretch, campaign
    return _Means(mean + values[0], runs, of_day, float(((away - mean[day]) ** 2).sum()), by_campaign)


def _joined(
    columns: list[tuple[Array, npt.ArrayLike, npt.NDArray[np.intp], npt.NDArray[np.intp]]],
) -> _Means:
    """Means of the days of several parts, whose days differ although their labels may be alike."""
    day, count = [], 0
    for values, days, *_ in columns:
        index = label_groups(days, len(values))[1]
        day.append(index + count)
        count += int(index.max()) + 1
    values, stretch, campaign = (np.concatenate([column[i] for column in columns]) for i in (0, 2, 3))
    return _means(values, np.concatenate(day), stretch, campaign)


def before_after(
    before: npt.ArrayLike,
    after: npt.ArrayLike,
    days_before: npt.ArrayLike,
    days_after: npt.ArrayLike,
    others: OtherDays | None = None,
    allowance: Allowance = Allowance(),  # noqa: B008
) -> BeforeAfter:
    """Compare runs (n,) before with runs (m,) after an event, of the days (n,) and (m,), every day alike.

    Where the days of both sides leave fewer than ``ENOUGH`` degrees of freedom, those of ``others`` are added. Exact
    for independent normal days of as many runs, whatever the day component; with unequal numbers of runs the scatter of
    the runs makes up what the means of a side scatter more than those of the others (Satterthwaite). A day that the
    event cuts in two counts on both sides: its two halves share what is of the day only in part, which is neglected.
    Raises ``DataError`` for fewer than three runs, or where nothing scatters. Measured: docs/trials-statistics.md.
    """
    x, y = as_vector(before, "before"), as_vector(after, "after")
    if len(x) + len(y) < 3:
        raise DataError(
            f"{len(x)} run(s) before and {len(y)} after say nothing of their scatter; three are needed."
        )
    of_x, of_y = np.zeros(len(x), np.intp), np.ones(len(y), np.intp)
    sides = [(x, days_before, of_x, of_x), (y, days_after, of_y, of_y)]
    joined = _joined(sides)
    means, other_days = joined, 0
    if others is not None and joined.dof_days < ENOUGH and len(np.asarray(others.values)):
        values = as_vector(others.values, "others")
        stretch = label_groups(others.stretches, len(values))[1] + 2
        campaign = label_groups(others.campaigns, len(values))[1] + 2
        every = _joined([*sides, (values, others.days, stretch, campaign)])
        if every.dof_days > joined.dof_days:
            means, other_days = every, len(every.mean) - len(joined.mean)
    if np.ptp(x) == 0.0 and np.ptp(y) == 0.0:
        raise DataError("no run differs from the others of its side; the difference has no uncertainty.")
    result = _judged(joined, means, other_days, allowance)
    return result if others is None else _beside_campaigns(result, others, joined)


def _beside_campaigns(result: BeforeAfter, others: OtherDays, joined: _Means) -> BeforeAfter:
    """The same with what the means of other campaigns differ by, where that asks for more than the days do."""
    means, stretch = _campaign_means(others)
    dof = len(means) - len(np.unique(stretch))
    if dof < CAMPAIGNS_THAT_SAY:
        return result
    # Days that follow each other make campaigns differ, and that is known; how wide the days of a side are is not.
    day = max(result.u_before**2 * result.days_before, result.u_after**2 * result.days_after)
    result = replace(
        result, rivals=_of_sides(joined, result.other_days, day, result.u**2, result.dof), correlation=None
    )
    squares = sum(
        float(((means[stretch == i] - means[stretch == i].mean()) ** 2).sum()) for i in set(stretch)
    )
    u, k = float(np.sqrt(2.0 * squares / dof)), factor(dof)
    if k * u <= result.expanded and result.decided:
        return result
    of_side = u / np.sqrt(2.0)
    between = of_side if result.between is None else result.between
    # Of days that say nothing of each other the campaigns do.
    rivals = _of_sides(joined, result.other_days, day if result.decided else of_side**2, u**2, float(dof))
    return replace(
        result, u_before=of_side, u_after=of_side, u=u, dof=float(dof), k=k, between=between,
        other_campaigns=len(means), rivals=rivals,
    )  # fmt: skip


def _campaign_means(others: OtherDays) -> tuple[Array, npt.NDArray[np.intp]]:
    """Means of the means of days of each campaign, and its stretch; one that an event cuts in two is two."""
    values = np.asarray(others.values, dtype=np.float64)
    if not len(values):
        return np.empty(0), np.empty(0, dtype=np.intp)
    campaign, stretch, day = (
        label_groups(labels, len(values))[1] for labels in (others.campaigns, others.stretches, others.days)
    )
    parts, part = np.unique(np.column_stack([stretch, campaign]), axis=0, return_inverse=True)
    of_days, of_day = np.unique(np.column_stack([part.ravel(), day]), axis=0, return_inverse=True)
    by_day = np.bincount(of_day.ravel(), values) / np.bincount(of_day.ravel())
    means = np.bincount(of_days[:, 0], by_day) / np.bincount(of_days[:, 0])
    return np.asarray(means), parts[:, 0]


def _of_sides(
    of_sides: _Means, other_days: int, day: float, variance: float, dof: float
) -> tuple[Rival, ...]:
    """What the days of each side leave open of their scatter: ``day`` is the variance of a mean of a day by all days,
    ``variance`` that of the difference with ``dof``."""
    means = [of_sides.mean[of_sides.stretch == side] for side in (0, 1)]
    if min(len(days) for days in means) > 1 and not other_days:
        return tuple(rival for rival in (two_scatters(*means),) if rival is not None)
    return (Rival(float(np.sqrt(variance + wider_side(means, day))), dof),)


def _judged(of_sides: _Means, means: _Means, other_days: int, allowance: Allowance) -> BeforeAfter:
    """The difference of the two sides of ``of_sides`` by the scatter of the days of ``means``."""
    sides = [of_sides.stretch == side for side in (0, 1)]
    first, second = (float(of_sides.mean[side].mean()) for side in sides)
    days = np.array([float(side.sum()) for side in sides])
    # Mean of 1/n over the days of a side: what the scatter of its runs adds to the variance of a day.
    share = np.array([float((1.0 / of_sides.runs[side]).mean()) for side in sides])
    of_runs = means.within / means.dof_runs if means.dof_runs else 0.0
    if means.dof_days == 0:
        # Nothing is known of the days: what the runs say, as a lower bound.
        variances, dof, between = of_runs * share / days, float(means.dof_runs), None
    else:
        of_days, expected = _scatter_of_days(means)
        by_runs = of_runs * float(np.maximum(share - expected, 0.0) @ (1.0 / days)), means.dof_runs
        dof = satterthwaite((of_days * float((1.0 / days).sum()), means.dof_days), by_runs)
        variances = (of_days + of_runs * np.maximum(share - expected, 0.0)) / days
        between = float(np.sqrt(max(of_days - of_runs * expected, 0.0)))
    u = float(np.sqrt(variances.sum()))
    if u == 0.0:
        raise DataError("no day differs from the others of its side; the difference has no uncertainty.")
    rivals: tuple[Rival, ...] = ()
    correlation = None
    if between is not None:
        follow = following_days(means.mean, means.stretch, means.campaign, (0, 1), allowance.refuted)
        assert follow is not None
        correlation = follow.correlation
        following = Rival(
            float(np.hypot(follow.u, np.sqrt(by_runs[0]))), satterthwaite((follow.u**2, follow.dof), by_runs)
        )
        rivals = (
            following,
            *_of_sides(of_sides, other_days, of_days, u**2, dof),
            Rival(float(np.sqrt(u**2 + 2.0 * allowance.campaigns**2 * of_days)), dof),
        )
    return BeforeAfter(
        before=first,
        after=second,
        u_before=float(np.sqrt(variances[0])),
        u_after=float(np.sqrt(variances[1])),
        difference=second - first,
        u=u,
        dof=dof,
        k=factor(dof),
        between=between,
        other_days=other_days,
        rivals=rivals,
        correlation=correlation,
        days_before=int(days[0]),
        days_after=int(days[1]),
    )


def _scatter_of_days(means: _Means) -> tuple[float, float]:
    """Variance of the means of days about those of their stretches, pooled, and the share of the variance of a run that
    it is expected to hold."""
    squares = expected = 0.0
    for stretch in np.unique(means.stretch):
        inside = means.stretch == stretch
        count = int(inside.sum())
        squares += float(((means.mean[inside] - means.mean[inside].mean()) ** 2).sum())
        expected += (count - 1) * float((1.0 / means.runs[inside]).mean())
    return squares / means.dof_days, expected / means.dof_days
