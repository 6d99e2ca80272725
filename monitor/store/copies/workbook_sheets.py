"""The tables of a workbook for people: parameters wide and long, runs, conditions, changes, and any other view.

A header says the unit behind a slash (``EXX / µm/m``, ISO 80000-1, 7.1.4); times are in UTC.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from datetime import datetime
from typing import Any

from monitor.exceptions import NotFoundError, did_you_mean
from monitor.store.connection import Database

#: Ends of names of columns, and the units that they stand for.
_UNITS = {
    "mm": "mm", "um": "µm", "deg": "°", "degC": "°C", "degc": "°C", "s": "s", "min": "min", "percent": "%",
    "hPa": "hPa",
}  # fmt: skip
#: The sheet of events and of changes that were computed.
CHANGES = "changes"
_WHERE = "WHERE $machine IS NULL OR machine = $machine"


@dataclass(frozen=True)
class Sheet:
    """One table: ``columns`` are its headers with units, ``meanings`` what each column holds (may be empty)."""

    name: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]
    meanings: tuple[str, ...]


def header(column: str, comment: str = "") -> str:
    """The header of a column: its name and unit, ``ambient / °C`` of ``ambient_degC``, ``started_at / UTC``."""
    if "(UTC" in comment:
        return f"{column} / UTC"
    stem, _, suffix = column.rpartition("_")
    return f"{stem} / {_UNITS[suffix]}" if stem and suffix in _UNITS else column


@dataclass(frozen=True)
class ComputedChange:
    """A row of the sheet ``changes`` that no person recorded: a change of a parameter, or that there is none.

    ``at`` is in UTC without an offset; ``what`` says in words what the row means.
    """

    machine: str
    at: datetime | None
    kind: str
    parameter: str | None = None
    size: float | None = None
    u: float | None = None
    unit: str | None = None
    p_value: float | None = None
    what: str = ""


def sheets(
    db: Database, names: Sequence[str] | None, machine: str | None, computed: Sequence[ComputedChange]
) -> tuple[Sheet, ...]:
    """The sheets of these names, of all machines or one. Without names those that people ask for first.

    ``computed`` are the changes for the sheet of that name. Raises NotFoundError, listing what is there, for a name
    that is neither one of ``SHEETS``, nor ``changes``, nor a view.
    """
    views = [
        name
        for (name,) in db.rows(
            "SELECT view_name FROM duckdb_views() WHERE NOT internal AND starts_with(view_name, 'v_') ORDER BY ALL"
        )
    ]
    sheets = []
    for name in (*SHEETS, CHANGES) if names is None else names:
        view = name if name in views else f"v_{name}"
        if name == CHANGES:
            sheets.append(_changes(db, machine, computed))
        elif name in SHEETS:
            sheets.append(SHEETS[name](db, machine))
        elif view in views:
            sheets.append(_view(db, view, machine))
        else:
            every = [*SHEETS, CHANGES, *views]
            hint = did_you_mean(name, every)
            raise NotFoundError(f"there is no table {name!r}; {hint}there are {', '.join(every)}")
    return tuple(sheets)


def _view(db: Database, view: str, machine: str | None, name: str | None = None) -> Sheet:
    """A view as it stands, without the columns of maps, which have no cell."""
    described = db.rows(
        "SELECT column_name, data_type, coalesce(comment, '') FROM duckdb_columns() WHERE table_name = ? "
        "AND database_name = current_database() ORDER BY column_index",
        [view],
    )
    plain = [(column, comment) for column, kind, comment in described if not kind.startswith("MAP")]
    listed = ", ".join(f'"{column}"' for column, _ in plain)
    # The names come from the catalogue.
    if any(column == "machine" for column, _ in plain):
        rows = db.rows(f"SELECT {listed} FROM {view} {_WHERE} ORDER BY ALL", {"machine": machine})
    else:
        rows = db.rows(f"SELECT {listed} FROM {view} ORDER BY ALL")
    return Sheet(
        name or view,
        tuple(header(column, comment) for column, comment in plain),
        tuple(rows),
        tuple(comment for _, comment in plain),
    )


def _comments(db: Database, view: str, columns: Sequence[str]) -> tuple[str, ...]:
    """Return what columns of a view hold, as the database says it."""
    comments = dict(
        db.rows(
            "SELECT column_name, coalesce(comment, '') FROM duckdb_columns() WHERE table_name = ? "
            "AND database_name = current_database()",
            [view],
        )
    )
    return tuple(comments[column] for column in columns)


def _parameters_long(db: Database, machine: str | None) -> Sheet:
    return _view(db, "v_parameters", machine, "parameters long")


def _parameters(db: Database, machine: str | None) -> Sheet:
    """A row for every run of every model, an estimate and its standard uncertainty a parameter."""
    keys = ("campaign", "machine", "model", "model_version", "run", "started_at", "day", "warm_up")
    # Machines of several topologies may have a parameter that refers to different axes.
    columns = db.rows(
        "SELECT parameter, unit, string_agg(DISTINCT refers_to, ' or ' ORDER BY refers_to) "
        f"FROM v_parameters {_WHERE} GROUP BY ALL ORDER BY ALL",
        {"machine": machine},
    )
    places = {(parameter, unit): index for index, (parameter, unit, _) in enumerate(columns)}
    table: dict[tuple[Any, ...], list[Any]] = {}
    for *key, parameter, unit, value, u in db.rows(
        f"SELECT {', '.join(keys)}, parameter, unit, value, u FROM v_parameters {_WHERE} "
        "ORDER BY started_at, campaign, run, model, model_version",
        {"machine": machine},
    ):
        row = table.setdefault(tuple(key), [None] * (2 * len(columns)))
        index = 2 * places[parameter, unit]
        row[index : index + 2] = [value, u]
    heads = [text for name, unit, _ in columns for text in (f"{name} / {unit}", f"u({name}) / {unit}")]
    meanings = [
        text
        for *_, frame in columns
        for text in (
            "Estimate, empty where refused" + (f"; refers to: {frame}" if frame else ""), "Standard uncertainty",
        )
    ]  # fmt: skip
    return Sheet(
        "parameters",
        tuple(f"{key} / UTC" if key == "started_at" else key for key in keys) + tuple(heads),
        tuple((*key, *row) for key, row in table.items()),
        _comments(db, "v_parameters", keys) + tuple(meanings),
    )


def _runs(db: Database, machine: str | None) -> Sheet:
    return _view(db, "v_runs", machine, "runs")


def _conditions(db: Database, machine: str | None) -> Sheet:
    """A row for every run, a column for every condition that any run recorded."""
    keys = ("campaign", "machine", "run", "started_at")
    recorded = db.rows(
        f"SELECT {', '.join(keys)}, conditions FROM v_runs {_WHERE} ORDER BY campaign, run",
        {"machine": machine},
    )
    names = sorted({name for *_, conditions in recorded for name in conditions or {}})
    rows = tuple((*key, *((conditions or {}).get(name) for name in names)) for *key, conditions in recorded)
    columns = ("campaign", "machine", "run", "started_at / UTC", *map(header, names))
    meanings = _comments(db, "v_runs", keys) + ("Condition of the run",) * len(names)
    return Sheet("conditions", columns, rows, meanings)


#: Columns of the changes, and what each holds.
_CHANGES = {
    "machine": "Machine id",
    "at / UTC": "When an event happened, or the first run after a change (of trend and transient the first run of all)",
    "kind": "step, slope, trend, transient: a change in a parameter; event: what somebody recorded; none: no change",
    "parameter": "Geometric error that changed, empty of an event",
    "size": "Size of the change, empty of an event",
    "u": "Standard uncertainty of the size",
    "unit of size and u": "Unit of the size and of its uncertainty",
    "p": "Probability that a series without a change shows as much",
    "what": "Description of an event, or where a change comes from",
}


def _changes(db: Database, machine: str | None, computed: Sequence[ComputedChange]) -> Sheet:
    """What people recorded of the machines, and the changes that were computed from their runs."""
    events = db.rows(
        "SELECT machine, happened_at, 'event: ' || kind, NULL, NULL, NULL, NULL, NULL, description "
        f"FROM v_events {_WHERE}",
        {"machine": machine},
    )
    rows = [*events, *map(astuple, computed)]
    # What has no time, that nothing changed, stands behind the rows of its machine.
    rows.sort(key=lambda row: (row[0], row[1] is None, row[1] or datetime.min, row[3] or ""))
    return Sheet(CHANGES, tuple(_CHANGES), tuple(rows), tuple(_CHANGES.values()))


#: The sheets that people ask for first, by name, but for the last: `changes`.
SHEETS: dict[str, Callable[[Database, str | None], Sheet]] = {
    "parameters": _parameters,
    "parameters long": _parameters_long,
    "runs": _runs,
    "conditions": _conditions,
}
