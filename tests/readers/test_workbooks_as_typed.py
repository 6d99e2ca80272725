"""Workbooks as people and their programs write them: percent, formulas, cover pages, titles, names of files."""

from __future__ import annotations

import csv
import io
import re
import shutil
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import openpyxl
import pytest

from monitor.exceptions import CampaignError
from monitor.readers import read_campaign
from monitor.records import Campaign, CurveCampaign

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def rows_of(path: Path) -> list[list[Any]]:
    def typed(cell: str) -> Any:
        try:
            return float(cell)
        except ValueError:
            return {"true": True, "false": False}.get(cell, cell)

    return [[typed(cell) for cell in row] for row in csv.reader(io.StringIO(path.read_text("utf-8")))]


def as_campaign(
    folder: Path, change: Callable[[openpyxl.Workbook], None], name: str = "campaign.xlsx"
) -> Path:
    """The example tilting-table as one workbook, changed."""
    shutil.copytree(EXAMPLES / "tilting-table", folder)
    book = openpyxl.Workbook()
    book.remove(book.worksheets[0])
    for table in ("runs", "probings"):
        sheet = book.create_sheet(table)
        for row in rows_of(folder / f"{table}.csv"):
            sheet.append(row)
        (folder / f"{table}.csv").unlink()
    change(book)
    book.save(folder / name)
    return folder


def as_curve(folder: Path, change: Callable[[Any], None]) -> Path:
    shutil.copytree(EXAMPLES / "load-cell", folder)
    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    for row in rows_of(folder / "data.csv"):
        sheet.append(row)
    change(sheet)
    (folder / "data.csv").unlink()
    book.save(folder / "data.xlsx")
    return folder


def with_column(name: str, value: float, number_format: str) -> Callable[[Any], None]:
    def change(sheet: Any) -> None:
        column = sheet.max_column + 1
        sheet.cell(1, column, name)
        for line in range(2, sheet.max_row + 1):
            sheet.cell(line, column, value + 0.001 * line).number_format = number_format

    return change


def refusal_of(folder: Path) -> list[str]:
    with pytest.raises(CampaignError, match="was refused") as refusal:
        read_campaign(folder)
    return [str(fault) for fault in refusal.value.faults]


@pytest.mark.parametrize("number_format", ["0%", "0.0%", "0.00\\ %"])
def test_percent_is_what_excel_shows(tmp_path: Path, number_format: str) -> None:
    """45 % is 0.45 in the file, and was stored as 0.45 %."""
    change = with_column("humidity_percent", 0.45, number_format)
    campaign = read_campaign(as_campaign(tmp_path / "runs", lambda book: change(book["runs"])))
    assert isinstance(campaign, Campaign)
    assert [run.conditions["humidity_percent"] for run in campaign.runs[:2]] == [45.2, 45.3]
    curve = read_campaign(as_curve(tmp_path / "curve", change))
    assert isinstance(curve, CurveCampaign)
    assert curve.columns["humidity_percent"][:2].tolist() == [45.2, 45.3]


@pytest.mark.parametrize("number_format", ["General", '0.0"%"'])
def test_a_number_without_the_format_is_percent_as_it_stands(tmp_path: Path, number_format: str) -> None:
    change = with_column("humidity_percent", 45.0, number_format)
    campaign = read_campaign(as_campaign(tmp_path / "runs", lambda book: change(book["runs"])))
    assert isinstance(campaign, Campaign)
    assert campaign.runs[0].conditions["humidity_percent"] == 45.002


def test_percent_where_the_column_does_not_say_so_is_refused(tmp_path: Path) -> None:
    faults = refusal_of(as_curve(tmp_path / "curve", with_column("slip", 0.45, "0%")))
    assert faults[0].startswith(
        "data.xlsx, line 2, column slip: '45.2%' is a percentage: in a column whose name ends"
    )


def test_a_formula_without_its_result_is_named(tmp_path: Path) -> None:
    def change(book: openpyxl.Workbook) -> None:
        column = next(cell.column for cell in book["probings"][1] if cell.value == "x_mm")
        for line in (2, 3):
            book["probings"].cell(line, column, "=1*2")

    assert refusal_of(as_campaign(tmp_path / "folder", change)) == [
        f"campaign.xlsx, sheet 'probings', line {line}, column x_mm: the cell holds a formula without a stored result; "
        "open the workbook in Excel and save it there"
        for line in (2, 3)
    ]


def test_a_title_above_the_head_is_one_fault(tmp_path: Path) -> None:
    def change(book: openpyxl.Workbook) -> None:
        book["probings"].insert_rows(1)
        book["probings"]["A1"] = "Messprotokoll"

    assert refusal_of(as_campaign(tmp_path / "folder", change)) == [
        "campaign.xlsx, sheet 'probings', line 1: the head seems to be in line 2; take away what stands above it: line "
        "1 names the columns"
    ]


def test_a_cell_beside_the_table_is_no_decimal_comma(tmp_path: Path) -> None:
    def change(book: openpyxl.Workbook) -> None:
        book["probings"].cell(3, book["probings"].max_column + 2, "looked at twice")

    (fault,) = refusal_of(as_campaign(tmp_path / "folder", change))
    assert re.fullmatch(
        r"campaign\.xlsx, sheet 'probings', line 3: \d+ cells where the header has \d+", fault
    )


def test_a_cover_page_is_named_with_the_sheets_that_there_are(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(EXAMPLES / "tilting-table", tmp_path / "folder"))
    book = openpyxl.Workbook()
    book.worksheets[0].title = "Deckblatt"
    book.worksheets[0]["A1"] = "hello"
    sheet = book.create_sheet("Tabelle1")
    for row in rows_of(folder / "runs.csv"):
        sheet.append(row)
    book.save(folder / "runs.xlsx")
    (folder / "runs.csv").unlink()
    assert refusal_of(folder) == [
        "runs.xlsx: the first sheet, 'Deckblatt', was read, since none is called 'runs', and it holds no table; call "
        "the sheet of the table 'runs'; there are 'Deckblatt', 'Tabelle1'"
    ]
    sheet.title = "Runs "
    book.save(folder / "runs.xlsx")
    assert read_campaign(folder).name == "tilting-table"


@pytest.mark.parametrize("name", ["Campaign.xlsx", "campaign.xlsm", "campaign.xls", "Messung 1.xlsx"])
def test_a_workbook_of_another_name_is_told_what_it_must_be_called(tmp_path: Path, name: str) -> None:
    folder = as_campaign(tmp_path / "folder", lambda book: None)
    (folder / "campaign.xlsx").rename(folder / "x").rename(folder / name)
    (fault,) = refusal_of(folder)
    assert fault.startswith(f"{name}: a workbook with a sheet for every table is called campaign.xlsx")
    assert fault.endswith(
        "rename it" if name.endswith("xlsx") else "save it in Excel as .xlsx under such a name"
    )


@pytest.mark.parametrize("content", [b"hello", b"\xd0\xcf\x11\xe0junk", b"PK\x03\x04 cut off"])
def test_what_is_no_workbook_is_said_without_the_words_of_a_library(tmp_path: Path, content: bytes) -> None:
    folder = as_campaign(tmp_path / "folder", lambda book: None)
    (folder / "campaign.xlsx").write_bytes(content)
    (fault,) = refusal_of(folder)
    assert "that can be read: it " in fault
    assert "zip" not in fault


def test_a_date_of_excel_is_told_to_be_text(tmp_path: Path) -> None:
    def change(book: openpyxl.Workbook) -> None:
        book["runs"].cell(2, 2, datetime(2012, 3, 5, 9))

    (fault,) = refusal_of(as_campaign(tmp_path / "folder", change))
    assert "write it as text (number format Text)" in fault
    assert "a date of Excel's own holds no offset" in fault


def test_messages_of_a_workbook_name_its_sheets_alone(tmp_path: Path) -> None:
    def change(book: openpyxl.Workbook) -> None:
        book["runs"].append([9, "2013-03-05T12:00:00-05:00", 2, False, 22.0])

    (fault,) = refusal_of(as_campaign(tmp_path / "folder", change))
    assert "run 9 has no row in the sheet 'probings'" in fault
    assert ".csv" not in fault


def test_blanks_around_a_label_are_refused(tmp_path: Path) -> None:
    """They made two operators of one."""

    def change(sheet: Any) -> None:
        column = next(cell.column for cell in sheet[1] if cell.value == "operator")
        sheet.cell(4, column, " anna")

    assert refusal_of(as_curve(tmp_path / "curve", change)) == [
        "data.xlsx, line 4, column operator: the label ' anna' has blanks around it, and would be another than 'anna'; "
        "remove them"
    ]


def test_a_missing_column_is_answered_in_the_order_of_the_manual(tmp_path: Path) -> None:
    def change(book: openpyxl.Workbook) -> None:
        for cell in book["probings"][1]:
            cell.value = {"x_mm": "x_um"}.get(cell.value, cell.value)

    (fault,) = refusal_of(as_campaign(tmp_path / "folder", change))
    assert fault.endswith("the header needs run, sequence, time_s, target, x_mm, y_mm, z_mm, c_deg, a_deg")
