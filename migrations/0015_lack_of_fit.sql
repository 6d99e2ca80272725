-- Whether the readings refute the model that an identification was made by, stored with it so that no verb that reads has
-- to fit again. Identifications of before have no row here; identifying again gives them one.

CREATE TABLE lack_of_fit (
    identification_id INTEGER NOT NULL,
    p_value DOUBLE
);
COMMENT ON TABLE lack_of_fit IS 'Lack of fit of an identification over the scatter of its runs; none for one that was made by an older version.';
COMMENT ON COLUMN lack_of_fit.identification_id IS 'Number of the identification (no unit)';
COMMENT ON COLUMN lack_of_fit.p_value IS 'Probability of as much lack of fit where the model is right, the noise of neighbours allowed for; NULL where no two runs follow one plan and nothing can be compared (no unit)';

CREATE VIEW v_lack_of_fit AS
SELECT c.campaign, c.machine, i.model, i.model_version, i.run_count, l.p_value, i.identification_id
FROM identification AS i
JOIN campaign AS c USING (campaign_id)
LEFT JOIN lack_of_fit AS l USING (identification_id)
QUALIFY row_number() OVER (
    PARTITION BY i.campaign_id, i.model, i.model_version ORDER BY i.run_count DESC, i.identification_id DESC) = 1;
COMMENT ON VIEW v_lack_of_fit IS 'Whether the readings refute a model: of each campaign, model and version the identification with the most runs, the latest of these.';
COMMENT ON COLUMN v_lack_of_fit.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_lack_of_fit.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_lack_of_fit.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN v_lack_of_fit.model_version IS 'Version of the model (no unit)';
COMMENT ON COLUMN v_lack_of_fit.run_count IS 'How many runs the identification holds (no unit)';
COMMENT ON COLUMN v_lack_of_fit.p_value IS 'Probability of as much lack of fit where the model is right; NULL where nothing could be compared or an older version identified (no unit)';
COMMENT ON COLUMN v_lack_of_fit.identification_id IS 'Number of the identification (no unit)';
