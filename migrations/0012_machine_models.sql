-- Which model a machine is followed and certified by. A later choice of the same machine and method stands beside the
-- earlier, and the latest counts; where there is none, it is the method's own model.

CREATE TABLE machine_model (
    choice_id INTEGER PRIMARY KEY,
    machine VARCHAR NOT NULL,
    method VARCHAR NOT NULL,
    model VARCHAR NOT NULL,
    model_version INTEGER NOT NULL,
    reason VARCHAR NOT NULL,
    software_version VARCHAR NOT NULL,
    made_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE machine_model IS 'The model that a machine is followed by, for each calibration method; the latest choice counts.';
COMMENT ON COLUMN machine_model.choice_id IS 'Number of the choice, from 1 in the order of storing (no unit)';
COMMENT ON COLUMN machine_model.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN machine_model.method IS 'The calibration method whose campaigns it is for (no unit)';
COMMENT ON COLUMN machine_model.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN machine_model.model_version IS 'Version of the model, from 1 (no unit)';
COMMENT ON COLUMN machine_model.reason IS 'Why it was chosen, in the words of the user (no unit)';
COMMENT ON COLUMN machine_model.software_version IS 'Version of the software that stored it (no unit)';
COMMENT ON COLUMN machine_model.made_at IS 'When it was stored (UTC)';

CREATE VIEW v_machine_models AS
SELECT machine, method, model, model_version, reason, made_at, choice_id
FROM machine_model
QUALIFY choice_id = max(choice_id) OVER (PARTITION BY machine, method)
ORDER BY machine, method;
COMMENT ON VIEW v_machine_models IS 'The model that each machine is followed by at present, where it is not the method''s own.';
COMMENT ON COLUMN v_machine_models.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_machine_models.method IS 'The calibration method whose campaigns it is for (no unit)';
COMMENT ON COLUMN v_machine_models.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN v_machine_models.model_version IS 'Version of the model (no unit)';
COMMENT ON COLUMN v_machine_models.reason IS 'Why it was chosen (no unit)';
COMMENT ON COLUMN v_machine_models.made_at IS 'When it was stored (UTC)';
COMMENT ON COLUMN v_machine_models.choice_id IS 'Number of the choice (no unit)';
