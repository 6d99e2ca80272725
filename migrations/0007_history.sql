-- The history of one machine without looking through those of all others: its campaigns, their runs and identifications by
-- an index, and the values of an identification in one row that its primary key finds. `parameter_value` holds the same
-- numbers a row each, for people and for sums over the fleet: there the rows of one machine lie scattered over the weeks.

CREATE INDEX campaign_of_machine ON campaign (machine);
CREATE INDEX run_of_campaign ON run (campaign_id);
CREATE INDEX identification_of_campaign ON identification (campaign_id);

CREATE TABLE identified_values (
    identification_id INTEGER PRIMARY KEY,
    runs BIGINT[] NOT NULL,
    value DOUBLE[] NOT NULL,
    u DOUBLE[] NOT NULL
);
COMMENT ON TABLE identified_values IS 'The values of parameter_value, one row an identification: what the history of one machine is read from.';
COMMENT ON COLUMN identified_values.identification_id IS 'The identification that it belongs to (no unit)';
COMMENT ON COLUMN identified_values.runs IS 'Numbers of its runs in their campaign (no unit)';
COMMENT ON COLUMN identified_values.value IS 'Estimates run by run, in each the parameters in the order of identification.parameters, NULL where refused (mm, rad or 1)';
COMMENT ON COLUMN identified_values.u IS 'Standard uncertainties of the estimates, in the same order (mm, rad or 1)';

INSERT INTO identified_values
SELECT identification_id, list_filter(runs, lambda run, i: (i - 1) % n = 0), value, u
FROM (
    SELECT identification_id, any_value(len(parameters)) AS n, list(run ORDER BY run, place) AS runs,
           list(value ORDER BY run, place) AS value, list(u ORDER BY run, place) AS u
    FROM (
        SELECT v.*, parameters, list_position(parameters, parameter) AS place
        FROM parameter_value AS v JOIN identification USING (identification_id)
    )
    GROUP BY identification_id
)
ORDER BY identification_id;
