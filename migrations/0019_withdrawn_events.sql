-- Events that should not have been recorded, as of a mistyped year: withdrawn with a reason, never deleted. The view
-- `v_events`, and all that reads events, leave them out. An entry of the audit holds whole rows of `event`, which so
-- gets no further column.

CREATE TABLE IF NOT EXISTS withdrawn_event (
    event_id INTEGER PRIMARY KEY,
    reason VARCHAR NOT NULL,
    software_version VARCHAR NOT NULL,
    withdrawn_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE withdrawn_event IS 'Events that no longer count, and why.';
COMMENT ON COLUMN withdrawn_event.event_id IS 'The event (no unit)';
COMMENT ON COLUMN withdrawn_event.reason IS 'Why it was withdrawn, in words (no unit)';
COMMENT ON COLUMN withdrawn_event.software_version IS 'Version of the software that withdrew it (no unit)';
COMMENT ON COLUMN withdrawn_event.withdrawn_at IS 'When it was withdrawn (UTC)';

CREATE OR REPLACE VIEW v_events AS
SELECT event_id, machine, happened_at,
       happened_at + to_microseconds(CAST(round(utc_offset_s * 1000000) AS BIGINT)) AS happened_at_local,
       kind, description, recorded_at
FROM event ANTI JOIN withdrawn_event USING (event_id)
ORDER BY machine, happened_at;
COMMENT ON VIEW v_events IS 'What people know of the machines, by machine and time; without what was withdrawn.';
COMMENT ON COLUMN v_events.event_id IS 'Number of the event (no unit)';
COMMENT ON COLUMN v_events.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_events.happened_at IS 'When it happened (UTC)';
COMMENT ON COLUMN v_events.happened_at_local IS 'When it happened by the shop''s clock (local time)';
COMMENT ON COLUMN v_events.kind IS 'What kind of event (no unit)';
COMMENT ON COLUMN v_events.description IS 'What happened (no unit)';
COMMENT ON COLUMN v_events.recorded_at IS 'When it was recorded (UTC)';

CREATE OR REPLACE VIEW v_withdrawn_events AS
SELECT e.machine, e.happened_at, e.kind, e.description, e.recorded_at, w.withdrawn_at, w.reason, w.event_id
FROM withdrawn_event AS w JOIN event AS e USING (event_id)
ORDER BY w.withdrawn_at, w.event_id;
COMMENT ON VIEW v_withdrawn_events IS 'Events that no longer count; their rows stay in the table.';
COMMENT ON COLUMN v_withdrawn_events.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_withdrawn_events.happened_at IS 'When it would have happened (UTC)';
COMMENT ON COLUMN v_withdrawn_events.kind IS 'What kind of event (no unit)';
COMMENT ON COLUMN v_withdrawn_events.description IS 'What was recorded (no unit)';
COMMENT ON COLUMN v_withdrawn_events.recorded_at IS 'When it was recorded (UTC)';
COMMENT ON COLUMN v_withdrawn_events.withdrawn_at IS 'When it was withdrawn (UTC)';
COMMENT ON COLUMN v_withdrawn_events.reason IS 'Why, in words (no unit)';
COMMENT ON COLUMN v_withdrawn_events.event_id IS 'Number of the event (no unit)';
