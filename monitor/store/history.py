"""The history of one machine: every run of every campaign with its parameters and conditions, in order of time.

Arrays for the statistics, read in two queries; people read the same numbers in the view ``v_parameters``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.store.catalogue import check_machine
from monitor.store.connection import Database

_RUNS = """
WITH chosen AS (
    -- Of each campaign the identification with the most runs, the later of two: what load_identification takes.
    SELECT i.campaign_id,
           max((CAST(i.run_count AS BIGINT) << 32) | i.identification_id) & 4294967295 AS identification_id
    FROM identification AS i JOIN campaign AS c USING (campaign_id)
    WHERE c.machine = $machine AND (i.model = $model OR $model IS NULL AND i.model = i.method)
      AND ($version IS NULL OR i.model_version = $version)
    GROUP BY i.campaign_id
)
SELECT h.identification_id, c.campaign, r.run, r.started_at, r.utc_offset_s, r.day, r.warm_up, r.conditions, c.method
FROM chosen AS h JOIN campaign AS c USING (campaign_id) JOIN run AS r USING (campaign_id)
WHERE r.started_at >= $since OR $since IS NULL
ORDER BY r.started_at, h.identification_id, r.run
"""

_VALUES = """
SELECT v.identification_id, v.run, v.parameter, v.value / v.display_factor AS value, v.u / v.display_factor AS u, v.unit
FROM parameter_value AS v
WHERE v.identification_id IN ({marks}) AND v.value IS NOT NULL
"""

_TOLERANCES = """
WITH latest AS (
    SELECT c.machine, arg_max(c.campaign_id, (r.latest, c.campaign_id)) AS campaign_id
    FROM campaign AS c
    LEFT JOIN (
        SELECT campaign_id, max(started_at) AS latest FROM run
        WHERE $machine IS NULL OR campaign_id IN (SELECT campaign_id FROM campaign WHERE machine = $machine)
        GROUP BY campaign_id
    ) AS r USING (campaign_id)
    WHERE $machine IS NULL OR c.machine = $machine
    GROUP BY c.machine
)
SELECT machine, parameter, CAST(machine_description -> 'tolerances' ->> parameter AS DOUBLE) AS tolerance
FROM (
    SELECT l.machine, c.machine_description, unnest(json_keys(c.machine_description, '$.tolerances')) AS parameter
    FROM latest AS l JOIN campaign AS c USING (campaign_id)
)
ORDER BY ALL
"""

_CHANNELS = """
SELECT c.campaign, p.run, e.key AS channel, avg(e.value) AS value
FROM (SELECT campaign_id, run, unnest(map_entries(channels)) AS e FROM probing
      WHERE campaign_id IN (SELECT campaign_id FROM campaign WHERE machine = $machine)) AS p
JOIN campaign AS c USING (campaign_id)
WHERE e.value IS NOT NULL
GROUP BY ALL ORDER BY ALL
"""


@dataclass(frozen=True)
class MachineHistory:
    """n runs and p parameters of one machine, in display units (µm, µrad, µm/m), runs in order of time.

    ``started_at`` keeps the shop's offset; ``method`` (n,) is that of the run's campaign; ``values`` and ``u`` (n, p)
    are NaN where a parameter was refused; ``conditions`` name to (n,): those of the runs and the means over each run of
    the recorded channels, in the unit that the name ends in, NaN where not recorded. ``tolerances`` are those of the
    machine's latest campaign.
    """

    machine: str
    campaign: npt.NDArray[np.str_]
    method: npt.NDArray[np.str_]
    run: npt.NDArray[np.int64]
    started_at: tuple[datetime, ...]
    day: npt.NDArray[np.int64]
    warm_up: npt.NDArray[np.bool_]
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    u: Array
    conditions: Mapping[str, Array]
    tolerances: Mapping[str, float]

    @property
    def seconds(self) -> Array:
        """Start of each run in seconds since 1970 (n,)."""
        return np.array([at.timestamp() for at in self.started_at])


def machine_history(
    db: Database,
    machine: str,
    *,
    model: str | None = None,
    version: int | None = None,
    parameter: str | None = None,
    since: datetime | None = None,
) -> MachineHistory:
    """All identified runs of a machine under one model (by default the method's own), from ``since`` on.

    May hold no run. Raises NotFoundError for a machine that is not there.
    """
    check_machine(db, machine)
    start = None if since is None else since.astimezone(UTC).replace(tzinfo=None)
    rows = db.rows(_RUNS, {"machine": machine, "model": model, "version": version, "since": start})
    place = {(row[0], row[2]): i for i, row in enumerate(rows)}
    names, units, values, u = _values(db, place, parameter)
    campaign = np.array([row[1] for row in rows], dtype=np.str_)
    run = np.array([row[2] for row in rows], dtype=np.int64)
    return MachineHistory(
        machine=machine,
        campaign=campaign,
        method=np.array([row[8] for row in rows], dtype=np.str_),
        run=run,
        started_at=tuple(
            row[3].replace(tzinfo=UTC).astimezone(timezone(timedelta(seconds=row[4]))) for row in rows
        ),
        day=np.array([row[5] for row in rows], dtype=np.int64),
        warm_up=np.array([row[6] for row in rows], dtype=np.bool_),
        parameters=names,
        units=units,
        values=values,
        u=u,
        conditions=_conditions(db, machine, [row[7] for row in rows], campaign, run),
        tolerances={name: limit for (_, name), limit in latest_tolerances(db, machine).items()},
    )


def unidentified_campaigns(
    db: Database, machine: str, model: str | None = None, version: int | None = None
) -> tuple[str, ...]:
    """Campaigns of a machine of which no identification under the model holds every run, in order of import."""
    return tuple(
        name
        for (name,) in db.rows(
            """
            SELECT c.campaign FROM campaign AS c
            LEFT JOIN identification AS i ON i.campaign_id = c.campaign_id
                AND (i.model = $model OR $model IS NULL AND i.model = i.method)
                AND ($version IS NULL OR i.model_version = $version)
            LEFT JOIN (
                SELECT campaign_id, count(*) AS runs FROM run
                WHERE campaign_id IN (SELECT campaign_id FROM campaign WHERE machine = $machine) GROUP BY campaign_id
            ) AS r ON r.campaign_id = c.campaign_id
            WHERE c.machine = $machine
            GROUP BY c.campaign_id, c.campaign, r.runs
            HAVING coalesce(max(i.run_count), 0) < r.runs
            ORDER BY c.campaign_id
            """,
            {"machine": machine, "model": model, "version": version},
        )
    )


def _values(
    db: Database, place: dict[tuple[int, int], int], parameter: str | None
) -> tuple[tuple[str, ...], tuple[str, ...], Array, Array]:
    numbers = sorted({number for number, _ in place})
    if not numbers:
        return (), (), np.zeros((0, 0)), np.zeros((0, 0))
    # Constants prune the blocks of rows that hold none of them; a joined table of numbers does not.
    found = db.arrays(_VALUES.format(marks=", ".join("?" * len(numbers))), numbers)
    data = {name: np.ma.getdata(column) for name, column in found.items()}
    if parameter is not None:
        wanted = data["parameter"].astype(np.str_) == parameter
        data = {name: column[wanted] for name, column in data.items()}
    names, first, column = np.unique(
        data["parameter"].astype(np.str_), return_index=True, return_inverse=True
    )
    values = np.full((len(place), len(names)), np.nan)
    u = np.full_like(values, np.nan)
    keys = zip(data["identification_id"].tolist(), data["run"].tolist(), strict=True)
    rows = np.array([place.get(key, -1) for key in keys], dtype=np.int64)
    # A run before `since` has values, but no place.
    kept = rows >= 0
    values[rows[kept], column[kept]] = data["value"][kept]
    u[rows[kept], column[kept]] = data["u"][kept]
    units = tuple(str(data["unit"][i]) for i in first)
    return tuple(str(name) for name in names), units, values, u


def _conditions(
    db: Database,
    machine: str,
    recorded: list[dict[str, float]],
    campaign: npt.NDArray[np.str_],
    run: npt.NDArray[np.int64],
) -> dict[str, Array]:
    found: dict[str, Array] = {}
    for i, conditions in enumerate(recorded):
        for name, value in conditions.items():
            found.setdefault(name, np.full(len(run), np.nan))[i] = value
    place = {(str(c), int(r)): i for i, (c, r) in enumerate(zip(campaign, run, strict=True))}
    for name_of, number, channel, value in db.rows(_CHANNELS, {"machine": machine}):
        row = place.get((name_of, number))
        if row is not None:
            found.setdefault(channel, np.full(len(run), np.nan))[row] = value
    return found


def latest_tolerances(db: Database, machine: str | None = None) -> dict[tuple[str, str], float]:
    """Limits of the absolute value by machine and parameter, in display units, as each latest campaign states them."""
    return {
        (name, parameter): float(limit)
        for name, parameter, limit in db.rows(_TOLERANCES, {"machine": machine})
    }
