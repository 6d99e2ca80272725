-- A limit says what its parameter refers to, as the values do: a squareness in the frame of the machine and one against the
-- axis before it are not the same number.

CREATE OR REPLACE VIEW v_tolerances AS
SELECT t.machine, t.campaign, t.parameter, t.tolerance, p.refers_to
FROM (
    SELECT machine, campaign, parameter,
           CAST(machine_description -> 'tolerances' ->> parameter AS DOUBLE) AS tolerance
    FROM (
        SELECT machine, campaign, machine_description,
               unnest(json_keys(machine_description, '$.tolerances')) AS parameter
        FROM campaign
    )
) AS t
LEFT JOIN (
    SELECT i.campaign_id, c.campaign, f.parameter, arg_max(f.refers_to, f.identification_id) AS refers_to
    FROM parameter_frame AS f
    JOIN identification AS i USING (identification_id)
    JOIN campaign AS c USING (campaign_id)
    GROUP BY i.campaign_id, c.campaign, f.parameter
) AS p USING (campaign, parameter);
COMMENT ON VIEW v_tolerances IS 'Limits of the absolute value of a parameter, campaign by campaign.';
COMMENT ON COLUMN v_tolerances.machine IS 'Name of the machine (no unit)';
COMMENT ON COLUMN v_tolerances.campaign IS 'Name of the campaign (no unit)';
COMMENT ON COLUMN v_tolerances.parameter IS 'Name of the parameter (no unit)';
COMMENT ON COLUMN v_tolerances.tolerance IS 'Limit of the absolute value (display unit of the parameter: µm, µrad, µm/m)';
COMMENT ON COLUMN v_tolerances.refers_to IS 'What the value is relative to: machine, axis A, axis A itself; NULL before the campaign is identified (no unit)';
