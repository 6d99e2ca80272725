"""The workbook for people, read back from its XML without the library that wrote it, against SQL."""

from __future__ import annotations

import re
import zipfile
from datetime import datetime, timedelta
from pathlib import Path
from xml.etree import ElementTree

import pytest

from monitor.exceptions import InputError, NotFoundError
from monitor.store import Database, export_tables, export_workbook, record_event

MAIN = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
#: Day 0 of Excel's dates, so that 1 March 1900 and later agree (ECMA-376, 18.17.4.1).
EPOCH = datetime(1899, 12, 30)


def cells(path: Path, sheet: str) -> list[list[str | float | None]]:
    """The cells of a sheet by rows, texts and numbers as they stand in the file."""
    with zipfile.ZipFile(path) as archive:
        book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
        names = [node.attrib["name"] for node in book.iter(f"{MAIN}sheet")]
        page = ElementTree.fromstring(archive.read(f"xl/worksheets/sheet{names.index(sheet) + 1}.xml"))
        shared: list[str] = []
        if "xl/sharedStrings.xml" in archive.namelist():
            strings = ElementTree.fromstring(archive.read("xl/sharedStrings.xml"))
            shared = ["".join(text.text or "" for text in node.iter(f"{MAIN}t")) for node in strings]
    rows: list[list[str | float | None]] = []
    for row in page.iter(f"{MAIN}row"):
        values: list[str | float | None] = []
        for cell in row:
            letters = re.sub(r"\d", "", cell.attrib["r"])
            column = 0
            for letter in letters:
                column = 26 * column + ord(letter) - 64
            values += [None] * (column - 1 - len(values))
            assert cell.find(f"{MAIN}f") is None, "a formula"
            text = "".join(node.text or "" for node in cell.iter() if node.tag in (f"{MAIN}v", f"{MAIN}t"))
            kind = cell.attrib.get("t")
            number = float(text) if text and kind not in ("s", "inlineStr") else None
            values.append(shared[int(text)] if kind == "s" else text if kind == "inlineStr" else number)
        rows.append(values)
    return rows


def test_parameters_runs_and_conditions_are_those_of_the_views(filled: Database, tmp_path: Path) -> None:
    path = export_workbook(filled, tmp_path / "shop.xlsx")
    head, *rows = cells(path, "parameters")
    long = {
        (run, f"{name} / {unit}"): (value, u, started)
        for run, name, unit, value, u, started in filled.rows(
            "SELECT run, parameter, unit, value, u, started_at FROM v_parameters"
        )
    }
    assert {name for _, name in long} == set(head[8::2])
    run, at = head.index("run"), head.index("started_at / UTC")
    for row in rows:
        row += [None] * (len(head) - len(row))
        for index in range(8, len(head), 2):
            value, u, started = long[int(row[run]), head[index]]
            name, unit = head[index].split(" / ")
            # openpyxl writes 16 digits, one more than Excel shows.
            for cell, number in ((row[index], value), (row[index + 1], u)):
                assert cell is None if number is None else cell == pytest.approx(number, rel=2e-16, abs=0)
            assert head[index + 1] == f"u({name}) / {unit}"
            assert abs(EPOCH + timedelta(days=row[at]) - started) < timedelta(milliseconds=1)
    assert len(cells(path, "parameters long")) == 1 + len(long)
    ((count,),) = filled.rows("SELECT count(*) FROM v_runs")
    assert len(cells(path, "runs")) == len(cells(path, "conditions")) == 1 + count
    assert "ambient / °C" in cells(path, "conditions")[0]
    assert ["parameters", "run"] in [row[:2] for row in cells(path, "about")]


def test_text_is_never_a_formula(filled: Database, tmp_path: Path) -> None:
    ((machine,),) = filled.rows("SELECT DISTINCT machine FROM v_runs")
    record_event(filled, machine, datetime.fromisoformat("2026-03-04T07:00+01:00"), "repair", "=1+1\x01")
    path = export_workbook(filled, tmp_path / "shop.xlsx", ["changes"])
    assert cells(path, "changes")[1][-1] == "=1+1\N{REPLACEMENT CHARACTER}"


def test_one_machine_and_chosen_tables(filled: Database, tmp_path: Path) -> None:
    ((machine,),) = filled.rows("SELECT DISTINCT machine FROM v_runs")
    path = export_workbook(filled, tmp_path / "one.xlsx", ["campaigns", "runs"], machine)
    assert len(cells(path, "v_campaigns")) == 2
    with pytest.raises(NotFoundError, match="there is no machine"):
        export_workbook(filled, tmp_path / "other.xlsx", None, "nope")
    with pytest.raises(NotFoundError, match="there is no table 'paramters'; did you mean 'parameters'"):
        export_workbook(filled, tmp_path / "other.xlsx", ["paramters"])
    with pytest.raises(InputError, match=r"one\.xlsx is there already"):
        export_workbook(filled, path)
    written = export_tables(filled, tmp_path / "csv", tables=["runs", "v_parameters"], machine=machine)
    assert [file.name for file in written] == ["v_runs.csv", "v_parameters.csv", "columns.csv"]
    with pytest.raises(NotFoundError, match="there is no table 'runn'; did you mean 'run'"):
        export_tables(filled, tmp_path / "no", tables=["runn"])
    assert not (tmp_path / "no").exists()


def test_every_column_of_every_sheet_for_people_has_a_meaning(filled: Database, tmp_path: Path) -> None:
    path = export_workbook(filled, tmp_path / "shop.xlsx")
    about = cells(path, "about")[4:]
    sheets = {"parameters", "parameters long", "runs", "conditions", "changes"}
    assert {str(row[0]) for row in about} == sheets
    assert [row for row in about if len(row) < 3 or not row[2]] == []
    for sheet in sheets:
        assert [row[1] for row in about if row[0] == sheet] == cells(path, sheet)[0]
