-- Whether anybody measured a campaign: what `simulate` writes looks like a measurement in every other column.

CREATE OR REPLACE VIEW v_campaigns AS
SELECT c.campaign_id, c.campaign, c.machine, c.method,
       coalesce(r.runs, 0) AS runs, coalesce(p.probings, 0) AS probings,
       r.first_run_at, r.last_run_at, r.days,
       c.probe ->> 'id' AS probe,
       CAST(c.probe ->> 'standard_uncertainty' AS DOUBLE) / 1e-3 AS probe_u_um,
       c.artefact ->> 'id' AS artefact,
       CAST(c.artefact -> 'scale_bar' ->> 'length' AS DOUBLE) AS scale_bar_mm,
       c.artefact -> 'scale_bar' ->> 'certificate' AS scale_bar_certificate,
       c.imported_at,
       coalesce((c.machine_description ->> 'virtual') = 'true', false) AS simulated
FROM campaign AS c
LEFT JOIN (
    SELECT campaign_id, count(*) AS runs, min(started_at) AS first_run_at, max(started_at) AS last_run_at,
           count(DISTINCT day) AS days
    FROM run GROUP BY campaign_id
) AS r USING (campaign_id)
LEFT JOIN (SELECT campaign_id, count(*) AS probings FROM probing GROUP BY campaign_id) AS p USING (campaign_id);
COMMENT ON VIEW v_campaigns IS 'Campaigns: what was probed with what, when, and how much.';
COMMENT ON COLUMN v_campaigns.campaign_id IS 'Number of the campaign (no unit)';
COMMENT ON COLUMN v_campaigns.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_campaigns.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_campaigns.method IS 'Calibration method (no unit)';
COMMENT ON COLUMN v_campaigns.runs IS 'How many runs (no unit)';
COMMENT ON COLUMN v_campaigns.probings IS 'How many touches (no unit)';
COMMENT ON COLUMN v_campaigns.first_run_at IS 'Start of the first run (UTC)';
COMMENT ON COLUMN v_campaigns.last_run_at IS 'Start of the last run (UTC)';
COMMENT ON COLUMN v_campaigns.days IS 'On how many days (no unit)';
COMMENT ON COLUMN v_campaigns.probe IS 'Name of the probe (no unit)';
COMMENT ON COLUMN v_campaigns.probe_u_um IS 'Standard uncertainty of one probed coordinate (µm)';
COMMENT ON COLUMN v_campaigns.artefact IS 'Name of the artefact (no unit)';
COMMENT ON COLUMN v_campaigns.scale_bar_mm IS 'Calibrated length of the scale bar (mm)';
COMMENT ON COLUMN v_campaigns.scale_bar_certificate IS 'Certificate of the scale bar (no unit)';
COMMENT ON COLUMN v_campaigns.imported_at IS 'When it was imported (UTC)';
COMMENT ON COLUMN v_campaigns.simulated IS 'True where its readings were computed and nobody measured them (no unit)';
