"""Campaign format 1, "Bad input": every refusal of the two CSV files, by its message, line and column."""

# ruff: noqa: E501 (one case a line)

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from monitor.readers import read_campaign

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
R, P = "runs.csv", "probings.csv"
ROW = "1,3,120.0,1,51.730164,-91.168911,115.032892,0,0,90,\n"

ONE_FAULT = [
    # a value that is not a number
    *(
        (P, "51.730164", f'"{bad}"' if "," in bad else bad, 4, "x_mm", words)
        for bad, words in (
            ("NaN", "'NaN' is not a finite number; leave out the row"),
            ("nan", "'nan' is not a finite number"),
            ("-inf", "'-inf' is not a finite number"),
            ("Infinity", "'Infinity' is not a finite number"),
            ("1e400", "'1e400' is too large for a number; a finite one is needed"),
            ("51,730164", "write a decimal point, 51.730164, and no thousands separators"),
            ("51.730.164", "'51.730.164' is not a number; write digits with a decimal point"),
            ("1,051.7", "write it without thousands separators"),
            ("1_051.7", "write it without thousands separators"),
            ("1'051.7", "write it without thousands separators"),
            ("1.051,7", "write it without thousands separators"),
            ("1\u00a0051,7", "write it without thousands separators"),
            ("\u221251.7", "its minus is a typographic sign; write the plain '-'"),
            (" 51.7", "remove the spaces around it"),
            ("", "the cell is empty; a number is needed"),
            ("\u0665\u0661", "is not a number; write digits"),
            ("0x33", "'0x33' is not a number"),
            ("fifty", "'fifty' is not a number; write digits with a decimal point, such as -12.345"),
            ("-", "'-' is not a number"),
        )
    ),
    (P, "21.561\n2,3", "warm\n2,3", 8, "x_axis_degC", "'warm' is not a number"),
    (P, "1,2,60.0,1,181.305767", "1,2,,1,181.305767", 3, "time_s", "the cell is empty; a number is needed"),
    (P, "1,2,60.0,1,181.305767", "1,2.5,60.0,1,181.305767", 3, "sequence", "'2.5' is not a whole number"),
    (P, ROW, ROW.replace("1,3,", "99999999999999999999999,3,"), 4, "run", "is not a whole number; write digits"),
    (R, "22.08", "", 2, "ambient_degC", "the cell is empty; a number is needed"),
    (R, "22.08", "inf", 2, "ambient_degC", "'inf' is not a finite number"),
    (R, "08:37:06.421766-05:00,1,", "08:37:06.421766-05:00,-1,", 2, "day", "'-1' is not a whole number"),
    (R, "08:37:06.421766-05:00,1,", "08:37:06.421766-05:00,2026-03-02,", 2, "day", "is a date; number them: 1 for the first"),
    (R, "false", "FALSE", 2, "warm_up", "'FALSE' is neither; write true or false"),
    # a length beyond the stroke; without a stroke beyond 100 m or 100 turns
    (P, "51.730164", "300.0001", 4, "x_mm", "beyond the stroke of axis X, -300 to 300 mm"),
    (P, "-7.036789,0,", "-7.036789,100.5,", 3, "b_deg", "beyond the stroke of axis B, -100 to 100 deg"),
    (P, "-91.168911", "-100000.1", 4, "y_mm", "beyond 100000 mm (no stroke is given); is its unit mm?"),
    (P, "115.032892,0,0,", "115.032892,0,36001,", 4, "c_deg", "beyond 36000 deg (no stroke is given)"),
    # an unknown target, run or axis
    (P, "1,3,120.0,1,51.730164", "1,3,120.0,9,51.730164", 4, "target", "there is no target '9'; the targets are 1, S1, S2"),
    (P, "1,3,120.0,1,51.730164", "1,3,120.0,,51.730164", 4, "target", "'' is not a name; name what was probed"),
    (P, "1,3,120.0", "7,3,120.0", 4, "run", "run 7 is not listed in runs.csv; list it there"),
    (P, "x_axis_degC", "a_deg", 1, "a_deg", "the topology has no axis for 'a_deg'; its columns are c_deg, b_deg, x_mm"),
    # a run listed twice, a sequence number twice
    (R, "22.29,\n", "22.29,\n1,2026-03-02T11:00:00-05:00,1,true,22,\n", 4, "run", "run 1 is listed twice, first on line 2; list it once"),
    (P, "1,3,120.0", "1,2,120.0", 4, "sequence", "sequence 2 stands twice in run 1, also on line 3"),
    # seen at fewer than three indexations; a bar that was never probed
    (P, "115.032892,0,0,90", "115.032892,0,-135,0", 2, "target", "run 1: ball '1' was seen at 2 indexations; probe it at 3 or more"),
    (P, "1,5,240.0,S2", "1,5,240.0,1", 2, "target", "run 1: the scale bar was never probed at 'S2'; probe both"),
    # a time that runs backwards
    (P, "1,3,120.0", "1,3,59.9", 4, "time_s", "time runs backwards in run 1: 59.9 s after 60.0 s on line 3"),
    (P, "1,3,120.0", "1,33,120.0", 4, "time_s", "time runs backwards in run 1: 120.0 s after 240.0 s on line 6"),
    (P, "1,1,0.0", "1,1,-0.1", 2, "time_s", "time_s counts from the start of the run; it must be 0 or more"),
    (R, "2026-03-02T09:50:41-05:00", "2026-03-02T09:50:41+05:00", 3, "started_at", "time runs backwards"),
    # an offset missing from a time, and other times
    (R, "41-05:00", "41", 3, "started_at", "'2026-03-02T09:50:41' has no offset from UTC; write for example 2026"),
    (R, "2026-03-02T09:50:41-05:00", "2.3.2026 09:50", 3, "started_at", "is not a time in ISO 8601 with an offset"),
    (R, "2026-03-02T09:50:41-05:00", "2026-02-30T09:50:41Z", 3, "started_at", "is not a time: day "),
    (R, "2026-03-02T09:50:41-05:00", "0001-01-01T00:00:00+14:00", 3, "started_at", "is not in the years 1900 to 2999"),
    # a unit that is not known
    (P, "x_axis_degC", "x_axis_degF", 1, "x_axis_degF", "the unit of 'x_axis_degF' is not known; did you mean 'degC'? "),
    (P, "x_axis_degC", "load_um", 1, "load_um", "end the name of a recorded column in _degC, _percent, _hPa, _min"),
    (P, "x_axis_degC", "_degC", 1, "_degC", "the unit of '_degC' is not known"),
    (R, "humidity_percent", "humidity", 1, "humidity", "the unit of 'humidity' is not known"),
    # the shape of the file
    (P, ROW, ROW.replace("51.730164", "51,730164"), 4, None, "12 cells where the header has 11; is a comma used as decimal point?"),
    (P, ROW, ROW.replace(",90,", ""), 4, None, "9 cells where the header has 11"),
    (P, ROW, ROW.replace(",0,0,90", ',0,0,"90'), 4, None, "a quote is opened and not closed on this line"),
    (P, ROW, ROW.replace("51.730164", '"51"x'), 4, None, "text follows a closing quote"),
    (P, ROW, "\n" + ROW, 4, None, "the line is empty; remove it"),
    (P, ROW, ROW.replace(",0,0", ",\r0,0"), 4, None, "a carriage return inside the line; end lines with LF or CRLF"),
    (P, "x_axis_degC", "z_mm", 1, "z_mm", "the header names the column 'z_mm' twice; name each column once"),
    (P, "x_axis_degC", "", 1, None, "the header's cell 11 is empty; name the column or remove it"),
    (P, "x_axis_degC", " x_axis_degC", 1, " x_axis_degC", "holds spaces or characters that cannot be printed"),
    (R, "2,2026-03-02T09:50:41-05:00,1,true,22.29,\n", "2,2026-03-02T09:50:41-05:00,1,true,22.29,\n3,2026-03-02T19:50:41-05:00,1,true,22,\n", 4, "run", "run 3 has no row in probings.csv; remove the run"),
    (P, ROW, ROW.replace("51.730164", "5" * 70_000), 4, None, "the line is longer than 65536 characters"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "old", "new", "line", "column", "words"), ONE_FAULT)
def test_format_1_bad_input_names_file_line_and_column(spoil, faults_of, file, old, new, line, column, words):
    faults = faults_of(spoil(file, old, new))
    assert [(fault.file, fault.line, fault.column) for fault in faults] == [(file, line, column)]
    if words is not None:
        assert words in faults[0].message


@pytest.mark.parametrize("column", ["run", "sequence", "time_s", "target", "x_mm", "z_mm", "b_deg", "c1_deg"])
def test_format_1_missing_column_of_probings(small, faults_of, column):
    path = small / P
    rows = [line.split(",") for line in path.read_text().splitlines()]
    place = rows[0].index(column)
    path.write_text("".join(",".join(row[:place] + row[place + 1 :]) + "\n" for row in rows))
    faults = faults_of(small)
    assert (faults[0].file, faults[0].line, faults[0].column) == (P, 1, column)
    assert "the column is missing; the header needs run, sequence, time_s, target" in faults[0].message


@pytest.mark.parametrize("column", ["run", "started_at", "day", "warm_up", "ambient_degC"])
def test_format_1_missing_column_of_runs(spoil, faults_of, column):
    renamed = "x_degC" if column == "ambient_degC" else f"{column}x_min"
    header = "run,started_at,day,warm_up,ambient_degC,humidity_percent"
    faults = faults_of(spoil(R, header, ",".join(renamed if c == column else c for c in header.split(","))))
    assert ("runs.csv", 1, column) in {(fault.file, fault.line, fault.column) for fault in faults}
    assert any("the column is missing" in fault.message for fault in faults)


@pytest.mark.parametrize(("file", "old", "new"), [(P, "x_mm", "X_mm"), (R, "started_at", "startet_at")])
def test_format_1_misspelt_column_is_one_fault(spoil, faults_of, file, old, new):
    (fault,) = faults_of(spoil(file, old, new))
    assert (fault.line, fault.column) == (1, old)
    assert f"the column is missing; is it '{new}'? " in fault.message


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        *((R, "ambient_degC", new) for new in ("ambient_C", "ambient")),
        *((P, "setup", new) for new in ("setups", "Setup", "setp")),
        *((P, "target", new) for new in ("targets", "Target", "targt")),
    ],
)
def test_format_1_a_misspelt_column_that_nobody_needs_is_refused(tmp_path, faults_of, file, old, new):
    """It was taken for the likely name of a missing column, which none is, and dropped without a word."""
    folder = tmp_path / "r-test"
    shutil.copytree(EXAMPLES / "r-test", folder)
    head, *lines = (folder / file).read_text().splitlines()
    if old not in head:
        head, lines = f"{head},{old}", [f"{line},T{number % 7}" for number, line in enumerate(lines)]
    (folder / file).write_text("\n".join([head.replace(old, new), *lines]) + "\n")
    (fault,) = faults_of(folder)
    assert (fault.line, fault.column) == (1, new)
    assert f"did you mean '{old}'? " in fault.message


def test_format_1_columns_without_name_and_cells_are_not_there(small):
    before = read_campaign(small)
    lines = (small / R).read_text().splitlines()
    (small / R).write_text("\n".join([lines[0] + ", ,", *(line + ",\t," for line in lines[1:])]) + "\n")
    assert read_campaign(small).runs == before.runs


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "the file is empty"),
        (b"\n\n", "the file is empty"),
        (b"\xef\xbb\xbf", "the file is empty"),
        (b"run|sequence|time_s\n1|2|3\n", "the header has one cell; separate the cells by commas"),
        (b"run,sequence\n1,\xff\n", "byte 0xff is not UTF-8; save the file as UTF-8 text"),
        (b"run,sequence\n1,\xed\xa0\x80\n", "byte 0xed is not UTF-8"),
        (b"run\x00,sequence\n", "a NUL character: this is not a text file"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "byte 0x89 is not UTF-8"),
        (b'"run,sequence\n', "the header cannot be read: a quote is opened"),
        (b"run,sequence,time_s,target,x_mm,y_mm,z_mm,b_deg,c_deg,c1_deg\n", "there is only a header"),
        (b"," * 1000 + b"\n", "the header's cell 1 is empty"),
        (b"a" * 10_000_000, "the line is longer than 65536 characters"),
        (b"a\n" * 1_000_002, "the file has more than 1000000 lines; split the campaign"),
    ],
)  # fmt: skip
def test_format_1_files_that_are_no_table(small, faults_of, content, words):
    (small / P).write_bytes(content)
    assert any(words in fault.message and fault.file == P for fault in faults_of(small))


def test_format_1_one_wrong_row_is_not_told_as_a_missing_ball_too(spoil, faults_of):
    # the row of the bar's second ball cannot be read: that the bar was not probed would be a second, false fault
    faults = faults_of(spoil(P, "1,5,240.0,S2,-150.1", "x,5,240.0,S2,-150.1"))
    assert [fault.column for fault in faults] == ["run"]
