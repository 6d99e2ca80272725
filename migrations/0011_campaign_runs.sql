-- The history of one machine without a secondary index, which DuckDB 1.5 loses rows from: the runs of a campaign in one row
-- that its primary key finds, and in the same row a number of its machine, four bytes a campaign to be looked through for
-- the campaigns of a machine instead of all names. `run` holds the same runs a row each, for people and for sums over the
-- fleet: there the runs of one machine lie scattered over the weeks.

CREATE TABLE campaign_runs (
    campaign_id INTEGER PRIMARY KEY,
    machine_hash INTEGER NOT NULL,
    run BIGINT[] NOT NULL,
    started_at TIMESTAMP[] NOT NULL,
    utc_offset_s DOUBLE[] NOT NULL,
    day BIGINT[] NOT NULL,
    warm_up BOOLEAN[] NOT NULL,
    conditions MAP(VARCHAR, DOUBLE)[] NOT NULL
);
COMMENT ON TABLE campaign_runs IS 'The rows of run, one row a campaign, withdrawn ones and those without runs included: what the history of one machine is read from.';
COMMENT ON COLUMN campaign_runs.campaign_id IS 'The campaign that the runs belong to (no unit)';
COMMENT ON COLUMN campaign_runs.machine_hash IS '24 bits of the MD5 of the name of its machine (md5_number_lower modulo 16777216); few machines share one (no unit)';
COMMENT ON COLUMN campaign_runs.run IS 'Numbers of its runs, ascending (no unit)';
COMMENT ON COLUMN campaign_runs.started_at IS 'Start of each of them (UTC)';
COMMENT ON COLUMN campaign_runs.utc_offset_s IS 'Offset of the shop''s clock from UTC, of each (s)';
COMMENT ON COLUMN campaign_runs.day IS 'Number of the day in the campaign, of each (no unit)';
COMMENT ON COLUMN campaign_runs.warm_up IS 'True where the machine was still warming up, of each (no unit)';
COMMENT ON COLUMN campaign_runs.conditions IS 'Conditions by name, of each, in the unit that the name ends in (degC, percent, hPa, min)';

INSERT INTO campaign_runs
SELECT campaign_id, CAST(md5_number_lower(machine) % 16777216 AS INTEGER), coalesce(r.run, []), coalesce(r.started_at, []),
       coalesce(r.utc_offset_s, []), coalesce(r.day, []), coalesce(r.warm_up, []), coalesce(r.conditions, [])
FROM imported_campaign LEFT JOIN (
    SELECT campaign_id, list(run ORDER BY run) AS run, list(started_at ORDER BY run) AS started_at,
           list(utc_offset_s ORDER BY run) AS utc_offset_s, list(day ORDER BY run) AS day,
           list(warm_up ORDER BY run) AS warm_up, list(conditions ORDER BY run) AS conditions
    FROM run GROUP BY campaign_id
) AS r USING (campaign_id)
ORDER BY campaign_id;
