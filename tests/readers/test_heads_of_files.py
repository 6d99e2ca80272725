"""What the head of an instrument's file says against its mapping, and files that end too early or hold too much."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from monitor.exceptions import CampaignError
from monitor.readers import read_campaign, read_exports
from monitor.readers.mapping.reading import Exports
from monitor.readers.row_places import RowPlaces
from monitor.records import SourceFile
from monitor.row_files import rows_in, runs_in
from monitor.workflow.intake.gross_doubts import gross_doubts
from tests.readers.test_exports import HEAD as OF_WEEK

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LASERS, PLATE = "files-as-they-come", "files-of-a-plate"
HEAD = (
    f"{OF_WEEK}\n"
    + """\
[[setups]]
id = "laser-X"
reading = "displacement"
standard_uncertainty_um = 0.3
direction = "X"

[[runs]]
started_at = 2026-03-02T20:00:00+01:00

[[exports]]
file = "laser.csv"

[exports.columns]
x_mm = "Position"
y_mm = 10.0
z_mm = 0.0
c_deg = 0.0
reading_um = { column = "Deviation", deviation = true }
"""
)


def changed(around: Path, sample: str, name: str, *changes: tuple[str, str], mapping: str = "") -> Exports:
    """Read a sample with pieces of one file exchanged, and keys of its mapping added."""
    folder = around / "changed"
    shutil.copytree(EXAMPLES / sample, folder)
    text = (folder / name).read_bytes().decode("cp1252")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    (folder / name).write_bytes(text.encode("cp1252"))
    table = (folder / "mapping.toml").read_text(encoding="utf-8")
    line = f'file = "{name}"\n'
    (folder / "mapping.toml").write_text(table.replace(line, line + mapping), encoding="utf-8")
    names = sorted(path for path in folder.iterdir() if path.name not in ("mapping.toml", "README.md"))
    return read_exports(folder / "mapping.toml", names)


def laser(around: Path, text: str | bytes, mapping: str = "") -> Exports:
    """Read one table of a laser."""
    (around / "mapping.toml").write_text(
        HEAD.replace('"laser.csv"\n', f'"laser.csv"\n{mapping}'), encoding="utf-8"
    )
    (around / "laser.csv").write_bytes(text.encode() if isinstance(text, str) else text)
    return read_exports(around / "mapping.toml", [around / "laser.csv"])


def passes(runs: int) -> str:
    """Rows of runs up and down five targets."""
    places = [0, 100, 200, 300, 400, 400, 300, 200, 100, 0]
    return "".join(
        f"{place}.0;{0.5 * row + 0.13 * run:.2f}\n" for run in range(runs) for row, place in enumerate(places)
    )


COLUMNS = "Position [mm];Deviation [um]\n"


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("laser-X.rtl", "Axis: X", "Axis: Y", "line 15, column Axis: the file says axis Y, by the mapping X moves"),
        ("laser-X.rtl", "Axis: X", "Axis: X-Axis", None),
        ("laser-X.rtl", "Axis: X", "Axis: B", "the machine has no axis B; take a file of this machine"),
        ("laser-X.rtl", "Axis: X", "Axis: diagonal", None),
        ("laser-X.rtl", "type: LINEAR", "type: ANGULAR", "line 2, column File type: the file says ANGULAR, the setup"),
        ("laser-X.rtl", "type: LINEAR", "type: ANGULAR", 'such a file is of a setup with reading = "angle"'),
        ("laser-X.rtl", "type: LINEAR", "type: STRAIGHTNESS", 'a setup with reading = "offset"'),
        ("bar-xy.bar", "100.0 mm", "150.0 mm", "line 3, column Radius: the file says 150 mm, the setup bar-xy has"),
        ("bar-xy.bar", "100.0 mm", "100.02 mm", None),
        ("bar-xy.bar", "Direction: CCW", "Plane: ZX\nDirection: CCW", "plane ZX, by the mapping Y, X move: map it"),
        ("bar-xy.bar", "Direction: CCW", "Plane: ZX\nDirection: CCW", 'a ball bar by axes = ["Z", "X"]'),
        ("bar-xy.bar", "Direction: CCW", "Plane: G18\nDirection: CCW", "the file says plane ZX"),
        ("bar-xy.bar", "Direction: CCW", "Plane: YX\nDirection: CCW", None),
    ],
)  # fmt: skip
def test_a_file_that_says_something_else_than_its_mapping_is_refused(tmp_path, name, old, new, said):
    if said is None:
        assert len(changed(tmp_path, LASERS, name, (old, new)).campaign.probings) == 806
        return
    with pytest.raises(CampaignError, match=re.escape(said)):
        changed(tmp_path, LASERS, name, (old, new))


def test_a_head_that_is_wrong_is_overruled_and_that_is_said(tmp_path):
    mapping = 'overruled = ["axis"]\n'
    read = changed(tmp_path, LASERS, "laser-X.rtl", ("Axis: X", "Axis: Y"), mapping=mapping)
    assert "laser-X.rtl: the file says Axis: Y and is overruled by the mapping" in read.notes


def test_a_radius_is_overruled_by_one_of_the_mapping_alone(tmp_path):
    mapping = 'overruled = ["radius"]\n'
    with pytest.raises(CampaignError, match="the mapping overrules the radius of the file and states none"):
        changed(tmp_path / "a", LASERS, "bar-xy.bar", ("100.0 mm", "150.0 mm"), mapping=mapping)
    read = changed(
        tmp_path / "b",
        LASERS,
        "bar-xy.bar",
        ("100.0 mm", "150.0 mm"),
        mapping=mapping + "radius_mm = 100.0\n",
    )
    assert read.campaign.probings.readings["X"].max() == pytest.approx(500.0)
    with pytest.raises(CampaignError, match=r"\['colour'\] is no list of axis, kind, plane, radius"):
        changed(tmp_path / "c", LASERS, "bar-xy.bar", mapping='overruled = ["colour"]\n')


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (11, "line 118, column Run Target Data: run 5 ends here and has target 1, 2, 3, 4, 5, ... once"),
        (5, "line 124, column Run Target Data: run 5 ends here and has target 1, 2, 3, 4, 5 once"),
        (22, "column run-count: 5 runs are announced and 4 are there"),
    ],
)
def test_a_laser_file_that_ends_between_or_within_passes_is_refused(tmp_path, rows, said):
    lines = (EXAMPLES / LASERS / "laser-X.rtl").read_text().splitlines()
    end = lines.index("EOF::")
    with pytest.raises(CampaignError, match=re.escape(said)):
        changed(tmp_path, LASERS, "laser-X.rtl", ("\n".join(lines[end - rows : end]) + "\n", ""))


def test_a_single_run_that_turns_back_and_ends_is_refused_and_one_that_turns_at_its_last_target_is_read(
    tmp_path,
):
    lines = (EXAMPLES / LASERS / "laser-X.rtl").read_text().splitlines()
    begin, end = lines.index("Run Target Data:") + 1, lines.index("EOF::")
    later = "\n".join(lines[begin + 22 : end]) + "\n"
    single = [("Run-count: 5", "Run-count: 1"), (later, "")]
    cut = "\n".join(lines[begin + 17 : begin + 22]) + "\n"
    with pytest.raises(CampaignError, match="run 1 ends here and has target 2, 3, 4, 5 once"):
        changed(tmp_path / "a", LASERS, "laser-X.rtl", *single, (cut, ""))
    # The axis turns at the last target, which is read once.
    first, second = (lines[begin + row] + "\n" for row in (10, 11))
    read = changed(tmp_path / "b", LASERS, "laser-X.rtl", *single, (first + second, first))
    assert len(read.campaign.probings) == 806 - 88 - 1


def test_runs_of_zeros_are_the_way_back_that_nobody_measured(tmp_path):
    """A writer of such files fills them in where it measured one way."""
    lines = (EXAMPLES / LASERS / "laser-X.rtl").read_text().splitlines()
    second = [line for line in lines if re.match(r"\s+2\s+[0-9]+\s", line)]
    zeros = [(line + "\n", re.sub(r"\S+$", "0", line) + "\n") for line in second]
    read = changed(tmp_path, LASERS, "laser-X.rtl", *zeros)
    assert len(read.campaign.probings) == 806 - 22
    assert any("22 rows are left out: every deviation of run 2 is 0" in note for note in read.notes)


def test_decimal_commas_and_a_second_measurement_of_a_laser_file(tmp_path):
    text = (EXAMPLES / LASERS / "laser-X.rtl").read_text()
    before = read_exports(EXAMPLES / LASERS / "mapping.toml", sorted((EXAMPLES / LASERS).glob("*.[!mt]*")))
    read = changed(tmp_path / "a", LASERS, "laser-X.rtl", (".", ","))
    assert (read.campaign.probings.readings["X"] == before.campaign.probings.readings["X"]).all()
    with pytest.raises(
        CampaignError, match=r"line 131: a second measurement begins here \(HEADER::\); split"
    ):
        changed(tmp_path / "b", LASERS, "laser-X.rtl", ("EOF::\n", "EOF::\n" + text))


def test_a_circle_that_ends_early_is_refused(tmp_path):
    text = (EXAMPLES / LASERS / "bar-xy.bar").read_text()
    rows = text.splitlines(keepends=True)
    with pytest.raises(
        CampaignError, match=r"column angle: this circle ends after [0-9]+ deg, where another of the"
    ):
        changed(tmp_path, LASERS, "bar-xy.bar", ("".join(rows[-30:]), ""))


def test_times_come_from_a_feed_in_inches_and_one_without_unit_is_said(tmp_path):
    before = changed(tmp_path / "a", LASERS, "bar-xy.bar", ("1000 mm/min", "25.4 mm/min"))
    inch = changed(tmp_path / "b", LASERS, "bar-xy.bar", ("1000 mm/min", "1 ipm"))
    assert inch.campaign.probings.time.tolist() == before.campaign.probings.time.tolist()
    none = changed(tmp_path / "c", LASERS, "bar-xy.bar", ("1000 mm/min", "1000"))
    assert any("the feed '1000' on line 4 is not in mm/min" in note for note in none.notes)


def test_angles_that_begin_anew_at_360_degrees_go_on(tmp_path):
    text = "".join(f"{angle % 360:.1f}\t1.00\n" for angle in range(180, 541, 5))
    old = (EXAMPLES / LASERS / "bar-xy.bar").read_text()
    head = "Date: 2026-03-03 08:00\nRadius: 100.0 mm\nFeed rate: 1000 mm/min\nDirection: CCW\n\n"
    read = changed(tmp_path, LASERS, "bar-xy.bar", (old, f"{head}Angle (deg)\tDeviation (um)\n{text}"))
    bar = next(file for file in read.files if file.file == "bar-xy.bar")
    times = next(column for column in bar.columns if column.column == "time_s")
    # 2 pi times 100 mm at 1000 mm/min.
    assert times.largest == pytest.approx(37.699112)


@pytest.mark.parametrize("attribute", ["255", "256"])
def test_values_that_q_das_marks_invalid_are_left_out_and_named(tmp_path, attribute):
    line = (EXAMPLES / PLATE / "plate.dfq").read_text(encoding="cp1252").splitlines()[-1]
    first, rest = line.split("\x0f", 1)
    value = first.split("\x14")[0]
    read = changed(tmp_path, PLATE, "plate.dfq", (line, f"{value}\x14{attribute}\x0f{rest}"))
    note = (
        "plate.dfq: 1 of 24 rows are left out, which the file marks invalid: x on line 220 "
        f"(attribute K0002 = {attribute} of H1)"
    )
    assert note in read.notes


def test_a_line_of_values_that_ends_early_is_refused(tmp_path):
    line = (EXAMPLES / PLATE / "plate.dfq").read_text(encoding="cp1252").splitlines()[-1]
    with pytest.raises(CampaignError, match=r"the line has values of 40 characteristics where 72 are named"):
        changed(tmp_path, PLATE, "plate.dfq", (line, "\x0f".join(line.split("\x0f")[:40])))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "Z33.3333 D",
            "Z[33.3333] D",
            "square.prn, line 5: 'Z[33.3333] D-0.02444' has a bracket behind a letter",
        ),
        ("Z33.3333 D", "Z D", "line 5: 'Z D-0.02444' is damaged: a row has a number behind every letter"),
        ("Z33.3333 D", "DPRNT[Z#101[44]]\nZ33.3333 D", "line 5: 'DPRNT[Z#101[44]]' is a line of the macro"),
        (".", ",", "has a comma within a number: print decimal points"),
    ],
)
def test_what_stands_in_a_log_instead_of_a_number_is_said(tmp_path, old, new, said):
    with pytest.raises(CampaignError, match=re.escape(said)):
        changed(tmp_path, LASERS, "square.prn", (old, new))


def test_a_log_keeps_what_a_serial_line_adds_and_one_without_its_end_is_said(tmp_path):
    """DC2 and DC4 are what POPEN and PCLOS send; zeros are the leader of a punched tape."""
    text = (EXAMPLES / LASERS / "square.prn").read_text()
    folder = tmp_path / "a"
    read = changed(folder, LASERS, "square.prn", (text, f"\x00\x00\x12{text}\x14\x00"))
    assert not any("square.prn" in note for note in read.notes)
    cut = changed(tmp_path / "b", LASERS, "square.prn", ("D-0.00220\n%\n", "D-0.00220\n"))
    assert (
        "square.prn: the log has % at one end only, which POPEN and PCLOS print at both: is it cut?"
        in cut.notes
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("Achse;Y\n" + COLUMNS + passes(2), "laser.csv, line 1, column Achse: the file says axis Y"),
        ("Messart: Winkel\n" + COLUMNS + passes(2), "column Messart: the file says Winkel, the setup"),
        ("Points: 5\nRuns: 5\n" + COLUMNS + passes(2), "line 1, column Points: 5 are announced in 5 runs"),
        (COLUMNS + passes(2) + "Max;4.75\n", "line 22: 'Max' begins a line of results and no row; remove it"),
        (COLUMNS + passes(1) + COLUMNS + passes(1), "line 12: the header of line 1 stands here again"),
        (COLUMNS + "0 mm;1 um\n100 mm;2 um\n", "line 2: '0 mm' has its unit behind the number"),
        (COLUMNS + "0;0\n500;3\n1,000;5\n1,500;7\n", "line 4: '1,000' may have a decimal mark or a thousands"),
        (COLUMNS + "0;0.10\n500;3.20\n1,000;5.00\n", "the numbers have thousands separators: export them without"),
        ("# Achse: Y\n" + COLUMNS + passes(2), "line 1, column # Achse: the file says axis Y"),
        ("PK\x03\x04 and more", "line 1: this is a workbook or another archive; name a workbook of Excel .xlsx"),
        ("<html><body>0;1</body></html>", "line 1: this is a web page; export the measurement as text or CSV"),
        ((COLUMNS + passes(2)).encode("utf-16")[:-3], "the file is UTF-16 and ends within a character: it is cut"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_table_is_said_where_it_stands(tmp_path, text, said):
    with pytest.raises(CampaignError, match=re.escape(said)):
        laser(tmp_path, text)


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_utf_16_without_its_mark_is_read(tmp_path, encoding):
    assert (
        laser(tmp_path, (COLUMNS + passes(2)).encode(encoding)).files[0].layout.startswith("UTF-16 without")
    )


def test_decimal_marks_of_three_digits_are_taken_where_the_mapping_says_so(tmp_path):
    rows = "0;0\n500;3\n1,500;5\n"
    assert laser(tmp_path, COLUMNS + rows, 'decimal = "comma"\n').campaign.probings.readings["X"][2] == 1.5


def test_times_of_day_become_seconds_also_past_midnight(tmp_path):
    rows = "23:59:58;0;0\n23:59:59,5;100;1\n00:00:02;200;2\n"
    assert laser(tmp_path, "Time;" + COLUMNS + rows).campaign.probings.time.tolist() == [0.0, 1.5, 4.0]


def test_exchanged_columns_of_deviations_are_told(tmp_path):
    read = laser(tmp_path, "Deviation [um];Position [mm]\n" + passes(2))
    assert read.notes == (
        "laser.csv: deviations range over 400 µm on 4.63 mm of travel: are columns or units exchanged?",
    )


def test_a_head_without_its_circle_is_refused(tmp_path):
    text = (EXAMPLES / LASERS / "bar-xy.bar").read_text()
    with pytest.raises(CampaignError, match="a circle begins here and has no table: the file is cut"):
        changed(tmp_path, LASERS, "bar-xy.bar", (text, text + "\nRadius: 100.0 mm\nDirection: CW\n"))


def test_a_table_whose_last_pass_stops_short_is_told(tmp_path):
    rows = passes(3).splitlines(keepends=True)
    assert laser(tmp_path, COLUMNS + "".join(rows)).notes == ()
    notes = laser(tmp_path, COLUMNS + "".join(rows[:-2])).notes
    said = "the last pass of X ends at 200, 200 before the end of the 5 others, on line 29: is the file cut?"
    assert notes == (f"laser.csv: {said}",)


def test_coded_values_that_end_early_are_told_or_refused(tmp_path):
    text = (EXAMPLES / PLATE / "plate.dfq").read_text(encoding="cp1252")
    line = text.splitlines()[-1]
    values = [cell.split("\x14")[0] for cell in line.split("\x0f")]
    coded = "".join(f"K0001/{number} {value}\n" for number, value in enumerate(values, start=1))
    whole = changed(tmp_path / "a", PLATE, "plate.dfq", (line, coded))
    short = changed(
        tmp_path / "b", PLATE, "plate.dfq", (line + "\n", "".join(coded.splitlines(keepends=True)[:69]))
    )
    assert len(whole.campaign.probings) - len(short.campaign.probings) == 1
    assert any("characteristics from 70 on" in note for note in short.notes)
    with pytest.raises(CampaignError, match="the last number is shorter than those above it"):
        changed(tmp_path / "c", PLATE, "plate.dfq", (line + "\n", coded[:-3]))


def test_a_wrong_reading_is_named_by_the_line_of_its_own_file(tmp_path):
    lines = (EXAMPLES / LASERS / "laser-X.rtl").read_text().splitlines()
    wrong = lines[59]
    run, target, _ = wrong.split()
    read = changed(tmp_path, LASERS, "laser-X.rtl", (wrong + "\n", f"  {run}  {target}  999.00\n"))
    assert any("correct or remove line 60 of laser-X.rtl" in note for note in gross_doubts(read.campaign))


def test_the_files_of_rows_and_runs_go_by_their_own_names():
    shipped = read_campaign(EXAMPLES / LASERS)
    assert rows_in(shipped).startswith("bar-xy.bar, bar-yz.bar, bar-zx.bar, laser-X.rtl")
    assert runs_in(shipped) == "[[runs]] of mapping.toml"
    folder = replace(shipped, files=(SourceFile("campaign.toml", b""), SourceFile("week.xlsx", b"")))
    assert (rows_in(folder), runs_in(folder)) == ("week.xlsx", "week.xlsx")
    assert RowPlaces(folder).row(1, 3) == "the row in week.xlsx"
    bare = replace(shipped, files=())
    assert (rows_in(bare), runs_in(bare)) == ("probings.csv", "runs.csv")


def test_rows_that_cannot_be_read_are_the_fault_and_not_a_setup_without_rows(tmp_path):
    with pytest.raises(CampaignError, match="is not a number") as caught:
        laser(tmp_path, COLUMNS + "0;(1.0)\n100;(2.0)\n")
    assert "has no row" not in str(caught.value)
    assert "laser.csv, line 2, column Deviation (reading_um): '(1.0)' is not a number" in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("-200.00000", "********", "axis' of this protocol is '********' and no number; measure"),
        ("Diameter: 12.0031", "Diameter: 12.0031\nDiameter: 99.0", "'Actual values/Diameter' stands twice in"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_protocol_is_said_of_that_protocol(tmp_path, old, new, said):
    with pytest.raises(CampaignError, match=re.escape(said)):
        changed(tmp_path, PLATE, "TCHPR421.TXT", (old, new))


@pytest.mark.parametrize("end", ["9.00", "9.000E", "9.000E-", "9.000E-0"])
def test_a_table_that_ends_within_a_power_of_ten_is_refused(tmp_path, end):
    rows = "".join(f"{place}.0;{place:.3E}\n" for place in range(100, 800, 100))
    assert len(laser(tmp_path, f"{COLUMNS}{rows}800.0;9.000E-04").campaign.probings) == 8
    with pytest.raises(CampaignError, match="line 9: the last number is shorter than those above it"):
        laser(tmp_path, f"{COLUMNS}{rows}800.0;{end}")


def test_a_circle_that_ends_within_an_angle_is_refused(tmp_path):
    text = (EXAMPLES / LASERS / "bar-xy.bar").read_text()
    with pytest.raises(CampaignError, match="'36' is the beginning of a row: the file is cut here"):
        changed(tmp_path, LASERS, "bar-xy.bar", (text, text.replace(".", ",") + "36"))


@pytest.mark.parametrize("head", ["Samples: 100\n", "Points: 5\nRuns: 5\n"])
def test_numbers_of_something_else_than_rows_are_overruled(tmp_path, head):
    with pytest.raises(CampaignError, match=re.escape('overruled = ["points"]')):
        laser(tmp_path, head + COLUMNS + passes(1))
    read = laser(tmp_path, head + COLUMNS + passes(1), 'overruled = ["points"]\n')
    assert len(read.campaign.probings) == 10
    assert any("is overruled by the mapping" in note for note in read.notes)


def test_runs_that_pass_the_targets_at_which_they_turn_once_are_whole(tmp_path):
    places = [0, *[100, 200, 300, 400, 300, 200, 100, 0] * 2]
    rows = "".join(f"{place}.0;{0.1 * row:.2f}\n" for row, place in enumerate(places))
    assert len(laser(tmp_path, f"Points: 5\nRuns: 4\n{COLUMNS}{rows}").campaign.probings) == 17


def test_a_file_that_turns_twice_at_a_target_and_lacks_its_last_row_is_refused(tmp_path):
    """Was read in silence: it has as many rows as two runs that pass the target at which they turn once."""
    rows = passes(1).splitlines(keepends=True)[:9]
    with pytest.raises(
        CampaignError, match=r"5 are announced in 2 runs and the table has 9 rows: the file is cut"
    ):
        laser(tmp_path, "".join([f"Points: 5\nRuns: 2\n{COLUMNS}", *rows]))
    once = [0, 100, 200, 300, 400, 300, 200, 100, 0]
    rows = [f"{place}.0;{0.1 * row:.2f}\n" for row, place in enumerate(once)]
    assert len(laser(tmp_path, "".join([f"Points: 5\nRuns: 2\n{COLUMNS}", *rows])).campaign.probings) == 9


@pytest.mark.parametrize(("mark", "other"), [(",", "1,25"), (".", "0.5")])
def test_three_decimals_beside_whole_numbers_are_decimals_where_another_cell_shows_the_mark(
    tmp_path, mark, other
):
    rows = f"0;{other}\n100{mark}125;2\n200;3\n"
    assert laser(tmp_path, COLUMNS + rows).campaign.probings.readings["X"].tolist() == [0.0, 100.125, 200.0]


@pytest.mark.parametrize(
    "line", ["Z D", "AXIS Z (1 OF 3)", "RUN D (25 MM)", "TOOL T5, D 10,5", "(#101=5: IF [Z] IS MEASURED)"]
)
def test_words_between_the_rows_of_a_log_are_no_damaged_rows(tmp_path, line):
    read = changed(tmp_path, LASERS, "square.prn", ("SQUARE ON TABLE", f"{line}\nSQUARE ON TABLE"))
    assert len(read.campaign.probings) == 806
