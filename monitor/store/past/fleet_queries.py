"""The queries of the sums over the fleet, each a table that the next ones read: groups of runs, blocks of these, sums.

``fleet.py`` says what is summed and why so, and sets the variables: a statement that makes a table cannot be prepared.
"""

from __future__ import annotations

from monitor.store.events import NOTE

# The temperature of each run, by the rule of the history of one machine: of the recorded ones that which most of its
# runs have, of several those recorded for the runs before channels of the touches, the first by name. The touches of
# all are many: they are read where no temperature is recorded for every run of a machine.
_TEMPERATURES = r"""
SELECT machine_no, campaign_id, run, e.key AS channel, {value} AS degc
FROM (SELECT machine_no, campaign_id, run, unnest(map_entries({source})) AS e
      FROM {rows} JOIN fleet_chosen USING (campaign_id) {where})
WHERE e.key LIKE '%_\_degC' ESCAPE '\' AND e.value IS NOT NULL
"""

RUN_TEMPERATURES = f"""
CREATE OR REPLACE TEMP TABLE fleet_run_temperature AS
SELECT *, false AS of_touches
FROM ({_TEMPERATURES.format(value="e.value", source="conditions", rows="run", where="")}) WHERE isfinite(degc)
"""

TOUCH_TEMPERATURES = f"""
INSERT INTO fleet_run_temperature
WITH every AS (
    SELECT machine_no, count(*) AS runs FROM run JOIN fleet_chosen USING (campaign_id) GROUP BY machine_no
), recorded AS (
    SELECT machine_no, count(*) AS runs FROM fleet_run_temperature GROUP BY machine_no, channel
), lacking AS (
    SELECT machine_no FROM every ANTI JOIN recorded USING (machine_no, runs)
), touched AS (
    {
    _TEMPERATURES.format(
        value="avg(e.value)", source="channels", rows="probing", where="SEMI JOIN lacking USING (machine_no)"
    )
}
    GROUP BY ALL
)
SELECT *, true FROM touched ANTI JOIN fleet_run_temperature USING (campaign_id, run, channel)
"""

THERMOMETERS = """
CREATE OR REPLACE TEMP TABLE fleet_thermometer AS
SELECT machine_no, channel FROM (
    SELECT machine_no, channel, count(*) AS runs, bool_and(of_touches) AS of_touches
    FROM fleet_run_temperature GROUP BY machine_no, channel
)
QUALIFY row_number() OVER (PARTITION BY machine_no ORDER BY runs DESC, of_touches, channel) = 1
"""

TEMPERATURES = """
CREATE OR REPLACE TEMP TABLE fleet_temperature AS
SELECT campaign_id, run, degc FROM fleet_run_temperature JOIN fleet_thermometer USING (machine_no, channel)
"""

# Of a campaign whose runs all have one.
CAMPAIGN_TEMPERATURES = """
CREATE OR REPLACE TEMP TABLE fleet_campaign_temperature AS
WITH counted AS (SELECT campaign_id, count(*) AS runs FROM run SEMI JOIN fleet_chosen USING (campaign_id) GROUP BY ALL)
SELECT campaign_id, avg(degc) AS degc FROM fleet_temperature JOIN counted USING (campaign_id)
GROUP BY campaign_id, runs HAVING count(*) = runs
"""

# A group is a campaign, or a day of a campaign that has several or runs while warming up, which count in no group where
# enough others remain, as in `monitor trend`: `places` are then its runs among those identified.
GROUPS = """
CREATE OR REPLACE TEMP TABLE fleet_group AS
SELECT identification_id, campaign_id, machine_no, heading, began_d, ended_d, CAST(NULL AS BIGINT[]) AS places, degc
FROM fleet_chosen LEFT JOIN fleet_campaign_temperature USING (campaign_id) WHERE NOT by_runs
UNION ALL
SELECT identification_id, campaign_id, machine_no, heading, epoch(min(started_at)) / 86400.0,
       epoch(max(started_at)) / 86400.0,
       coalesce(list(place) FILTER (place IS NOT NULL), []),
       CASE WHEN count(degc) = count(*) THEN avg(degc) END
FROM (
    SELECT c.identification_id, c.campaign_id, c.machine_no, c.heading, r.day, r.started_at,
           list_position(v.runs, r.run) AS place, d.degc
    FROM fleet_chosen AS c JOIN run AS r USING (campaign_id) JOIN identified_values AS v USING (identification_id)
    LEFT JOIN fleet_temperature AS d ON d.campaign_id = c.campaign_id AND d.run = r.run
    WHERE c.by_runs AND NOT (c.leaves_out AND r.warm_up)
)
GROUP BY identification_id, campaign_id, machine_no, heading, day
"""

# Every day of the machines of which days of two campaigns overlap: a day overlaps an earlier one where it begins before
# that ends.
SAME_HOURS = """
WITH followed AS (
    SELECT machine_no, began_d,
           max(ended_d) OVER (PARTITION BY machine_no ORDER BY began_d, ended_d
                              ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING) AS ended_before_d
    FROM fleet_group
)
SELECT machine, campaign, began_d, ended_d FROM fleet_group JOIN campaign USING (campaign_id)
WHERE machine_no IN (SELECT machine_no FROM followed WHERE began_d <= ended_before_d)
"""

# The identified runs of some groups, with their places among those identified.
_RUNS = """
SELECT g.* EXCLUDE (degc, places), r.run, r.started_at, list_position(v.runs, r.run) AS place
FROM {groups} AS g JOIN run AS r USING (campaign_id) JOIN identified_values AS v USING (identification_id)
WHERE CASE WHEN places IS NULL THEN place IS NOT NULL ELSE list_contains(places, place) END
"""

# A recorded event splits the history of a machine, as in `monitor trend`: runs that began before the last event count
# no more. An event after the last run splits nothing yet, a note never.
SINCE = f"""
CREATE OR REPLACE TEMP TABLE fleet_since AS
WITH happened AS (
    SELECT machine_no, epoch(happened_at) / 86400.0 AS at_d FROM v_events JOIN fleet_machine USING (machine)
    WHERE kind <> '{NOTE}'
), latest AS (
    SELECT machine_no, max(began_d) AS latest_d FROM fleet_group SEMI JOIN happened USING (machine_no) GROUP BY ALL
), late AS (
    SELECT fleet_group.* FROM fleet_group JOIN latest USING (machine_no) WHERE ended_d >= latest_d
), last AS (
    SELECT machine_no, epoch(max(started_at)) / 86400.0 AS last_d FROM ({_RUNS.format(groups="late")}) GROUP BY ALL
)
SELECT machine_no, max(at_d) AS since_d FROM happened JOIN last USING (machine_no) WHERE at_d <= last_d
GROUP BY machine_no
"""

# Of a group that the event divides the runs after it are one: those before it are of another machine.
DIVIDED = f"""
INSERT INTO fleet_group
WITH divided AS (
    SELECT fleet_group.*, since_d FROM fleet_group JOIN fleet_since USING (machine_no)
    WHERE began_d < since_d AND ended_d >= since_d
)
SELECT identification_id, campaign_id, machine_no, heading, epoch(min(started_at)) / 86400.0,
       epoch(max(started_at)) / 86400.0, list(place), CASE WHEN count(degc) = count(*) THEN avg(degc) END
FROM ({_RUNS.format(groups="divided")}) LEFT JOIN fleet_temperature USING (campaign_id, run)
WHERE epoch(started_at) / 86400.0 >= since_d
GROUP BY identification_id, campaign_id, machine_no, heading, began_d
"""

ENDED = """
DELETE FROM fleet_group USING fleet_since
WHERE fleet_group.machine_no = fleet_since.machine_no AND fleet_group.began_d < fleet_since.since_d
"""

# The history of a machine is cut into blocks of equal time, as that of a parameter in `monitor trend`: from the number
# of
# groups to their number, and from the time of a group to its block.
BLOCKS = """
CREATE OR REPLACE TEMP TABLE fleet_blocked AS
WITH span AS (
    SELECT machine_no, min(began_d) AS first_d, max(began_d) AS last_d, count(*) AS k
    FROM fleet_group GROUP BY machine_no
), cut AS (
    SELECT machine_no, first_d, greatest(last_d - first_d, 1e-300) AS span_d,
           CASE WHEN k <= getvariable('whole') THEN k
           ELSE least(greatest(k // getvariable('each'), getvariable('whole')), getvariable('most')) END AS blocks
    FROM span
)
SELECT g.*, CAST(least(floor((began_d - first_d) / span_d * blocks), blocks - 1) AS UTINYINT) AS block
FROM fleet_group AS g JOIN cut USING (machine_no)
"""

# A cell is a machine and a parameter: its number is made of both.
PARAMETER_BITS = 20
# And of a cell and a block.
BLOCK_BITS = 6

# Each parameter with its number, its unit and what its values are divided by where they are shown.
SHOWN = """
CREATE OR REPLACE TEMP TABLE fleet_shown AS
SELECT k, parameter, first(unit) AS unit, first(factor) AS factor
FROM (
    SELECT unnest(h.numbers) AS k, unnest(h.parameters) AS parameter, unnest(i.units) AS unit,
           unnest(i.display_factors) AS factor
    FROM identification AS i JOIN fleet_heading AS h ON i.identification_id = h.identifications[1]
)
GROUP BY k, parameter
"""

# The values of every cell in some groups, a list each. The outer join keeps the values on the side that is only read:
# a hash table of them would be most of the time and memory.
LISTS = f"""
SELECT (machine_no << {PARAMETER_BITS}) | k AS cell, (cell << {BLOCK_BITS}) | block AS cb, began_d, degc,
       CASE WHEN places IS NULL THEN x ELSE list_select(x, places) END AS x
FROM (
    SELECT g.machine_no, g.began_d, g.degc, g.places, g.block, unnest(h.numbers) AS k, unnest(v.value) AS x
    FROM identified_values AS v JOIN {{groups}} AS g USING (identification_id)
    LEFT JOIN fleet_heading AS h USING (heading)
)
"""

# The last day of each machine, that of its last run: of every parameter what it found. A day of another campaign that
# overlaps it is part of it, as in `monitor trend`: which of two was stored first says nothing.
LATEST = f"""
CREATE OR REPLACE TEMP TABLE fleet_latest AS
WITH ends AS (
    SELECT machine_no, max(ended_d) AS ended_d FROM fleet_group GROUP BY machine_no
), begins AS (
    SELECT machine_no, min(began_d) AS last_began_d FROM fleet_group JOIN ends USING (machine_no, ended_d)
    GROUP BY machine_no
), last AS (
    SELECT fleet_group.*, 0 AS block FROM fleet_group JOIN begins USING (machine_no) WHERE ended_d >= last_began_d
)
SELECT cell, max(began_d) AS began_d, flatten(list(x)) AS x,
       list(list_avg(x)) FILTER (list_count(x) > 0) AS means
FROM ({LISTS.format(groups="last")}) GROUP BY cell
"""

# Of every parameter the value and the standard uncertainty of the last run of its machine, whatever happened since.
LAST_RUN = f"""
CREATE OR REPLACE TEMP TABLE fleet_last_run AS
WITH last AS (
    SELECT machine_no, arg_max(identification_id, ended_d) AS identification_id, arg_max(heading, ended_d) AS heading,
           arg_max(campaign_id, ended_d) AS campaign_id
    FROM fleet_chosen GROUP BY machine_no
), ends AS (
    SELECT campaign_id, arg_max(run, started_at) AS run FROM run SEMI JOIN last USING (campaign_id) GROUP BY campaign_id
)
SELECT (machine_no << {PARAMETER_BITS}) | k AS cell, x AS last_value, u AS last_u
FROM (
    SELECT machine_no, unnest(h.numbers) AS k, unnest(list_transform(v.value, lambda xs: xs[place])) AS x,
           unnest(list_transform(v.u, lambda us: us[place])) AS u
    FROM (
        SELECT last.*, list_position(v.runs, run) AS place, v.value, v.u
        FROM last JOIN ends USING (campaign_id) JOIN identified_values AS v USING (identification_id)
    ) AS v JOIN fleet_heading AS h USING (heading)
)
"""

# When each machine is measured next: as far after its last run as the beginnings of its campaigns lie apart, as in
# `monitor trend`.
CHECKS = """
CREATE OR REPLACE TEMP TABLE fleet_check AS
WITH apart AS (
    SELECT machine_no, ended_d, began_d - lag(began_d) OVER (PARTITION BY machine_no ORDER BY began_d) AS apart_d
    FROM fleet_chosen
)
SELECT machine_no, max(ended_d) + coalesce(median(apart_d), getvariable('apart')) AS check_d
FROM apart GROUP BY machine_no
"""

# Limits of the absolute values, in display units.
LIMITS = "CREATE OR REPLACE TEMP TABLE fleet_limit (machine VARCHAR, parameter VARCHAR, most DOUBLE)"
LIMITED = "INSERT INTO fleet_limit SELECT unnest($machines), unnest($parameters), unnest($limits)"

# Where the mean of the last day is beyond its limit: since when every run is, in the whole history of the machine. An
# event that does not bring a parameter back splits its history, not this.
BEYOND = f"""
CREATE OR REPLACE TEMP TABLE fleet_beyond AS
WITH beyond AS (
    SELECT cell, machine_no, most * factor AS most
    FROM fleet_limit JOIN fleet_machine USING (machine) JOIN fleet_shown USING (parameter)
    JOIN fleet_latest ON cell = ((machine_no << {PARAMETER_BITS}) | k)
    WHERE abs(list_avg(x)) >= most * factor
), timed AS (
    SELECT cell, most, started_at, x
    FROM (
        SELECT campaign_id, cell, most, unnest(runs) AS run, unnest(xs) AS x
        FROM (
            SELECT c.campaign_id, c.machine_no, v.runs, unnest(h.numbers) AS k, unnest(v.value) AS xs
            FROM identified_values AS v JOIN fleet_chosen AS c USING (identification_id)
            JOIN fleet_heading AS h USING (heading)
            WHERE c.machine_no IN (SELECT machine_no FROM beyond)
        ) AS values_of JOIN beyond ON cell = ((values_of.machine_no << {PARAMETER_BITS}) | k)
    ) JOIN run USING (campaign_id, run)
    WHERE x IS NOT NULL
), within AS (
    SELECT cell, max(started_at) FILTER (abs(x) <= most) AS last_within FROM timed GROUP BY cell
)
SELECT cell, epoch(min(started_at)) / 86400.0 AS beyond_d
FROM timed JOIN within USING (cell) WHERE last_within IS NULL OR started_at > last_within GROUP BY cell
"""

# Every machine has an origin for every parameter: a value of its first campaign, else one of its last day.
ORIGINS = f"""
CREATE OR REPLACE TEMP TABLE fleet_origin AS
WITH earliest AS (
    SELECT *, NULL AS places, 0 AS block, NULL AS degc FROM fleet_chosen
    WHERE identification_id IN (SELECT min(identification_id) FROM fleet_chosen GROUP BY machine_no)
), first AS ({LISTS.format(groups="earliest")})
SELECT cell, coalesce(list_any_value(f.x), list_any_value(l.x), 0.0) AS origin
FROM (
    SELECT (machine_no << {PARAMETER_BITS}) | k AS cell
    FROM fleet_machine CROSS JOIN (SELECT DISTINCT unnest(numbers) AS k FROM fleet_heading)
)
LEFT JOIN first AS f USING (cell)
LEFT JOIN fleet_latest AS l USING (cell)
"""

# A row for each cell, block and number of runs in a group: what depends on that number alone is worked out afterwards.
PARTS = f"""
CREATE OR REPLACE TEMP TABLE fleet_part AS
SELECT cb, n, count(*) AS k, min(t) AS t_first, sum(v) AS v, min(v) AS least,
       sum(ln(CASE WHEN v > 0.0 THEN v END)) AS logs,
       sum(t) AS t, sum(t * t) AS tt, sum(m) AS m, sum(m * m) AS mm, sum(m * t) AS tm,
       sum(v * v) AS vv, count(g) AS g_k, sum(g) AS g, sum(g * g) AS gg, sum(g * t) AS gt, sum(g * m) AS gm,
       min(g) AS g_low, max(g) AS g_high
FROM (
    SELECT cb, t, g, list_count(d) AS n, list_avg(d) AS m, list_var_pop(d) AS v
    FROM (
        SELECT cb, began_d - getvariable('epoch_d') AS t, degc - 20.0 AS g,
               list_transform(x, lambda value: value - origin) AS d
        FROM ({LISTS.format(groups="fleet_blocked")}) JOIN fleet_origin USING (cell)
    )
)
GROUP BY cb, n
"""

TOGETHER = f"""
WITH latest AS (
    SELECT cell, began_d AS last_d, list_count(x) AS latest_n,
           list_avg(list_transform(x, lambda value: value - origin)) AS latest, len(means) AS latest_k,
           list_sum(list_transform(means, lambda value: value - origin)) AS latest_m,
           list_sum(list_transform(means, lambda value: (value - origin) * (value - origin))) AS latest_mm
    FROM fleet_latest JOIN fleet_origin USING (cell)
), part AS (
    SELECT cb >> {BLOCK_BITS} AS cell, n, sum(k) AS k, min(t_first) AS t_first, sum(v) AS v, min(least) AS least,
           sum(logs) AS logs, sum(t) AS t, sum(tt) AS tt, sum(m) AS m, sum(mm) AS mm, sum(tm) AS tm, sum(vv) AS vv,
           sum(g_k) AS g_k, sum(g) AS g, sum(gg) AS gg, sum(gt) AS gt, sum(gm) AS gm, min(g_low) AS g_low,
           max(g_high) AS g_high
    -- Groups in which a parameter was refused in every run have no part in it.
    FROM fleet_part WHERE n > 0 GROUP BY cell, n
), summed AS (
    SELECT cell, sum(k) AS k, sum(k * n) AS n, sum(n * m) AS s, sum(n * mm) AS q, sum(n * v) AS ss,
           coalesce(sum(k) FILTER (n > 1), 0) AS repeated,
           coalesce(min(least * n / (n - 1)) FILTER (n > 1), 0.0) AS least,
           coalesce(sum((n - 1) * (logs + k * ln(n / (n - 1)))) FILTER (n > 1), 0.0) AS logs,
           coalesce(sum(k / (n - 1)) FILTER (n > 1), 0.0) AS inverse,
           min(t_first) AS t_first, sum(t) AS t, sum(tt) AS tt, sum(m) AS m, sum(mm) AS mm, sum(tm) AS tm,
           -- About 20 °C, of the groups whose runs all have a temperature.
           sum(g_k) AS g_k, coalesce(sum(g), 0.0) AS g, coalesce(sum(gg), 0.0) AS gg, coalesce(sum(gt), 0.0) AS gt,
           coalesce(sum(gm), 0.0) AS gm, coalesce(max(g_high) - min(g_low), 0.0) AS g_range,
           -- Of the groups with several runs, whose variances are v n / (n - 1).
           coalesce(sum(k * n) FILTER (n > 1), 0) AS runs_rep, coalesce(sum(n * m) FILTER (n > 1), 0.0) AS offset_rep,
           coalesce(sum(n * mm) FILTER (n > 1), 0.0) AS squares_rep,
           coalesce(sum(v * n / (n - 1)) FILTER (n > 1), 0.0) AS s2,
           coalesce(sum(v * n * n / (n - 1)) FILTER (n > 1), 0.0) AS s2_runs,
           coalesce(sum(vv * n * n / ((n - 1) * (n - 1))) FILTER (n > 1), 0.0) AS s4,
           coalesce(sum(vv * n * n * n / ((n - 1) * (n - 1))) FILTER (n > 1), 0.0) AS s4_runs,
           coalesce(sum(vv * n * n / ((n - 1) * (n - 1) * (n - 1))) FILTER (n > 1), 0.0) AS s4_dof,
           coalesce(sum(vv * n * n * n / ((n - 1) * (n - 1) * (n - 1))) FILTER (n > 1), 0.0) AS s4_dof_runs,
           coalesce(sum(vv * n * n * n * n / ((n - 1) * (n - 1) * (n - 1))) FILTER (n > 1), 0.0) AS s4_dof_runs_squared
    FROM part GROUP BY cell
)
SELECT m.machine, s.parameter, s.unit, s.factor, o.origin, p.*,
       CASE WHEN l.latest_n > 0 THEN l.last_d ELSE 'nan' END AS last_d, coalesce(l.latest, 'nan') AS latest,
       coalesce(l.latest_n, 0) AS latest_n, coalesce(l.latest_k, 0) AS latest_k, coalesce(l.latest_m, 0.0) AS latest_m,
       coalesce(l.latest_mm, 0.0) AS latest_mm, coalesce(e.since_d, 'nan') AS since_d,
       coalesce(b.beyond_d, 'nan') AS beyond_d,
       coalesce(r.last_value, 'nan') AS last_value, coalesce(r.last_u, 'nan') AS last_u,
       c.check_d,
       coalesce(h.channel, '') AS thermometer
FROM summed AS p
JOIN fleet_machine AS m ON m.machine_no = p.cell >> {PARAMETER_BITS}
JOIN fleet_origin AS o USING (cell)
LEFT JOIN latest AS l USING (cell)
LEFT JOIN fleet_since AS e ON e.machine_no = m.machine_no
LEFT JOIN fleet_beyond AS b USING (cell)
LEFT JOIN fleet_last_run AS r USING (cell)
JOIN fleet_check AS c ON c.machine_no = m.machine_no
LEFT JOIN fleet_thermometer AS h ON h.machine_no = m.machine_no
JOIN fleet_shown AS s ON s.k = p.cell & ((1 << {PARAMETER_BITS}) - 1)
ORDER BY m.machine, s.parameter
"""

# The blocks of every cell: how many groups, and their mean times and values about the origin.
OF_BLOCKS = f"""
SELECT cb >> {BLOCK_BITS} AS cell, cb & ((1 << {BLOCK_BITS}) - 1) AS block, CAST(sum(k) AS DOUBLE) AS k, sum(t) /
sum(k) AS t, sum(m) / sum(k) AS m,
       coalesce(sum(g), 0.0) / sum(k) AS g
FROM fleet_part WHERE n > 0 GROUP BY cb
"""

# What the groups of every cell have of each calibrated quantity that outlasts a campaign, by blocks: of a campaign that
# of its first run, which is as good as that of any. Of two statements of one calibration the surer is in common.
OF_COMMON = f"""
WITH alike AS (
    SELECT identification_id, arg_min(part, run) AS part, arg_min(p.u, run) AS u, machine_no, calibrated, certificate,
           quantity
    FROM common_part AS p JOIN fleet_chosen USING (identification_id)
    GROUP BY identification_id, machine_no, calibrated, certificate, quantity
), surest AS (
    SELECT *, min(u) OVER (PARTITION BY machine_no, calibrated, certificate, quantity) / u AS share,
           dense_rank() OVER (ORDER BY calibrated, certificate, quantity) AS quantity_no
    FROM alike
)
SELECT cell, quantity_no, block, sum(part) AS p, sum(part * t) AS tp
FROM (
    SELECT (g.machine_no << {PARAMETER_BITS}) | unnest(h.numbers) AS cell, quantity_no, block,
           unnest(s.part) * share AS part, began_d - getvariable('epoch_d') AS t
    FROM fleet_blocked AS g JOIN surest AS s USING (identification_id) JOIN fleet_heading AS h USING (heading)
)
WHERE part <> 0.0 GROUP BY ALL ORDER BY ALL
"""

TABLES = (
    "machine",
    "heading",
    "model",
    "own",
    "chosen",
    "run_temperature",
    "thermometer",
    "temperature",
    "campaign_temperature",
    "group",
    "blocked",
    "since",
    "latest",
    "last_run",
    "check",
    "shown",
    "limit",
    "beyond",
    "origin",
    "part",
)
