"""Machines whose latest campaign contradicts the model that their numbers come from, over the whole fleet."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.records import Verdict
from monitor.store.connection import Database
from monitor.store.machine_models import NUMBERED

# From what speaks against a machine, which is rare, to the machines that have any, and of these alone to the campaign
# that counts: the latest that is identified by the model that its numbers come from.
_LATEST = f"""
WITH suspect AS ({{suspect}}), own AS (
    SELECT model, max(version) AS version FROM model
    WHERE model IN (SELECT model FROM model WHERE version = 1 AND parent IS NULL) GROUP BY model
), chosen AS (
    -- Of each campaign the identification with the most runs, the later of two: what load_identification takes.
    SELECT c.machine, c.campaign_id, c.campaign,
           max((CAST(i.run_count AS BIGINT) << 32) | i.identification_id) & 4294967295 AS identification_id
    FROM identification AS i
    JOIN campaign AS c USING (campaign_id)
    SEMI JOIN suspect USING (machine)
    LEFT JOIN ({NUMBERED}) AS f ON f.machine = c.machine AND f.method = c.method
    LEFT JOIN own AS o ON o.model = i.method
    WHERE CASE WHEN $model IS NULL
          -- That which its numbers come from, else the latest version of the method's own.
          THEN i.model = coalesce(f.model, i.method)
               AND i.model_version = coalesce(f.model_version, o.version, i.model_version)
          ELSE i.model = $model AND ($version IS NULL OR i.model_version = $version) END
    GROUP BY ALL
), latest AS (
    SELECT c.machine, arg_max(c.campaign_id, (r.started_at, c.campaign_id)) AS campaign_id
    FROM chosen AS c JOIN run AS r USING (campaign_id) GROUP BY c.machine
)
"""

_REFUTED = (
    _LATEST.format(
        suspect="""
    SELECT DISTINCT c.machine
    FROM lack_of_fit JOIN identification USING (identification_id) JOIN campaign AS c USING (campaign_id)
    WHERE p_value < $level
"""
    )
    + """
SELECT c.machine, c.campaign, i.model, i.model_version, l.p_value
FROM chosen AS c
SEMI JOIN latest USING (machine, campaign_id)
JOIN identification AS i ON i.identification_id = c.identification_id
JOIN lack_of_fit AS l ON l.identification_id = c.identification_id
WHERE l.p_value < $level ORDER BY c.machine
"""
)

# The residuals of the last identified run of the latest campaign, over what its readings are stated to scatter by.
_CONTRADICTED = (
    _LATEST.format(
        suspect="""
    SELECT DISTINCT c.machine
    FROM identified_run JOIN identification USING (identification_id) JOIN campaign AS c USING (campaign_id)
    WHERE chi_square > $times * $times * degrees_of_freedom AND ($machine IS NULL OR machine = $machine)
"""
    )
    + """
, last AS (
    SELECT c.machine, c.campaign, c.identification_id, arg_max(f.run, r.started_at) AS run
    FROM chosen AS c
    SEMI JOIN latest USING (machine, campaign_id)
    JOIN identified_run AS f ON f.identification_id = c.identification_id
    JOIN run AS r ON r.campaign_id = c.campaign_id AND r.run = f.run
    GROUP BY ALL
)
SELECT machine, campaign, model, model_version, run, sqrt(chi_square / degrees_of_freedom)
FROM last JOIN identified_run USING (identification_id, run) JOIN identification USING (identification_id)
WHERE degrees_of_freedom > 0 AND chi_square > $times * $times * degrees_of_freedom ORDER BY machine
"""
)


@dataclass(frozen=True)
class RefutedMachine:
    """A machine whose latest ``campaign`` refutes a ``version`` of its ``model``: ``p_value`` of lack of fit."""

    machine: str
    campaign: str
    model: str
    version: int
    p_value: float


def refuted_machines(
    db: Database, level: float, model: str | None = None, version: int | None = None
) -> tuple[RefutedMachine, ...]:
    """The machines whose latest identified campaign refutes its model at a ``level``, by name.

    Without ``model`` that which the numbers of each machine come from. Reads what was stored with the identifications.
    """
    rows = db.rows(_REFUTED, {"level": level, "model": model, "version": version})
    return tuple(RefutedMachine(*row) for row in rows)


@dataclass(frozen=True)
class ContradictingMachine:
    """A machine of which the last ``run`` of its latest ``campaign`` contradicts what is stated of its readings: under
    a ``version`` of its ``model`` the residuals are ``times`` what the stated uncertainties leave."""

    machine: str
    campaign: str
    model: str
    version: int
    run: int
    times: float


def contradicting_machines(
    db: Database,
    times: float,
    model: str | None = None,
    version: int | None = None,
    machine: str | None = None,
) -> tuple[ContradictingMachine, ...]:
    """The machines whose last identified run has residuals of more than ``times`` what is stated, by name.

    Without ``model`` under that which the numbers of each machine come from; of one ``machine`` alone where named.
    Of a single run, too, which nothing else judges. Reads what was stored with the identifications.
    """
    asked = {"times": times, "model": model, "version": version, "machine": machine}
    return tuple(ContradictingMachine(*row) for row in db.rows(_CONTRADICTED, asked))


# The latest campaign of each machine by its runs, and of its comparisons under the model that its numbers come from
# the latest: what `compare`, `explain`, the page of the model or a weekly report stored.
_UNEXPLAINED = f"""
WITH own AS (
    SELECT model, max(version) AS version FROM model
    WHERE model IN (SELECT model FROM model WHERE version = 1 AND parent IS NULL) GROUP BY model
), judged AS (
    SELECT campaign_id, model, model_version, analysis_id, document ->> 'verdict' AS verdict
    FROM analysis WHERE kind = 'comparison' AND campaign_id IS NOT NULL
), latest AS (
    SELECT c.machine, arg_max(c.campaign_id, (r.started_at, c.campaign_id)) AS campaign_id
    FROM campaign AS c JOIN run AS r USING (campaign_id)
    SEMI JOIN (SELECT machine FROM judged JOIN campaign USING (campaign_id)) USING (machine) GROUP BY c.machine
)
SELECT c.machine, arg_max(c.campaign, j.analysis_id)
FROM latest JOIN campaign AS c USING (campaign_id) JOIN judged AS j USING (campaign_id)
LEFT JOIN ({NUMBERED}) AS f ON f.machine = c.machine AND f.method = c.method
LEFT JOIN own AS o ON o.model = c.method
WHERE j.model = coalesce(f.model, c.method)
      AND j.model_version = coalesce(f.model_version, o.version, j.model_version)
GROUP BY c.machine HAVING arg_max(j.verdict, j.analysis_id) = $missing ORDER BY c.machine
"""


def unexplained_machines(db: Database) -> dict[str, str]:
    """Return by machine its latest campaign, where the latest stored comparison says that something is missing.

    A campaign that nobody compared is not judged: the sums of the fleet do not compare.
    """
    return dict(db.rows(_UNEXPLAINED, {"missing": Verdict.SOMETHING_IS_MISSING.value}))
