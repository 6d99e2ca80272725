"""The history of one machine: every run of every campaign with its parameters and conditions, in order of time.

Arrays for the statistics; people read the same numbers in the view ``v_parameters``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.sources import CommonQuantity
from monitor.store.catalogue import campaigns_of_machine
from monitor.store.connection import Database
from monitor.store.past.common_parts import parts_of
from monitor.store.past.identified_values import IdentifiedValues, values_of
from monitor.store.past.instruments import Calibrations, measured_by
from monitor.store.past.machine_runs import RecordedRun, runs_of_campaigns
from monitor.store.type_tolerances import types_in_use
from monitor.units import CONDITION_SUFFIXES

#: So many runs of a machine have to remain for those while it warms up to be left out: fewer are not searched for
#: changes.
FEWEST_STEADY = 6

# Only numbers are looked through for the whole fleet; a key, alone in its condition, finds the heads, which are long.
_IDENTIFICATIONS = """
SELECT identification_id
FROM identification JOIN (SELECT unnest(CAST(? AS INTEGER[])) AS campaign_id) USING (campaign_id)
"""

_HEADS = """
SELECT model, model_version, method, campaign_id, run_count, identification_id, parameters, units, display_factors
FROM identification WHERE identification_id IN ({marks})
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

_LACK_OF_FIT = "SELECT identification_id, p_value FROM lack_of_fit WHERE identification_id IN ({marks})"

_CHANNELS = """
SELECT campaign_id, run, e.key AS channel, avg(e.value) AS value
FROM (SELECT campaign_id, run, unnest(map_entries(channels)) AS e FROM probing WHERE campaign_id IN ({marks}))
WHERE e.value IS NOT NULL
GROUP BY ALL ORDER BY ALL
"""


@dataclass(frozen=True)
class CampaignFit:
    """How the readings of a campaign judge the ``model`` (a version of it) that its values come from.

    ``lack_of_fit_p`` is the probability of as much lack of fit where the model is right; None where nothing could be
    compared.
    """

    model: str
    version: int
    lack_of_fit_p: float | None


@dataclass(frozen=True)
class _Identified:
    """The head of an identification: its model, its number, of how many runs it is, and its parameters."""

    model: str
    version: int
    runs: int
    number: int
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    factors: tuple[float, ...]


@dataclass(frozen=True)
class MachineHistory:
    """The n runs and p parameters of one machine, in display units (µm, µrad, µm/m), runs in order of time.

    ``started_at`` keeps the shop's offset; ``method`` (n,) is that of the run's campaign, ``measured_by`` (n,) the same
    with the instruments of the campaign where its setups name them; ``values`` and ``u`` (n, p)
    are NaN where a parameter was refused; ``conditions`` name to (n,): those of the runs and the means over each run of
    the recorded ``channels`` (names), in the unit that the name ends in, NaN where not recorded. ``tolerances``
    are those of the machine's latest campaign. ``unidentified`` names the campaigns, in order of import,
    of which no identification under the model holds every run; ``campaigns`` are the number and name of all that count,
    in the same order. ``common_parts`` are what values (n, p) have of each calibrated quantity that outlasts a
    campaign, 0 for runs that do not rest on it. ``fits`` by campaign say whether its readings refute the model, where
    that was looked for: none for identifications of older versions. ``calibrations`` are those of the instruments.
    """

    machine: str
    campaigns: Mapping[int, str]
    campaign: npt.NDArray[np.str_]
    method: npt.NDArray[np.str_]
    measured_by: npt.NDArray[np.str_]
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
    channels: frozenset[str] = frozenset()
    fits: Mapping[str, CampaignFit] = field(default_factory=dict)
    common_parts: Mapping[CommonQuantity, Array] = field(default_factory=dict)
    calibrations: Calibrations = field(default_factory=Calibrations)

    @cached_property
    def seconds(self) -> Array:
        """Start of each run in seconds since 1970 (n,)."""
        return np.array([at.timestamp() for at in self.started_at])

    @property
    def true_conditions(self) -> dict[str, Array]:
        """The conditions without what instruments read and how a surface lay: of the recorded channels those alone that
        have the unit of a condition."""
        return {
            name: values
            for name, values in self.conditions.items()
            if name not in self.channels or name.rpartition("_")[2] in CONDITION_SUFFIXES
        }

    def own_copy(self, parameter: str | None = None) -> MachineHistory:
        """Return the history with arrays of its own, of one parameter (none where the history lacks it) or of all."""
        columns = [j for j, name in enumerate(self.parameters) if parameter in (None, name)]
        return replace(
            self,
            parameters=tuple(self.parameters[j] for j in columns),
            units=tuple(self.units[j] for j in columns),
            values=np.array(self.values[:, columns], order="C"),
            u=np.array(self.u[:, columns], order="C"),
            conditions={name: values.copy() for name, values in self.conditions.items()},
            common_parts={
                quantity: np.array(parts[:, columns], order="C")
                for quantity, parts in self.common_parts.items()
            },
        )

    def part(self, mask: npt.NDArray[np.bool_]) -> MachineHistory:
        """The runs of a mask (n,), with all parameters, tolerances and campaigns."""
        if mask.all():
            return self
        return replace(
            self,
            campaign=self.campaign[mask],
            method=self.method[mask],
            measured_by=self.measured_by[mask],
            run=self.run[mask],
            started_at=tuple(at for at, selected in zip(self.started_at, mask, strict=True) if selected),
            day=self.day[mask],
            warm_up=self.warm_up[mask],
            values=self.values[mask],
            u=self.u[mask],
            conditions={name: values[mask] for name, values in self.conditions.items()},
            common_parts={quantity: parts[mask] for quantity, parts in self.common_parts.items()},
        )


def machine_history(
    db: Database,
    machine: str,
    *,
    model: str | None = None,
    version: int | None = None,
    parameter: str | None = None,
    since: datetime | None = None,
    followed_by: Mapping[str, tuple[str, int]] = MappingProxyType({}),
    has_parts: bool = True,
) -> MachineHistory:
    """All identified runs of a machine under one model, from ``since`` on; its ``common_parts`` where asked for.

    Without ``model`` that of the run's method in ``followed_by`` (name and version), else any version of the method's
    own. May hold no run. Raises NotFoundError for a machine that is not there.
    """
    if since is None:
        key = ("history", machine, model, version, tuple(sorted(followed_by.items())), has_parts)
        whole = db.recall(key, lambda: _read(db, machine, model, version, None, None, followed_by, has_parts))
        return whole.own_copy(parameter)
    return _read(db, machine, model, version, parameter, since, followed_by, has_parts)


def _read(
    db: Database,
    machine: str,
    model: str | None,
    version: int | None,
    parameter: str | None,
    since: datetime | None,
    followed_by: Mapping[str, tuple[str, int]],
    has_parts: bool,
) -> MachineHistory:
    campaigns = campaigns_of_machine(db, machine)
    identified = _identified(db, list(campaigns), None if model is None else (model, version), followed_by)
    recorded = runs_of_campaigns(db, campaigns)
    runs = [
        run
        for run in recorded
        if run.campaign_id in identified and (since is None or run.started_at >= since)
    ]
    rows = {(identified[run.campaign_id].number, run.run): row for row, run in enumerate(runs)}
    names, units, values, u = _values(db, identified.values(), rows, parameter)
    conditions, channels = _conditions(db, runs)
    methods, calibrations = measured_by(db, runs, [head.number for head in identified.values()])
    latest = max(recorded, key=lambda run: (run.started_at, run.campaign_id), default=None)
    return MachineHistory(
        machine=machine,
        campaigns={number: name for number, (name, _) in campaigns.items()},
        campaign=np.array([run.campaign for run in runs], dtype=np.str_),
        method=np.array([run.method for run in runs], dtype=np.str_),
        measured_by=methods,
        run=np.array([run.run for run in runs], dtype=np.int64),
        started_at=tuple(run.started_at for run in runs),
        day=np.array([run.day for run in runs], dtype=np.int64),
        warm_up=np.array([run.warm_up for run in runs], dtype=np.bool_),
        parameters=names,
        units=units,
        values=values,
        u=u,
        conditions=conditions,
        tolerances=_tolerances_of(db, max(campaigns, default=0) if latest is None else latest.campaign_id),
        unidentified=_unidentified(campaigns, recorded, identified),
        channels=channels,
        fits=_fits(db, campaigns, identified),
        common_parts=_common_parts(db, identified.values(), rows, names, has_parts=has_parts),
        calibrations=calibrations,
    )


def _common_parts(
    db: Database,
    identified: Iterable[_Identified],
    rows: Mapping[tuple[int, int], int],
    names: tuple[str, ...],
    *,
    has_parts: bool,
) -> dict[CommonQuantity, Array]:
    """What the values (n, p) of the history have of each calibrated quantity, in display units, where asked for."""
    at = {name: column for column, name in enumerate(names)}
    heads = {head.number: head for head in identified if has_parts}
    places: dict[int, tuple[list[int], list[int], Array]] = {}
    for number, head in heads.items():
        read = [index for index, name in enumerate(head.parameters) if name in at]
        places[number] = read, [at[head.parameters[index]] for index in read], np.array(head.factors)[read]
    parts: dict[CommonQuantity, Array] = {}
    for (number, run), of_run in parts_of(db, list(heads)).items():
        read, columns, factors = places[number]
        for quantity, part in of_run.items() if (number, run) in rows else ():
            whole = parts.setdefault(quantity, np.zeros((len(rows), len(names))))
            whole[rows[number, run], columns] = np.nan_to_num(part[read] / factors)
    return parts


def _fits(
    db: Database, campaigns: Mapping[int, tuple[str, str]], identified: Mapping[int, _Identified]
) -> dict[str, CampaignFit]:
    """Return how the readings of each campaign judge its model, where that was stored, in the order of import."""
    judged = dict(_with_marks(db, _LACK_OF_FIT, [head.number for head in identified.values()]))
    return {
        name: CampaignFit(
            identified[number].model, identified[number].version, judged[identified[number].number]
        )
        for number, (name, _) in campaigns.items()
        if number in identified and identified[number].number in judged
    }


def _unidentified(
    campaigns: Mapping[int, tuple[str, str]],
    recorded: Iterable[RecordedRun],
    identified: Mapping[int, _Identified],
) -> tuple[str, ...]:
    """Return the names of the campaigns of which no identification holds every run."""
    counts = Counter(run.campaign_id for run in recorded)
    return tuple(
        name
        for number, (name, _) in campaigns.items()
        if counts[number] > (identified[number].runs if number in identified else 0)
    )


def _identified(
    db: Database,
    campaigns: list[int],
    model: tuple[str, int | None] | None,
    followed_by: Mapping[str, tuple[str, int]],
) -> dict[int, _Identified]:
    """Of each campaign the identification with the most runs, the later of two: what load_identification takes."""
    if not campaigns:
        return {}
    numbers = [number for (number,) in db.rows(_IDENTIFICATIONS, [campaigns])]
    identified: dict[int, _Identified] = {}
    for of_model, of_version, method, campaign, *head in _with_marks(db, _HEADS, numbers):
        name, version = model or followed_by.get(method) or (method, None)
        if of_model != name or version not in (None, of_version):
            continue
        run_count, number, *lists = head
        current = identified.get(campaign)
        if current is None or (run_count, number) > (current.runs, current.number):
            identified[campaign] = _Identified(of_model, of_version, run_count, number, *map(tuple, lists))
    return identified


def _with_marks(db: Database, sql: str, numbers: list[int]) -> list[tuple[Any, ...]]:
    """The rows of a query with ``numbers`` among its marks: constants, for which a key is looked up."""
    return db.rows(sql.format(marks=", ".join("?" * len(numbers))), numbers) if numbers else []


@dataclass(frozen=True)
class _Block:
    """Values and u (r, k) of k parameters in r runs; ``rows`` (r,) are those of the history, -1 for a run before it."""

    unit_of: Mapping[str, str]
    rows: npt.NDArray[np.int64]
    values: Array
    u: Array


def _blocks(
    db: Database,
    identified: Iterable[_Identified],
    rows: Mapping[tuple[int, int], int],
    parameter: str | None,
) -> Iterator[_Block]:
    """Identifications under one version of a model have the same parameters: they are taken together."""
    numbers = {number for number, _ in rows}
    heads = sorted((head for head in identified if head.number in numbers), key=lambda head: head.number)
    stored = values_of(db, [head.number for head in heads]) if heads else {}
    alike: dict[tuple[tuple[str, ...], tuple[str, ...], tuple[float, ...]], list[IdentifiedValues]] = {}
    for head in heads:
        alike.setdefault((head.parameters, head.units, head.factors), []).append(stored[head.number])
    for (names, units, factors), parts in alike.items():
        values = np.concatenate([part.value for part in parts]) / np.array(factors)
        u = np.concatenate([part.u for part in parts]) / np.array(factors)
        # A parameter that was refused everywhere is none of the history.
        estimated = np.isfinite(values).any(axis=0)
        columns = [j for j, name in enumerate(names) if estimated[j] and parameter in (None, name)]
        numbered = [(part.number, run) for part in parts for run in part.runs.tolist()]
        row = np.array([rows.get(number, -1) for number in numbered])
        yield _Block({names[j]: units[j] for j in columns}, row, values[:, columns], u[:, columns])


def _values(
    db: Database,
    identified: Iterable[_Identified],
    rows: Mapping[tuple[int, int], int],
    parameter: str | None,
) -> tuple[tuple[str, ...], tuple[str, ...], Array, Array]:
    """Names, units, values and u (n, p) of the parameters that any run has; ``rows`` by identification and run."""
    blocks = list(_blocks(db, identified, rows, parameter))
    unit_of: dict[str, str] = {}
    for block in blocks:
        unit_of = {**block.unit_of, **unit_of}
    names = tuple(sorted(unit_of))
    values = np.full((len(rows), len(names)), np.nan)
    uncertainties = np.full_like(values, np.nan)
    for block in blocks:
        recorded = block.rows >= 0
        columns = np.array([names.index(name) for name in block.unit_of], dtype=np.int64)
        target = np.ix_(block.rows[recorded], columns)
        values[target] = block.values[recorded]
        uncertainties[target] = np.where(np.isnan(block.values[recorded]), np.nan, block.u[recorded])
    return names, tuple(unit_of[name] for name in names), values, uncertainties


def _conditions(db: Database, runs: list[RecordedRun]) -> tuple[dict[str, Array], frozenset[str]]:
    """Conditions of the runs and means of their channels, each (n,), and the names of the latter.

    What is recorded for a run goes before the mean of a channel of that name.
    """
    conditions: dict[str, Array] = {}
    for row, run in enumerate(runs):
        for name, value in run.conditions.items():
            conditions.setdefault(name, np.full(len(runs), np.nan))[row] = value
    of_runs = set(conditions)
    rows = {(run.campaign_id, run.run): row for row, run in enumerate(runs)}
    for campaign, number, channel, value in _with_marks(
        db, _CHANNELS, sorted({run.campaign_id for run in runs})
    ):
        if (campaign, number) not in rows:
            continue
        row = rows[campaign, number]
        means = conditions.setdefault(channel, np.full(len(runs), np.nan))
        means[row] = value if np.isnan(means[row]) else means[row]
    return conditions, frozenset(set(conditions) - of_runs)


def latest_tolerances(db: Database) -> dict[tuple[str, str], float]:
    """Limits of the absolute value by machine and parameter, in display units, as each latest campaign states them."""
    latest = f"SELECT campaign_id FROM ({_LATEST})"
    rows = db.rows(_TOLERANCES.format(latest=latest))
    stated = {(machine, parameter): float(limit) for machine, parameter, limit in rows}
    for machine, of_type in types_in_use(db, latest).items():
        stated |= {(machine, parameter): limit for parameter, limit in of_type.limits.items()}
    return stated


def tolerance_types(db: Database) -> dict[str, str]:
    """The machine type by machine, of those whose latest campaign states no tolerances and whose type has some."""
    types = types_in_use(db, f"SELECT campaign_id FROM ({_LATEST})")
    return {machine: types[machine].name for machine in sorted(types)}


def _tolerances_of(db: Database, campaign: int) -> dict[str, float]:
    rows = db.rows(_TOLERANCES.format(latest="?"), [campaign])
    stated = {parameter: float(limit) for _, parameter, limit in rows}
    for of_type in types_in_use(db, "?", [campaign]).values():
        stated |= of_type.limits
    return stated
