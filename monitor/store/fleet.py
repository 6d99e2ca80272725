"""Sums over the whole fleet: for every machine and parameter what Bartlett, ANOVA and a drift need.

The rows never leave the database. They are first summed by campaign and day, about an origin of their own
machine and parameter (a value of its first campaign): a sum of squares about zero would lose the digits that all
values share. The sums of the days are then summed by machine. Rows are taken in portions, so that memory does not
grow with the history. Use ``fleet_sums`` for many machines; for one machine ``machine_history`` reads its rows.

Most of the time goes into telling the groups of the first sum apart, so their key is one whole number: machine,
moment and parameter in its bits. The second sum reads them from the key and needs no join.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from monitor.exceptions import NotFoundError
from monitor.records import Array
from monitor.store.connection import Database

#: Values summed at a time: 16 million keep the sums by day (a quarter as many, each some 60 bytes) below 1 GB.
PORTION = 16_000_000

_MACHINES = """
CREATE OR REPLACE TEMP TABLE fleet_machine AS
SELECT machine, row_number() OVER (ORDER BY machine) - 1 AS machine_no FROM machine
"""

_CHOSEN = """
CREATE OR REPLACE TEMP TABLE fleet_chosen AS
WITH latest AS (
    -- Of each campaign the identification with the most runs, the later of two: what load_identification takes.
    SELECT campaign_id, max((CAST(run_count AS BIGINT) << 32) | identification_id) AS most
    FROM identification
    WHERE ($model IS NULL AND model = method OR model = $model) AND ($version IS NULL OR model_version = $version)
    GROUP BY campaign_id
), span AS (
    SELECT campaign_id, min(day) AS first_day, max(day) AS last_day, min(started_at) AS began
    FROM run GROUP BY campaign_id
)
SELECT CAST(l.most & 4294967295 AS INTEGER) AS identification_id, l.most >> 32 AS run_count, l.campaign_id,
       n.machine_no, s.first_day <> s.last_day AS several_days, s.began
FROM latest AS l
JOIN campaign AS c ON c.campaign_id = l.campaign_id
JOIN span AS s ON s.campaign_id = l.campaign_id
JOIN fleet_machine AS n USING (machine)
"""

# A group is a campaign, or a day of a campaign that has several. Its second is that of its first run in the history
# of the fleet; groups that begin in the same second on one machine are numbered (`tie`), which hardly ever happens.
_GROUPS = """
CREATE OR REPLACE TEMP TABLE fleet_group AS
WITH begun AS (
    SELECT identification_id, campaign_id, machine_no, CAST(NULL AS BIGINT) AS day, began
    FROM fleet_chosen WHERE NOT several_days
    UNION ALL
    SELECT c.identification_id, c.campaign_id, c.machine_no, r.day, min(r.started_at)
    FROM fleet_chosen AS c JOIN run AS r USING (campaign_id) WHERE c.several_days GROUP BY ALL
), placed AS (
    SELECT *, CAST(floor(epoch(began - $epoch)) AS BIGINT) AS second FROM begun
), tied AS (
    SELECT identification_id, day,
           row_number() OVER (PARTITION BY machine_no, second ORDER BY identification_id, day) - 1 AS tie
    FROM placed
    SEMI JOIN (SELECT machine_no, second FROM placed GROUP BY ALL HAVING count(*) > 1) USING (machine_no, second)
)
SELECT p.* EXCLUDE (began), coalesce(t.tie, 0) AS tie
FROM placed AS p
LEFT JOIN tied AS t ON t.identification_id = p.identification_id AND t.day IS NOT DISTINCT FROM p.day
"""

# The key of a group: machine, second, tie and parameter, from the highest bits to the lowest.
_BASE = "((((machine_no << $second_bits) | second) << $tie_bits) | tie) << $bits AS base"

# Where the rows of an identification belong: `base` is the key of its group, without the parameter.
_WHOLE = f"""
CREATE OR REPLACE TEMP TABLE fleet_whole AS
SELECT identification_id, machine_no, {_BASE} FROM fleet_group WHERE day IS NULL
"""

_DAYS = f"""
CREATE OR REPLACE TEMP TABLE fleet_day AS
SELECT identification_id, run, machine_no, {_BASE} FROM fleet_group JOIN run USING (campaign_id, day)
"""

# The last day of each machine: of its latest campaign, and of that the latest day.
_LATEST = """
CREATE OR REPLACE TEMP TABLE fleet_latest AS
WITH campaign_of AS (
    SELECT machine_no, max({'began': began, 'own': identification_id, 'campaign': campaign_id}) AS latest
    FROM fleet_chosen GROUP BY machine_no
), last AS (
    SELECT c.machine_no, c.latest.own AS identification_id, r.run, r.started_at
    FROM campaign_of AS c JOIN run AS r ON r.campaign_id = c.latest.campaign
    QUALIFY r.day = arg_max(r.day, r.started_at) OVER (PARTITION BY c.machine_no)
)
SELECT (l.machine_no << $bits) | list_position($names, v.parameter) AS cell, favg(v.value) AS latest,
       count(*) AS latest_n, epoch(min(l.started_at)) / 86400.0 AS last_d, first(v.unit) AS unit,
       first(v.display_factor) AS factor
FROM parameter_value AS v
JOIN last AS l USING (identification_id, run)
WHERE v.value IS NOT NULL
GROUP BY cell
"""

# Every machine has an origin for every parameter: a value of its first campaign, else the mean of its last day.
_ORIGINS = """
CREATE OR REPLACE TEMP TABLE fleet_origin AS
WITH first_value AS (
    SELECT (c.machine_no << $bits) | list_position($names, v.parameter) AS cell, first(v.value) AS origin
    FROM parameter_value AS v
    JOIN (SELECT machine_no, min(identification_id) AS identification_id FROM fleet_chosen GROUP BY machine_no) AS c
        USING (identification_id)
    WHERE v.value IS NOT NULL
    GROUP BY cell
)
SELECT (m.machine_no << $bits) | p.k AS cell, coalesce(f.origin, l.latest, 0.0) AS origin
FROM fleet_machine AS m
CROSS JOIN (SELECT unnest(range(1, len($names) + 1)) AS k) AS p
LEFT JOIN first_value AS f ON f.cell = (m.machine_no << $bits) | p.k
LEFT JOIN fleet_latest AS l ON l.cell = (m.machine_no << $bits) | p.k
"""

# A row for each cell and number of runs in a group: what depends on that number alone is worked out afterwards.
_PARTS = """
CREATE OR REPLACE TEMP TABLE fleet_part (
    cell BIGINT, n BIGINT, k BIGINT, v DOUBLE, least DOUBLE, logs DOUBLE, t DOUBLE, tt DOUBLE, m DOUBLE, mm DOUBLE,
    tm DOUBLE
)
"""

# {place}: the table that gives the group of a row; {keys}: what a row shares with it.
_SUMS = """
INSERT INTO fleet_part
SELECT cell, n, count(*), sum(v), min(v), sum(ln(CASE WHEN v > 0.0 THEN v END)),
       sum(t), sum(t * t), sum(m), sum(m * m), sum(m * t)
FROM (
    SELECT ((key >> ($bits + $tie_bits + $second_bits)) << $bits) | (key & ((1 << $bits) - 1)) AS cell,
           ((key >> ($bits + $tie_bits)) & ((CAST(1 AS BIGINT) << $second_bits) - 1)) / 86400.0 AS t,
           n, m, v
    FROM (
        SELECT base | k AS key, count(*) AS n, avg(d) AS m, var_pop(d) AS v
        FROM (
            SELECT r.base, r.k, r.value - o.origin AS d
            FROM (
                SELECT p.base, p.machine_no, list_position($names, x.parameter) AS k, x.value
                FROM parameter_value AS x JOIN {place} AS p USING ({keys})
                WHERE x.identification_id >= $first AND x.identification_id < $end AND x.value IS NOT NULL
            ) AS r
            JOIN fleet_origin AS o ON o.cell = (r.machine_no << $bits) | r.k
        )
        GROUP BY key
    )
)
GROUP BY cell, n
"""

_TOGETHER = """
WITH shown AS (
    SELECT cell & ((1 << $bits) - 1) AS k, first(unit) AS unit, first(factor) AS factor FROM fleet_latest GROUP BY k
), summed AS (
    SELECT cell, sum(k) AS k, sum(k * n) AS n, sum(n * m) AS s, sum(n * mm) AS q, sum(n * v) AS ss,
           coalesce(sum(k) FILTER (n > 1), 0) AS repeated,
           coalesce(min(least * n / (n - 1)) FILTER (n > 1), 0.0) AS least,
           coalesce(sum((n - 1) * (logs + k * ln(n / (n - 1)))) FILTER (n > 1), 0.0) AS logs,
           coalesce(sum(k / (n - 1)) FILTER (n > 1), 0.0) AS inverse,
           sum(t) AS t, sum(tt) AS tt, sum(m) AS m, sum(mm) AS mm, sum(tm) AS tm
    FROM fleet_part GROUP BY cell
)
SELECT b.machine, $names[p.cell & ((1 << $bits) - 1)] AS parameter, coalesce(s.unit, '1') AS unit,
       coalesce(s.factor, 1.0) AS factor, o.origin, p.* EXCLUDE (cell),
       coalesce(l.last_d, 'nan') AS last_d, coalesce(l.latest - o.origin, 'nan') AS latest,
       coalesce(l.latest_n, 0) AS latest_n
FROM summed AS p
JOIN fleet_machine AS b ON b.machine_no = p.cell >> $bits
JOIN fleet_origin AS o USING (cell)
LEFT JOIN fleet_latest AS l USING (cell)
LEFT JOIN shown AS s ON s.k = p.cell & ((1 << $bits) - 1)
ORDER BY b.machine, parameter
"""

_TABLES = ("machine", "chosen", "group", "whole", "day", "latest", "origin", "part")


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

    Without ``model`` the method's own. ``portion`` values are summed at a time. A parameter that a machine refused
    both in its first campaign and on its last day has zero for its origin and loses 2 lg(mean / scatter) of 16
    digits. Sums of several threads differ in the last bits from one time to the next. Raises NotFoundError where
    nothing was identified.
    """
    db.execute(_MACHINES)
    db.execute(_CHOSEN, {"model": model, "version": version})
    chosen = db.arrays("SELECT identification_id, run_count FROM fleet_chosen ORDER BY identification_id")
    if not len(chosen["identification_id"]):
        of = "" if model is None else f" with model {model}"
        raise NotFoundError(f"no campaign was identified{of} yet; type `monitor identify`")
    ((epoch, several, single),) = db.rows(
        "SELECT min(began), count(*) FILTER (several_days), count(*) FILTER (NOT several_days) FROM fleet_chosen"
    )
    names = [name for (name,) in db.rows("SELECT DISTINCT parameter FROM parameter_value ORDER BY parameter")]
    bits = len(names).bit_length()
    db.execute(_GROUPS, {"epoch": epoch})
    ((second, tie),) = db.rows("SELECT max(second), max(tie) FROM fleet_group")
    shift = {"bits": bits, "second_bits": int(second).bit_length(), "tie_bits": int(tie).bit_length()}
    places = [("fleet_whole", "identification_id", _WHOLE)] * bool(single)
    places += [("fleet_day", "identification_id, run", _DAYS)] * bool(several)
    for _, _, statement in places:
        db.execute(statement, shift)
    for statement in (_LATEST, _ORIGINS):
        db.execute(statement, {"bits": bits, "names": names})
    db.execute(_PARTS)
    for first, end in pairwise(
        _bounds(chosen["identification_id"], chosen["run_count"] * len(names), portion)
    ):
        for place, keys, _ in places:
            db.execute(
                _SUMS.format(place=place, keys=keys), {**shift, "names": names, "first": first, "end": end}
            )
    found = {
        name: np.ma.getdata(column)
        for name, column in db.arrays(_TOGETHER, {"bits": bits, "names": names}).items()
    }
    for name in _TABLES:
        db.execute(f"DROP TABLE IF EXISTS fleet_{name}")
    return _sums(found, (epoch - datetime(1970, 1, 1)) / timedelta(days=1))


def _bounds(numbers: npt.NDArray[np.int64], sizes: npt.NDArray[np.int64], portion: int) -> list[int]:
    """Identification numbers at which a new portion begins, and one after the last."""
    filled = np.cumsum(np.asarray(sizes, dtype=np.int64)) // max(portion, 1)
    starts = np.flatnonzero(np.diff(filled)) + 1
    return [int(numbers[0]), *(int(numbers[i]) for i in starts), int(numbers[-1]) + 1]


def _sums(found: Mapping[str, npt.NDArray[np.generic]], epoch_d: float) -> FleetSums:
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
