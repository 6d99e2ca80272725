"""Results of one machine that should agree, or should not: two methods, and before against after an event.

A part of `monitor trend`. The latest campaign of each method is compared with that of every other; and the last
campaign before a recorded event with the first after it, of the same method. Where setups name their instruments, a
method with other instruments is another method: a laser in January and an R-test in June should agree.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from itertools import combinations

import numpy as np
import numpy.typing as npt

from monitor.documents import OMITTED, WORDED
from monitor.exceptions import DataError
from monitor.reporting.lacks import Undecided
from monitor.sources import CommonQuantity
from monitor.statistics.days.before_after import OtherDays, before_after
from monitor.statistics.days.beside_drift import Verdict, beside_drift
from monitor.statistics.days.stepped_line import campaigns_of
from monitor.statistics.normalised_error import K, normalised_error, result_of_runs
from monitor.store import Database, MachineEvent, MachineHistory, latest_documents
from monitor.workflow.history.calendar import SECONDS_PER_DAY
from monitor.workflow.history.in_common import RestsOn, calibrated_alike, rests_on
from monitor.workflow.history.other_instruments import calibrations_may_do
from monitor.workflow.history.series import UNSURE, day_numbers
from monitor.workflow.history.what_measured import what_measured

#: Level of false calls of one parameter at one event.
LEVEL = 0.05
#: A drift is stated over so many days.
DAYS_OF_DRIFT = 30.0
#: Whether both sides agree, and why that is not decided.
_AGREE: dict[Verdict, tuple[bool | None, Undecided | None]] = {
    Verdict.STEPPED: (False, None),
    Verdict.NOT_SEEN: (True, None),
    Verdict.DAYS: (None, Undecided.DAYS_MAY_DO),
    Verdict.DRIFT: (None, Undecided.DRIFT_MAY_DO),
    Verdict.UNKNOWN: (None, Undecided.ONE_DAY_EACH),
}


class PairKind(Enum):
    """Why two results are compared."""

    METHODS = "methods"
    EVENT = "event"


@dataclass(frozen=True)
class ParameterAgreement:
    """A parameter of two results, in ``unit``: their difference, its expanded uncertainty with the factor ``k``, and
    E_n.

    Before and after an event u is that of the means without what both share; ``between_days`` is the standard deviation
    of the days that it holds, estimated with ``other_days`` of the machine where the sides have few, or
    the scatter of so many ``other_campaigns`` where that is larger. ``agree`` and
    ``e_n`` are None where nothing is known of the days, and ``why_not_decided`` says what would decide it: ``expanded``
    is then of runs alone. ``expanded`` and ``e_n`` are for independent days of one scatter; ``agree`` is None, too,
    where the difference is larger than ``expanded`` and no larger than ``expanded_cautious``, for days that follow each
    other, sides that scatter differently, or campaigns that differ by more than their days. Where enough campaigns say
    what the machine does between events (``beside_drift``) they judge the difference less ``expected_of_drift``, and
    ``e_n`` and ``expanded`` are of that; ``drift_in_30_days`` is stated where a drift is seen.
    """

    unit: str
    first: float
    u_first: float
    second: float
    u_second: float
    difference: float
    expanded: float
    k: float
    e_n: float | None
    agree: bool | None
    degrees_of_freedom: float | None = field(default=None, metadata=OMITTED)
    between_days: float | None = field(default=None, metadata=OMITTED)
    other_days: int | None = field(default=None, metadata=OMITTED)
    other_campaigns: int | None = field(default=None, metadata=OMITTED)
    why_not_decided: Undecided | None = field(default=None, metadata={**WORDED, **OMITTED})
    expanded_cautious: float | None = field(default=None, metadata=OMITTED)
    expected_of_drift: float | None = field(default=None, metadata=OMITTED)
    drift_in_30_days: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True, kw_only=True)
class AgreementPair:
    """Two results with E_n of every parameter that both have; ``disagree`` names those beyond their uncertainties.

    Two ``methods``, of which the second was measured ``days_apart`` after the first (before it where negative); or one
    ``method`` before and after an ``event``. What both rest on, ``in_common``, is no part of their difference.
    """

    kind: PairKind
    methods: tuple[str, str] | None = field(default=None, metadata=OMITTED)
    event: str | None = field(default=None, metadata=OMITTED)
    description: str | None = field(default=None, metadata=OMITTED)
    method: str | None = field(default=None, metadata=OMITTED)
    campaigns: tuple[str, str]
    days_apart: float | None = field(default=None, metadata=OMITTED)
    parameters: Mapping[str, ParameterAgreement]
    disagree: tuple[str, ...]
    in_common: tuple[RestsOn, ...] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class _Comparison:
    """A pair without its numbers; ``before`` and ``after`` (n,) select the runs of its campaigns.

    ``stretch`` (n,) numbers the runs by the events before them.
    """

    pair: AgreementPair
    before: npt.NDArray[np.bool_] | None = None
    after: npt.NDArray[np.bool_] | None = None
    stretch: npt.NDArray[np.int64] | None = None


def agreement(
    db: Database, history: MachineHistory, events: Sequence[MachineEvent]
) -> tuple[AgreementPair, ...]:
    """Compare the results of a machine that should agree, or should not.

    The uncertainty of the result of a method is that of its identification or, where it is larger, the one that was
    evaluated for its campaign (the latest `monitor uncertainty`), and the scatter of its runs. Before and after an
    event
    one method measured with the same artefact and probe: what they share drops out, and the scatter of runs and days is
    left (``before_after``), with the machine's other days where both sides have few. What the machine drifts by between
    them is taken out (``beside_drift``), as the campaigns of all instruments show it that know the parameter as well.
    """
    comparisons = list(_comparisons(history, events))
    # Of years of campaigns few are compared: only their results are read.
    names = {name for comparison in comparisons for name in comparison.pair.campaigns}
    history = _with_stated(history, _stated_uncertainties(db, history, names))
    history = replace(history, common_parts=calibrated_alike(history.common_parts))
    pairs = [_compared(history, comparison) for comparison in comparisons]
    return tuple(pair for pair in pairs if pair.parameters)


def _comparisons(history: MachineHistory, events: Sequence[MachineEvent]) -> Iterator[_Comparison]:
    latest: dict[str, str] = {}
    seconds, last = history.seconds, {}
    runs = zip(history.campaign.tolist(), history.measured_by.tolist(), seconds.tolist(), strict=True)
    for campaign, method, second in runs:
        latest[method], last[method] = campaign, second  # runs are in the order of time
    for first, other in combinations(latest, 2):
        yield _Comparison(
            AgreementPair(
                kind=PairKind.METHODS, methods=(first, other), campaigns=(latest[first], latest[other]),
                days_apart=(last[other] - last[first]) / SECONDS_PER_DAY, parameters={}, disagree=(),
            )
        )  # fmt: skip
    moments = np.sort([event.at.timestamp() for event in events])
    for event in events:
        for method in latest:
            of_method = history.measured_by == method
            before = of_method & (seconds < event.at.timestamp())
            after = of_method & (seconds >= event.at.timestamp())
            if before.any() and after.any():
                stretch = np.searchsorted(moments, seconds, side="right")
                # A campaign that the event cuts in two is compared with itself: its runs before, its runs after; of
                # one that several events cut those next to this one.
                before &= stretch == stretch[before][-1]
                after &= stretch == stretch[after][0]
                campaigns = (str(history.campaign[before][-1]), str(history.campaign[after][0]))
                pair = AgreementPair(
                    kind=PairKind.EVENT, event=event.kind, description=event.description, method=method,
                    campaigns=campaigns, parameters={}, disagree=(),
                )  # fmt: skip
                yield _Comparison(pair, before, after, stretch)


def _stated_uncertainties(
    db: Database, history: MachineHistory, campaigns: Collection[str]
) -> Mapping[str, Mapping[str, float]]:
    """Standard uncertainties, in display units, of the latest `monitor uncertainty` of the campaigns that have one."""
    numbers = {number: name for number, name in history.campaigns.items() if name in campaigns}
    stored = latest_documents(db, "uncertainty", numbers)
    return {campaign: document["guf"]["u"] for campaign, document in stored.items()}


def _with_stated(history: MachineHistory, stated: Mapping[str, Mapping[str, float]]) -> MachineHistory:
    u = history.u.copy()
    for campaign, of_parameter in stated.items():
        rows = history.campaign == campaign
        for column, name in enumerate(history.parameters):
            u[rows, column] = np.fmax(u[rows, column], of_parameter.get(name, np.nan))
    return replace(history, u=u)


def _rows(history: MachineHistory, comparison: _Comparison, column: int) -> list[npt.NDArray[np.bool_]]:
    """The runs (n,) of each side that have a parameter."""
    sides = zip(comparison.pair.campaigns, (comparison.before, comparison.after), strict=True)
    finite = np.isfinite(history.values[:, column])
    return [
        finite & (history.campaign == campaign) & (True if side is None else side) for campaign, side in sides
    ]


def _across_event(
    history: MachineHistory, comparison: _Comparison, column: int, unit: str
) -> ParameterAgreement | None:
    """A parameter before and after an event; None where its runs do not suffice."""
    days, (before, after) = day_numbers(history), _rows(history, comparison, column)
    if not before.any() or not after.any():
        return None
    values, stretch = history.values[:, column], comparison.stretch
    assert stretch is not None
    by = what_measured(history, column, history.common_parts)[1]
    of_method = np.isfinite(values) & (history.measured_by == comparison.pair.method)
    rest = of_method & (by == by[before][-1]) & ~np.isin(days, days[before | after])
    others = OtherDays(values[rest], days[rest], stretch[rest], history.campaign[rest])
    try:
        result = before_after(values[before], values[after], days[before], days[after], others)
    except DataError:
        return None
    # What the machine drifts by runs through the campaigns of all instruments, each off by its own amount.
    sure = _as_sure(history, column, by, before | after)
    campaigns = campaigns_of(
        values[sure], days[sure], history.seconds[sure] / SECONDS_PER_DAY, stretch[sure], history.campaign[sure],
        group=by[sure],
    )  # fmt: skip
    # Campaigns may overlap: by name, not by the order of their means in time.
    last, first = (
        int(np.flatnonzero((campaigns.piece == stretch[side][0]) & (campaigns.label == name))[0])
        for side, name in zip((before, after), comparison.pair.campaigns, strict=True)
    )
    judged = beside_drift(result, campaigns, last, first, levels=False)
    agree, lack = _AGREE[judged.verdict(LEVEL)]
    line = judged.line
    is_renewed = by[before][-1] != by[after][0]
    if (
        agree is False
        and is_renewed
        and calibrations_may_do(result.difference, result.u, _apart(history, column, before, after))
    ):
        agree, lack = None, Undecided.INSTRUMENTS_MAY_DO
    if line is None:
        return ParameterAgreement(
            unit, result.before, result.u_before, result.after, result.u_after, result.difference, result.expanded,
            result.k, result.e_n, agree, result.dof, result.between, result.other_days, result.other_campaigns, lack,
            result.cautious,
        )  # fmt: skip
    expanded = line.k * line.u
    return ParameterAgreement(
        unit, result.before, result.u_before, result.after, result.u_after, result.difference, expanded, line.k,
        line.step / expanded, agree, float(line.dof), result.between, 0, line.campaigns - 2, lack,
        line.k * float(np.hypot(line.u, np.sqrt(judged.widest))), line.expected,
        line.rate * DAYS_OF_DRIFT if line.drifts else None,
    )  # fmt: skip


def _as_sure(
    history: MachineHistory, column: int, by: npt.NDArray[np.intp], pair: npt.NDArray[np.bool_]
) -> npt.NDArray[np.bool_]:
    """The runs (n,) of a parameter by the instruments that know it about as well as those of a ``pair`` (n,)."""
    u = history.u[:, column]
    limit = UNSURE * float(np.nanmedian(u[pair]))
    finite = np.isfinite(history.values[:, column])
    groups = [
        group for group in np.unique(by[finite]) if float(np.median(u[finite & (by == group)])) <= limit
    ]
    return np.asarray(finite & (np.isin(by, groups) | np.isin(by, by[pair])))


def _apart(
    history: MachineHistory, column: int, before: npt.NDArray[np.bool_], after: npt.NDArray[np.bool_]
) -> npt.NDArray[np.float64]:
    """What two sides are apart by for one standard uncertainty of each calibrated quantity (q,)."""
    parts = history.common_parts.values()
    return np.array([part[after, column].mean() - part[before, column].mean() for part in parts])


def _compared(history: MachineHistory, comparison: _Comparison) -> AgreementPair:
    first, second = comparison.pair.campaigns
    parameters: dict[str, ParameterAgreement] = {}
    in_common: dict[CommonQuantity, None] = {}
    for column, (name, unit) in enumerate(zip(history.parameters, history.units, strict=True)):
        if comparison.pair.kind is PairKind.EVENT:
            across = _across_event(history, comparison, column, unit)
            if across is not None:
                parameters[name] = across
            continue
        results = []
        for campaign in (first, second):
            rows = (history.campaign == campaign) & np.isfinite(history.values[:, column])
            rows &= np.isfinite(history.u[:, column])
            if rows.any():
                results.append(result_of_runs(history.values[rows, column], history.u[rows, column]))
        if len(results) < 2 or results[0][1] + results[1][1] == 0.0:
            continue
        (x1, u1), (x2, u2) = results
        shared = _shared(history, comparison, column)
        in_common |= dict.fromkeys(shared)
        try:
            error = normalised_error(x1, u1, x2, u2, sum(shared.values()))
        except DataError:
            continue
        parameters[name] = ParameterAgreement(
            unit, x1, u1, x2, u2, float(error.difference[0]), float(error.expanded[0]), K, float(error.e_n[0]),
            bool(error.agree[0]),
        )  # fmt: skip
    disagree = tuple(name for name, result in parameters.items() if result.agree is False)
    return replace(
        comparison.pair,
        parameters=parameters,
        disagree=disagree,
        in_common=tuple(map(rests_on, sorted(in_common))) or None,
    )


def _shared(history: MachineHistory, comparison: _Comparison, column: int) -> dict[CommonQuantity, float]:
    """The covariance of both results by each calibrated quantity that both rest on (JCGM 100:2008, F.1.2.3)."""
    first, second = _rows(history, comparison, column)
    shared = {}
    for quantity, part in history.common_parts.items():
        product = float(part[first, column].mean() * part[second, column].mean())
        if product != 0.0:
            shared[quantity] = product
    return shared
