"""Folders whose tables come from a spreadsheet: the same campaign, to the last bit, as from plain CSV."""

from __future__ import annotations

import csv
import io
import re
import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from monitor.exceptions import CampaignError
from monitor.readers import read_campaign

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
#: One campaign of every method that has tables of its own.
FOLDERS = ("tilting-table", "load-cell", "mount-gem-28", "l-shape", "tracked-robot")


def tables(folder: Path) -> dict[str, list[list[str]]]:
    return {
        path.name: list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"))))
        for path in sorted(folder.glob("*.csv"))
    }


def german(rows: list[list[str]], mark: str = ";") -> bytes:
    """The rows as a German Excel saves "CSV UTF-8": BOM, semicolons, decimal commas, WAHR and FALSCH, CRLF."""
    words = {"true": "WAHR", "false": "FALSCH"}
    lines = [
        mark.join(re.sub(r"^([+-]?\d*)\.(\d+(e-?\d+)?)$", r"\1,\2", words.get(cell, cell)) for cell in row)
        for row in rows
    ]
    return b"\xef\xbb\xbf" + "\r\n".join([*lines, ""]).encode()


def typed(cell: str) -> Any:
    """A cell as Excel keeps it: numbers as numbers, true and false as such."""
    if cell in ("true", "false"):
        return cell == "true"
    try:
        return float(cell)
    except ValueError:
        return cell


def as_workbook(folder: Path, *, single: bool) -> None:
    """Replace the CSV files by a workbook each, or by one with a sheet each."""
    book = openpyxl.Workbook()
    book.remove(book.worksheets[0])
    for name, rows in tables(folder).items():
        if not single:
            book = openpyxl.Workbook()
        page = book.create_sheet(name.removesuffix(".csv")) if single else book.worksheets[0]
        for row in rows:
            page.append([typed(cell) for cell in row])
        if not single:
            book.save(folder / name.replace(".csv", ".xlsx"))
        (folder / name).unlink()
    if single:
        book.save(folder / "campaign.xlsx")


def assert_same(ours: Any, theirs: Any) -> None:
    """Compare what was read, but for the files themselves."""
    for name in (field for field in ours.__dataclass_fields__ if field != "files"):
        first, second = getattr(ours, name), getattr(theirs, name)
        if hasattr(first, "__dataclass_fields__"):
            assert_same(first, second)
        elif isinstance(first, np.ndarray):
            np.testing.assert_array_equal(first, second)
        elif isinstance(first, dict) or hasattr(first, "keys"):
            assert first.keys() == second.keys()
            for key in first:
                np.testing.assert_array_equal(first[key], second[key])
        else:
            assert first == second


@pytest.fixture(params=FOLDERS)
def folder(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return Path(shutil.copytree(EXAMPLES / request.param, tmp_path / request.param))


@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_german_csv_is_the_same_campaign(folder: Path, mark: str) -> None:
    original = read_campaign(folder)
    for name, rows in tables(folder).items():
        (folder / name).write_bytes(german(rows, mark))
    assert_same(read_campaign(folder), original)


@pytest.mark.parametrize("single", [True, False])
def test_a_workbook_is_the_same_campaign(folder: Path, single: bool) -> None:
    original = read_campaign(folder)
    as_workbook(folder, single=single)
    campaign = read_campaign(folder)
    assert_same(campaign, original)
    names = {file.name for file in campaign.files}
    assert ("campaign.xlsx" in names) == single
    assert not any(name.endswith(".csv") for name in names)


@pytest.mark.parametrize("single", [True, False])
def test_a_table_that_stands_in_two_files_is_refused(tmp_path: Path, single: bool) -> None:
    """The table was corrected in Excel and saved beside the CSV, which was read without a word."""
    folder = Path(shutil.copytree(EXAMPLES / "cold-cold", tmp_path / "cold-cold"))
    kept = (folder / "probings.csv").read_bytes()
    as_workbook(folder, single=single)
    (folder / "probings.csv").write_bytes(kept)
    other = "campaign.xlsx" if single else "probings.xlsx"
    with pytest.raises(CampaignError, match=rf"this table stands in probings.csv and in {other}; take away"):
        read_campaign(folder)
    # Other tables may come from the workbook, and notes beside a table are no table.
    (folder / "probings.csv").unlink()
    assert read_campaign(folder).name == "cold-cold"


def mixed_marks(folder: Path, points: int) -> str:
    """What is said of a German table whose last cells of the first rows, so many, have a decimal point."""
    rows = tables(folder)["probings.csv"]
    body = [[*row[:-1], f"{row[-1].partition('.')[0]},5"] for row in rows[1:]]
    body = [[*row[:-1], row[-1].replace(",", ".")] for row in body[:points]] + body[points:]
    # Whole numbers elsewhere: the last column alone has marks.
    body = [[*(cell.partition(".")[0] for cell in row[:-1]), row[-1]] for row in body]
    (folder / "probings.csv").write_text("\n".join(";".join(row) for row in [rows[0], *body]), "utf-8")
    with pytest.raises(CampaignError, match=r"probings\.csv") as refusal:
        read_campaign(folder)
    return str(refusal.value)


def test_one_decimal_point_in_a_table_of_commas_is_named_alone(tmp_path: Path) -> None:
    """All other cells were blamed for their commas: 6 599 faults of a table with one slip."""
    folder = Path(shutil.copytree(EXAMPLES / "cold-cold", tmp_path / "cold-cold"))
    rows = tables(folder)["probings.csv"]
    head = rows[0]
    mixed = [head, [*rows[1][:-1], "1.5"], *([cell.replace(".", ",") for cell in row] for row in rows[2:])]
    mixed[1][:-1] = [cell.replace(".", ",") for cell in mixed[1][:-1]]
    (folder / "probings.csv").write_text("\n".join(";".join(row) for row in mixed), encoding="utf-8")
    with pytest.raises(CampaignError, match="was refused") as refusal:
        read_campaign(folder)
    assert [str(fault) for fault in refusal.value.faults] == [
        f"probings.csv, line 2, column {head[-1]}: '1.5' has a decimal point in a table of decimal commas; write '1,5'"
    ]


def test_where_points_are_as_frequent_as_commas_the_commas_are_named(tmp_path: Path) -> None:
    fewer, more = (
        Path(shutil.copytree(EXAMPLES / "cold-cold", tmp_path / name)) for name in ("fewer", "more")
    )
    count = len(tables(fewer)["probings.csv"]) - 1
    assert "has a decimal point in a table of decimal commas" in mixed_marks(fewer, count // 2 - 1)
    text = mixed_marks(more, count - count // 2)
    assert "it has a decimal comma" in text
    assert "table of decimal commas" not in text
    assert len(text.splitlines()) < 25


@pytest.mark.parametrize("content", [b"no workbook", b"PK\x03\x04 cut off"])
def test_a_workbook_that_is_none_beside_whole_tables_is_named(tmp_path: Path, content: bytes) -> None:
    """It was passed over without a word, though it may hold what was corrected last."""
    folder = Path(shutil.copytree(EXAMPLES / "cold-cold", tmp_path / "cold-cold"))
    (folder / "campaign.xlsx").write_bytes(content)
    with pytest.raises(CampaignError, match=r"campaign\.xlsx: this is no workbook of Excel") as refusal:
        read_campaign(folder)
    assert "take it away" in str(refusal.value)
    assert len(refusal.value.faults) == 1


def test_a_workbook_whose_sheet_is_damaged_is_refused_in_words(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(EXAMPLES / "load-cell", tmp_path / "load-cell"))
    as_workbook(folder, single=False)
    path = folder / "data.xlsx"
    with zipfile.ZipFile(path) as packed:
        sheet = packed.getinfo("xl/worksheets/sheet1.xml")
    content = bytearray(path.read_bytes())
    start = sheet.header_offset + 60
    content[start : start + 40] = bytes(40)
    path.write_bytes(content)
    with pytest.raises(CampaignError, match=r"data\.xlsx: this is no workbook of Excel .* that can be read"):
        read_campaign(folder)


@pytest.mark.parametrize(
    ("part", "sound", "changed"),
    [
        (
            "xl/worksheets/sheet1.xml",
            b"summaryRight",
            b"summiryRight",
        ),  # TypeError of openpyxl, as its sheets are read
        ("xl/styles.xml", b"<color theme", b"<color tHeme"),  # TypeError, as it is opened
    ],
)
def test_a_workbook_with_xml_that_openpyxl_does_not_know_is_refused_in_words(
    tmp_path: Path, part: str, sound: bytes, changed: bytes
) -> None:
    folder = Path(shutil.copytree(EXAMPLES / "load-cell", tmp_path / "load-cell"))
    as_workbook(folder, single=False)
    path = folder / "data.xlsx"
    with zipfile.ZipFile(path) as packed:
        parts = {name: packed.read(name) for name in packed.namelist()}
    assert sound in parts[part]
    parts[part] = parts[part].replace(sound, changed, 1)
    with zipfile.ZipFile(path, "w") as packed:
        for name, content in parts.items():
            packed.writestr(name, content)
    with pytest.raises(CampaignError, match=r"data\.xlsx: this is no workbook of Excel .* that can be read"):
        read_campaign(folder)


def test_faults_of_a_workbook_name_its_file_and_row(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(EXAMPLES / "load-cell", tmp_path / "load-cell"))
    as_workbook(folder, single=False)
    book = openpyxl.load_workbook(folder / "data.xlsx")
    column = next(cell.column for cell in book.worksheets[0][1] if cell.value == "load_N")
    book.worksheets[0].cell(row=7, column=column, value="none")
    book.save(folder / "data.xlsx")
    with pytest.raises(CampaignError, match=r"data\.xlsx, line 7, column load_N: 'none' is not a number"):
        read_campaign(folder)


def test_faults_of_a_workbook_of_all_tables_name_the_sheet_too(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(EXAMPLES / "tilting-table", tmp_path / "tilting-table"))
    as_workbook(folder, single=True)
    book = openpyxl.load_workbook(folder / "campaign.xlsx")
    for sheet, line, name in (("runs", 3, "ambient_degC"), ("probings", 3, "x_mm")):
        column = next(cell.column for cell in book[sheet][1] if cell.value == name)
        book[sheet].cell(row=line, column=column, value="none")
    book.save(folder / "campaign.xlsx")
    with pytest.raises(CampaignError, match="'none' is not a number") as refusal:
        read_campaign(folder)
    shown = str(refusal.value)
    assert "  campaign.xlsx, sheet 'runs', line 3, column ambient_degC: 'none' is not a number" in shown
    assert "  campaign.xlsx, sheet 'probings', line 3, column x_mm: 'none' is not a number" in shown


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"PK\x03\x04 no workbook", "this is no workbook of Excel"), (b"text", "this is no workbook of Excel")],
)
def test_what_is_no_workbook_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    folder = Path(shutil.copytree(EXAMPLES / "load-cell", tmp_path / "load-cell"))
    (folder / "data.csv").unlink()
    (folder / "data.xlsx").write_bytes(content)
    with pytest.raises(CampaignError, match=words):
        read_campaign(folder)


def test_a_workbook_without_the_sheet_says_what_it_has(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(EXAMPLES / "load-cell", tmp_path / "load-cell"))
    as_workbook(folder, single=True)
    book = openpyxl.load_workbook(folder / "campaign.xlsx")
    book.worksheets[0].title = "Tabelle1"
    book.save(folder / "campaign.xlsx")
    with pytest.raises(
        CampaignError, match="there is no sheet 'data'; name the sheet of that table so; there are 'Tabelle1'"
    ):
        read_campaign(folder)


def test_a_table_in_windows_1252_is_the_same_campaign(tmp_path):
    folder = tmp_path / "folder"
    shutil.copytree(EXAMPLES / "tracked-robot", folder)
    text = (folder / "probings.csv").read_text(encoding="utf-8")
    rows = list(csv.reader(io.StringIO(text.replace(",R1,", ",Würfel,"))))
    toml = (folder / "campaign.toml").read_text(encoding="utf-8").replace('"R1"', '"Würfel"')
    (folder / "campaign.toml").write_text(toml, encoding="utf-8")
    (folder / "probings.csv").write_bytes(german(rows))
    utf8 = read_campaign(folder)
    (folder / "probings.csv").write_bytes(
        german(rows).removeprefix(b"\xef\xbb\xbf").decode().encode("cp1252")
    )
    assert_same(read_campaign(folder), utf8)
    # With commas between the cells nobody knows what wrote it.
    (folder / "probings.csv").write_bytes(text.replace("target", "zi\u00e4l", 1).encode("cp1252"))
    with pytest.raises(CampaignError, match="byte 0xe4 is not UTF-8; save the file as UTF-8 text"):
        read_campaign(folder)


@pytest.fixture
def tilting(tmp_path: Path) -> Path:
    return Path(shutil.copytree(EXAMPLES / "tilting-table", tmp_path / "tilting-table"))


@pytest.mark.parametrize("end", [";;\r\n", ";\r\n", ",,,\n"])
def test_empty_columns_at_the_right_are_no_columns(tilting: Path, end: str) -> None:
    original = read_campaign(tilting)
    for name, rows in tables(tilting).items():
        text = german(rows).decode() if end.startswith(";") else "".join(",".join(row) + "\n" for row in rows)
        (tilting / name).write_bytes(text.replace("\r\n" if end.startswith(";") else "\n", end).encode())
    assert_same(read_campaign(tilting), original)


def test_an_empty_column_with_a_cell_is_no_empty_column(tilting: Path, faults_of: Any) -> None:
    file = tilting / "runs.csv"
    head, *rows = file.read_text().splitlines()
    file.write_text("\n".join([head + ",", *(row + "," for row in rows[:-1]), rows[-1] + ",late"]) + "\n")
    assert "the header's cell 6 is empty" in faults_of(tilting)[0].message


def test_a_row_of_units_a_remark_and_an_empty_line_are_a_fault_each(tilting: Path, faults_of: Any) -> None:
    file = tilting / "probings.csv"
    head, *rows = file.read_text().splitlines()
    units = {"_mm": "mm", "_deg": "°", "_s": "s"}
    row = ",".join(
        next((unit for end, unit in units.items() if name.endswith(end)), "-") for name in head.split(",")
    )
    width = head.count(",")
    file.write_text("\n".join([head, row, *rows, "," * width, "Geprüft: Jürgen" + "," * width]) + "\n")
    faults = faults_of(tilting)
    assert [(fault.line, fault.message.split(";")[0]) for fault in faults] == [
        (2, "this is a row of units"),
        (len(rows) + 3, "the line is empty"),
        (len(rows) + 4, "this is no row of the table, only 'Geprüft: Jürgen'"),
    ]


def test_an_empty_first_line_is_told(tilting: Path, faults_of: Any) -> None:
    file = tilting / "runs.csv"
    file.write_text("\n1,2,3\n")
    assert [(fault.line, fault.message) for fault in faults_of(tilting) if fault.file == "runs.csv"] == [
        (1, "the line is empty; line 1 names the columns")
    ]
