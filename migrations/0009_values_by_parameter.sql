-- The values of an identification parameter by parameter instead of run by run: the mean and variance of a parameter over
-- the runs of a campaign, which the table of the fleet is made of, are then those of one list.

CREATE TABLE by_parameter (
    identification_id INTEGER PRIMARY KEY,
    runs BIGINT[] NOT NULL,
    value DOUBLE[][] NOT NULL,
    u DOUBLE[][] NOT NULL
);
INSERT INTO by_parameter
SELECT identification_id, runs, list_transform(range(1, n + 1), lambda p: value[p:len(value):n]),
       list_transform(range(1, n + 1), lambda p: u[p:len(u):n])
FROM (
    SELECT v.*, len(i.parameters) AS n FROM identified_values AS v JOIN identification AS i USING (identification_id)
)
ORDER BY identification_id;
DROP TABLE identified_values;
ALTER TABLE by_parameter RENAME TO identified_values;
COMMENT ON TABLE identified_values IS 'The values of parameter_value, one row an identification: what the history of a machine and the table of the fleet are read from.';
COMMENT ON COLUMN identified_values.identification_id IS 'The identification that it belongs to (no unit)';
COMMENT ON COLUMN identified_values.runs IS 'Numbers of its runs in their campaign (no unit)';
COMMENT ON COLUMN identified_values.value IS 'A list for each of identification.parameters: its estimates in the order of runs, NULL where refused (mm, rad or 1)';
COMMENT ON COLUMN identified_values.u IS 'Standard uncertainties of the estimates, in the same order (mm, rad or 1)';
