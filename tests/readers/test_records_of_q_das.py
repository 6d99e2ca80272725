"""Several records of a Q-DAS file, parts or clampings, are never one run in one frame unless the mapping says so."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from monitor.exceptions import CampaignError
from monitor.readers import read_campaign
from monitor.readers.export import Export, ExportFile
from monitor.readers.exports import dfq
from monitor.readers.faults import Faults
from monitor.records import Campaign

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "files-of-a-plate"
ENTRY = 'file = "plate.dfq"\n'


def _moved(record: bytes, by: float) -> bytes:
    """A record of a part that was clamped elsewhere."""
    cells = [cell.split(b"\x14") for cell in record.split(b"\x0f")]
    return b"\x0f".join(b"\x14".join([b"%.5f" % (float(cell[0]) + by), *cell[1:]]) for cell in cells)


@pytest.fixture
def two_records(tmp_path: Path) -> Path:
    folder = tmp_path / "plate"
    shutil.copytree(EXAMPLE, folder)
    path = folder / "plate.dfq"
    content = path.read_bytes()
    *head, last = content.rstrip(b"\r\n").split(b"\n")
    path.write_bytes(b"\n".join([*head, last, _moved(last, 3.0)]) + b"\n")
    return folder


def _mapped(folder: Path, *records: str) -> Campaign:
    """The campaign with an export of the file for each of the ``records``, as keys."""
    path = folder / "mapping.toml"
    text = path.read_text(encoding="utf-8")
    begin = text.index(f"[[exports]]\n{ENTRY}")
    end = text.index("\n[[", begin + 1)
    entry = text[begin:end]
    entries = "\n".join(entry.replace(ENTRY, f"{ENTRY}{keys}\n") for keys in records)
    path.write_text(text[:begin] + entries + text[end:], encoding="utf-8")
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    return campaign


def _rows(campaign: Campaign) -> npt.NDArray[np.bool_]:
    setups = [setup.id for setup in campaign.artefact.setups]
    return campaign.probings.channels["setup"] == 1 + setups.index("plate-dfq")


def test_two_records_are_refused_with_what_to_write(two_records: Path) -> None:
    with pytest.raises(
        CampaignError, match=r'every coordinate has 2 records .*record = 1, record = 2, .*"one clamping"'
    ):
        _mapped(two_records, "")


def test_each_record_is_read_into_its_own_run(two_records: Path) -> None:
    campaign = _mapped(two_records, "record = 1", "record = 2\nrun = 2")
    rows = _rows(campaign)
    points, run = campaign.probings.channels["point_x_mm"], campaign.probings.run
    first, second = (points[rows & (run == number)] for number in (1, 2))
    assert len(first) == len(second) == 24
    assert second - first == pytest.approx(np.full(24, 3.0), abs=1e-9)


def test_records_of_one_clamping_share_a_run_where_that_is_said(two_records: Path) -> None:
    campaign = _mapped(two_records, 'record = "one clamping"')
    assert np.count_nonzero(_rows(campaign)) == 48
    assert np.unique(campaign.probings.run).tolist() == [1]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("record = 3", r"column record: there is no record 3; the file has 2"),
        ("record = 0", r"0 is no record; write its number from 1 on"),
        ('record = "first"', r"'first' is no record; write its number"),
    ],
)
def test_a_record_that_there_is_not_is_refused(two_records: Path, keys: str, message: str) -> None:
    with pytest.raises(CampaignError, match=message):
        _mapped(two_records, keys)


def _read(values: str, record: int | str | None = None) -> Export:
    """What is read of a file with the coordinates of P1 and these values, ``a b c`` a line of K-fields each."""
    names = "".join(f"K2002/{number} P1.{letter}\n" for number, letter in enumerate("XYZ", start=1))
    faults = Faults([])
    export = dfq.read(ExportFile("a.dfq", (names + values).encode()), record, faults)
    assert export is not None, faults.sorted()
    return export


def _record(number: int, date: str | None, place: str) -> str:
    """A record in K-fields: its date above each value, below each, or once above or below all of them."""
    values = [f"K0001/{which} {number}.{which}00\n" for which in (1, 2, 3)]
    dates = [f"K0004/{which} {date}\n" if date else "" for which in (1, 2, 3)]
    once = f"K0004/0 {date}\n" if date else ""
    return {
        "above": "".join(map("".join, zip(dates, values, strict=True))),
        "below": "".join(map("".join, zip(values, dates, strict=True))),
        "above all": once + "".join(values),
        "below all": "".join(values) + once,
    }[place]


@pytest.mark.parametrize("place", ["above", "below", "above all", "below all"])
@pytest.mark.parametrize(
    "dates",
    [("1.3.2026", "2.3.2026", "3.3.2026"), ("1.3.2026", None, "3.3.2026"), ("1.3.2026", "2.3.2026", None)],
)
def test_each_record_has_its_own_date_wherever_it_stands(place: str, dates: tuple[str | None, ...]) -> None:
    text = "".join(_record(number, date, place) for number, date in enumerate(dates, start=1))
    # Without the last date, dates below the values stand where dates above them could.
    is_unclear = dates[2] is None and place.startswith("below")
    for number, date in enumerate(dates, start=1):
        export = _read(text, number)
        assert export.started == (None if is_unclear else date)
        assert any(
            "may be the date of the value above it or of that below" in note for note in export.notes
        ) == (is_unclear)


@pytest.mark.parametrize("place", ["above", "below"])
def test_a_record_without_a_date_does_not_get_that_of_the_next(place: str) -> None:
    text = _record(1, None, place) + _record(2, "2.3.2026", place)
    assert _read(text, 1).started is None
    assert _read(text, 2).started == ("2.3.2026" if place == "below" else None)


def test_the_date_of_a_value_counts_before_that_of_the_head() -> None:
    text = "K0004/0 1.3.2026\n" + _record(1, "2.3.2026", "below")
    assert _read(text).started == "2.3.2026"


def _marked(records: Sequence[tuple[str, ...]]) -> dict[int, str]:
    """The records of X that are read as invalid, of these K-fields of X a record; Y and Z have none."""
    lines = [f"{field.replace('/', '/1')}\n" for record in records for field in record]
    others = [f"K0001/{which} {number}.{which}00\n" for number in range(len(records)) for which in (2, 3)]
    export = _read("".join([*lines, *others]), dfq.ONE_CLAMPING)
    assert all(export.columns["x"][record] == "" for record in export.invalid.get("x", {}))
    return dict(export.invalid.get("x", {}))


VALUES = [f"K0001/ {number}.100" for number in (1, 2, 3)]
DATES = [f"K0004/ {number}.3.2026" for number in (1, 2, 3)]
GOOD, BAD = "K0002/ 0", "K0002/ 256"


@pytest.mark.parametrize(
    "records",
    [
        # Attributes of all values, above and below.
        [(GOOD, VALUES[0]), (BAD, VALUES[1]), (GOOD, VALUES[2])],
        [(VALUES[0], GOOD), (VALUES[1], BAD), (VALUES[2], GOOD)],
        # Of some: one stands above the first value, or below the last.
        [(GOOD, VALUES[0]), (BAD, VALUES[1]), (VALUES[2],)],
        [(VALUES[0],), (VALUES[1], BAD), (VALUES[2], GOOD)],
        # Of one: the dates say it, or the format.
        [(DATES[0], VALUES[0]), (DATES[1], BAD, VALUES[1]), (DATES[2], VALUES[2])],
        [(VALUES[0], DATES[0]), (VALUES[1], BAD, DATES[1]), (VALUES[2], DATES[2])],
        [(VALUES[0],), (VALUES[1], BAD), (VALUES[2],)],
    ],
)
def test_an_attribute_marks_its_own_value_wherever_it_stands(records: Sequence[tuple[str, ...]]) -> None:
    """Was: that of the value below it took the valid one above it, and 256 counted as measured."""
    (record,) = _marked(records)
    assert record == 1


def test_an_attribute_above_the_first_value_is_its_own() -> None:
    assert list(_marked([(BAD, VALUES[0]), (VALUES[1],), (VALUES[2],)])) == [0]
    assert list(_marked([(VALUES[0],), (VALUES[1],), (VALUES[2], BAD)])) == [2]


@pytest.mark.parametrize(
    "records",
    [
        # Dates above the values, and no date between the attribute and the value above it.
        [(DATES[0], VALUES[0]), (BAD, DATES[1], VALUES[1]), (DATES[2], VALUES[2])],
        # A date of which nobody knows either.
        [(VALUES[0],), (DATES[1], BAD, VALUES[1]), (VALUES[2],)],
        # Attributes on both sides.
        [(GOOD, VALUES[0]), (BAD, VALUES[1]), (VALUES[2], GOOD), (GOOD, "K0001/ 4.100", GOOD)],
    ],
)
def test_an_attribute_that_may_be_of_either_value_is_refused(records: Sequence[tuple[str, ...]]) -> None:
    with pytest.raises(AssertionError, match=r"marks the value above it or that below it invalid"):
        _marked(records)


def test_a_point_whose_every_row_is_marked_invalid_is_said(two_records: Path) -> None:
    """One coordinate that does not count leaves no row where its point alone is read, and no column goes silently."""
    path = two_records / "plate.dfq"
    *head, first, second = path.read_text(encoding="cp1252").splitlines()
    cells = second.split("\x0f")
    cells[1] = f"{cells[1].split(chr(0x14))[0]}\x14255"
    path.write_text("\n".join([*head, first, "\x0f".join(cells)]) + "\n", encoding="cp1252")
    with pytest.raises(
        CampaignError, match=r"marks every row invalid: y on line 221 \(attribute K0002 = 255 of H1\)"
    ):
        _mapped(two_records, 'record = 2\nwhere = { target = "H1" }')


def test_the_last_value_may_have_fewer_fields_where_further_lines_follow(two_records: Path) -> None:
    path = two_records / "plate.dfq"
    *head, first, second = path.read_text(encoding="cp1252").splitlines()
    *others, last = first.split("\x0f")
    short = "\x0f".join([*others, last.split("\x14")[0]])
    path.write_text("\n".join([*head, short, second]) + "\n", encoding="cp1252")
    assert np.count_nonzero(_rows(_mapped(two_records, "record = 1"))) == 24
    path.write_text("\n".join([*head, second, short]) + "\n", encoding="cp1252")
    with pytest.raises(
        CampaignError, match=r"line 221: the last value of the line has 1 fields where the others"
    ):
        read_campaign(two_records)
