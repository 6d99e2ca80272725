-- What the parameters of a run have of calibrated quantities that outlast a campaign: the scale of a laser, the length of
-- a bar. Results of two campaigns that rest on the same one are off by the same. Identifications of before have no row
-- here; identifying again gives them one.

CREATE TABLE common_part (
    identification_id INTEGER NOT NULL,
    run BIGINT NOT NULL,
    calibrated VARCHAR NOT NULL,
    certificate VARCHAR NOT NULL,
    quantity VARCHAR NOT NULL,
    u DOUBLE NOT NULL,
    part DOUBLE[] NOT NULL
);
COMMENT ON TABLE common_part IS 'What the parameters of a run change by where a calibrated quantity that other campaigns may rest on is larger by its standard uncertainty.';
COMMENT ON COLUMN common_part.identification_id IS 'Number of the identification (no unit)';
COMMENT ON COLUMN common_part.run IS 'Number of the run in its campaign (no unit)';
COMMENT ON COLUMN common_part.calibrated IS 'The instrument or artefact that was calibrated (no unit)';
COMMENT ON COLUMN common_part.certificate IS 'Its certificate, empty where the campaign names none (no unit)';
COMMENT ON COLUMN common_part.quantity IS 'What of it was calibrated: its scale, a length (no unit)';
COMMENT ON COLUMN common_part.u IS 'Standard uncertainty of the quantity as stated (mm, of a scale mm/mm)';
COMMENT ON COLUMN common_part.part IS 'Changes of the parameters in their order, NULL where refused (mm, rad or 1)';

CREATE VIEW v_common_parts AS
WITH latest AS (
    SELECT identification_id, campaign_id, model, model_version, parameters, units, display_factors
    FROM identification
    QUALIFY row_number() OVER (
        PARTITION BY campaign_id, model, model_version ORDER BY run_count DESC, identification_id DESC) = 1
)
SELECT campaign, machine, model, model_version, run, calibrated, certificate, quantity, parameter,
       internal / display_factor AS part, unit, identification_id
FROM (
    SELECT c.campaign, c.machine, l.model, l.model_version, p.run, p.calibrated, p.certificate, p.quantity,
           unnest(l.parameters) AS parameter, unnest(p.part) AS internal, unnest(l.display_factors) AS display_factor,
           unnest(l.units) AS unit, p.identification_id
    FROM common_part AS p
    JOIN latest AS l USING (identification_id)
    JOIN campaign AS c USING (campaign_id)
);
COMMENT ON VIEW v_common_parts IS 'What parameters change by for one standard uncertainty of a calibrated quantity: of each campaign, model and version the identification with the most runs, the latest of these.';
COMMENT ON COLUMN v_common_parts.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_common_parts.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_common_parts.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN v_common_parts.model_version IS 'Version of the model (no unit)';
COMMENT ON COLUMN v_common_parts.run IS 'Number of the run in its campaign (no unit)';
COMMENT ON COLUMN v_common_parts.calibrated IS 'The instrument or artefact that was calibrated (no unit)';
COMMENT ON COLUMN v_common_parts.certificate IS 'Its certificate, empty where the campaign names none (no unit)';
COMMENT ON COLUMN v_common_parts.quantity IS 'What of it was calibrated: its scale, a length (no unit)';
COMMENT ON COLUMN v_common_parts.parameter IS 'Name of the parameter (no unit)';
COMMENT ON COLUMN v_common_parts.part IS 'Change of the parameter, NULL where refused (display unit of the parameter)';
COMMENT ON COLUMN v_common_parts.unit IS 'Name of the display unit (no unit)';
COMMENT ON COLUMN v_common_parts.identification_id IS 'Number of the identification (no unit)';
