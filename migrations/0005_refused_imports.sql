-- Imports that were refused: nothing of their folder is kept, but that somebody tried, and what was wrong, is.
--
-- A report says which data never arrived. Rows are only ever added: that a folder was imported well later is a row of
-- its own.

CREATE TABLE refused_import (
    refusal_id INTEGER PRIMARY KEY,
    refused_at TIMESTAMP NOT NULL,
    utc_offset_s DOUBLE NOT NULL,
    folder VARCHAR NOT NULL,
    campaign VARCHAR,
    machine VARCHAR,
    fault_count BIGINT NOT NULL,
    faults VARCHAR[] NOT NULL,
    software_version VARCHAR NOT NULL
);
COMMENT ON TABLE refused_import IS 'An import that was refused as a whole, with its first faults.';
COMMENT ON COLUMN refused_import.refusal_id IS 'Number of the refusal, from 1 in the order of recording (no unit)';
COMMENT ON COLUMN refused_import.refused_at IS 'When it was refused (UTC)';
COMMENT ON COLUMN refused_import.utc_offset_s IS 'Offset of the clock of the computer that imported from UTC (s)';
COMMENT ON COLUMN refused_import.folder IS 'Whole path of the folder (no unit)';
COMMENT ON COLUMN refused_import.campaign IS 'Name of the campaign, NULL where the folder did not tell (no unit)';
COMMENT ON COLUMN refused_import.machine IS 'Name of the machine, NULL where the folder did not tell (no unit)';
COMMENT ON COLUMN refused_import.fault_count IS 'How many faults it had (no unit)';
COMMENT ON COLUMN refused_import.faults IS 'The first faults: file, line, column and what would be right (no unit)';
COMMENT ON COLUMN refused_import.software_version IS 'Version of the software that refused it (no unit)';

CREATE TABLE refusal_cleared (
    refusal_id INTEGER PRIMARY KEY,
    campaign VARCHAR NOT NULL,
    cleared_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE refusal_cleared IS 'Refusals whose folder, or campaign, was imported well later.';
COMMENT ON COLUMN refusal_cleared.refusal_id IS 'The refusal that is settled (no unit)';
COMMENT ON COLUMN refusal_cleared.campaign IS 'Name of the campaign that was imported (no unit)';
COMMENT ON COLUMN refusal_cleared.cleared_at IS 'When it was imported (UTC)';

CREATE VIEW v_refused_imports AS
SELECT r.refusal_id, r.refused_at,
       r.refused_at + to_microseconds(CAST(round(r.utc_offset_s * 1000000) AS BIGINT)) AS refused_at_local,
       r.folder, r.campaign, r.machine, r.fault_count, r.faults, c.campaign AS imported_as, c.cleared_at
FROM refused_import AS r LEFT JOIN refusal_cleared AS c USING (refusal_id)
ORDER BY r.refusal_id;
COMMENT ON VIEW v_refused_imports IS 'Imports that were refused, and when the same folder or campaign was imported well.';
COMMENT ON COLUMN v_refused_imports.refusal_id IS 'Number of the refusal (no unit)';
COMMENT ON COLUMN v_refused_imports.refused_at IS 'When it was refused (UTC)';
COMMENT ON COLUMN v_refused_imports.refused_at_local IS 'When it was refused by the clock of the computer that imported (local time)';
COMMENT ON COLUMN v_refused_imports.folder IS 'Whole path of the folder (no unit)';
COMMENT ON COLUMN v_refused_imports.campaign IS 'Name of the campaign, NULL where the folder did not tell (no unit)';
COMMENT ON COLUMN v_refused_imports.machine IS 'Name of the machine, NULL where the folder did not tell (no unit)';
COMMENT ON COLUMN v_refused_imports.fault_count IS 'How many faults it had (no unit)';
COMMENT ON COLUMN v_refused_imports.faults IS 'The first faults: file, line, column and what would be right (no unit)';
COMMENT ON COLUMN v_refused_imports.imported_as IS 'Name of the campaign that was imported later, NULL where none was (no unit)';
COMMENT ON COLUMN v_refused_imports.cleared_at IS 'When it was imported well, NULL where it was not (UTC)';
