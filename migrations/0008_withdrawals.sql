-- Campaigns that should not have been imported: withdrawn with a reason, never deleted. What counts is read from the
-- views `campaign` and `machine`, which leave them out, so that no query can forget to; a name is free again once
-- its campaign is withdrawn, and so is a machine whose campaigns all are (a wrong topology can be corrected).
--
-- The tables keep their rows under new names without the keys on the names, which a corrected import may repeat.

CREATE TABLE imported_campaign (
    campaign_id INTEGER PRIMARY KEY,
    campaign VARCHAR NOT NULL,
    machine VARCHAR NOT NULL,
    method VARCHAR NOT NULL,
    machine_description JSON NOT NULL,
    probe JSON NOT NULL,
    artefact JSON NOT NULL,
    content_sha256 VARCHAR NOT NULL,
    software_version VARCHAR NOT NULL,
    imported_at TIMESTAMP NOT NULL
);
INSERT INTO imported_campaign SELECT * FROM campaign ORDER BY campaign_id;
DROP TABLE campaign;
CREATE INDEX imported_campaign_of_machine ON imported_campaign (machine);
COMMENT ON TABLE imported_campaign IS 'Every campaign that was ever imported, the withdrawn ones included; the view campaign has those that count.';
COMMENT ON COLUMN imported_campaign.campaign_id IS 'Number of the campaign, from 1 in the order of import (no unit)';
COMMENT ON COLUMN imported_campaign.campaign IS 'Name of the campaign, unique among those that are not withdrawn (no unit)';
COMMENT ON COLUMN imported_campaign.machine IS 'The machine that was probed (no unit)';
COMMENT ON COLUMN imported_campaign.method IS 'Calibration method: samba, rotary-probing, free-form, l-shape, tracker, curve (no unit)';
COMMENT ON COLUMN imported_campaign.machine_description IS 'The machine as this campaign describes it; lengths in mm, angles in rad, tolerances in display units';
COMMENT ON COLUMN imported_campaign.probe IS 'The probe; standard uncertainty and tip in mm';
COMMENT ON COLUMN imported_campaign.artefact IS 'Balls and scale bar; lengths in mm, expansion in 1/K, temperature in degree Celsius';
COMMENT ON COLUMN imported_campaign.content_sha256 IS 'SHA-256 over the names and hashes of all its files, hexadecimal (no unit)';
COMMENT ON COLUMN imported_campaign.software_version IS 'Version of the software that imported it (no unit)';
COMMENT ON COLUMN imported_campaign.imported_at IS 'When it was imported (UTC)';

CREATE TABLE withdrawn_campaign (
    campaign_id INTEGER PRIMARY KEY,
    reason VARCHAR NOT NULL,
    software_version VARCHAR NOT NULL,
    withdrawn_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE withdrawn_campaign IS 'Campaigns that no longer count, and why.';
COMMENT ON COLUMN withdrawn_campaign.campaign_id IS 'The campaign (no unit)';
COMMENT ON COLUMN withdrawn_campaign.reason IS 'Why it was withdrawn, in words (no unit)';
COMMENT ON COLUMN withdrawn_campaign.software_version IS 'Version of the software that withdrew it (no unit)';
COMMENT ON COLUMN withdrawn_campaign.withdrawn_at IS 'When it was withdrawn (UTC)';

CREATE VIEW campaign AS
SELECT campaign_id, campaign, machine, method, machine_description, probe, artefact, content_sha256, software_version,
       imported_at
FROM imported_campaign ANTI JOIN withdrawn_campaign USING (campaign_id);
COMMENT ON VIEW campaign IS 'The calibration campaigns that count: one machine, one artefact, one probe, the runs of one plan.';
COMMENT ON COLUMN campaign.campaign_id IS 'Number of the campaign, from 1 in the order of import (no unit)';
COMMENT ON COLUMN campaign.campaign IS 'Name of the campaign, unique in this view (no unit)';
COMMENT ON COLUMN campaign.machine IS 'The machine that was probed (no unit)';
COMMENT ON COLUMN campaign.method IS 'Calibration method: samba, rotary-probing, free-form, l-shape, tracker, curve (no unit)';
COMMENT ON COLUMN campaign.machine_description IS 'The machine as this campaign describes it; lengths in mm, angles in rad, tolerances in display units';
COMMENT ON COLUMN campaign.probe IS 'The probe; standard uncertainty and tip in mm';
COMMENT ON COLUMN campaign.artefact IS 'Balls and scale bar; lengths in mm, expansion in 1/K, temperature in degree Celsius';
COMMENT ON COLUMN campaign.content_sha256 IS 'SHA-256 over the names and hashes of all its files, hexadecimal (no unit)';
COMMENT ON COLUMN campaign.software_version IS 'Version of the software that imported it (no unit)';
COMMENT ON COLUMN campaign.imported_at IS 'When it was imported (UTC)';

CREATE TABLE registered_machine (
    registration INTEGER PRIMARY KEY,
    machine VARCHAR NOT NULL,
    topology VARCHAR NOT NULL,
    registered_at TIMESTAMP NOT NULL
);
INSERT INTO registered_machine
SELECT row_number() OVER (ORDER BY registered_at, machine), machine, topology, registered_at FROM machine;
DROP TABLE machine;
COMMENT ON TABLE registered_machine IS 'Machines and their topologies as they were first imported; the latest of a machine holds.';
COMMENT ON COLUMN registered_machine.registration IS 'Number of the registration, from 1 (no unit)';
COMMENT ON COLUMN registered_machine.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN registered_machine.topology IS 'Chain from the workpiece to the tool in the notation of ISO 10791-1 (no unit)';
COMMENT ON COLUMN registered_machine.registered_at IS 'When the first campaign with this topology was imported (UTC)';

CREATE VIEW machine AS
SELECT machine, arg_max(topology, registration) AS topology, min(registered_at) AS registered_at
FROM registered_machine
WHERE machine IN (SELECT machine FROM campaign) OR machine IN (SELECT machine FROM event)
GROUP BY machine;
COMMENT ON VIEW machine IS 'Machines with a campaign that counts, or with an event. Their description may change and is kept with every campaign; their topology may not.';
COMMENT ON COLUMN machine.machine IS 'Name of the machine, unique in this view (no unit)';
COMMENT ON COLUMN machine.topology IS 'Chain from the workpiece to the tool in the notation of ISO 10791-1 (no unit)';
COMMENT ON COLUMN machine.registered_at IS 'When its first campaign was imported (UTC)';

CREATE VIEW v_withdrawn_campaigns AS
SELECT c.campaign, c.machine, c.method, c.imported_at, w.withdrawn_at, w.reason, c.campaign_id
FROM withdrawn_campaign AS w JOIN imported_campaign AS c USING (campaign_id)
ORDER BY w.withdrawn_at, c.campaign_id;
COMMENT ON VIEW v_withdrawn_campaigns IS 'Campaigns that no longer count; their rows, files and results stay in the tables.';
COMMENT ON COLUMN v_withdrawn_campaigns.campaign IS 'Name of the campaign, which another may have now (no unit)';
COMMENT ON COLUMN v_withdrawn_campaigns.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_withdrawn_campaigns.method IS 'Calibration method (no unit)';
COMMENT ON COLUMN v_withdrawn_campaigns.imported_at IS 'When it was imported (UTC)';
COMMENT ON COLUMN v_withdrawn_campaigns.withdrawn_at IS 'When it was withdrawn (UTC)';
COMMENT ON COLUMN v_withdrawn_campaigns.reason IS 'Why, in words (no unit)';
COMMENT ON COLUMN v_withdrawn_campaigns.campaign_id IS 'Number of the campaign (no unit)';

-- Results of a withdrawn campaign are left out like those of every view; certificates stay, since paper is out there.
CREATE OR REPLACE VIEW v_analyses AS
SELECT a.analysis_id, a.kind, coalesce(a.machine, c.machine) AS machine, c.campaign, a.run, a.model, a.model_version, a.method,
       a.seed, a.software_version, a.computed_at, a.document
FROM analysis AS a LEFT JOIN campaign AS c USING (campaign_id)
WHERE a.campaign_id IS NULL OR c.campaign IS NOT NULL
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

CREATE OR REPLACE VIEW v_certificates AS
SELECT s.number, s.state, c.campaign, c.machine, s.runs, s.drafted_at, s.issued_at, s.changed_at, s.reason, s.replaced_by,
       s.pdf_sha256, w.withdrawn_at AS campaign_withdrawn_at, s.campaign_id
FROM (
    SELECT number, arg_max(state, entry) AS state, arg_max(campaign_id, entry) AS campaign_id, arg_max(runs, entry) AS runs,
           min(made_at) FILTER (state = 'draft') AS drafted_at, min(made_at) FILTER (state = 'issued') AS issued_at,
           max(made_at) AS changed_at, arg_max(reason, entry) AS reason, arg_max(replaced_by, entry) AS replaced_by,
           arg_max(pdf_sha256, entry) FILTER (pdf_sha256 IS NOT NULL) AS pdf_sha256
    FROM certificate GROUP BY number
) AS s
JOIN imported_campaign AS c USING (campaign_id)
LEFT JOIN withdrawn_campaign AS w USING (campaign_id)
ORDER BY s.number;
COMMENT ON VIEW v_certificates IS 'Certificates in their present state, those of withdrawn campaigns included.';
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
COMMENT ON COLUMN v_certificates.campaign_withdrawn_at IS 'When the campaign that it rests on was withdrawn, NULL where it counts (UTC)';
COMMENT ON COLUMN v_certificates.campaign_id IS 'Number of the campaign that it rests on (no unit)';

-- What an import noticed: a run cut short, numbers that look a thousand times too small. And of every run of some length
-- the hash of its readings, so that runs which came in twice are told, which no measurement does by chance.
CREATE TABLE import_note (
    campaign_id INTEGER NOT NULL,
    position INTEGER NOT NULL,
    note VARCHAR NOT NULL,
    PRIMARY KEY (campaign_id, position)
);
COMMENT ON TABLE import_note IS 'What looked like a mistake when a campaign was imported, but may be none.';
COMMENT ON COLUMN import_note.campaign_id IS 'The campaign (no unit)';
COMMENT ON COLUMN import_note.position IS 'Place among the notes of the campaign, from 1 (no unit)';
COMMENT ON COLUMN import_note.note IS 'A sentence (no unit)';

CREATE VIEW v_import_notes AS
SELECT c.campaign, c.machine, n.position, n.note
FROM import_note AS n JOIN campaign AS c USING (campaign_id)
ORDER BY c.campaign_id, n.position;
COMMENT ON VIEW v_import_notes IS 'What looked like a mistake when a campaign was imported, but may be none.';
COMMENT ON COLUMN v_import_notes.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_import_notes.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_import_notes.position IS 'Place among the notes of the campaign, from 1 (no unit)';
COMMENT ON COLUMN v_import_notes.note IS 'A sentence (no unit)';

CREATE TABLE run_fingerprint (
    campaign_id INTEGER NOT NULL,
    run BIGINT NOT NULL,
    readings_sha256 VARCHAR NOT NULL
);
COMMENT ON TABLE run_fingerprint IS 'Hash of the targets and readings of every run of 12 probings or more, without times and temperatures.';
COMMENT ON COLUMN run_fingerprint.campaign_id IS 'The campaign (no unit)';
COMMENT ON COLUMN run_fingerprint.run IS 'Number of the run in its campaign (no unit)';
COMMENT ON COLUMN run_fingerprint.readings_sha256 IS 'SHA-256 of targets and readings, hexadecimal (no unit)';

CREATE VIEW v_repeated_runs AS
SELECT c.campaign, c.machine, f.run, o.campaign AS same_as_campaign, o.machine AS same_as_machine, g.run AS same_as_run
FROM run_fingerprint AS f
JOIN campaign AS c USING (campaign_id)
JOIN run_fingerprint AS g ON g.readings_sha256 = f.readings_sha256 AND g.campaign_id < f.campaign_id
JOIN campaign AS o ON o.campaign_id = g.campaign_id
ORDER BY f.campaign_id, f.run, g.campaign_id, g.run;
COMMENT ON VIEW v_repeated_runs IS 'Runs whose readings all equal those of a run of an earlier campaign: they are no independent measurements.';
COMMENT ON COLUMN v_repeated_runs.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_repeated_runs.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_repeated_runs.run IS 'Number of the run (no unit)';
COMMENT ON COLUMN v_repeated_runs.same_as_campaign IS 'Name of the earlier campaign (no unit)';
COMMENT ON COLUMN v_repeated_runs.same_as_machine IS 'Machine of the earlier campaign (no unit)';
COMMENT ON COLUMN v_repeated_runs.same_as_run IS 'Number of the run there (no unit)';
