-- What came from the shop floor: machines, campaigns, their files byte for byte, runs, probings, events; and the
-- audit chain. Rows are only ever added.
--
-- Readings stay in the controller's own digits (mm, degree). A MAP keyed by axis keeps one row a touch for any
-- topology: no column for every axis that some machine may have, no join to bring a touch together. With 200
-- campaigns of 1240 touches an import took 4.7 ms and the file 7.6 MB; a row a reading 4.4 ms and 9.2 MB; a
-- column an axis 2.3 ms and 5.3 MB.
--
-- No foreign keys: COPY FROM DATABASE, which backups use, fills the tables in an order of its own and fails on them.
-- No keys on the tables that grow with every touch: they cost more space than the rows.

CREATE TABLE machine (
    machine VARCHAR PRIMARY KEY,
    topology VARCHAR NOT NULL,
    registered_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE machine IS 'A machine. Its description may change and is kept with every campaign; its topology may not.';
COMMENT ON COLUMN machine.machine IS 'Name of the machine, unique in this database (no unit)';
COMMENT ON COLUMN machine.topology IS 'Chain from the workpiece to the tool in the notation of ISO 10791-1 (no unit)';
COMMENT ON COLUMN machine.registered_at IS 'When its first campaign was imported (UTC)';

CREATE TABLE campaign (
    campaign_id INTEGER PRIMARY KEY,
    campaign VARCHAR NOT NULL UNIQUE,
    machine VARCHAR NOT NULL,
    method VARCHAR NOT NULL,
    machine_description JSON NOT NULL,
    probe JSON NOT NULL,
    artefact JSON NOT NULL,
    content_sha256 VARCHAR NOT NULL,
    software_version VARCHAR NOT NULL,
    imported_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE campaign IS 'A calibration campaign: one machine, one artefact, one probe, the runs of one plan.';
COMMENT ON COLUMN campaign.campaign_id IS 'Number of the campaign, from 1 in the order of import (no unit)';
COMMENT ON COLUMN campaign.campaign IS 'Name of the campaign, unique in this database (no unit)';
COMMENT ON COLUMN campaign.machine IS 'The machine that was probed (no unit)';
COMMENT ON COLUMN campaign.method IS 'Calibration method: samba, rotary-probing, free-form, l-shape (no unit)';
COMMENT ON COLUMN campaign.machine_description IS 'The machine as this campaign describes it; lengths in mm, angles in rad, tolerances in display units';
COMMENT ON COLUMN campaign.probe IS 'The probe; standard uncertainty and tip in mm';
COMMENT ON COLUMN campaign.artefact IS 'Balls and scale bar; lengths in mm, expansion in 1/K, temperature in degree Celsius';
COMMENT ON COLUMN campaign.content_sha256 IS 'SHA-256 over the names and hashes of all its files, hexadecimal (no unit)';
COMMENT ON COLUMN campaign.software_version IS 'Version of the software that imported it (no unit)';
COMMENT ON COLUMN campaign.imported_at IS 'When it was imported (UTC)';

CREATE TABLE source_file (
    campaign_id INTEGER NOT NULL,
    file VARCHAR NOT NULL,
    content BLOB NOT NULL,
    sha256 VARCHAR NOT NULL,
    PRIMARY KEY (campaign_id, file)
);
COMMENT ON TABLE source_file IS 'Every imported file, byte for byte.';
COMMENT ON COLUMN source_file.campaign_id IS 'The campaign that the file belongs to (no unit)';
COMMENT ON COLUMN source_file.file IS 'Name of the file inside its folder (no unit)';
COMMENT ON COLUMN source_file.content IS 'The bytes of the file (no unit)';
COMMENT ON COLUMN source_file.sha256 IS 'SHA-256 of the bytes, hexadecimal (no unit)';

CREATE TABLE run (
    campaign_id INTEGER NOT NULL,
    position INTEGER NOT NULL,
    run BIGINT NOT NULL,
    started_at TIMESTAMP NOT NULL,
    utc_offset_s DOUBLE NOT NULL,
    day BIGINT NOT NULL,
    warm_up BOOLEAN NOT NULL,
    conditions MAP(VARCHAR, DOUBLE) NOT NULL,
    PRIMARY KEY (campaign_id, run)
);
COMMENT ON TABLE run IS 'One run of the plan of a campaign, with its conditions.';
COMMENT ON COLUMN run.campaign_id IS 'The campaign that the run belongs to (no unit)';
COMMENT ON COLUMN run.position IS 'Place of the run in its file, from 1 (no unit)';
COMMENT ON COLUMN run.run IS 'Number of the run in its campaign (no unit)';
COMMENT ON COLUMN run.started_at IS 'Start of the run (UTC)';
COMMENT ON COLUMN run.utc_offset_s IS 'Offset of the shop''s clock from UTC (s)';
COMMENT ON COLUMN run.day IS 'Number of the day in the campaign (no unit)';
COMMENT ON COLUMN run.warm_up IS 'True where the machine was still warming up (no unit)';
COMMENT ON COLUMN run.conditions IS 'Conditions by name, each in the unit that its name ends in (degC, percent, hPa, min)';

CREATE TABLE probing (
    campaign_id INTEGER NOT NULL,
    position INTEGER NOT NULL,
    run BIGINT NOT NULL,
    sequence BIGINT NOT NULL,
    time_s DOUBLE NOT NULL,
    target VARCHAR NOT NULL,
    readings MAP(VARCHAR, DOUBLE) NOT NULL,
    channels MAP(VARCHAR, DOUBLE) NOT NULL
);
COMMENT ON TABLE probing IS 'One row a probed ball centre, in file order, in the digits that the controller printed.';
COMMENT ON COLUMN probing.campaign_id IS 'The campaign that the touch belongs to (no unit)';
COMMENT ON COLUMN probing.position IS 'Place of the row in its file, from 1 (no unit)';
COMMENT ON COLUMN probing.run IS 'Number of the run in its campaign (no unit)';
COMMENT ON COLUMN probing.sequence IS 'Number of the touch in its run (no unit)';
COMMENT ON COLUMN probing.time_s IS 'Time since the start of the run (s)';
COMMENT ON COLUMN probing.target IS 'Name of the ball (no unit)';
COMMENT ON COLUMN probing.readings IS 'Axis readings by axis, as printed: mm for linear axes, degree for rotary axes and spindles';
COMMENT ON COLUMN probing.channels IS 'Recorded channels by name, each in the unit that its name ends in; NULL where a cell is empty';

CREATE TABLE event (
    event_id INTEGER PRIMARY KEY,
    machine VARCHAR NOT NULL,
    happened_at TIMESTAMP NOT NULL,
    utc_offset_s DOUBLE NOT NULL,
    kind VARCHAR NOT NULL,
    description VARCHAR NOT NULL,
    recorded_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE event IS 'What people know of a machine: a crash, a repair, a compensation, another probe.';
COMMENT ON COLUMN event.event_id IS 'Number of the event, from 1 in the order of recording (no unit)';
COMMENT ON COLUMN event.machine IS 'The machine it happened to (no unit)';
COMMENT ON COLUMN event.happened_at IS 'When it happened (UTC)';
COMMENT ON COLUMN event.utc_offset_s IS 'Offset of the shop''s clock from UTC (s)';
COMMENT ON COLUMN event.kind IS 'What kind of event, in the user''s word (no unit)';
COMMENT ON COLUMN event.description IS 'What happened, in words (no unit)';
COMMENT ON COLUMN event.recorded_at IS 'When it was recorded (UTC)';

CREATE TABLE audit (
    entry INTEGER PRIMARY KEY,
    made_at TIMESTAMP NOT NULL,
    actor VARCHAR NOT NULL,
    action VARCHAR NOT NULL,
    subject VARCHAR NOT NULL,
    key VARCHAR NOT NULL,
    content_sha256 VARCHAR NOT NULL,
    software_version VARCHAR NOT NULL,
    previous_sha256 VARCHAR NOT NULL,
    entry_sha256 VARCHAR NOT NULL
);
COMMENT ON TABLE audit IS 'Every change, each entry holding the hash of the one before: none can be altered or left out unseen.';
COMMENT ON COLUMN audit.entry IS 'Number of the entry, from 1 without a gap (no unit)';
COMMENT ON COLUMN audit.made_at IS 'When the change was made (UTC)';
COMMENT ON COLUMN audit.actor IS 'Who made it (no unit)';
COMMENT ON COLUMN audit.action IS 'What was done (no unit)';
COMMENT ON COLUMN audit.subject IS 'Table of the thing that changed (no unit)';
COMMENT ON COLUMN audit.key IS 'Key of the thing that changed, in its table (no unit)';
COMMENT ON COLUMN audit.content_sha256 IS 'SHA-256 of what was stored, hexadecimal (no unit)';
COMMENT ON COLUMN audit.software_version IS 'Version of the software that made the change (no unit)';
COMMENT ON COLUMN audit.previous_sha256 IS 'Hash of the entry before, zeros for the first, hexadecimal (no unit)';
COMMENT ON COLUMN audit.entry_sha256 IS 'SHA-256 of this entry with the hash before it, hexadecimal (no unit)';
