"""Answers as tables: the main rows of each kind of answer, with the units of the columns in ``attrs``."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from datetime import date, datetime
from enum import Enum
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

from monitor.documents import inlined_parts
from monitor.exceptions import InputError
from monitor.units import column_unit

if TYPE_CHECKING:
    import pandas as pd

    from monitor.workflow.identify.answer import IdentifyAnswer
    from monitor.workflow.intake.campaigns import RunsAnswer
    from monitor.workflow.query import TableAnswer

#: Where the main rows of an answer are, the first that it has.
MAIN_ROWS = (
    "missing", "table", "parameters", "versions", "models", "effects", "runs", "campaigns", "imported",
    "selections", "certificates", "machines", "entries", "history", "events",
)  # fmt: skip
#: A table of so few rows and so many columns is wider than a notebook and is shown turned.
FEW_ROWS, MANY_COLUMNS = 5, 12
SCALARS = (str, int, float, bool, date, datetime, type(None))


def main_table(content: object) -> pd.DataFrame:
    """Return the main rows of an answer. Raises InputError where it is no list of rows."""
    # Loaded here: who asks for no table waits for no table engine.
    import pandas as pd

    if hasattr(content, "columns") and hasattr(content, "rows"):
        return table_of(content)  # type: ignore[arg-type]
    if hasattr(content, "guf"):
        return _uncertainties(content)
    for name in MAIN_ROWS:
        frame = _frame_of(_field(content, name))
        if frame is not None:
            return _with_units(frame)
    groups = _field(content, "by")
    if isinstance(groups, Mapping):
        parts = ((kind, name, part) for kind, group in groups.items() for name, part in group.items())
        return _with_units(
            pd.DataFrame([{"by": kind, "of": name, **_scalars(part)} for kind, name, part in parts])
        )
    raise InputError(f"{type(content).__name__} is no list of rows; its fields are attributes, or to_dict()")


def _field(content: object, name: str) -> object:
    """Return a field of an answer or of a record that is inlined in it; None where there is none."""
    values = (getattr(part, name, None) for part in inlined_parts(content))
    return next((value for value in values if value is not None), None)


def _frame_of(rows: object) -> pd.DataFrame | None:
    """Return records, by name or in a row, as a table; None where these are none."""
    import pandas as pd

    if isinstance(rows, Mapping) and rows:
        records = {key: _scalars(record) for key, record in rows.items()}
        return (
            _numbers_first(pd.DataFrame.from_dict(records, orient="index")) if all(records.values()) else None
        )
    if isinstance(rows, tuple) and (not rows or dataclasses.is_dataclass(rows[0])):
        frame = pd.DataFrame([_scalars(record) for record in rows])
        frame.attrs["meanings"] = dict(_clocks(rows[0])) if rows else {}
        return frame
    return None


def _clocks(record: object) -> Iterator[tuple[str, str]]:
    """Yield the name of every moment of a record, whose table has no offsets, with the clock that it is by."""
    for part in inlined_parts(record):
        hints = get_type_hints(type(part))
        for field in dataclasses.fields(part):  # type: ignore[arg-type]
            if datetime in (hints[field.name], *get_args(hints[field.name])):
                yield field.name, "in UTC" if field.metadata.get("utc") else "by the clock of the shop"


def _numbers_first(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the table with the columns that say why something is not there behind all others."""
    return frame[sorted(frame.columns, key=lambda column: str(column).startswith("why"))]


def as_text(frame: pd.DataFrame) -> str:
    """Return a table as a terminal shows it: see :func:`_shown`."""
    rows, is_turned = _shown(frame)
    if is_turned:
        rows = rows.apply(lambda column: column.str.ljust(column.str.len().max()))
    return rows.to_string(max_rows=40, line_width=120, float_format=_in_digits)


def as_html(frame: pd.DataFrame) -> str:
    """Return a table as a notebook shows it: see :func:`_shown`."""
    import pandas as pd

    rows, is_turned = _shown(frame)
    # Sentences stand whole in a table that is turned, and would make another wider still.
    with pd.option_context("display.max_colwidth", None if is_turned else 50):
        return str(rows.to_html(max_rows=60, float_format=_in_digits, notebook=True))


def _shown(frame: pd.DataFrame) -> tuple[pd.DataFrame, bool]:
    """Return a table as a screen shows it, and whether it is turned: without columns of which no row has anything; of
    few rows and many columns as text, a line for each column."""
    filled = frame.dropna(axis="columns", how="all")
    rows, columns = filled.shape
    if not FEW_ROWS >= rows > 0 or columns <= MANY_COLUMNS:
        return filled, False
    return filled.T.map(lambda cell: _in_digits(cell) if isinstance(cell, float) else str(cell)), True


def _in_digits(number: float) -> str:
    """Return a number as a screen shows it; the table itself has all its digits."""
    return f"{number:.6g}"


def table_of(answer: TableAnswer) -> pd.DataFrame:
    """Return the table of an answer that is one; ``attrs`` has what the columns mean."""
    import pandas as pd

    frame = pd.DataFrame(list(answer.rows), columns=list(answer.columns))
    for column, kind in zip(answer.columns, answer.types, strict=True):
        if kind.startswith("TIMESTAMP") or kind == "DATE":
            frame[column] = pd.to_datetime(frame[column])
    frame.attrs["meanings"] = {
        name: answer.meanings[name] for name in answer.columns if name in answer.meanings
    }
    return _with_units(frame)


def run_table(answer: RunsAnswer) -> pd.DataFrame:
    """Return the runs by number, a column for each condition."""
    import pandas as pd

    rows = [{**_scalars(run), **run.conditions} for run in answer.runs]
    frame = pd.DataFrame(rows).drop(columns=["ambient_degc"], errors="ignore")
    frame.attrs["meanings"] = dict(_clocks(answer.runs[0])) if rows else {}
    return _with_units(frame.set_index("run") if rows else frame)


def parameter_table(answer: IdentifyAnswer, *, wide: bool) -> pd.DataFrame:
    """Return the identified parameters of every run: a column each and u(...) beside it, or a row each."""
    import pandas as pd

    rows = [
        {"run": run.run, "parameter": name, "value": estimate.value, "u": estimate.u, "unit": estimate.unit}
        for run in answer.runs
        for name, estimate in run.parameters.items()
    ]
    frame = pd.DataFrame(rows, columns=["run", "parameter", "value", "u", "unit"])
    if not wide:
        return frame
    names = list(dict.fromkeys(frame["parameter"]))
    units = dict(zip(frame["parameter"], frame["unit"], strict=True))
    values = frame.pivot(index="run", columns="parameter", values="value")
    u = frame.pivot(index="run", columns="parameter", values="u")
    columns = {}
    for name in names:
        columns[name], columns[f"u({name})"] = values[name], u[name]
    table = pd.DataFrame(columns)
    table.attrs["units"] = {key: units[name] for name in names for key in (name, f"u({name})")}
    return table


def _uncertainties(answer: Any) -> pd.DataFrame:
    """Return estimate, standard and expanded uncertainty of each parameter, of the Monte Carlo where there is one."""
    import pandas as pd

    columns = {"estimate": answer.guf.estimate, "u": answer.guf.u, "expanded": answer.guf.expanded}
    if answer.mcm is not None:
        columns |= {"estimate_mcm": answer.mcm.estimate, "u_mcm": answer.mcm.u}
    frame = pd.DataFrame(columns).reindex(list(answer.parameters))
    frame["unit"] = [answer.units[name] for name in answer.parameters]
    frame.attrs["correlation"] = answer.guf.correlation
    return frame


def facts(content: object) -> dict[str, str]:
    """Return what an answer without rows says of itself: its fields of one value, and the files that it names."""
    files = _field(content, "files")
    named = {"files": ", ".join(map(str, files))} if isinstance(files, tuple) and files else {}
    plain = {name: value for name, value in _scalars(content).items() if value not in (None, "")}
    return {name: _in_digits(v) if isinstance(v, float) else str(v) for name, v in plain.items()} | named


def _scalars(record: object) -> dict[str, Any]:
    """Return the fields of a record that one cell can hold."""
    if not dataclasses.is_dataclass(record):
        return {}
    values = (
        (field.name, getattr(part, field.name))
        for part in inlined_parts(record)
        for field in dataclasses.fields(part)  # type: ignore[arg-type]
    )
    plain = ((name, value.value if isinstance(value, Enum) else value) for name, value in values)
    return {name: value for name, value in plain if isinstance(value, SCALARS)}


def _with_units(frame: pd.DataFrame) -> pd.DataFrame:
    """Note the unit of every column whose name ends in one."""
    frame.attrs["units"] = {name: unit for name in frame.columns if (unit := _unit(str(name)))}
    return frame


def _unit(column: str) -> str:
    unit = column_unit(column)
    return "" if unit is None else unit.name
