"""Files as instruments write them, by a mapping: what is read, what is refused, and with which words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import CampaignError
from monitor.readers import export_formats, read_campaign, read_exports

HEAD = """\
format = 1
campaign = "week-12"
method = "instruments"

[machine]
id = "M1"
topology = "w C Y b X Z t"

[dates]
utc_offset = "+01:00"
"""
LASER = """
[[setups]]
id = "laser-X"
reading = "displacement"
standard_uncertainty_um = 0.3
direction = "X"

[[exports]]
file = "laser.csv"
setup = "laser-X"

[exports.columns]
x_mm = "Position"
y_mm = 10.0
z_mm = 0.0
c_deg = 0.0
reading_um = { column = "Deviation", deviation = true }
"""
TRACKER = """
[[setups]]
id = "tracker"
reading = "point"
standard_uncertainty_um = 5.0

[[exports]]
file = "tracker.csv"
setup = "tracker"
positions = "poses.csv"

[exports.columns]
point_x_mm = { column = "x", unit = "m" }
point_y_mm = { column = "y", unit = "m" }
point_z_mm = { column = "z", unit = "m" }
c_deg = 0.0
"""
GERMAN = (
    "Bediener: Müller\r\nDatum: 02.03.2026 14:05\r\n\r\nPosition [mm];Deviation [µm]\r\n"
    "0,000;0,0\r\n100,000;1,2\r\n200,000;2,1\r\n100,000;1,0\r\n0,000;-0,2\r\n"
)
POSES = "x_mm,y_mm,z_mm,target\n0,0,0,P1\n100,0,0,P2\n100,50,0,P3\n100,50,80,P4\n"
POINTS = "target x y z\nP4 1.1 2.05 3.08\nP1 1 2 3\nP2 1.1 2 3\nP3 1.1 2.05 3\n"


def folder(around: Path, mapping: str, **files: str | bytes) -> Path:
    around.mkdir(exist_ok=True)
    (around / "mapping.toml").write_text(HEAD + mapping, encoding="utf-8")
    for stem, text in files.items():
        content = text if isinstance(text, bytes) else text.encode()
        (around / stem.replace("__", ".")).write_bytes(content)
    return around


def faults(around: Path) -> str:
    with pytest.raises(CampaignError, match="was refused, nothing of it was kept") as caught:
        read_campaign(around)
    return str(caught.value)


@pytest.mark.parametrize("form", export_formats().values(), ids=lambda form: form.name)
def test_contract_of_every_format(form):
    assert form.name == form.name.casefold()
    assert form.summary
    assert all(suffix.startswith(".") and suffix == suffix.casefold() for suffix in form.suffixes)


def test_deviations_of_a_german_laser_are_added_to_the_travel(tmp_path):
    for encoding in ("cp1252", "utf-8", "utf-8-sig", "utf-16"):
        campaign = read_campaign(folder(tmp_path, LASER, laser__csv=GERMAN.encode(encoding)))
        assert campaign.probings.readings["X"].tolist() == [0.0, 100.0, 200.0, 100.0, 0.0]
        assert campaign.probings.readings["Y"].tolist() == [10.0] * 5
        assert campaign.probings.channels["reading_um"].tolist() == [0.0, 100001.2, 200002.1, 100001.0, -0.2]
        assert campaign.runs[0].started_at.isoformat() == "2026-03-02T14:05:00+01:00"
        assert [file.name for file in campaign.files] == ["mapping.toml", "laser.csv"]
        assert campaign.files[1].content == GERMAN.encode(encoding)


def test_a_beam_against_the_axis_turns_travel_and_deviation(tmp_path):
    for old, new in (('direction = "X"', "direction = [-1.0, 0.0, 0.0]"), ("Y b X Z", "Y b X Z")):
        around = folder(tmp_path, LASER, laser__csv=GERMAN)
        text = (around / "mapping.toml").read_text(encoding="utf-8").replace(old, new)
        (around / "mapping.toml").write_text(text, encoding="utf-8")
        readings = read_campaign(around).probings.channels["reading_um"]
        sign = -1.0 if old != new else 1.0
        np.testing.assert_allclose(readings, sign * np.array([0.0, 100001.2, 200002.1, 100001.0, -0.2]))


def test_points_of_a_tracker_are_joined_with_the_poses_by_target(tmp_path):
    runs = "\n[[runs]]\nstarted_at = 2026-03-02T14:05:00+01:00\nambient_degC = 20.4\n"
    exports = read_exports(
        folder(tmp_path, TRACKER + runs, tracker__csv=POINTS, poses__csv=POSES) / "mapping.toml",
        [tmp_path / "tracker.csv", tmp_path / "poses.csv"],
        "renamed",
    )
    campaign, (understood,) = exports.campaign, exports.files
    assert campaign.name == "renamed"
    assert campaign.runs[0].conditions == {"ambient_degC": 20.4}
    assert campaign.probings.target.tolist() == ["P4", "P1", "P2", "P3"]
    assert campaign.probings.readings["Z"].tolist() == [80.0, 0.0, 0.0, 0.0]
    assert campaign.probings.channels["point_x_mm"].tolist() == [1100.0, 1000.0, 1100.0, 1100.0]
    columns = {column.column: column for column in understood.columns}
    assert columns["point_x_mm"].source == "column x in m (by the mapping)"
    assert (columns["point_x_mm"].smallest, columns["point_x_mm"].largest) == (1000.0, 1100.0)
    assert (columns["point_x_mm"].first, columns["point_x_mm"].last) == ("1100", "1100")
    assert columns["y_mm"].moves == "2 positions, once up, once down"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[mm]", "[inch]", None),
        ("[mm]", "", "nothing states the unit of column 'Position' of laser.csv; write x_mm = {"),
        ("[mm]", "[°C]", "column 'Position' of laser.csv is in degC, which is no length; x_mm takes mm, µm"),
        ("Position", "Pos", "laser.csv has no column 'Position'; "),
        ("200,000;2,1", "200,000;nan", "line 7, column Deviation (reading_um): 'nan' is not a finite number"),
        ("200,000;2,1", "200,000;", "laser.csv, line 7, column Deviation (reading_um): the cell is empty"),
        ("200,000;2,1", "200,000", "laser.csv, line 7: 1 cell where the table has 2; the file is cut here"),
        ("200,000;2,1", "200.000;2,1", "has a comma and '200.000' on line 7 a point; say in the mapping which"),
        ("200,000;2,1", "2e9;2,1", "laser.csv, line 7, column Position (x_mm): "),
        ("02.03.2026 14:05", "02-03-2026 14:05", "column date: '02-03-2026 14:05' may be day and month"),
        ("02.03.2026 14:05", "March", "column date: 'March' is no date that can be read"),
        ("Datum: 02.03.2026 14:05\r\n", "", "no file says when run 1 began; write [[runs]] with run = 1"),
        (GERMAN, "", "laser.csv, line 1: the file is empty"),
        (GERMAN, "\x7fELF\x00\x01", "laser.csv, line 1: character 0x7f: this is no text file"),
        (GERMAN, "only words\n", "there is no table of numbers in the first 400 lines"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_table_is_named_by_file_line_and_remedy(tmp_path, old, new, said):
    around = folder(tmp_path, LASER, laser__csv=GERMAN.replace(old, new))
    if said is None:
        assert read_campaign(around).probings.readings["X"].tolist() == [0.0, 2540.0, 5080.0, 2540.0, 0.0]
    else:
        assert said in faults(around)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('x_mm = "Position"', 'x_mm = { column = "Position", unit = "inch" }', "states mm for column 'Position', the"),
        ('x_mm = "Position"', 'x_mm = { column = "Position", unit = "furlong" }', "'furlong' is no unit that is known"),
        ('x_mm = "Position"\n', "", 'nothing says which column of laser.csv is x_mm; write x_mm = "COLUMN", or'),
        ("laser.csv", "laser*.rtl", "no file is called 'laser*.rtl'; there are laser.csv"),
        ('file = "laser.csv"', 'file = "laser.csv"\nformat = "tabel"', "'tabel' is no format; did you mean 'table'? "),
        ('setup = "laser-X"', 'setup = "laser-Y"', "there is no setup 'laser-Y'; write setup = \"laser-X\""),
        ('setup = "laser-X"\n', 'setup = "laser-X"\nsetpu = 1\n', "this key is not known; did you mean 'setup'?"),
        ("y_mm = 10.0", "run = 2", "rows and runs are numbered here; write run = 2 beside file"),
        ("c_deg = 0.0", "c_deg = 5.0", "c_deg is not zero, and the travel is known only with all rotary axes at zero"),
        ('x_mm = "Position"', "x_mm = 0.0", "no axis moves along the direction of the setup"),
        ("y_mm = 10.0", 'y_mm = { column = "Position", sign = 2 }', "2 is not a sign; write sign = 1 or sign = -1"),
        ('[dates]\nutc_offset = "+01:00"\n', "", "has no offset from UTC; write [dates] utc_offset"),
        ('utc_offset = "+01:00"', 'utc_offset = "CET"', "'CET' is no offset from UTC"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_mapping_is_named_by_line_and_remedy(tmp_path, old, new, said):
    around = folder(tmp_path, LASER, laser__csv=GERMAN)
    text = (around / "mapping.toml").read_text(encoding="utf-8")
    assert old in text
    (around / "mapping.toml").write_text(text.replace(old, new), encoding="utf-8")
    assert said in faults(around)


def test_dates_of_two_readings_are_read_as_the_mapping_says(tmp_path):
    around = folder(tmp_path, LASER, laser__csv=GERMAN.replace("02.03.2026", "02/03/2026"))
    text = (around / "mapping.toml").read_text(encoding="utf-8")
    for order, month in (("day-month-year", 3), ("month-day-year", 2)):
        said = text.replace("[dates]", f'[dates]\norder = "{order}"')
        (around / "mapping.toml").write_text(said, encoding="utf-8")
        assert read_campaign(around).runs[0].started_at.month == month


def test_rows_are_chosen_by_the_text_of_a_column(tmp_path):
    table = "Axis;Position [mm];Deviation [µm]\nX;0;0\nY;0;0\nX;100;1\nY;100;2\n"
    runs = "\n[[runs]]\nstarted_at = 2026-03-02T14:05:00+01:00\n"
    where = '\n[exports.where]\nAxis = "x"\n'
    assert len(read_campaign(folder(tmp_path, LASER + where + runs, laser__csv=table)).probings) == 2
    assert "no row of laser.csv has 'W' there; it has X, Y" in faults(
        folder(tmp_path, LASER + where.replace('"x"', '"W"') + runs, laser__csv=table)
    )
