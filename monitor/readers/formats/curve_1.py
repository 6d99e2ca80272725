"""Curve folder, format 1: ``campaign.toml`` with ``method = "curve"`` and ``data.csv``."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from monitor.exceptions import CampaignError
from monitor.readers.csv_table import CsvTable, parse_csv
from monitor.readers.csv_values import numbers
from monitor.readers.curve_cells import are_dates, days_of, refuse_copies, refuse_dates, refuse_enormous
from monitor.readers.faults import Faults, near, one_of, quoted
from monitor.readers.files import LARGEST_CSV, LARGEST_TOML, decode, read_bytes
from monitor.readers.registry import Reader
from monitor.readers.toml_table import Table, parse_toml
from monitor.records import Array, CurveCampaign, Instrument, SourceFile

TOML, DATA = "campaign.toml", "data.csv"
FORMAT = 1
METHOD = "curve"
#: What a column's name may end in to say its unit; another unit is written in [curve.units].
UNITS = (
    "pm", "nm", "um", "mm", "cm", "m", "km", "in", "urad", "mrad", "rad", "deg", "arcsec", "s", "ms", "us", "min", "h",
    "d", "day", "week", "month", "year", "degC", "degF", "K", "mK", "N", "mN", "kN", "MN", "Nm", "kg", "g", "mg", "ug",
    "lbf", "Pa", "hPa", "kPa", "MPa", "bar", "mbar", "V", "mV", "uV", "nV", "A", "mA", "uA", "nA", "ohm", "mohm",
    "kohm", "Mohm", "Hz", "kHz", "MHz", "W", "mW", "J", "F", "uF", "nF", "pF", "H", "mH", "T", "mT", "dB", "lx", "cd",
    "mol", "percent", "ppm", "ppb", "counts", "rpm",
)  # fmt: skip
SAME_UNIT = {"day": "d"}
#: Units of time, in which a column says when a row was measured where it is the only one.
CLOCKS = ("ms", "s", "min", "h", "d", "week", "month", "year")
DATE_UNIT = "d"
NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)
#: A column of whole numbers without a unit that names things (operator 1 and 2) rather than counts them: at most so
#: many different ones, with so many rows each on average. Others are listed under ``groups``.
MOST_LABELS, ROWS_A_LABEL = 6, 3
RESERVED = ("sequence", "formula", "pi")


def recognises(folder: Path) -> bool:
    """Whether a folder is a curve: its file says so, or it has data.csv and no probings."""
    try:
        content = (folder / TOML).read_bytes()[:LARGEST_TOML]
        return tomllib.loads(content.decode("utf-8-sig")).get("method") == METHOD
    except (OSError, ValueError, RecursionError):
        # A damaged file: the name of the method in it, or the data beside it, say which reader should refuse it.
        if (folder / DATA).is_file() and not (folder / "probings.csv").exists():
            return True
        try:
            return (
                re.search(rb'(?m)^\s*method\s*=\s*["\']curve["\']', (folder / TOML).read_bytes()) is not None
            )
        except OSError:
            return False


@dataclass(frozen=True)
class _Told:
    """What campaign.toml says of the columns; None where nothing or something wrong."""

    response: str | None
    base: str | None
    time: str | None
    groups: tuple[str, ...]
    inputs: tuple[str, ...]
    units: dict[str, str]
    uncertainty: float | None


def read(folder: Path) -> CurveCampaign:
    """The curve of a folder; CampaignError with all faults of the folder if there are any."""
    faults = Faults((TOML, DATA))
    found = {
        name: read_bytes(folder, name, LARGEST_TOML if name == TOML else LARGEST_CSV, faults)
        for name in (TOML, DATA)
    }
    files = tuple(SourceFile(name, content) for name, content in found.items() if content is not None)
    texts = {file.name: decode(file.name, file.content, faults) for file in files}
    toml, data = texts.get(TOML), texts.get(DATA)
    top = None if toml is None else parse_toml(TOML, toml, faults)
    table = None if data is None else parse_csv(DATA, data, faults)
    name = instrument = told = None
    if top is not None:
        if top.raw("format", required=True, example=str(FORMAT)) not in (FORMAT, None):
            top.fault("format", f"this software reads format = {FORMAT}")
        name = top.text("campaign", required=True, example='"load-cell-7"')
        top.text("method", required=True, example='"curve"')
        instrument = _instrument(top, name)
        told = _told(top)
        top.finish()
    columns: dict[str, Array] = {}
    labels: dict[str, np.ndarray[tuple[int], np.dtype[np.str_]]] = {}
    units: dict[str, str] = {}
    time = None
    if table is not None and told is not None and top is not None:
        _check_names(table, faults)
        if len(table) and _check_told(top, told, table):
            columns, labels, units, time = _columns(table, told, faults)
    if len(faults):
        raise CampaignError(str(folder), faults.sorted())
    assert name is not None
    assert instrument is not None
    assert told is not None
    assert told.response is not None
    assert told.base is not None
    assert table is not None
    return CurveCampaign(
        name, METHOD, instrument, told.response, told.base, columns, labels, units, time,
        np.array(table.lines, dtype=np.int64), told.uncertainty, files,
    )  # fmt: skip


def _instrument(top: Table, name: str | None) -> Instrument | None:
    table = top.table("instrument")
    if table is None:
        # Nobody has to give a resistor a name of its own.
        return None if name is None else Instrument(name)
    identity = table.text("id", required=True, example='"LC-7"')
    words = {key: table.text(key) for key in ("manufacturer", "model", "serial_number", "location")}
    table.finish()
    return None if identity is None else Instrument(identity, **words)


def _told(top: Table) -> _Told | None:
    table = top.table("curve", required=True)
    if table is None:
        return None
    units = table.table("units")
    given: dict[str, str] = {}
    if units is not None:
        given = {key: value for key in units.data if (value := units.text(key, example='"N"')) is not None}
        units.finish()
    found = _Told(
        response=table.text("response", required=True, example='"deflection_mm"'),
        base=table.text("base", required=True, example='"deflection_mm ~ 1 + load_N"'),
        time=table.text("time", example='"date"'),
        groups=_names(table, "groups"),
        inputs=_names(table, "inputs"),
        units=given,
        uncertainty=table.number(
            "standard_uncertainty", positive=True, unit="the response's unit", example="0.001"
        ),
    )
    table.finish()
    return found


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
            told = "is a word of the language" if name in RESERVED else "is not a name that a model can use"
            faults.add(
                DATA,
                1,
                name,
                f"the column name {quoted(name)} {told}; write letters, digits and _, such as load_N",
            )


def _check_told(top: Table, told: _Told, table: CsvTable) -> bool:
    """Whether all columns that campaign.toml names are there."""
    section = Table(top.file, top.faults, {}, top._lines, ("curve",))
    wanted = [("response", told.response), ("time", told.time)]
    wanted += [("groups", name) for name in told.groups] + [("inputs", name) for name in told.inputs]
    wanted += [("units", name) for name in told.units]
    sound = told.response is not None
    for key, name in wanted:
        if name is not None and name not in table.columns:
            hint = near(name, table.columns)
            section.fault(key, f"{DATA} has no column {quoted(name)}; {hint}it has {one_of(table.columns)}")
            sound = False
    both = set(told.groups) & set(told.inputs)
    for name in sorted(both):
        section.fault(
            "groups", f"{quoted(name)} is among the inputs too; a column holds either numbers or labels"
        )
        sound = False
    for key in ("groups", "inputs"):
        if told.response in getattr(told, key):
            section.fault(key, f"{quoted(told.response)} is the response; leave it out here")
            sound = False
    return sound


Columns = tuple[
    dict[str, Array], dict[str, np.ndarray[tuple[int], np.dtype[np.str_]]], dict[str, str], str | None
]


def _columns(table: CsvTable, told: _Told, faults: Faults) -> Columns:
    """Numbers, labels, units and the column of the time."""
    columns: dict[str, Array] = {}
    labels: dict[str, np.ndarray[tuple[int], np.dtype[np.str_]]] = {}
    units: dict[str, str] = {}
    dated: list[str] = []
    # What the base model names is an input, whatever its values look like.
    numeric = {told.response, told.time, *told.inputs, *NAME.findall(told.base or "")}
    for name, cells in table.columns.items():
        days = None if name in (*told.groups, told.response) else days_of(cells)
        if days is not None:
            columns[name], units[name] = days, DATE_UNIT
            dated.append(name)
        elif name not in (*told.groups, told.response) and are_dates(cells):
            refuse_dates(table, name, faults)
        elif (
            name in told.groups
            or (_are_words(cells) and name not in (told.response, *told.inputs))
            or (name not in numeric and not _unit(name) and _are_labels(cells))
        ):
            _refuse_empty(table, name, cells, faults)
            labels[name] = np.array(cells, dtype=np.str_)
        else:
            columns[name] = numbers(table, name, faults).values
            units[name] = _unit(name)
            refuse_enormous(table, name, columns[name], faults)
    units |= told.units
    clocks = [name for name in columns if name != told.response and units[name] in CLOCKS]
    time = told.time or (dated[0] if dated else clocks[0] if len(clocks) == 1 else None)
    if told.time is not None and told.time not in columns and not are_dates(table.columns[told.time]):
        faults.add(
            DATA, 1, told.time, "the column of the time holds neither numbers nor dates such as 1980-02-05"
        )
    if not len(faults):
        refuse_copies(table, time, faults)
    if not len(faults) and told.response is not None:
        for name, values in columns.items():
            if name == told.response and np.ptp(values) == 0.0:
                faults.add(
                    DATA, None, name, "the response is the same in every row: there is nothing to explain"
                )
    return columns, labels, units, time


def _refuse_empty(table: CsvTable, name: str, cells: Sequence[str], faults: Faults) -> None:
    for line, cell in zip(table.lines, cells, strict=True):
        if not cell.strip() or not cell.isprintable():
            faults.add(DATA, line, name, "the cell is empty or cannot be printed; a label is needed")


def _are_labels(cells: Sequence[str]) -> bool:
    """Whether a column of whole numbers names things: few that come again and again."""
    values = set(cells)
    whole = all(re.fullmatch(r"[0-9]+\.?", cell) for cell in values)
    return whole and 2 <= len(values) <= min(MOST_LABELS, len(cells) / ROWS_A_LABEL)


def _are_words(cells: Sequence[str]) -> bool:
    """Whether most cells are no numbers: one mistyped number does not make a column of words."""
    return sum(_is_number(cell) for cell in cells) < len(cells) / 2


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _unit(name: str) -> str:
    stem, _, suffix = name.rpartition("_")
    return SAME_UNIT.get(suffix, suffix) if stem and suffix in UNITS else ""


READER = Reader("curve folder, format 1", recognises, read)
