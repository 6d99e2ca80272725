-- Views for people who query with SQL: names instead of numbers, display units instead of internal ones, and of every
-- result only the latest.

CREATE VIEW v_machines AS
SELECT m.machine, m.topology,
       c.machine_description ->> 'manufacturer' AS manufacturer,
       c.machine_description ->> 'model' AS machine_model,
       c.machine_description ->> 'serial_number' AS serial_number,
       c.machine_description ->> 'location' AS location,
       c.campaigns, c.latest_campaign, c.latest_run_at
FROM machine AS m
LEFT JOIN (
    SELECT k.machine, count(*) AS campaigns,
           arg_max(k.machine_description, (s.latest, k.campaign_id)) AS machine_description,
           arg_max(k.campaign, (s.latest, k.campaign_id)) AS latest_campaign,
           max(s.latest) AS latest_run_at
    FROM campaign AS k
    LEFT JOIN (SELECT campaign_id, max(started_at) AS latest FROM run GROUP BY campaign_id) AS s USING (campaign_id)
    GROUP BY k.machine
) AS c USING (machine);
COMMENT ON VIEW v_machines IS 'Machines, each as its latest campaign describes it.';
COMMENT ON COLUMN v_machines.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_machines.topology IS 'Chain from the workpiece to the tool (no unit)';
COMMENT ON COLUMN v_machines.manufacturer IS 'Manufacturer (no unit)';
COMMENT ON COLUMN v_machines.machine_model IS 'Model of the machine (no unit)';
COMMENT ON COLUMN v_machines.serial_number IS 'Serial number (no unit)';
COMMENT ON COLUMN v_machines.location IS 'Where it stands (no unit)';
COMMENT ON COLUMN v_machines.campaigns IS 'How many campaigns there are of it (no unit)';
COMMENT ON COLUMN v_machines.latest_campaign IS 'Its latest campaign (no unit)';
COMMENT ON COLUMN v_machines.latest_run_at IS 'Start of the latest run (UTC)';

CREATE VIEW v_tolerances AS
SELECT machine, campaign, parameter, CAST(machine_description -> 'tolerances' ->> parameter AS DOUBLE) AS tolerance
FROM (
    SELECT machine, campaign, machine_description,
           unnest(json_keys(machine_description, '$.tolerances')) AS parameter
    FROM campaign
);
COMMENT ON VIEW v_tolerances IS 'Limits of the absolute value of a parameter, campaign by campaign.';
COMMENT ON COLUMN v_tolerances.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_tolerances.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_tolerances.parameter IS 'Name of the parameter (no unit)';
COMMENT ON COLUMN v_tolerances.tolerance IS 'Limit of the absolute value (display unit of the parameter: µm, µrad, µm/m)';

CREATE VIEW v_campaigns AS
SELECT c.campaign_id, c.campaign, c.machine, c.method,
       coalesce(r.runs, 0) AS runs, coalesce(p.probings, 0) AS probings,
       r.first_run_at, r.last_run_at, r.days,
       c.probe ->> 'id' AS probe,
       CAST(c.probe ->> 'standard_uncertainty' AS DOUBLE) / 1e-3 AS probe_u_um,
       c.artefact ->> 'id' AS artefact,
       CAST(c.artefact -> 'scale_bar' ->> 'length' AS DOUBLE) AS scale_bar_mm,
       c.artefact -> 'scale_bar' ->> 'certificate' AS scale_bar_certificate,
       c.imported_at
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

CREATE VIEW v_runs AS
SELECT c.campaign, c.machine, r.run, r.started_at,
       r.started_at + to_microseconds(CAST(round(r.utc_offset_s * 1000000) AS BIGINT)) AS started_at_local,
       r.day, r.warm_up, r.conditions['ambient_degC'] AS ambient_degc, r.conditions
FROM run AS r JOIN campaign AS c USING (campaign_id)
ORDER BY c.campaign_id, r.position;
COMMENT ON VIEW v_runs IS 'Runs of every campaign with their conditions.';
COMMENT ON COLUMN v_runs.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_runs.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_runs.run IS 'Number of the run (no unit)';
COMMENT ON COLUMN v_runs.started_at IS 'Start of the run (UTC)';
COMMENT ON COLUMN v_runs.started_at_local IS 'Start of the run by the shop''s clock (local time)';
COMMENT ON COLUMN v_runs.day IS 'Number of the day (no unit)';
COMMENT ON COLUMN v_runs.warm_up IS 'True where the machine was still warming up (no unit)';
COMMENT ON COLUMN v_runs.ambient_degc IS 'Ambient temperature (degree Celsius)';
COMMENT ON COLUMN v_runs.conditions IS 'All conditions, each in the unit that its name ends in (degC, percent, hPa, min)';

CREATE VIEW v_probings AS
SELECT c.campaign, c.machine, p.run, p.sequence, p.time_s, p.target,
       p.readings['X'] AS x_mm, p.readings['Y'] AS y_mm, p.readings['Z'] AS z_mm,
       p.readings['A'] AS a_deg, p.readings['B'] AS b_deg, p.readings['C'] AS c_deg, p.readings['C1'] AS c1_deg,
       p.readings, p.channels
FROM probing AS p JOIN campaign AS c USING (campaign_id);
COMMENT ON VIEW v_probings IS 'Touches, the usual axes as columns; readings[axis] gives any other.';
COMMENT ON COLUMN v_probings.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_probings.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_probings.run IS 'Number of the run (no unit)';
COMMENT ON COLUMN v_probings.sequence IS 'Number of the touch in its run (no unit)';
COMMENT ON COLUMN v_probings.time_s IS 'Time since the start of the run (s)';
COMMENT ON COLUMN v_probings.target IS 'Name of the ball (no unit)';
COMMENT ON COLUMN v_probings.x_mm IS 'Reading of X (mm)';
COMMENT ON COLUMN v_probings.y_mm IS 'Reading of Y (mm)';
COMMENT ON COLUMN v_probings.z_mm IS 'Reading of Z (mm)';
COMMENT ON COLUMN v_probings.a_deg IS 'Reading of A (degree)';
COMMENT ON COLUMN v_probings.b_deg IS 'Reading of B (degree)';
COMMENT ON COLUMN v_probings.c_deg IS 'Reading of C (degree)';
COMMENT ON COLUMN v_probings.c1_deg IS 'Reading of the spindle C1 (degree)';
COMMENT ON COLUMN v_probings.readings IS 'Readings by axis (mm for linear axes, degree for rotary axes and spindles)';
COMMENT ON COLUMN v_probings.channels IS 'Recorded channels, each in the unit that its name ends in (degC, percent, hPa, min, mm, um, deg, s)';

CREATE VIEW v_identifications AS
SELECT i.identification_id, c.campaign, c.machine, i.model, i.model_version, i.method, i.run_count, i.parameters,
       i.software_version, i.computed_at,
       i.identification_id < max(i.identification_id)
           OVER (PARTITION BY i.campaign_id, i.model, i.model_version) AS superseded
FROM identification AS i JOIN campaign AS c USING (campaign_id);
COMMENT ON VIEW v_identifications IS 'Identifications; superseded where a later one holds the same campaign, model and version.';
COMMENT ON COLUMN v_identifications.identification_id IS 'Number of the identification (no unit)';
COMMENT ON COLUMN v_identifications.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_identifications.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_identifications.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN v_identifications.model_version IS 'Version of the model (no unit)';
COMMENT ON COLUMN v_identifications.method IS 'Calibration method (no unit)';
COMMENT ON COLUMN v_identifications.run_count IS 'How many runs it holds (no unit)';
COMMENT ON COLUMN v_identifications.parameters IS 'Names of the parameters (no unit)';
COMMENT ON COLUMN v_identifications.software_version IS 'Version of the software that computed it (no unit)';
COMMENT ON COLUMN v_identifications.computed_at IS 'When it was stored (UTC)';
COMMENT ON COLUMN v_identifications.superseded IS 'True where a later identification exists (no unit)';

CREATE VIEW v_identified_runs AS
SELECT c.campaign, c.machine, i.model, i.model_version, f.run, r.started_at, r.day, r.warm_up,
       f.rms_mm / 1e-3 AS rms_um, f.iterations, f.degrees_of_freedom, f.chi_square, f.refused,
       i.identification_id, i.campaign_id
FROM identified_run AS f
JOIN identification AS i USING (identification_id)
JOIN campaign AS c USING (campaign_id)
JOIN run AS r ON r.campaign_id = i.campaign_id AND r.run = f.run
QUALIFY i.identification_id = max(i.identification_id)
    OVER (PARTITION BY i.campaign_id, i.model, i.model_version, f.run);
COMMENT ON VIEW v_identified_runs IS 'How well every run was fitted: the latest identification of each run, model and version.';
COMMENT ON COLUMN v_identified_runs.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_identified_runs.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_identified_runs.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN v_identified_runs.model_version IS 'Version of the model (no unit)';
COMMENT ON COLUMN v_identified_runs.run IS 'Number of the run (no unit)';
COMMENT ON COLUMN v_identified_runs.started_at IS 'Start of the run (UTC)';
COMMENT ON COLUMN v_identified_runs.day IS 'Number of the day (no unit)';
COMMENT ON COLUMN v_identified_runs.warm_up IS 'True where the machine was still warming up (no unit)';
COMMENT ON COLUMN v_identified_runs.rms_um IS 'Root mean square of all residual components (µm)';
COMMENT ON COLUMN v_identified_runs.iterations IS 'Iterations of the solver (no unit)';
COMMENT ON COLUMN v_identified_runs.degrees_of_freedom IS 'Observations less unknowns (no unit)';
COMMENT ON COLUMN v_identified_runs.chi_square IS 'Sum of squared normalised residuals (no unit)';
COMMENT ON COLUMN v_identified_runs.refused IS 'Groups of parameters that cannot be told apart (no unit)';
COMMENT ON COLUMN v_identified_runs.identification_id IS 'Number of the identification (no unit)';
COMMENT ON COLUMN v_identified_runs.campaign_id IS 'Number of the campaign (no unit)';

CREATE VIEW v_parameters AS
SELECT f.campaign, f.machine, f.model, f.model_version, f.run, f.started_at, f.day, f.warm_up,
       v.parameter, v.value / v.display_factor AS value, v.u / v.display_factor AS u, v.unit, f.identification_id
FROM parameter_value AS v JOIN v_identified_runs AS f USING (identification_id, run);
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

CREATE VIEW v_residuals AS
SELECT f.campaign, f.machine, f.model, f.model_version, f.run, d.sequence, p.target,
       d.dx_mm / 1e-3 AS dx_um, d.dy_mm / 1e-3 AS dy_um, d.dz_mm / 1e-3 AS dz_um,
       sqrt(d.dx_mm * d.dx_mm + d.dy_mm * d.dy_mm + d.dz_mm * d.dz_mm) / 1e-3 AS length_um,
       p.readings, f.identification_id
FROM residual AS d
JOIN v_identified_runs AS f USING (identification_id, run)
JOIN probing AS p ON p.campaign_id = f.campaign_id AND p.run = d.run AND p.sequence = d.sequence;
COMMENT ON VIEW v_residuals IS 'What the model left at every touch: the latest identification of each run, model and version.';
COMMENT ON COLUMN v_residuals.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_residuals.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_residuals.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN v_residuals.model_version IS 'Version of the model (no unit)';
COMMENT ON COLUMN v_residuals.run IS 'Number of the run (no unit)';
COMMENT ON COLUMN v_residuals.sequence IS 'Number of the touch in its run (no unit)';
COMMENT ON COLUMN v_residuals.target IS 'Name of the ball (no unit)';
COMMENT ON COLUMN v_residuals.dx_um IS 'X component (µm)';
COMMENT ON COLUMN v_residuals.dy_um IS 'Y component (µm)';
COMMENT ON COLUMN v_residuals.dz_um IS 'Z component (µm)';
COMMENT ON COLUMN v_residuals.length_um IS 'Length of the vector (µm)';
COMMENT ON COLUMN v_residuals.readings IS 'Readings by axis (mm for linear axes, degree for rotary axes and spindles)';
COMMENT ON COLUMN v_residuals.identification_id IS 'Number of the identification (no unit)';

CREATE VIEW v_analyses AS
SELECT a.analysis_id, a.kind, coalesce(a.machine, c.machine) AS machine, c.campaign, a.run, a.model, a.model_version, a.method,
       a.seed, a.software_version, a.computed_at, a.document
FROM analysis AS a LEFT JOIN campaign AS c USING (campaign_id)
ORDER BY a.analysis_id DESC;
COMMENT ON VIEW v_analyses IS 'Computed results that are kept as documents, the latest first.';
COMMENT ON COLUMN v_analyses.analysis_id IS 'Number of the result (no unit)';
COMMENT ON COLUMN v_analyses.kind IS 'What was computed (no unit)';
COMMENT ON COLUMN v_analyses.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_analyses.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_analyses.run IS 'Number of the run, NULL for all (no unit)';
COMMENT ON COLUMN v_analyses.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN v_analyses.model_version IS 'Version of the model (no unit)';
COMMENT ON COLUMN v_analyses.method IS 'How it was computed (no unit)';
COMMENT ON COLUMN v_analyses.seed IS 'Seed of the random numbers (no unit)';
COMMENT ON COLUMN v_analyses.software_version IS 'Version of the software that computed it (no unit)';
COMMENT ON COLUMN v_analyses.computed_at IS 'When it was stored (UTC)';
COMMENT ON COLUMN v_analyses.document IS 'The result; units are in the keys (mm, rad, s, degree Celsius where a key names none)';

CREATE VIEW v_certificates AS
SELECT s.number, s.state, c.campaign, c.machine, s.runs, s.drafted_at, s.issued_at, s.changed_at, s.reason, s.replaced_by,
       s.pdf_sha256
FROM (
    SELECT number, arg_max(state, entry) AS state, arg_max(campaign_id, entry) AS campaign_id, arg_max(runs, entry) AS runs,
           min(made_at) FILTER (state = 'draft') AS drafted_at, min(made_at) FILTER (state = 'issued') AS issued_at,
           max(made_at) AS changed_at, arg_max(reason, entry) AS reason, arg_max(replaced_by, entry) AS replaced_by,
           arg_max(pdf_sha256, entry) FILTER (pdf_sha256 IS NOT NULL) AS pdf_sha256
    FROM certificate GROUP BY number
) AS s JOIN campaign AS c USING (campaign_id)
ORDER BY s.number;
COMMENT ON VIEW v_certificates IS 'Certificates in their present state.';
COMMENT ON COLUMN v_certificates.number IS 'Number of the certificate (no unit)';
COMMENT ON COLUMN v_certificates.state IS 'draft, issued, amended or withdrawn (no unit)';
COMMENT ON COLUMN v_certificates.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_certificates.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_certificates.runs IS 'Numbers of the runs that it certifies (no unit)';
COMMENT ON COLUMN v_certificates.drafted_at IS 'When it was first drafted (UTC)';
COMMENT ON COLUMN v_certificates.issued_at IS 'When it was issued (UTC)';
COMMENT ON COLUMN v_certificates.changed_at IS 'When its state last changed (UTC)';
COMMENT ON COLUMN v_certificates.reason IS 'Why it was amended or withdrawn (no unit)';
COMMENT ON COLUMN v_certificates.replaced_by IS 'Number of the certificate that replaces it (no unit)';
COMMENT ON COLUMN v_certificates.pdf_sha256 IS 'SHA-256 of the document, hexadecimal (no unit)';

CREATE VIEW v_events AS
SELECT event_id, machine, happened_at,
       happened_at + to_microseconds(CAST(round(utc_offset_s * 1000000) AS BIGINT)) AS happened_at_local,
       kind, description, recorded_at
FROM event
ORDER BY machine, happened_at;
COMMENT ON VIEW v_events IS 'What people know of the machines, by machine and time.';
COMMENT ON COLUMN v_events.event_id IS 'Number of the event (no unit)';
COMMENT ON COLUMN v_events.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_events.happened_at IS 'When it happened (UTC)';
COMMENT ON COLUMN v_events.happened_at_local IS 'When it happened by the shop''s clock (local time)';
COMMENT ON COLUMN v_events.kind IS 'What kind of event (no unit)';
COMMENT ON COLUMN v_events.description IS 'What happened (no unit)';
COMMENT ON COLUMN v_events.recorded_at IS 'When it was recorded (UTC)';
