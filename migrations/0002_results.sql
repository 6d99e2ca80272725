-- What was computed: models and their versions, identifications, other results, certificates. Rows are only ever
-- added: a newer result stands beside the older one.
--
-- Parameters are in internal units (mm, rad, 1); value / display_factor is the number that people see, in `unit`.

CREATE TABLE model (
    model VARCHAR NOT NULL,
    version INTEGER NOT NULL,
    parent VARCHAR,
    parent_version INTEGER,
    effects VARCHAR[] NOT NULL,
    added VARCHAR[] NOT NULL,
    removed VARCHAR[] NOT NULL,
    note VARCHAR NOT NULL,
    software_version VARCHAR NOT NULL,
    created_at TIMESTAMP NOT NULL,
    PRIMARY KEY (model, version)
);
COMMENT ON TABLE model IS 'A version of a model: the list of effects that it contains, and where it came from.';
COMMENT ON COLUMN model.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN model.version IS 'Version of the model, from 1 (no unit)';
COMMENT ON COLUMN model.parent IS 'Name of the model that it was made from, NULL for a base model (no unit)';
COMMENT ON COLUMN model.parent_version IS 'Version of the model that it was made from (no unit)';
COMMENT ON COLUMN model.effects IS 'All its effects, each written term:shape@driver (no unit)';
COMMENT ON COLUMN model.added IS 'The effects that its parent does not have (no unit)';
COMMENT ON COLUMN model.removed IS 'The effects of its parent that it does not have (no unit)';
COMMENT ON COLUMN model.note IS 'Why it was made (no unit)';
COMMENT ON COLUMN model.software_version IS 'Version of the software that made it (no unit)';
COMMENT ON COLUMN model.created_at IS 'When it was made (UTC)';

CREATE TABLE identification (
    identification_id INTEGER PRIMARY KEY,
    campaign_id INTEGER NOT NULL,
    model VARCHAR NOT NULL,
    model_version INTEGER NOT NULL,
    method VARCHAR NOT NULL,
    parameters VARCHAR[] NOT NULL,
    units VARCHAR[] NOT NULL,
    display_factors DOUBLE[] NOT NULL,
    run_count INTEGER NOT NULL,
    software_version VARCHAR NOT NULL,
    computed_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE identification IS 'One identification of the parameters of a model from the runs of a campaign.';
COMMENT ON COLUMN identification.identification_id IS 'Number of the identification, from 1 in the order of storing (no unit)';
COMMENT ON COLUMN identification.campaign_id IS 'The campaign that it was computed from (no unit)';
COMMENT ON COLUMN identification.model IS 'Name of the model (no unit)';
COMMENT ON COLUMN identification.model_version IS 'Version of the model (no unit)';
COMMENT ON COLUMN identification.method IS 'Calibration method that computed it (no unit)';
COMMENT ON COLUMN identification.parameters IS 'Names of the parameters, in the order of every covariance (no unit)';
COMMENT ON COLUMN identification.units IS 'Name of the display unit of each parameter (no unit)';
COMMENT ON COLUMN identification.display_factors IS 'Internal value of one display unit of each parameter (mm, rad or 1)';
COMMENT ON COLUMN identification.run_count IS 'How many runs it holds (no unit)';
COMMENT ON COLUMN identification.software_version IS 'Version of the software that computed it (no unit)';
COMMENT ON COLUMN identification.computed_at IS 'When it was stored (UTC)';

CREATE TABLE identified_run (
    identification_id INTEGER NOT NULL,
    run BIGINT NOT NULL,
    rms_mm DOUBLE NOT NULL,
    iterations INTEGER NOT NULL,
    degrees_of_freedom BIGINT NOT NULL,
    chi_square DOUBLE NOT NULL,
    covariance DOUBLE[] NOT NULL,
    refused JSON NOT NULL
);
COMMENT ON TABLE identified_run IS 'How well one run was fitted, and the covariance of its parameters.';
COMMENT ON COLUMN identified_run.identification_id IS 'The identification that it belongs to (no unit)';
COMMENT ON COLUMN identified_run.run IS 'Number of the run in its campaign (no unit)';
COMMENT ON COLUMN identified_run.rms_mm IS 'Root mean square of all residual components of the run (mm)';
COMMENT ON COLUMN identified_run.iterations IS 'Iterations of the solver (no unit)';
COMMENT ON COLUMN identified_run.degrees_of_freedom IS 'Observations less unknowns (no unit)';
COMMENT ON COLUMN identified_run.chi_square IS 'Sum of squared residuals, each divided by its standard uncertainty (no unit)';
COMMENT ON COLUMN identified_run.covariance IS 'Covariance of the parameters row by row, NULL where refused (products of mm, rad and 1)';
COMMENT ON COLUMN identified_run.refused IS 'Groups of parameters that the plan cannot tell apart, and why (no unit)';

CREATE TABLE parameter_value (
    identification_id INTEGER NOT NULL,
    run BIGINT NOT NULL,
    parameter VARCHAR NOT NULL,
    value DOUBLE,
    u DOUBLE,
    unit VARCHAR NOT NULL,
    display_factor DOUBLE NOT NULL
);
COMMENT ON TABLE parameter_value IS 'One parameter of one run; the displayed number is value / display_factor, in the display unit.';
COMMENT ON COLUMN parameter_value.identification_id IS 'The identification that it belongs to (no unit)';
COMMENT ON COLUMN parameter_value.run IS 'Number of the run in its campaign (no unit)';
COMMENT ON COLUMN parameter_value.parameter IS 'Name of the parameter (no unit)';
COMMENT ON COLUMN parameter_value.value IS 'Estimate, NULL where refused (mm, rad or 1)';
COMMENT ON COLUMN parameter_value.u IS 'Standard uncertainty of the estimate, NULL where refused (mm, rad or 1)';
COMMENT ON COLUMN parameter_value.unit IS 'Name of the display unit (no unit)';
COMMENT ON COLUMN parameter_value.display_factor IS 'Internal value of one display unit (mm, rad or 1)';

CREATE TABLE residual (
    identification_id INTEGER NOT NULL,
    run BIGINT NOT NULL,
    sequence BIGINT NOT NULL,
    dx_mm DOUBLE NOT NULL,
    dy_mm DOUBLE NOT NULL,
    dz_mm DOUBLE NOT NULL
);
COMMENT ON TABLE residual IS 'Vector from the fitted target to the tip at every touch, in the frame of the last work axis.';
COMMENT ON COLUMN residual.identification_id IS 'The identification that it belongs to (no unit)';
COMMENT ON COLUMN residual.run IS 'Number of the run in its campaign (no unit)';
COMMENT ON COLUMN residual.sequence IS 'Number of the touch in its run (no unit)';
COMMENT ON COLUMN residual.dx_mm IS 'X component (mm)';
COMMENT ON COLUMN residual.dy_mm IS 'Y component (mm)';
COMMENT ON COLUMN residual.dz_mm IS 'Z component (mm)';

CREATE TABLE analysis (
    analysis_id INTEGER PRIMARY KEY,
    kind VARCHAR NOT NULL,
    machine VARCHAR,
    campaign_id INTEGER,
    run BIGINT,
    model VARCHAR,
    model_version INTEGER,
    method VARCHAR NOT NULL,
    seed VARCHAR,
    document JSON NOT NULL,
    software_version VARCHAR NOT NULL,
    computed_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE analysis IS 'A computed result kept as one document: an uncertainty, a comparison, an explanation, a trend.';
COMMENT ON COLUMN analysis.analysis_id IS 'Number of the result, from 1 in the order of storing (no unit)';
COMMENT ON COLUMN analysis.kind IS 'What was computed: uncertainty, comparison, explanation, statistics, trend (no unit)';
COMMENT ON COLUMN analysis.machine IS 'The machine it is about, NULL for a whole fleet (no unit)';
COMMENT ON COLUMN analysis.campaign_id IS 'The campaign it is about, NULL for several (no unit)';
COMMENT ON COLUMN analysis.run IS 'The run it is about, NULL for all (no unit)';
COMMENT ON COLUMN analysis.model IS 'Name of the model, NULL where none was used (no unit)';
COMMENT ON COLUMN analysis.model_version IS 'Version of the model (no unit)';
COMMENT ON COLUMN analysis.method IS 'How it was computed (no unit)';
COMMENT ON COLUMN analysis.seed IS 'Seed of the random numbers in decimal digits, NULL where none were drawn (no unit)';
COMMENT ON COLUMN analysis.document IS 'The result; units are in the keys (mm, rad, s, degree Celsius where a key names none)';
COMMENT ON COLUMN analysis.software_version IS 'Version of the software that computed it (no unit)';
COMMENT ON COLUMN analysis.computed_at IS 'When it was stored (UTC)';

CREATE TABLE certificate (
    entry INTEGER PRIMARY KEY,
    number VARCHAR NOT NULL,
    state VARCHAR NOT NULL,
    campaign_id INTEGER NOT NULL,
    runs BIGINT[] NOT NULL,
    record JSON,
    pdf BLOB,
    pdf_sha256 VARCHAR,
    reason VARCHAR NOT NULL,
    replaced_by VARCHAR,
    software_version VARCHAR NOT NULL,
    made_at TIMESTAMP NOT NULL,
    previous_sha256 VARCHAR NOT NULL,
    entry_sha256 VARCHAR NOT NULL
);
COMMENT ON TABLE certificate IS 'The life of every certificate, entry by entry; each holds the hash of the entry before.';
COMMENT ON COLUMN certificate.entry IS 'Number of the entry, from 1 without a gap (no unit)';
COMMENT ON COLUMN certificate.number IS 'Number of the certificate, unique (no unit)';
COMMENT ON COLUMN certificate.state IS 'State that this entry brings: draft, issued, amended, withdrawn (no unit)';
COMMENT ON COLUMN certificate.campaign_id IS 'The campaign that it certifies (no unit)';
COMMENT ON COLUMN certificate.runs IS 'Numbers of the runs that it certifies (no unit)';
COMMENT ON COLUMN certificate.record IS 'All that the document says; units are in the keys. NULL where only the state changes';
COMMENT ON COLUMN certificate.pdf IS 'The document, byte for byte; NULL where only the state changes (no unit)';
COMMENT ON COLUMN certificate.pdf_sha256 IS 'SHA-256 of the document, hexadecimal (no unit)';
COMMENT ON COLUMN certificate.reason IS 'Why it was amended or withdrawn (no unit)';
COMMENT ON COLUMN certificate.replaced_by IS 'Number of the certificate that replaces an amended one (no unit)';
COMMENT ON COLUMN certificate.software_version IS 'Version of the software that made the entry (no unit)';
COMMENT ON COLUMN certificate.made_at IS 'When the entry was made (UTC)';
COMMENT ON COLUMN certificate.previous_sha256 IS 'Hash of the entry before, zeros for the first, hexadecimal (no unit)';
COMMENT ON COLUMN certificate.entry_sha256 IS 'SHA-256 of this entry with the hash before it, hexadecimal (no unit)';
