"""Each format of instruments' files: its refusals by line, and whatever bytes stand in it, an answer in words."""

from __future__ import annotations

import re
import shutil
import tempfile
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from monitor.exceptions import CampaignError
from monitor.readers import read_campaign
from monitor.readers.exports import qif
from monitor.records import Campaign

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
#: Every sample with the folder that it belongs to: one of every format.
SAMPLES = {
    "laser-X.rtl": "files-as-they-come",
    "bar-xy.bar": "files-as-they-come",
    "r-test.csv": "files-as-they-come",
    "square.prn": "files-as-they-come",
    "plate.qif": "files-of-a-plate",
    "plate.dfq": "files-of-a-plate",
    "TCHPR421.TXT": "files-of-a-plate",
    "tracker.txt": "files-of-a-plate",
    "mapping.toml": "files-of-a-plate",
}
PIECES = [
    b"", b",", b";", b"\n", b"\r", b'"', b"nan", b"1e999", b"-", b"\x00", b"\xff", b"\x0f", b"\x14", b"::", b":", b"<",
    b"&lol;", b"9" * 5000, b"\xef\xbb\xbf", b"\xff\xfe", b"K0001/1 ", b"G20\n", b"=", b"[", b"\t", b" ", b"Targets :\n",
    b"0" * 400,
]  # fmt: skip


def spoilt(around: Path, name: str, content: bytes) -> Path:
    target = around / "spoilt"
    shutil.copytree(EXAMPLES / SAMPLES[name], target)
    (target / name).write_bytes(content)
    return target


@cache
def alone(name: str) -> dict[str, bytes]:
    """A sample with its part of the mapping."""
    folder = EXAMPLES / SAMPLES[name]
    text = (folder / "mapping.toml").read_text(encoding="utf-8")
    named = name if name != "mapping.toml" else "tracker.txt"
    head, *tables = re.split(r"\n(?=\[\[)", text)
    entry = next(table for table in tables if f'file = "{named}"' in table)
    setup = re.search('setup = "(.*)"', entry)[1]
    kept = [head, next(table for table in tables if f'id = "{setup}"' in table), entry]
    runs = "\n[[runs]]\nstarted_at = 2026-03-02T20:00:00+01:00\n"
    files = {named: (folder / named).read_bytes(), "mapping.toml": ("\n".join(kept) + runs).encode()}
    return files | (
        {"tracker-poses.csv": (folder / "tracker-poses.csv").read_bytes()} if named == "tracker.txt" else {}
    )


def said(around: Path, name: str, old: str, new: str, count: int = 1) -> str:
    text = (EXAMPLES / SAMPLES[name]).joinpath(name).read_bytes().decode("cp1252")
    assert old in text, old
    with pytest.raises(CampaignError, match="was refused, nothing of it was kept") as caught:
        read_campaign(spoilt(around, name, text.replace(old, new, count).encode("cp1252")))
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("laser-X.rtl", "Target-count: 11", "Target-count: 12", "line 7, column target-count: 12 targets are"),
        ("laser-X.rtl", "Run-count: 5", "Run-count: five", "line 17, column Run-count: 'five' is no number"),
        ("laser-X.rtl", "  1  3  ", "  1  2  ", "column Run Target Data: run 1 has target 2 a third time"),
        ("laser-X.rtl", "  1  3  ", "  1  33  ", "line 22, column Run Target Data: there is no target 33"),
        ("laser-X.rtl", "  1  3  ", "  1  x  ", "is not run, target and deviation; the file is cut or damaged here"),
        ("laser-X.rtl", "Targets :", "Goals :", "the file has no targets (Targets :)"),
        ("laser-X.rtl", "HEADER::", "HEADER", "line 1: 'HEADER' stands before the first section"),
        ("bar-xy.bar", "Radius: 100.0 mm", "Radius: 100.0", "line 3, column radius: nothing states the unit"),
        ("bar-xy.bar", "Radius: 100.0 mm\n", "", "nothing states the radius of this circle; write it as radius_mm"),
        ("bar-xy.bar", "Radius: 100.0 mm", "Radius: ten", "column radius: 'ten' is no radius"),
        ("bar-xy.bar", "Direction: CCW", "Direction: CW", "the head says CW, the angles go CCW; are they counted"),
        ("bar-xy.bar", "\n10.0\t", "\n5.0\t", "column angle: the angle is that of the row before"),
        ("bar-xy.bar", "Deviation (um)", "Deviation", "column deviation: this circle is in um, the first in none"),
        ("bar-xy.bar", "Angle (deg)", "Turn (deg)", "the table has no column of the angle; it has Turn, Deviation"),
        ("square.prn", "G21", "", "nothing states the unit of column 'Z' of square.prn"),
        ("square.prn", "G21", "G21\nG20", "line 4: the log goes from mm (line 3) to inch"),
        ("square.prn", "0000 D-", "0000-", "line 4: "),
        ("square.prn", "D-0.02512", "D-2.512E-02", "line 4: '2.512E-02' may be a power of ten"),
        ("square.prn", " D-0.", "\nD-0.", "the line has Z where others have Z, D; the log is cut here"),
        ("plate.qif", "<UnitName>mm", "<UnitName>ell", "column LinearUnit: 'ell' is no unit of lengths"),
        ("plate.qif", "</QIFDocument>", "", "this is no XML: "),
        ("plate.qif", "QIFDocument", "Document", "this is no XML: "),
        ("plate.qif", "\n<QIF", '\n<!DOCTYPE q [<!ENTITY lol "ha">]>\n<QIF', "line 1: the document declares"),
        ("plate.dfq", "K0100 72", "K0100 75", "line 1, column K0100: 75 characteristics are announced and 72 named"),
        ("plate.dfq", "K2142/5 mm", "K2142/5 inch", "column K2142: the coordinates are in different units (inch, mm)"),
        ("plate.dfq", "K2002/1 ", "K2002/1 \x0e", "line 4: character 0x0e: this is no text file"),
        ("TCHPR421.TXT", "End of measuring log", "", "this protocol has no end mark"),
        ("TCHPR421.TXT", "0 = MM / 1 = INCH): 0", "0 = MM / 1 = INCH): 1", "is in mm, that on line 1 in inch"),
        ("TCHPR421.TXT", "Center in minor axis", "Centre", "stands in one of this protocol and that on line 1 alone"),
        ("TCHPR421.TXT", "Measuring log for", "Log of", "line 1: "),
        ("tracker.txt", "\nH2 ", "\nH77 ", "tracker-poses.csv has no row of 'H77' of tracker.txt"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_by_line_and_remedy(tmp_path, name, old, new, message):
    if message == "column runs: ":
        # A first line that begins no protocol: the text before the next one is not read, and a protocol is missing.
        assert (
            len(
                read_campaign(
                    spoilt(tmp_path, name, sample(name).replace(old.encode(), new.encode(), 1))
                ).probings
            )
            == 83
        )
    elif message is None:
        said(tmp_path, name, old, new) if "\x0e" in new else None
    else:
        assert message in said(tmp_path, name, old, new)


def sample(name: str) -> bytes:
    return (EXAMPLES / SAMPLES[name] / name).read_bytes()


def test_a_head_of_a_ball_bar_holds_until_another_states_otherwise(tmp_path):
    """The second circle has its sense alone: radius and feed are those of the first, not of the mapping's example."""
    head = b"Radius: 100.0 mm\nFeed rate: 1000 mm/min\n"
    first, second, third = sample("bar-xy.bar").split(head)
    campaign = read_campaign(spoilt(tmp_path, "bar-xy.bar", first + head + second + third))
    before = read_campaign(EXAMPLES / "files-as-they-come").probings
    assert campaign.probings.readings["X"].tolist() == before.readings["X"].tolist()
    assert campaign.probings.time.tolist() == before.time.tolist()


def test_inches_are_inches(tmp_path):
    """A protocol in inches is carried to mm exactly, whatever the machine."""
    text = sample("TCHPR421.TXT").replace(b"1 = INCH): 0", b"1 = INCH): 1")
    campaign = read_campaign(spoilt(tmp_path, "TCHPR421.TXT", text))
    before = read_campaign(EXAMPLES / "files-of-a-plate").probings
    rows = campaign.probings.channels["setup"] == 3.0
    assert campaign.probings.readings["X"][rows] == pytest.approx(
        25.4 * before.readings["X"][rows], rel=1e-15
    )


def test_no_entity_is_expanded_and_no_file_read(tmp_path, monkeypatch):
    secret = tmp_path / "secret.txt"
    secret.write_text("1 2 3")
    for entity in (f'SYSTEM "file://{secret}"', '"1 2 3"'):
        text = sample("plate.qif").replace(
            b"\n<QIF", f"\n<!DOCTYPE q [<!ENTITY place {entity}>]>\n<QIF".encode()
        )
        text = text.replace(b"<Location>", b"<Location>&place;", 1)
        folder = tmp_path / f"with-{len(entity)}"
        folder.mkdir()
        with pytest.raises(CampaignError, match="the document declares a document type"):
            read_campaign(spoilt(folder, "plate.qif", text))
    monkeypatch.setattr(qif, "LARGEST_XML", 1000)
    with pytest.raises(CampaignError, match="the document is larger than 0 MiB"):
        read_campaign(EXAMPLES / "files-of-a-plate")


def outcome(name: str, content: bytes) -> Campaign | CampaignError:
    with tempfile.TemporaryDirectory() as around:
        for file, sound in alone(name).items():
            (Path(around) / file).write_bytes(content if file == name else sound)
        try:
            return read_campaign(Path(around))
        except CampaignError as error:
            str(error).encode("utf-8")  # raises where a message cannot be printed
            return error


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(sorted(SAMPLES)), st.binary(max_size=300))
def test_any_bytes_in_any_file(name, content):
    assert isinstance(outcome(name, content), CampaignError)


@settings(max_examples=80, deadline=None)
@given(st.data())
def test_any_small_damage_to_any_file(data):
    name = data.draw(st.sampled_from(sorted(SAMPLES)))
    content = alone(name)[name]
    start, length = data.draw(st.integers(0, len(content))), data.draw(st.integers(0, 40))
    piece = data.draw(st.sampled_from(PIECES) | st.binary(max_size=10))
    assert isinstance(
        outcome(name, content[:start] + piece + content[start + length :]), Campaign | CampaignError
    )


def test_a_column_goes_by_its_whole_header_too(tmp_path):
    """People copy what stands in the file: ``Position [mm]``; another unit than the file's is another column."""
    mapping = """format = 1
campaign = "header"
method = "instruments"

[machine]
id = "header"
topology = "w Y b X Z t"

[[setups]]
id = "laser"
reading = "displacement"
standard_uncertainty_um = 0.3
direction = "X"

[[exports]]
file = "laser.csv"
format = "table"
setup = "laser"

[exports.columns]
x_mm = "Position [UNIT]"
y_mm = 0.0
z_mm = 0.0
reading_um = { column = "abweichung [µm]", deviation = true }

[[runs]]
run = 1
started_at = "2026-03-02T08:00:00+01:00"
day = 1
warm_up = false
ambient_degC = 20.0
"""
    (tmp_path / "laser.csv").write_text(
        "Position [mm];Abweichung [µm]\n" + "".join(f"{100 * n},5;{n},25\n" for n in range(5)),
        encoding="cp1252",
    )
    (tmp_path / "mapping.toml").write_text(mapping.replace("UNIT", "mm"), encoding="utf-8")
    campaign = read_campaign(tmp_path)
    assert campaign.probings.readings["X"].tolist() == [0.5, 100.5, 200.5, 300.5, 400.5]
    (tmp_path / "mapping.toml").write_text(mapping.replace("UNIT", "inch"), encoding="utf-8")
    with pytest.raises(CampaignError, match=r"laser.csv has no column 'Position \[inch\]'; it has Position"):
        read_campaign(tmp_path)
