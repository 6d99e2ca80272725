-- Named selections of runs: a condition on the runs of a campaign, kept under a name of the user's.
--
-- The condition is kept as typed and the runs that met it with it: what was computed from a selection can be checked
-- later, whatever a later version makes of the condition. A newer selection of the same name stands beside the older.

CREATE TABLE selection (
    selection_id INTEGER PRIMARY KEY,
    campaign_id INTEGER NOT NULL,
    selection VARCHAR NOT NULL,
    condition VARCHAR NOT NULL,
    runs BIGINT[] NOT NULL,
    software_version VARCHAR NOT NULL,
    made_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE selection IS 'A named choice of runs of a campaign; the latest of a name counts.';
COMMENT ON COLUMN selection.selection_id IS 'Number of the selection, from 1 in the order of storing (no unit)';
COMMENT ON COLUMN selection.campaign_id IS 'The campaign whose runs are chosen (no unit)';
COMMENT ON COLUMN selection.selection IS 'Name of the selection (no unit)';
COMMENT ON COLUMN selection.condition IS 'The condition as typed; each column in the unit that its name ends in (degC, percent, hPa, min), hours in h';
COMMENT ON COLUMN selection.runs IS 'Numbers of the runs that met it (no unit)';
COMMENT ON COLUMN selection.software_version IS 'Version of the software that chose the runs (no unit)';
COMMENT ON COLUMN selection.made_at IS 'When it was stored (UTC)';

CREATE VIEW v_selections AS
SELECT s.selection, c.campaign, c.machine, s.condition, s.runs, len(s.runs) AS run_count, s.made_at, s.selection_id
FROM selection AS s JOIN campaign AS c USING (campaign_id)
QUALIFY s.selection_id = max(s.selection_id) OVER (PARTITION BY s.campaign_id, s.selection)
ORDER BY c.campaign, s.selection;
COMMENT ON VIEW v_selections IS 'Named selections of runs: the latest of each campaign and name.';
COMMENT ON COLUMN v_selections.selection IS 'Name of the selection (no unit)';
COMMENT ON COLUMN v_selections.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_selections.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_selections.condition IS 'The condition as typed; each column in the unit that its name ends in (degC, percent, hPa, min), hours in h';
COMMENT ON COLUMN v_selections.runs IS 'Numbers of the runs that met it (no unit)';
COMMENT ON COLUMN v_selections.run_count IS 'How many runs met it (no unit)';
COMMENT ON COLUMN v_selections.made_at IS 'When it was stored (UTC)';
COMMENT ON COLUMN v_selections.selection_id IS 'Number of the selection (no unit)';
