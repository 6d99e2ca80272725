"""All machines at once: what needs attention, ranked. The rows stay in the database; only sums come out of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from enum import StrEnum

import numpy as np

from monitor.documents import OMITTED
from monitor.exceptions import InputError
from monitor.records import Array
from monitor.statistics import control_false_discoveries
from monitor.statistics.block_lines import DAYS_AS_BLOCKS, DAYS_OF_BLOCK, MOST_BLOCKS, Blocks
from monitor.statistics.means import VarianceMoments, brown_forsythe_from_moments
from monitor.statistics.sufficient import (
    CellDrift,
    CellTests,
    GroupSums,
    cells_from_sums,
    drift_from_sums,
    drift_in_blocks,
)
from monitor.store import (
    BlockCut,
    Database,
    FleetSums,
    fleet_sums,
    latest_maps,
    latest_tolerances,
    not_identified,
    tolerance_types,
)
from monitor.units import MICROMETRE
from monitor.workflow.history.calendar import DAYS_PER_YEAR
from monitor.workflow.history.drift import SHORTEST_DAYS
from monitor.workflow.history.weekly_looks import WeeklyNotices, weekly_notices
from monitor.workflow.models import resolve
from monitor.workflow.trend.volumetric import VOLUMETRIC

#: How histories are cut into blocks: as those of `monitor trend`.
CUT = BlockCut(DAYS_AS_BLOCKS, DAYS_OF_BLOCK, MOST_BLOCKS)
#: A drift that reaches the limit within so many years needs attention now.
SOON_YEARS = 1.0
#: False discovery rate over all machines and parameters.
RATE = 0.05
#: Days of one machine usually differ: they need attention where they scatter so much more than runs.
DAYS_OVER_RUNS = 3.0
#: Fewer days than this make a difference, not a drift.
FEWEST_DAYS = 5
#: The latest day stands out where it lies so many standard deviations of the days from their mean, with so many days.
STANDS_OUT, FEWEST_TO_STAND_OUT = 3.0, 6.0


@dataclass(frozen=True)
class FleetRequest:
    """Every machine and parameter under a model (by default that which each machine is followed by).

    ``top`` rows are listed (0: all). ``weekly_looks`` adds what looks at all of them every week noticed, each
    machine by the model that it is followed by.
    """

    model: str | None = None
    top: int = 20
    weekly_looks: bool = False

    def __post_init__(self) -> None:
        if self.top < 0:
            raise InputError(f"--top {self.top}: a number of rows, 0 for all")


class Attention(StrEnum):
    """Why a parameter needs attention, the most urgent first; the last is of a limit of the volumetric error."""

    OUT = "out of tolerance"
    DRIFTS_OUT = "drifts out of tolerance within a year"
    STANDS_OUT = "the latest day stands out"
    DRIFTS = "drifts"
    DAYS_DIFFER = "days differ much more than runs"
    AS_USUAL = "as usual"
    ONE_DAY = "one day only, nothing to compare it with"
    UNJUDGED = "limit not judged: no map is stored (monitor map CAMPAIGN)"


#: The classes by their number.
ATTENTION = tuple(Attention)


@dataclass(frozen=True)
class FleetTableRow:
    """A parameter of a machine: why it needs attention, the tests of its days, its drift, its latest day."""

    rank: int
    machine: str
    parameter: str
    attention: Attention
    unit: str
    n: int
    days: int
    mean: float | None
    sd_all: float | None
    sd_pooled: float | None
    between_days: float | None
    bartlett: float | None
    bartlett_p: float | None
    bartlett_q: float | None
    anova_f: float | None
    anova_p: float | None
    anova_q: float | None
    slope_per_year: float | None
    u_slope: float | None
    slope_widening: float | None
    drift_p: float | None
    drift_q: float | None
    latest: float | None
    latest_at: str | None
    since: str | None
    limit: float | None
    years_to_limit: float | None


@dataclass(frozen=True)
class FleetAnswer:
    """The most urgent rows of ``rows``, and how many of all need attention, by kind.

    ``not_identified`` are campaigns without numbers under the model that their machine is followed by: they have no
    part in it. ``tolerances_of_type`` names the machine type by machine, where its campaign states no tolerances.
    """

    machines: int
    rows: int
    values: int
    false_discovery_rate: float
    attention: Mapping[str, int]
    not_identified: tuple[str, ...]
    table: tuple[FleetTableRow, ...]
    weekly_looks: WeeklyNotices | None = field(default=None, metadata=OMITTED)
    tolerances_of_type: Mapping[str, str] | None = field(default=None, metadata=OMITTED)


def cell_tests(sums: FleetSums) -> tuple[CellTests, CellDrift]:
    """Bartlett, ANOVA and drift (a day) of every machine and parameter from its sums."""
    cells = cells_from_sums(
        GroupSums(
            sums.groups, sums.runs, sums.offset, sums.squares, sums.within, sums.repeated, sums.least_variance,
            sums.log_variances, sums.inverse_dof,
        )
    )  # fmt: skip
    drift = drift_from_sums(sums.groups, sums.sum_t, sums.sum_tt, sums.sum_m, sums.sum_mm, sums.sum_tm)
    blocks = Blocks(sums.blocks.groups, sums.blocks.t, sums.blocks.m, sums.groups)
    return cells, drift_in_blocks(drift, blocks, cycle=DAYS_PER_YEAR)


def means_p(sums: FleetSums) -> Array:
    """Return p-values (c,) of equal means of the days, whatever their scatter: Brown and Forsythe's test."""
    repeated = sums.repeated_sums
    with np.errstate(divide="ignore", invalid="ignore"):
        between = np.maximum(repeated.squares - repeated.offset**2 / repeated.runs, 0.0)
    moments = VarianceMoments(
        groups=sums.repeated, runs=repeated.runs, between=between, first=repeated.s2,
        first_runs=repeated.s2_runs, second=repeated.s4, second_runs=repeated.s4_runs, by_dof=repeated.s4_dof,
    )  # fmt: skip
    return brown_forsythe_from_moments(moments)[3]


def _limits(db: Database, sums: FleetSums) -> Array:
    """Limit of the absolute value of each cell by the machine's latest campaign; NaN where none is stated."""
    stated = latest_tolerances(db)
    keys = zip(sums.machine.tolist(), sums.parameter.tolist(), strict=True)
    return np.array([stated.get(key, np.nan) for key in keys])


def _level(sums: FleetSums, drift: CellDrift) -> Array:
    """Where the line of each cell is on the last day, from which trend page and report forecast, too.

    The mean of that day alone scatters as runs and days do, and so would the day on which the limit is reached.
    """
    ahead = sums.last_d - sums.epoch_d - sums.sum_t / sums.groups
    return np.asarray(sums.origin + sums.sum_m / sums.groups + drift.slope * ahead)


def _rank(
    sums: FleetSums, cells: CellTests, drift: CellDrift, drift_q: Array, limit: Array
) -> tuple[Array, Array, Array]:
    """Class of each cell (0 is the most urgent), its measure within the class (larger first), years to the limit."""
    latest = sums.origin + sums.latest
    share = np.abs(latest) / limit
    per_year = drift.slope * DAYS_PER_YEAR
    with np.errstate(divide="ignore", invalid="ignore"):
        years = (np.where(per_year >= 0.0, limit, -limit) - _level(sums, drift)) / per_year
        # Against the other days: the latest one is taken out of their mean.
        k = sums.groups
        others = (sums.sum_m - sums.latest) / (k - 1.0)
        squares = sums.sum_mm - sums.latest**2 - (k - 1.0) * others**2
        variance = np.maximum(squares, 0.0) / (k - 2.0) * (1.0 + 1.0 / (k - 1.0))
        # A day of few runs after days of many: what the mean of its runs scatters more than theirs do.
        fewer = 1.0 / sums.latest_runs - (k - 1.0) / (sums.runs - sums.latest_runs)
        sd = np.sqrt(variance + np.nan_to_num(cells.sd_pooled) ** 2 * np.maximum(fewer, 0.0))
        z = np.abs(sums.latest - others) / np.where(k >= FEWEST_TO_STAND_OUT, sd, np.nan)
        ratio = cells.between / cells.sd_pooled
        steepness = np.abs(drift.slope / drift.u)
    drifting = (drift_q < RATE) & (sums.groups >= FEWEST_DAYS)
    kind = np.where(sums.groups < 2.0, 6, 5)
    measure = np.nan_to_num(ratio, nan=0.0, posinf=0.0)
    for number, holds, size in (
        (4, ratio > DAYS_OVER_RUNS, ratio),
        (3, drifting, steepness),
        (2, z > STANDS_OUT, z),
        (1, drifting & (years >= 0.0) & (years < SOON_YEARS), -years),
        (0, share >= 1.0, share),
    ):
        mask = np.asarray(holds, dtype=np.bool_)
        kind[mask], measure[mask] = number, np.nan_to_num(size)[mask]
    return kind, measure, years


def _date(days: float) -> str | None:
    return (
        None
        if not np.isfinite(days)
        else (datetime(1970, 1, 1, tzinfo=UTC) + timedelta(days=days)).isoformat()
    )


def _without_short_histories(sums: FleetSums, drift: CellDrift) -> CellDrift:
    """No slope a year from less than ``SHORTEST_DAYS``: evenly spread days have a standard deviation of their span
    over the root of 12."""
    mean = sums.sum_t / sums.groups
    spread = np.sqrt(np.maximum(sums.sum_tt / sums.groups - mean**2, 0.0))
    short = spread < SHORTEST_DAYS / np.sqrt(12.0)
    columns = (drift.slope, drift.u, drift.p_value, drift.widening)
    return CellDrift(*(np.where(short, np.nan, values) for values in columns))


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def fleet(db: Database, request: FleetRequest) -> FleetAnswer:
    """Every machine and parameter of one model, the most urgent first.

    Raises NotFoundError where nothing was identified.
    """
    name, version = None, None
    if request.model is not None:
        stored = resolve(db, request.model)
        name, version = stored.name, stored.version
    sums = fleet_sums(db, name, version, cut=CUT)
    cells, drift = cell_tests(sums)
    drift = _without_short_histories(sums, drift)
    limit = _limits(db, sums)
    q_values = {
        test: control_false_discoveries(p_values, rate=RATE).q_value
        for test, p_values in (
            ("anova", means_p(sums)), ("bartlett", cells.bartlett_p), ("drift", drift.p_value)
        )
    }  # fmt: skip
    kind, measure, years = _rank(sums, cells, drift, q_values["drift"], limit)
    order = np.lexsort((sums.parameter, sums.machine, -measure, kind))
    parameters = [
        FleetTableRow(
            rank=0,
            machine=str(sums.machine[i]),
            parameter=str(sums.parameter[i]),
            attention=ATTENTION[int(kind[i])],
            unit=str(sums.unit[i]),
            n=int(sums.runs[i]),
            days=int(sums.groups[i]),
            mean=float(sums.origin[i] + cells.mean[i]),
            sd_all=_number(cells.sd_all[i]),
            sd_pooled=_number(cells.sd_pooled[i]),
            between_days=_number(cells.between[i]),
            bartlett=_number(cells.bartlett[i]),
            bartlett_p=_number(cells.bartlett_p[i]),
            bartlett_q=_number(q_values["bartlett"][i]),
            anova_f=_number(cells.anova_f[i]),
            anova_p=_number(cells.anova_p[i]),
            anova_q=_number(q_values["anova"][i]),
            slope_per_year=_number(drift.slope[i] * DAYS_PER_YEAR),
            u_slope=_number(drift.u[i] * DAYS_PER_YEAR),
            slope_widening=_number(drift.widening[i]),
            drift_p=_number(drift.p_value[i]),
            drift_q=_number(q_values["drift"][i]),
            latest=_number(sums.origin[i] + sums.latest[i]),
            latest_at=_date(float(sums.last_d[i])),
            since=_date(float(sums.since_d[i])),
            limit=_number(limit[i]),
            years_to_limit=_number(years[i]) if kind[i] == 1 else None,
        )
        for i in order[: request.top or None]
    ]
    volumetric = _volumetric_rows(db, set(sums.machine.tolist()))
    measures = {id(row): float(measure[i]) for row, i in zip(parameters, order, strict=False)}
    measures |= {id(row): _share(row) for row in volumetric}
    ranked = sorted(
        [*parameters, *volumetric],
        key=lambda row: (ATTENTION.index(row.attention), -measures[id(row)], row.machine, row.parameter),
    )
    return FleetAnswer(
        machines=len(np.unique(sums.machine)),
        rows=len(sums.machine) + len(volumetric),
        values=int(sums.runs.sum()),
        false_discovery_rate=RATE,
        attention={
            label: int((kind == number).sum()) + sum(row.attention is label for row in volumetric)
            for number, label in enumerate(ATTENTION)
        },
        not_identified=not_identified(db) if request.model is None else (),
        table=tuple(
            replace(row, rank=rank) for rank, row in enumerate(ranked[: request.top or None], start=1)
        ),
        weekly_looks=weekly_notices(db) if request.weekly_looks else None,
        tolerances_of_type=tolerance_types(db) or None,
    )


def _share(row: FleetTableRow) -> float:
    """The part of its limit that a volumetric error takes, 0 where there is none."""
    return 0.0 if row.latest is None or row.limit is None else row.latest / row.limit


def _volumetric_rows(db: Database, machines: set[str]) -> list[FleetTableRow]:
    """A row for every machine with a limit of the volumetric error: the worst error of its last map against it.

    The map is that of the latest run of which one was stored, by ``map`` or by a weekly report; without one the limit
    is not judged.
    """
    limits = {
        machine: limit
        for (machine, name), limit in latest_tolerances(db).items()
        if name == VOLUMETRIC and machine in machines
    }
    worst = latest_maps(db) if limits else {}
    rows = []
    for machine, limit in limits.items():
        latest = worst.get(machine)
        attention = Attention.OUT if latest is not None and latest >= limit else Attention.AS_USUAL
        if latest is None:
            attention = Attention.UNJUDGED
        rows.append(
            FleetTableRow(
                rank=0, machine=machine, parameter="volumetric error", attention=attention, unit=MICROMETRE.name,
                n=0 if latest is None else 1, days=0 if latest is None else 1, mean=latest, sd_all=None, sd_pooled=None,
                between_days=None, bartlett=None, bartlett_p=None, bartlett_q=None, anova_f=None, anova_p=None,
                anova_q=None, slope_per_year=None, u_slope=None, drift_p=None, drift_q=None, latest=latest,
                slope_widening=None, latest_at=None, since=None, limit=limit, years_to_limit=None,
            )
        )  # fmt: skip
    return rows
