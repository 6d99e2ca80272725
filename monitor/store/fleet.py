"""Sums over the whole fleet: for every machine and parameter what Bartlett, ANOVA and a drift need.

The rows never leave the database. They are first summed by campaign and day, about an origin of their own
machine and parameter (the first value there): a sum of squares about zero would lose the digits that all values
share. The sums of the days are then summed by machine. Rows are taken in portions, so that memory does not grow
with the history. Use ``fleet_sums`` for many machines; for one machine ``list_parameters`` reads its rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from monitor.exceptions import NotFoundError
from monitor.records import Array
from monitor.store.connection import Database

#: Values summed at a time: 16 million keep the sums by day (a quarter as many, each some 80 bytes) below 1 GB.
PORTION = 16_000_000

_CHOSEN = """
CREATE OR REPLACE TEMP TABLE fleet_chosen AS
WITH latest AS (
    -- Of each campaign the identification with the most runs, the later of two: what load_identification takes.
    SELECT campaign_id, max((CAST(run_count AS BIGINT) << 32) | identification_id) & 4294967295 AS identification_id
    FROM identification
    WHERE ($model IS NULL AND model = method OR model = $model) AND ($version IS NULL OR model_version = $version)
    GROUP BY campaign_id
), span AS (
    SELECT campaign_id, min(day) AS first_day, max(day) AS last_day, min(started_at) AS began
    FROM run GROUP BY campaign_id
), numbered AS (
    SELECT machine, CAST(row_number() OVER (ORDER BY machine) - 1 AS INTEGER) AS machine_no FROM machine
)
SELECT CAST(l.identification_id AS INTEGER) AS identification_id, l.campaign_id, n.machine_no,
       s.first_day <> s.last_day AS several_days, epoch(s.began) / 86400.0 AS began_d,
       i.run_count * len(i.parameters) AS size
FROM latest AS l
JOIN identification AS i USING (identification_id)
JOIN campaign AS c ON c.campaign_id = l.campaign_id
JOIN span AS s ON s.campaign_id = l.campaign_id
JOIN numbered AS n USING (machine)
"""

# A group is a campaign, or a day of a campaign that has several; `moment_d` is when it began (days since 1970).
_DAYS = """
CREATE OR REPLACE TEMP TABLE fleet_day AS
SELECT c.identification_id, r.run, CAST(dense_rank() OVER (ORDER BY c.identification_id, r.day) AS INTEGER) AS group_no,
       c.machine_no, epoch(min(r.started_at) OVER (PARTITION BY c.identification_id, r.day)) / 86400.0 AS moment_d
FROM fleet_chosen AS c JOIN run AS r USING (campaign_id)
WHERE c.several_days
"""

_ORIGINS = """
CREATE OR REPLACE TEMP TABLE fleet_origin AS
SELECT c.machine_no, v.parameter, first(v.value) AS origin
FROM parameter_value AS v
JOIN (SELECT machine_no, min(identification_id) AS identification_id FROM fleet_chosen GROUP BY machine_no) AS c
    USING (identification_id)
WHERE v.value IS NOT NULL
GROUP BY ALL
"""

# The last day of each machine: of its latest campaign, and of that the latest day.
_LATEST = """
CREATE OR REPLACE TEMP TABLE fleet_latest AS
WITH last AS (
    SELECT c.machine_no, c.identification_id, r.run, r.started_at, r.day
    FROM fleet_chosen AS c JOIN run AS r USING (campaign_id)
    WHERE c.began_d = (SELECT max(o.began_d) FROM fleet_chosen AS o WHERE o.machine_no = c.machine_no)
    QUALIFY r.day = arg_max(r.day, r.started_at) OVER (PARTITION BY c.machine_no)
)
SELECT l.machine_no, v.parameter, avg(v.value - coalesce(o.origin, 0.0)) AS latest, count(*) AS latest_n,
       epoch(min(l.started_at)) / 86400.0 AS last_d, first(v.unit) AS unit, first(v.display_factor) AS factor
FROM parameter_value AS v
JOIN last AS l USING (identification_id, run)
LEFT JOIN fleet_origin AS o USING (machine_no, parameter)
WHERE v.value IS NOT NULL
GROUP BY l.machine_no, v.parameter
"""

_PARTS = """
CREATE OR REPLACE TEMP TABLE fleet_part (
    machine_no INTEGER, parameter VARCHAR, k BIGINT, n DOUBLE, s DOUBLE, q DOUBLE, ss DOUBLE, repeated BIGINT,
    least DOUBLE, logs DOUBLE, inverse DOUBLE, t DOUBLE, tt DOUBLE, m DOUBLE, mm DOUBLE, tm DOUBLE
)
"""

# {place}: the table that gives the group of a row; {keys}: what a row shares with it.
_SUMS = """
INSERT INTO fleet_part
SELECT machine_no, parameter, count(*), sum(n), sum(n * m), sum(n * m * m), sum(n * v),
       count(s2), min(s2), sum(w * ln(CASE WHEN s2 > 0.0 THEN s2 END)), sum(1.0 / nullif(w, 0.0)),
       sum(t), sum(t * t), sum(m), sum(m * m), sum(m * t)
FROM (
    SELECT machine_no, parameter, n, m, v, n - 1.0 AS w, n * v / nullif(n - 1.0, 0.0) AS s2, moment_d - $epoch AS t
    FROM (
        SELECT group_no, parameter, CAST(count(d) AS DOUBLE) AS n, avg(d) AS m, var_pop(d) AS v
        FROM (
            SELECT p.group_no, x.parameter, x.value - coalesce(o.origin, 0.0) AS d
            FROM parameter_value AS x
            JOIN {place} AS p USING ({keys})
            LEFT JOIN fleet_origin AS o USING (machine_no, parameter)
            WHERE x.identification_id >= $first AND x.identification_id < $end AND x.value IS NOT NULL
        )
        GROUP BY group_no, parameter
    ) JOIN (
        SELECT DISTINCT group_no, machine_no, moment_d FROM {place}
        WHERE identification_id >= $first AND identification_id < $end
    ) USING (group_no)
)
GROUP BY machine_no, parameter
"""

_TOGETHER = """
WITH numbered AS (
    SELECT machine, CAST(row_number() OVER (ORDER BY machine) - 1 AS INTEGER) AS machine_no FROM machine
), shown AS (
    SELECT parameter, first(unit) AS unit, first(factor) AS factor FROM fleet_latest GROUP BY parameter
)
SELECT b.machine, p.parameter, coalesce(s.unit, '1') AS unit, coalesce(s.factor, 1.0) AS factor,
       coalesce(first(o.origin), 0.0) AS origin, sum(k) AS k, sum(n) AS n, sum(p.s) AS s, sum(q) AS q, sum(ss) AS ss,
       sum(repeated) AS repeated, coalesce(min(least), 0.0) AS least, coalesce(sum(logs), 0.0) AS logs,
       coalesce(sum(inverse), 0.0) AS inverse, sum(t) AS t, sum(tt) AS tt, sum(m) AS m, sum(mm) AS mm, sum(tm) AS tm,
       coalesce(first(l.last_d), 'nan') AS last_d, coalesce(first(l.latest), 'nan') AS latest,
       coalesce(first(l.latest_n), 0) AS latest_n
FROM fleet_part AS p
JOIN numbered AS b USING (machine_no)
LEFT JOIN fleet_origin AS o USING (machine_no, parameter)
LEFT JOIN fleet_latest AS l USING (machine_no, parameter)
LEFT JOIN shown AS s USING (parameter)
GROUP BY b.machine, p.parameter, s.unit, s.factor ORDER BY b.machine, p.parameter
"""


@dataclass(frozen=True)
class FleetSums:
    """Sufficient statistics of c cells, one a machine and parameter; every array is (c,), in display units.

    Groups are campaigns, or the days of a campaign with several. ``origin`` is what the sums are about:
    ``offset`` of all values, ``squares`` the sum over the groups of n_j times the squared offset of their mean,
    ``within`` the sum of squares within the groups. ``repeated`` groups have two runs or more, the smallest
    of their variances is ``least_variance``; ``log_variances`` sums (n_j - 1) ln s_j² and ``inverse_dof``
    1 / (n_j - 1) over them. ``sum_t`` to ``sum_tm`` are sums over the groups of t, t², m, m² and t m, with t in days
    since ``epoch_d`` and m the mean of the group less the origin. ``last_d`` is when the machine's last day began
    (days since 1970), ``latest`` the mean of that day less the origin, ``latest_runs`` its runs; NaN, NaN and 0 where
    the parameter was refused there.
    """

    machine: npt.NDArray[np.str_]
    parameter: npt.NDArray[np.str_]
    unit: npt.NDArray[np.str_]
    origin: Array
    groups: Array
    runs: Array
    offset: Array
    squares: Array
    within: Array
    repeated: Array
    least_variance: Array
    log_variances: Array
    inverse_dof: Array
    epoch_d: float
    sum_t: Array
    sum_tt: Array
    sum_m: Array
    sum_mm: Array
    sum_tm: Array
    last_d: Array
    latest: Array
    latest_runs: Array


def fleet_sums(
    db: Database, model: str | None = None, version: int | None = None, *, portion: int = PORTION
) -> FleetSums:
    """Sums of all machines and parameters, of the latest identification of every campaign under one model.

    Without ``model`` the method's own. ``portion`` values are summed at a time. A parameter that a machine's first
    campaign refused has zero for its origin and loses 2 lg(mean / scatter) of 16 digits. Sums of several threads
    differ in the last bits from one time to the next. Raises NotFoundError where nothing was identified.
    """
    db.execute(_CHOSEN, {"model": model, "version": version})
    chosen = db.arrays("SELECT identification_id, size FROM fleet_chosen ORDER BY identification_id")
    if not len(chosen["identification_id"]):
        of = "" if model is None else f" with model {model}"
        raise NotFoundError(f"no campaign was identified{of} yet; type `monitor identify`")
    for statement in (_DAYS, _ORIGINS, _LATEST, _PARTS):
        db.execute(statement)
    ((epoch_d, several, single),) = db.rows(
        "SELECT min(began_d), count(*) FILTER (several_days), count(*) FILTER (NOT several_days) FROM fleet_chosen"
    )
    if single:
        # A campaign of one day needs no run to know its group; its own number is free in the other table.
        db.execute(
            "CREATE OR REPLACE TEMP TABLE fleet_whole AS SELECT identification_id, identification_id AS group_no, "
            "machine_no, began_d AS moment_d FROM fleet_chosen WHERE NOT several_days"
        )
    for first, end in pairwise(_bounds(chosen["identification_id"], chosen["size"], portion)):
        values = {"first": first, "end": end, "epoch": epoch_d}
        if single:
            db.execute(_SUMS.format(place="fleet_whole", keys="identification_id"), values)
        if several:
            db.execute(_SUMS.format(place="fleet_day", keys="identification_id, run"), values)
    return _sums(db, float(epoch_d))


def _bounds(numbers: npt.NDArray[np.int64], sizes: npt.NDArray[np.int64], portion: int) -> list[int]:
    """Identification numbers at which a new portion begins, and one after the last."""
    filled = np.cumsum(np.asarray(sizes, dtype=np.int64)) // max(portion, 1)
    starts = np.flatnonzero(np.diff(filled)) + 1
    return [int(numbers[0]), *(int(numbers[i]) for i in starts), int(numbers[-1]) + 1]


def _sums(db: Database, epoch_d: float) -> FleetSums:
    found = {name: np.ma.getdata(column) for name, column in db.arrays(_TOGETHER).items()}
    for name in ("fleet_chosen", "fleet_day", "fleet_latest", "fleet_origin", "fleet_part", "fleet_whole"):
        db.execute(f"DROP TABLE IF EXISTS {name}")
    number = {
        name: np.asarray(column, dtype=np.float64)
        for name, column in found.items()
        if name not in ("machine", "parameter", "unit")
    }
    f = number["factor"]
    # ln s² of the groups becomes that of the display unit; their degrees of freedom are runs less groups.
    shift = 2.0 * np.log(f) * (number["n"] - number["k"])
    return FleetSums(
        machine=found["machine"].astype(np.str_),
        parameter=found["parameter"].astype(np.str_),
        unit=found["unit"].astype(np.str_),
        origin=number["origin"] / f,
        groups=number["k"],
        runs=number["n"],
        offset=number["s"] / f,
        squares=number["q"] / f**2,
        within=number["ss"] / f**2,
        repeated=number["repeated"],
        least_variance=number["least"] / f**2,
        log_variances=number["logs"] - shift,
        inverse_dof=number["inverse"],
        epoch_d=epoch_d,
        sum_t=number["t"],
        sum_tt=number["tt"],
        sum_m=number["m"] / f,
        sum_mm=number["mm"] / f**2,
        sum_tm=number["tm"] / f,
        last_d=number["last_d"],
        latest=number["latest"] / f,
        latest_runs=number["latest_n"],
    )
