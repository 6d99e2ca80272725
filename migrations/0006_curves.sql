-- Curves: one response over its inputs, for load cells, resistors, thermometers. Their campaign stands among the others
-- with the method 'curve' (its instrument is no machine: it has no topology); their rows stand here. A MAP keyed by
-- column keeps one row a measurement whatever the columns are called, as for probings.

CREATE TABLE curve (
    campaign_id INTEGER PRIMARY KEY,
    response VARCHAR NOT NULL,
    base VARCHAR NOT NULL,
    time_column VARCHAR,
    standard_uncertainty DOUBLE,
    units MAP(VARCHAR, VARCHAR) NOT NULL
);
COMMENT ON TABLE curve IS 'What a curve measures, over what, and its base model.';
COMMENT ON COLUMN curve.campaign_id IS 'The campaign (no unit)';
COMMENT ON COLUMN curve.response IS 'Name of the column that was measured (no unit)';
COMMENT ON COLUMN curve.base IS 'The base model in one line (no unit)';
COMMENT ON COLUMN curve.time_column IS 'The column that says when a row was measured, NULL where the order of the rows is all (no unit)';
COMMENT ON COLUMN curve.standard_uncertainty IS 'Stated standard uncertainty of one response, in the unit that its name ends in or that units gives';
COMMENT ON COLUMN curve.units IS 'Unit of every column of numbers by name, empty where nothing says one (no unit)';

CREATE TABLE curve_row (
    campaign_id INTEGER NOT NULL,
    position INTEGER NOT NULL,
    line BIGINT NOT NULL,
    numbers MAP(VARCHAR, DOUBLE) NOT NULL,
    labels MAP(VARCHAR, VARCHAR) NOT NULL
);
COMMENT ON TABLE curve_row IS 'One row a measurement, in file order.';
COMMENT ON COLUMN curve_row.campaign_id IS 'The campaign (no unit)';
COMMENT ON COLUMN curve_row.position IS 'Place of the row in its file, from 1 (no unit)';
COMMENT ON COLUMN curve_row.line IS 'Line of the row in its file, the header being 1 (no unit)';
COMMENT ON COLUMN curve_row.numbers IS 'Numbers by column, each in the unit that its name ends in or that curve.units gives; dates in days since the first';
COMMENT ON COLUMN curve_row.labels IS 'Labels by column: probe, operator, day (no unit)';

CREATE VIEW v_curves AS
SELECT c.campaign, c.machine AS instrument, k.response, k.base, k.time_column, k.standard_uncertainty, k.units,
       r.position, r.line, r.numbers[k.response] AS measured, r.numbers, r.labels
FROM curve AS k JOIN campaign AS c USING (campaign_id) JOIN curve_row AS r USING (campaign_id)
ORDER BY c.campaign, r.position;
COMMENT ON VIEW v_curves IS 'The rows of all curves with what they measure.';
COMMENT ON COLUMN v_curves.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_curves.instrument IS 'What was calibrated or measured with (no unit)';
COMMENT ON COLUMN v_curves.response IS 'Name of the column that was measured (no unit)';
COMMENT ON COLUMN v_curves.base IS 'The base model in one line (no unit)';
COMMENT ON COLUMN v_curves.time_column IS 'The column that says when a row was measured (no unit)';
COMMENT ON COLUMN v_curves.standard_uncertainty IS 'Stated standard uncertainty of one response, in the unit that its name ends in or that units gives';
COMMENT ON COLUMN v_curves.units IS 'Unit of every column of numbers by name (no unit)';
COMMENT ON COLUMN v_curves.position IS 'Place of the row in its file, from 1 (no unit)';
COMMENT ON COLUMN v_curves.line IS 'Line of the row in its file (no unit)';
COMMENT ON COLUMN v_curves.measured IS 'The response, in the unit that its name ends in or that units gives';
COMMENT ON COLUMN v_curves.numbers IS 'Numbers by column, each in the unit that its name ends in or that units gives';
COMMENT ON COLUMN v_curves.labels IS 'Labels by column (no unit)';
