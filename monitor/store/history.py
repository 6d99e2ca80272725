"""The history of one machine: every run of every campaign with its parameters and conditions, in order of time.

Arrays for the statistics; people read the same numbers in the view ``v_parameters``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.store.catalogue import campaigns_of_machine
from monitor.store.connection import Database
from monitor.store.identified_values import IdentifiedValues, values_of

# The numbers of a machine's campaigns are read once and are constants of what follows, for which there are indices: a
# joined table of numbers would be held against every row of the fleet.
_IDENTIFICATIONS = """
SELECT campaign_id, run_count, identification_id, parameters, units, display_factors
FROM identification
WHERE campaign_id IN ({marks}) AND (model = ? OR CAST(? AS VARCHAR) IS NULL AND model = method)
  AND (CAST(? AS INTEGER) IS NULL OR model_version = ?)
"""

_RUNS = """
SELECT campaign_id, run, started_at, utc_offset_s, day, warm_up, conditions FROM run WHERE campaign_id IN ({marks})
"""

_LATEST = """
SELECT c.machine, arg_max(c.campaign_id, (r.latest, c.campaign_id)) AS campaign_id
FROM campaign AS c
LEFT JOIN (SELECT campaign_id, max(started_at) AS latest FROM run GROUP BY campaign_id) AS r USING (campaign_id)
GROUP BY c.machine
"""

_TOLERANCES = """
SELECT machine, parameter, CAST(machine_description -> 'tolerances' ->> parameter AS DOUBLE) AS tolerance
FROM (
    SELECT machine, machine_description, unnest(json_keys(machine_description, '$.tolerances')) AS parameter
    FROM imported_campaign WHERE campaign_id IN ({latest})
)
ORDER BY ALL
"""

_CHANNELS = """
SELECT campaign_id, run, e.key AS channel, avg(e.value) AS value
FROM (SELECT campaign_id, run, unnest(map_entries(channels)) AS e FROM probing WHERE campaign_id IN ({marks}))
WHERE e.value IS NOT NULL
GROUP BY ALL ORDER BY ALL
"""


@dataclass(frozen=True)
class _Identified:
    """The head of an identification."""

    runs: int
    number: int
    parameters: list[str]
    units: list[str]
    factors: list[float]


@dataclass(frozen=True)
class MachineHistory:
    """n runs and p parameters of one machine, in display units (µm, µrad, µm/m), runs in order of time.

    ``started_at`` keeps the shop's offset; ``method`` (n,) is that of the run's campaign; ``values`` and ``u`` (n, p)
    are NaN where a parameter was refused; ``conditions`` name to (n,): those of the runs and the means over each run of
    the recorded channels, in the unit that the name ends in, NaN where not recorded. ``tolerances`` are those of the
    machine's latest campaign. ``unidentified`` names the campaigns, in order of import, of which no identification
    under the model holds every run; ``campaigns`` are the number and name of all that count, in the same order.
    """

    machine: str
    campaigns: Mapping[int, str]
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
    unidentified: tuple[str, ...]

    @cached_property
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
    start = None if since is None else since.astimezone(UTC).replace(tzinfo=None)
    campaigns = campaigns_of_machine(db, machine)
    chosen = _chosen(db, list(campaigns), model, version)
    every = _of(db, _RUNS, list(campaigns))
    counts = Counter(row[0] for row in every)
    rows = _ordered(every, chosen, start)
    place = {(row[0], row[2]): i for i, row in enumerate(rows)}
    names, units, values, u = _values(db, chosen.values(), place, parameter)
    run = np.array([row[2] for row in rows], dtype=np.int64)
    latest = max(every, key=lambda row: (row[2], row[0]))[0] if every else max(campaigns, default=0)
    return MachineHistory(
        machine=machine,
        campaigns={number: name for number, (name, _) in campaigns.items()},
        campaign=np.array([campaigns[row[1]][0] for row in rows], dtype=np.str_),
        method=np.array([campaigns[row[1]][1] for row in rows], dtype=np.str_),
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
        conditions=_conditions(
            db, [row[7] for row in rows], {(row[1], row[2]): i for i, row in enumerate(rows)}
        ),
        tolerances={name: limit for (_, name), limit in _tolerances(db, "?", [latest]).items()},
        unidentified=tuple(
            name
            for number, (name, _) in campaigns.items()
            if counts[number] > (chosen[number].runs if number in chosen else 0)
        ),
    )


def _of(db: Database, sql: str, numbers: list[int]) -> list[tuple[Any, ...]]:
    """The rows of a query with ``numbers`` among its marks."""
    return db.rows(sql.format(marks=", ".join("?" * len(numbers))), numbers) if numbers else []


def _chosen(
    db: Database, campaigns: list[int], model: str | None, version: int | None
) -> dict[int, _Identified]:
    """Of each campaign the identification with the most runs, the later of two: what load_identification takes."""
    if not campaigns:
        return {}
    sql = _IDENTIFICATIONS.format(marks=", ".join("?" * len(campaigns)))
    found: dict[int, _Identified] = {}
    for campaign, *row in db.rows(sql, [*campaigns, model, model, version, version]):
        one = _Identified(*row)
        if campaign not in found or (one.runs, one.number) > (found[campaign].runs, found[campaign].number):
            found[campaign] = one
    return found


def _ordered(
    every: list[tuple[Any, ...]], chosen: dict[int, _Identified], since: datetime | None
) -> list[tuple[Any, ...]]:
    """The runs with an identification, its number before them, in the order of time."""
    rows = [
        (chosen[row[0]].number, *row)
        for row in every
        if row[0] in chosen and (since is None or row[2] >= since)
    ]
    return sorted(rows, key=lambda row: (row[3], row[0], row[2]))


def _values(
    db: Database, chosen: Iterable[_Identified], place: dict[tuple[int, int], int], parameter: str | None
) -> tuple[tuple[str, ...], tuple[str, ...], Array, Array]:
    """Names, units, values and u (n, p) of the parameters that any of the runs in ``place`` has."""
    wanted = {number for number, _ in place}
    heads = sorted((one for one in chosen if one.number in wanted), key=lambda one: one.number)
    found = values_of(db, [one.number for one in heads]) if heads else {}
    # Identifications under one version of a model have the same parameters: they are taken together.
    alike: dict[tuple[tuple[str, ...], tuple[str, ...], tuple[float, ...]], list[IdentifiedValues]] = {}
    for one in heads:
        head = (tuple(one.parameters), tuple(one.units), tuple(one.factors))
        alike.setdefault(head, []).append(found[one.number])
    units: dict[str, str] = {}
    stacked = []
    for head, parts in alike.items():
        value = np.concatenate([part.value for part in parts]) / np.array(head[2])
        own_u = np.concatenate([part.u for part in parts]) / np.array(head[2])
        # A run before `since` has values, but no place.
        rows = np.array(
            [place.get((part.number, run), -1) for part in parts for run in part.runs.tolist()],
            dtype=np.int64,
        )
        # A parameter that was refused everywhere is none of the history.
        known = np.isfinite(value).any(axis=0)
        here = [i for i, name in enumerate(head[0]) if known[i] and parameter in (None, name)]
        for i in here:
            units.setdefault(head[0][i], head[1][i])
        stacked.append((rows, [head[0][i] for i in here], value[:, here], own_u[:, here]))
    names = tuple(sorted(units))
    values = np.full((len(place), len(names)), np.nan)
    u = np.full_like(values, np.nan)
    for rows, own, value, own_u in stacked:
        kept = rows >= 0
        columns = np.array([names.index(name) for name in own], dtype=np.int64)
        where = np.ix_(rows[kept], columns)
        values[where] = value[kept]
        u[where] = np.where(np.isnan(value[kept]), np.nan, own_u[kept])
    return names, tuple(units[name] for name in names), values, u


def _conditions(
    db: Database, recorded: list[dict[str, float]], place: dict[tuple[int, int], int]
) -> dict[str, Array]:
    """Conditions of the runs and means of their channels; ``place`` is where the run of a campaign is."""
    found: dict[str, Array] = {}
    for i, conditions in enumerate(recorded):
        for name, value in conditions.items():
            found.setdefault(name, np.full(len(place), np.nan))[i] = value
    numbers = sorted({number for number, _ in place})
    for campaign, run, channel, value in _of(db, _CHANNELS, numbers):
        row = place.get((campaign, run))
        if row is not None:
            found.setdefault(channel, np.full(len(place), np.nan))[row] = value
    return found


def latest_tolerances(db: Database) -> dict[tuple[str, str], float]:
    """Limits of the absolute value by machine and parameter, in display units, as each latest campaign states them."""
    return _tolerances(db, f"SELECT campaign_id FROM ({_LATEST})", [])


def _tolerances(db: Database, latest: str, numbers: list[int]) -> dict[tuple[str, str], float]:
    return {
        (name, parameter): float(limit)
        for name, parameter, limit in db.rows(_TOLERANCES.format(latest=latest), numbers)
    }
