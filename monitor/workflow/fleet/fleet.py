"""All machines at once: what needs attention, ranked. The rows stay in the database; only sums come out of it."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.statistics import control_false_discoveries
from monitor.statistics.days.seasonal_slopes import REFUTED
from monitor.statistics.sufficient import CellDrift, CellTests
from monitor.store import (
    Database,
    FleetSums,
    GroupHours,
    campaign_machines,
    earlier_frames,
    fleet_sums,
    latest_frames,
    latest_tolerances,
    machines_with_runs,
    older_numbers,
    refuted_machines,
    simulated_campaigns,
    tolerance_types,
    unexplained_machines,
    without_part,
)
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.fleet.answer import FleetAnswer, FleetTableRow, OlderVersion
from monitor.workflow.fleet.attention import ATTENTION, Attention, Onset
from monitor.workflow.fleet.ranking import (
    CUT,
    RATE,
    Ranking,
    cell_tests,
    means_p,
    ranked,
    warmth_beside,
)
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.fleet.steps import split_times
from monitor.workflow.fleet.volumetric import share_of_limit, volumetric_rows
from monitor.workflow.history.forecast import NEXT_CHECK_D
from monitor.workflow.history.limits_of_type import limits_without_parameter_by_machine
from monitor.workflow.history.refuted import REFUTED_P, RefutedCampaign, statements_contradicted
from monitor.workflow.history.runs import overlapping
from monitor.workflow.models import label_of, resolve


@dataclass(frozen=True, eq=False)
class _Cells:
    """Every machine and parameter: its sums, tests and q-values, the limit, and how urgent it is."""

    sums: FleetSums
    cells: CellTests
    drift: CellDrift
    q_values: Mapping[str, Array]
    limit: Array
    ranking: Ranking

    @cached_property
    def warmth(self) -> npt.NDArray[np.bool_]:
        """Whether the temperature is fitted beside each slope that is stated (c,)."""
        return warmth_beside(self.sums) & np.isfinite(self.drift.slope)

    @property
    def order(self) -> npt.NDArray[np.int64]:
        """The most urgent first."""
        ranking = self.ranking
        return np.lexsort((self.sums.parameter, self.sums.machine, -ranking.measure, ranking.urgency))

    @cached_property
    def differs_d(self) -> Array:
        """Since when the days of each cell differ most from those before (c,), in days since 1970."""
        return split_times(self.sums)

    def onset(self, index: int) -> tuple[float, Onset]:
        """Since when a row holds (days since 1970), and what began then."""
        sums, attention = self.sums, ATTENTION[int(self.ranking.kind[index])]
        if attention is Attention.OUT and np.isfinite(sums.beyond_d[index]):
            return float(sums.beyond_d[index]), Onset.BEYOND
        if attention in (Attention.OUT, Attention.MAY_BE_OUT, Attention.STANDS_OUT):
            return float(sums.last_d[index]), Onset.LATEST
        if attention is Attention.DAYS_DIFFER:
            return float(self.differs_d[index]), Onset.DIFFERS
        if np.isfinite(sums.since_d[index]):
            return float(sums.since_d[index]), Onset.EVENT
        return float(sums.first_d[index]), Onset.FIRST

    def row(self, index: int) -> FleetTableRow:
        """One of them as a row without a rank."""
        onset, onset_is = self.onset(index)
        return FleetTableRow(
            rank=0,
            machine=str(self.sums.machine[index]),
            parameter=str(self.sums.parameter[index]),
            attention=ATTENTION[int(self.ranking.kind[index])],
            unit=str(self.sums.unit[index]),
            n=int(self.sums.runs[index]),
            days=int(self.sums.groups[index]),
            mean=float(self.sums.origin[index] + self.cells.mean[index]),
            sd_all=_number(self.cells.sd_all[index]),
            sd_pooled=_number(self.cells.sd_pooled[index]),
            between_days=_number(self.cells.between[index]),
            bartlett=_number(self.cells.bartlett[index]),
            bartlett_p=_number(self.cells.bartlett_p[index]),
            bartlett_q=_number(self.q_values["bartlett"][index]),
            anova_f=_number(self.cells.anova_f[index]),
            anova_p=_number(self.cells.anova_p[index]),
            anova_q=_number(self.q_values["anova"][index]),
            slope_per_year=_number(self.drift.slope[index] * DAYS_PER_YEAR),
            u_slope=_number(self.drift.u[index] * DAYS_PER_YEAR),
            slope_widening=_number(self.drift.widening[index]),
            drift_p=_number(self.drift.p_value[index]),
            drift_q=_number(self.q_values["drift"][index]),
            latest=_number(self.sums.origin[index] + self.sums.latest[index]),
            latest_at=_date(float(self.sums.last_d[index])),
            since=_date(float(self.sums.since_d[index])),
            limit=_number(self.limit[index]),
            years_to_limit=_number(self.ranking.years[index]),
            probability_out=_number(self.ranking.near.out[index]),
            in_tolerance_at_next_check=_number(self.ranking.near.inside[index]),
            next_check=_date(self.sums.check_d[index]) if np.isfinite(self.limit[index]) else None,
            temperature=str(self.sums.temperatures.thermometer[index]) if self.warmth[index] else None,
            season_not_told=True if self.drift.season_p[index] >= REFUTED else None,
            onset=_date(onset),
            onset_is=onset_is,
        )


def fleet(db: Database, request: FleetRequest) -> FleetAnswer:
    """Every machine and parameter of one model, the most urgent first.

    Raises NotFoundError where nothing was identified.
    """
    cells = _cells_of(db, request.model)
    sums, most = cells.sums, request.top or None
    numbered = set(sums.machine.tolist())
    volumetric = volumetric_rows(db, numbered)
    ranking = cells.ranking
    measured = [
        (float(ranking.urgency[index]), -float(ranking.measure[index]), cells.row(index))
        for index in cells.order[:most]
    ]
    measured += [(float(ATTENTION.index(row.attention)), -share_of_limit(row), row) for row in volumetric]
    measured.sort(key=lambda ranked_row: (*ranked_row[:2], ranked_row[2].machine, ranked_row[2].parameter))
    noticed = None
    if request.weekly_looks:
        # Loaded where it is asked for: the histories of all machines, which the table needs none of.
        from monitor.workflow.history.weekly_looks import weekly_notices

        noticed = weekly_notices(db)
    return FleetAnswer(
        machines=len(numbered),
        rows=len(sums.machine) + len(volumetric),
        values=int(sums.runs.sum()),
        false_discovery_rate=RATE,
        attention={
            label: int((ranking.kind == number).sum()) + sum(row.attention is label for row in volumetric)
            for number, label in enumerate(ATTENTION)
        },
        table=_shown(db, [row for _, _, row in measured[:most]]),
        weekly_looks=noticed,
        tolerances_of_type=tolerance_types(db) or None,
        limits_without_parameter=_limits_without_parameter(db, sums) or None,
        models_refuted=_refuted(db, request.model) or None,
        statements_contradicted=statements_contradicted(db, request.model) or None,
        simulated=simulated_campaigns(db) or None,
        same_hours=_same_hours(sums.same_hours) or None,
        **_by_their_own_models(db, request.model, numbered),
    )


def _by_their_own_models(db: Database, model: str | None, numbered: Container[str]) -> dict[str, Any]:
    """Return what is said of machines where each is judged by the model of its own numbers: the fields of the answer.

    Under a ``model`` by its name those of other methods are lacking, which have numbers of their own: nothing is said.
    """
    if model is not None:
        return {"not_identified": ()}
    without = without_part(db)
    machine_of = campaign_machines(db) if without else {}
    left_out: dict[str, tuple[str, ...]] = {}
    for campaign in without:
        if (machine := machine_of[campaign]) in numbered:
            left_out[machine] = (*left_out.get(machine, ()), campaign)
    return {
        "not_identified": without,
        "left_out": left_out or None,
        "models_lacking": unexplained_machines(db) or None,
        "without_numbers": _without_numbers(db, numbered) or None,
        "older_versions": _older_versions(db) or None,
    }


def _limits_without_parameter(db: Database, sums: FleetSums) -> dict[str, tuple[str, ...]]:
    """Return by machine what is said of limits of its type that are of none of its parameters."""
    if not db.type_tolerances:
        return {}
    parameters: dict[str, list[str]] = {}
    for machine, parameter in zip(sums.machine.tolist(), sums.parameter.tolist(), strict=True):
        parameters.setdefault(machine, []).append(parameter)
    return limits_without_parameter_by_machine(db, parameters)


def _older_versions(db: Database) -> dict[str, tuple[OlderVersion, ...]]:
    """Return by machine the older versions that its numbers come from, one a method."""
    versions: dict[str, tuple[OlderVersion, ...]] = {}
    for row in older_numbers(db):
        older = OlderVersion(f"{row.model}@{row.version}", f"{row.model}@{row.newest}")
        versions[row.machine] = (*versions.get(row.machine, ()), older)
    return versions


def _same_hours(groups: Iterable[GroupHours]) -> dict[str, tuple[tuple[str, ...], ...]]:
    """Return by machine the groups of campaigns that it cannot all have made."""
    days: dict[str, list[tuple[float, float, str]]] = {}
    for group in groups:
        days.setdefault(group.machine, []).append((group.began_d, group.ended_d, group.campaign))
    campaigns = {machine: tuple(overlapping(days[machine])) for machine in sorted(days)}
    return {machine: of_machine for machine, of_machine in campaigns.items() if of_machine}


def _without_numbers(db: Database, numbered: Container[str]) -> tuple[str, ...]:
    """Return the machines of which a run was imported, and that are not among the ``numbered`` ones."""
    return tuple(name for name in machines_with_runs(db) if name not in numbered)


def _refuted(db: Database, model: str | None) -> dict[str, RefutedCampaign]:
    """Return by machine the latest campaign, where its readings refute its model."""
    stored = None if model is None else resolve(db, model)
    name, version = (None, None) if stored is None else (stored.name, stored.version)
    return {
        row.machine: RefutedCampaign(row.campaign, label_of(row.model, row.version), row.p_value)
        for row in refuted_machines(db, REFUTED_P, name, version)
    }


def _shown(db: Database, rows: list[FleetTableRow]) -> tuple[FleetTableRow, ...]:
    """Return the rows with their ranks and what their parameters refer to."""
    frames = latest_frames(db, sorted({row.machine for row in rows}))
    lacking = sorted({row.machine for row in rows if (row.machine, row.parameter) not in frames})
    if lacking:
        frames = earlier_frames(db, lacking) | frames
    return tuple(
        replace(row, rank=rank, refers_to=frames.get((row.machine, row.parameter)))
        for rank, row in enumerate(rows, start=1)
    )


def _cells_of(db: Database, model: str | None) -> _Cells:
    """Every machine and parameter under a model, tested and ranked."""
    stored = None if model is None else resolve(db, model)
    name, version = (None, None) if stored is None else (stored.name, stored.version)
    limits = latest_tolerances(db)
    sums = fleet_sums(db, name, version, cut=CUT, limits=limits, apart_d=NEXT_CHECK_D)
    cells, drift = cell_tests(sums)
    keys = zip(sums.machine.tolist(), sums.parameter.tolist(), strict=True)
    limit = np.array([limits.get(key, np.nan) for key in keys])
    tests = {"anova": means_p(sums), "bartlett": cells.bartlett_p, "drift": drift.p_value}
    q_values = {
        test: control_false_discoveries(p_values, rate=RATE).q_value for test, p_values in tests.items()
    }
    return _Cells(sums, cells, drift, q_values, limit, ranked(sums, cells, drift, q_values["drift"], limit))


def _date(days: float) -> str | None:
    return (
        None
        if not np.isfinite(days)
        else (datetime(1970, 1, 1, tzinfo=UTC) + timedelta(days=days)).isoformat()
    )


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
