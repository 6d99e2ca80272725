"""The queries that choose what the sums over the fleet are made of: of each campaign its identification, by its model.

``fleet.py`` sets the variables; ``fleet_queries.py`` has the queries that read these tables.
"""

from __future__ import annotations

from monitor.store.machine_models import NUMBERED

MACHINES = """
CREATE OR REPLACE TEMP TABLE fleet_machine AS
SELECT machine, row_number() OVER (ORDER BY machine) - 1 AS machine_no FROM machine
"""

# Identifications that hold the same parameters, and the numbers of those among all, told apart once for the fleet.
HEADINGS = """
CREATE OR REPLACE TEMP TABLE fleet_heading AS
WITH heading AS (
    -- As one text: lists of texts are compared at twice the cost.
    SELECT any_value(parameters) AS parameters, list(identification_id) AS identifications
    FROM identification GROUP BY array_to_string(parameters, chr(31))
), every AS (
    SELECT list_sort(list_distinct(flatten(list(parameters)))) AS names FROM heading
)
SELECT row_number() OVER () AS heading, parameters, identifications,
       list_transform(parameters, lambda parameter: list_position(names, parameter)) AS numbers
FROM heading, every
"""

# Models of single machines, by campaign, and the latest version of each method's own: few rows both, but for the time
# between a new version and the identifications by it.
MODELS = f"""
CREATE OR REPLACE TEMP TABLE fleet_model AS
SELECT c.campaign_id, m.method, m.model, m.model_version FROM ({NUMBERED}) AS m JOIN campaign AS c USING (machine)
"""

OWN = """
CREATE OR REPLACE TEMP TABLE fleet_own AS
SELECT model, max(version) AS version FROM model
WHERE model IN (SELECT model FROM model WHERE version = 1 AND parent IS NULL) GROUP BY model
"""

CHOSEN = """
CREATE OR REPLACE TEMP TABLE fleet_chosen AS
WITH latest AS (
    -- Of each campaign the identification with the most runs, the later of two: what load_identification takes.
    SELECT campaign_id, max((CAST(run_count AS BIGINT) << 32) | identification_id) & 4294967295 AS identification_id
    FROM identification
    LEFT JOIN fleet_model AS f USING (campaign_id, method)
    LEFT JOIN fleet_own AS o ON o.model = identification.method
    WHERE CASE WHEN getvariable('model') IS NULL
          -- That which its numbers come from, else the latest version of the method's own.
          THEN identification.model = coalesce(f.model, identification.method)
               AND identification.model_version = coalesce(f.model_version, o.version, identification.model_version)
          ELSE identification.model = getvariable('model')
               AND (getvariable('version') IS NULL OR identification.model_version = getvariable('version')) END
    GROUP BY campaign_id
), span AS (
    SELECT campaign_id, min(day) <> max(day) AS several_days, epoch(min(started_at)) / 86400.0 AS began_d,
           epoch(max(started_at)) / 86400.0 AS ended_d, bool_or(warm_up) AS warms,
           count(*) FILTER (NOT warm_up) AS steady
    FROM run GROUP BY campaign_id
), own AS (
    SELECT CAST(l.identification_id AS INTEGER) AS identification_id, n.machine_no, h.heading, s.*
    FROM latest AS l
    JOIN campaign AS c ON c.campaign_id = l.campaign_id
    JOIN span AS s ON s.campaign_id = l.campaign_id
    JOIN fleet_machine AS n USING (machine)
    JOIN (SELECT heading, unnest(identifications) AS identification_id FROM fleet_heading) AS h
      USING (identification_id)
), member AS (
    SELECT machine_no, heading, steady, unnest(numbers) AS k
    FROM (SELECT machine_no, heading, sum(steady) AS steady FROM own GROUP BY ALL) JOIN fleet_heading USING (heading)
), least AS (
    -- Runs that are steady are counted by parameter, as in `monitor trend`; a group holds all of a heading, so that the
    -- parameter with the fewest decides.
    SELECT machine_no, heading, min(steady) AS steady
    FROM (SELECT machine_no, heading, sum(steady) OVER (PARTITION BY machine_no, k) AS steady FROM member) GROUP BY ALL
)
SELECT identification_id, campaign_id, machine_no, heading,
       warms AND least.steady >= getvariable('steady') AS leaves_out,
       several_days OR leaves_out AS by_runs, began_d, ended_d
FROM own JOIN least USING (machine_no, heading)
"""
