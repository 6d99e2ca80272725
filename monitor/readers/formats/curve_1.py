"""Curve folder, format 1: ``campaign.toml`` with ``method = "curve"`` and ``data.csv``."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from monitor.bounded import read_bounded
from monitor.exceptions import CampaignError, did_you_mean
from monitor.readers.campaign.curve_columns import DATA, NAME, CurveColumns, CurveSettings, read_columns
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.files import LARGEST_TOML, decode, read_bytes
from monitor.readers.registry import Reader, method_rules
from monitor.readers.tables.csv_table import CsvTable, parse_csv
from monitor.readers.tables.spreadsheet import read_table, renamed
from monitor.readers.toml_table import Table, parse_toml
from monitor.records import CurveCampaign, Instrument, SourceFile

TOML = "campaign.toml"
FORMAT = 1
METHOD = "curve"
RESERVED = ("sequence", "formula", "pi")


def recognises(folder: Path) -> bool:
    """Return whether a folder is a curve: its file says so, or it has data.csv and no probings beside a file that is
    damaged or names a method that there is not."""
    has_rows = (folder / DATA).is_file() and not (folder / "probings.csv").exists()
    try:
        content = read_bounded(folder / TOML, LARGEST_TOML)
        method = tomllib.loads(content.decode("utf-8-sig")).get("method")
        return method == METHOD or (has_rows and method not in list(method_rules()))
    except (OSError, ValueError, RecursionError):
        # A damaged file: the name of the method in it, or the data beside it, say which reader should refuse it.
        if has_rows:
            return True
        try:
            head = read_bounded(folder / TOML, LARGEST_TOML)
            return re.search(rb'(?m)^\s*method\s*=\s*["\']curve["\']', head) is not None
        except OSError:
            return False


@dataclass(frozen=True)
class _Head:
    """What campaign.toml says; None where a key is missing or wrong."""

    name: str | None = None
    instrument: Instrument | None = None
    settings: CurveSettings | None = None


def read(folder: Path) -> CurveCampaign:
    """Read the curve of a folder. Raises CampaignError with all faults of the folder."""
    faults = Faults((TOML, DATA))
    content = read_bytes(folder, TOML, LARGEST_TOML, faults)
    toml = None if content is None else decode(TOML, content, faults)
    rows = read_table(folder, DATA, faults)
    head_file = None if content is None else SourceFile(TOML, content)
    files = tuple(file for file in (head_file, rows.source) if file is not None)
    top = None if toml is None else parse_toml(TOML, toml, faults)
    table = None if rows.text is None else parse_csv(DATA, rows.text, faults, of_workbook=rows.of_workbook)
    head = _Head() if top is None else _head(top)
    columns = CurveColumns()
    if table is not None and head.settings is not None and top is not None:
        _check_names(table, faults)
        if len(table) and _check_settings(top, head.settings, table):
            columns = read_columns(table, head.settings, faults)
    if len(faults):
        raise CampaignError(str(folder), renamed(faults.sorted(), {DATA: rows}))
    return _campaign(head, table, columns, files)


def _campaign(
    head: _Head, table: CsvTable | None, columns: CurveColumns, files: tuple[SourceFile, ...]
) -> CurveCampaign:
    """Put the parts of a folder without faults together: then all of them could be read."""
    assert head.name is not None
    assert head.instrument is not None
    assert head.settings is not None
    assert head.settings.response is not None
    assert head.settings.base is not None
    assert table is not None
    return CurveCampaign(
        head.name, METHOD, head.instrument, head.settings.response, head.settings.base,
        columns.numbers, columns.labels, columns.units, columns.time,
        np.array(table.lines, dtype=np.int64), head.settings.uncertainty, files,
    )  # fmt: skip


def _head(top: Table) -> _Head:
    if top.raw("format", required=True, example=str(FORMAT)) not in (FORMAT, None):
        top.fault("format", f"this software reads format = {FORMAT}")
    name = top.text("campaign", required=True, example='"load-cell-7"')
    method = top.text("method", required=True, example='"curve"')
    if method not in (METHOD, None):
        names = [*method_rules(), METHOD]
        hint = did_you_mean(method, names)
        top.fault("method", f"method {quoted(method)} is not known; {hint}the methods are {one_of(names)}")
    instrument = _instrument(top, name)
    settings = _settings(top)
    top.finish()
    return _Head(name, instrument, settings)


def _instrument(top: Table, name: str | None) -> Instrument | None:
    table = top.table("instrument")
    if table is None:
        # A resistor needs no name beside that of its campaign.
        return None if name is None else Instrument(name)
    identity = table.text("id", required=True, example='"LC-7"')
    plate = {key: table.text(key) for key in ("manufacturer", "model", "serial_number", "location")}
    table.finish()
    return None if identity is None else Instrument(identity, **plate)


def _settings(top: Table) -> CurveSettings | None:
    table = top.table("curve", required=True)
    if table is None:
        return None
    unit_table = table.table("units")
    units: dict[str, str] = {}
    if unit_table is not None:
        units = {
            key: unit for key in unit_table.data if (unit := unit_table.text(key, example='"N"')) is not None
        }
        unit_table.finish()
    settings = CurveSettings(
        response=table.text("response", required=True, example='"deflection_mm"'),
        base=table.text("base", required=True, example='"deflection_mm ~ 1 + load_N"'),
        time=table.text("time", example='"date"'),
        groups=_names(table, "groups"),
        inputs=_names(table, "inputs"),
        units=units,
        uncertainty=table.number(
            "standard_uncertainty", positive=True, unit="the response's unit", example="0.001"
        ),
    )
    table.finish()
    return settings


def _names(table: Table, key: str) -> tuple[str, ...]:
    value = table.raw(key, required=False, example='["probe", "operator"]')
    if value is None:
        return ()
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        table.fault(
            key, f'{quoted(value)} is not a list of columns; write for example {key} = ["probe", "operator"]'
        )
        return ()
    return tuple(value)


def _check_names(table: CsvTable, faults: Faults) -> None:
    for name in table.columns:
        if not NAME.fullmatch(name) or name in RESERVED:
            fault = "is a word of the language" if name in RESERVED else "is not a name that a model can use"
            message = f"the column name {quoted(name)} {fault}; write letters, digits and _, such as load_N"
            faults.add(DATA, 1, name, message)


def _check_settings(top: Table, settings: CurveSettings, table: CsvTable) -> bool:
    """Return whether data.csv has all columns that campaign.toml names, each in one role."""
    section = top.section("curve")
    named = [("response", settings.response), ("time", settings.time)]
    named += [("groups", name) for name in settings.groups] + [("inputs", name) for name in settings.inputs]
    named += [("units", name) for name in settings.units]
    sound = settings.response is not None
    for key, name in named:
        if name is not None and name not in table.columns:
            hint = did_you_mean(name, table.columns)
            section.fault(key, f"{DATA} has no column {quoted(name)}; {hint}it has {one_of(table.columns)}")
            sound = False
    both = set(settings.groups) & set(settings.inputs)
    for name in sorted(both):
        section.fault(
            "groups", f"{quoted(name)} is among the inputs too; a column holds either numbers or labels"
        )
        sound = False
    for key, columns in (("groups", settings.groups), ("inputs", settings.inputs)):
        if settings.response in columns:
            section.fault(key, f"{quoted(settings.response)} is the response; leave it out here")
            sound = False
    return sound


READER = Reader("curve folder, format 1", recognises, read)
