-- What every identified parameter refers to: the machine, the axis before it in the chain, or its own axis. Identifications
-- of before have no rows here; identifying again gives them.

CREATE TABLE parameter_frame (
    identification_id INTEGER NOT NULL,
    parameter VARCHAR NOT NULL,
    refers_to VARCHAR NOT NULL
);
COMMENT ON TABLE parameter_frame IS 'What the parameters of an identification refer to; none for one that is no error of a chain, or that was identified by an older version.';
COMMENT ON COLUMN parameter_frame.identification_id IS 'Number of the identification (no unit)';
COMMENT ON COLUMN parameter_frame.parameter IS 'Name of the parameter (no unit)';
COMMENT ON COLUMN parameter_frame.refers_to IS 'machine: the frame of the machine; axis A: the axis before it in the chain; axis A itself: the nominal motion of its own axis (no unit)';

CREATE OR REPLACE VIEW v_parameters AS
SELECT f.campaign, f.machine, f.model, f.model_version, f.run, f.started_at, f.day, f.warm_up,
       v.parameter, v.value / v.display_factor AS value, v.u / v.display_factor AS u, v.unit, f.identification_id,
       r.refers_to
FROM parameter_value AS v
JOIN v_identified_runs AS f USING (identification_id, run)
LEFT JOIN parameter_frame AS r ON r.identification_id = v.identification_id AND r.parameter = v.parameter;
COMMENT ON VIEW v_parameters IS 'Every parameter of every run in its display unit: the latest identification of each run, model and version.';
COMMENT ON COLUMN v_parameters.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_parameters.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_parameters.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN v_parameters.model_version IS 'Version of the model (no unit)';
COMMENT ON COLUMN v_parameters.run IS 'Number of the run (no unit)';
COMMENT ON COLUMN v_parameters.started_at IS 'Start of the run (UTC)';
COMMENT ON COLUMN v_parameters.day IS 'Number of the day (no unit)';
COMMENT ON COLUMN v_parameters.warm_up IS 'True where the machine was still warming up (no unit)';
COMMENT ON COLUMN v_parameters.parameter IS 'Name of the parameter (no unit)';
COMMENT ON COLUMN v_parameters.value IS 'Estimate, NULL where refused (in the column unit: µm, µrad, µm/m)';
COMMENT ON COLUMN v_parameters.u IS 'Standard uncertainty (in the column unit: µm, µrad, µm/m)';
COMMENT ON COLUMN v_parameters.unit IS 'Name of the unit (no unit)';
COMMENT ON COLUMN v_parameters.identification_id IS 'Number of the identification (no unit)';
COMMENT ON COLUMN v_parameters.refers_to IS 'What the parameter refers to: machine, axis A (the one before it), axis A itself; NULL where it is no error of a chain or was identified by an older version (no unit)';
