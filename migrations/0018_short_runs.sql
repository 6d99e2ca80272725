-- Campaigns whose runs are all short have one row without a hash: two such rows are equal, and say nothing of the readings.

CREATE OR REPLACE VIEW v_repeated_runs AS
SELECT c.campaign, c.machine, f.run, o.campaign AS same_as_campaign, o.machine AS same_as_machine, g.run AS same_as_run
FROM run_fingerprint AS f
JOIN campaign AS c USING (campaign_id)
JOIN run_fingerprint AS g ON g.readings_sha256 = f.readings_sha256 AND g.campaign_id < f.campaign_id
JOIN campaign AS o ON o.campaign_id = g.campaign_id
WHERE f.readings_sha256 <> ''
ORDER BY f.campaign_id, f.run, g.campaign_id, g.run;
COMMENT ON VIEW v_repeated_runs IS 'Runs whose readings all equal those of a run of an earlier campaign: they are no independent measurements.';
COMMENT ON COLUMN v_repeated_runs.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_repeated_runs.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_repeated_runs.run IS 'Number of the run (no unit)';
COMMENT ON COLUMN v_repeated_runs.same_as_campaign IS 'Name of the earlier campaign (no unit)';
COMMENT ON COLUMN v_repeated_runs.same_as_machine IS 'Machine of the earlier campaign (no unit)';
COMMENT ON COLUMN v_repeated_runs.same_as_run IS 'Number of the run there (no unit)';
