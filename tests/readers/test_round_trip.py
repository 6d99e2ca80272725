"""Readings are kept to the last digit (campaign format 1): read, written, read again, nothing has moved."""

from __future__ import annotations

import dataclasses
import math
import shutil
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from monitor.exceptions import CampaignError, InputError
from monitor.readers import read_campaign, write_campaign
from monitor.readers.tables.decimals import decimal_in
from monitor.records import Campaign
from monitor.units import DEGREE, MICROMETRE

EXAMPLES = Path(__file__).parents[2] / "examples"
FOLDERS = sorted(path.name for path in EXAMPLES.iterdir() if (path / "probings.csv").is_file())


def assert_same(one: Campaign, other: Campaign) -> None:
    """Everything but the files is equal, to the last bit; NaN equals NaN."""
    for name in ("name", "method", "machine", "probe", "artefact", "runs"):
        assert getattr(one, name) == getattr(other, name)
    for name in ("run", "sequence", "time", "target"):
        np.testing.assert_array_equal(getattr(one.probings, name), getattr(other.probings, name))
    for name in ("readings", "channels"):
        mine, theirs = getattr(one.probings, name), getattr(other.probings, name)
        assert list(mine) == list(theirs)
        for key in mine:
            np.testing.assert_array_equal(mine[key], theirs[key])


@pytest.mark.parametrize("name", FOLDERS)
def test_examples_are_read_and_come_back_from_writing(name, tmp_path):
    campaign = read_campaign(EXAMPLES / name)
    assert campaign.name == name
    assert_same(read_campaign(write_campaign(campaign, tmp_path / name)), campaign)


def test_small_folder_in_internal_units(small):
    campaign = read_campaign(small)
    assert campaign.machine.axes["X"].stroke == (-300.0, 300.0)
    assert campaign.machine.axes["B"].stroke == (-100 * math.pi / 180, 100 * math.pi / 180)
    assert campaign.machine.tolerances == {"EC0Y": 20.0, "EXX": 15.0}
    assert campaign.probe.standard_uncertainty == pytest.approx(0.0007, rel=1e-15)
    assert campaign.probe.tip == (0.0, 0.1, -150.0)
    assert campaign.artefact.scale_bar is not None
    assert campaign.artefact.scale_bar.expansion_coefficient == 11.5e-6
    first, second = campaign.runs
    assert first.started_at == datetime(2026, 3, 2, 8, 37, 6, 421766, timezone(timedelta(hours=-5)))
    assert first.started_at.utcoffset() == timedelta(hours=-5)
    assert (first.warm_up, second.warm_up) == (False, True)
    assert first.conditions == {"ambient_degC": 22.08, "humidity_percent": 41.0}
    assert second.conditions == {"ambient_degC": 22.29}
    probings = campaign.probings
    assert probings.readings["X"][0] == 191.060674
    assert probings.readings["B"][0] == -60 * (math.pi / 180)
    assert math.isnan(probings.channels["x_axis_degC"][2])
    assert [file.name for file in campaign.files] == ["campaign.toml", "runs.csv", "probings.csv"]
    assert campaign.files[2].content == (small / "probings.csv").read_bytes()


def test_small_folder_comes_back_with_every_optional_key(small, tmp_path):
    campaign = read_campaign(small)
    assert_same(read_campaign(write_campaign(campaign, tmp_path / "again")), campaign)


@pytest.mark.parametrize(
    "change",
    [
        lambda content: b"\xef\xbb\xbf" + content,
        lambda content: content.replace(b"\n", b"\r\n"),
        lambda content: b"\xef\xbb\xbf" + content.replace(b"\n", b"\r\n"),
        lambda content: content.rstrip(b"\n"),
        lambda content: content + b"\n\n",
    ],
    ids=["BOM", "CRLF", "BOM and CRLF", "no last line end", "blank lines at the end"],
)
def test_format_1_byte_order_mark_and_line_ends_change_nothing(small, change):
    before = read_campaign(small)
    for path in small.iterdir():
        path.write_bytes(change(path.read_bytes()))
    assert_same(read_campaign(small), before)


def test_rfc_4180_quotes_change_nothing(small):
    before = read_campaign(small)
    for name in ("runs.csv", "probings.csv"):
        lines = (small / name).read_text().splitlines()
        quoted = [",".join(f'"{cell}"' for cell in line.split(",")) for line in lines]
        (small / name).write_text("\n".join(quoted) + "\n")
    assert_same(read_campaign(small), before)


def test_rfc_4180_doubled_quote_and_comma_in_a_name(small, tmp_path):
    toml, rows = small / "campaign.toml", small / "probings.csv"
    toml.write_text(toml.read_text().replace('id = "1"', "id = 'the \"red\", big one ü'"))
    rows.write_text(rows.read_text().replace(".0,1,", '.0,"the ""red"", big one ü",'))
    campaign = read_campaign(small)
    assert 'the "red", big one ü' in set(campaign.probings.target.tolist())
    assert_same(read_campaign(write_campaign(campaign, tmp_path / "again")), campaign)


def test_columns_may_stand_in_any_order(small):
    before = read_campaign(small)
    rows = [line.split(",")[::-1] for line in (small / "probings.csv").read_text().splitlines()]
    (small / "probings.csv").write_text("".join(",".join(row) + "\n" for row in rows))
    assert_same(read_campaign(small), before)


@given(st.decimals(min_value=-36000, max_value=36000, places=6))
def test_every_decimal_of_degrees_comes_back(decimal):
    internal = DEGREE.to_internal(float(decimal))
    assert DEGREE.to_internal(float(decimal_in(DEGREE)(internal))) == internal


@given(st.floats(min_value=-600.0, max_value=600.0, allow_subnormal=False))
def test_any_angle_comes_back_within_one_bit(internal):
    back = DEGREE.to_internal(float(decimal_in(DEGREE)(internal)))
    assert back in (internal, math.nextafter(internal, math.inf), math.nextafter(internal, -math.inf))


def test_probe_uncertainties_of_a_nanometre_come_back():
    write = decimal_in(MICROMETRE)
    for nanometres in range(1, 5000):
        internal = MICROMETRE.to_internal(nanometres / 1000)
        assert MICROMETRE.to_internal(float(write(internal))) == internal


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(-1e5, 1e5), min_size=10, max_size=10))
def test_any_double_of_a_linear_axis_comes_back(tmp_path_factory, values):
    campaign = read_campaign(EXAMPLES / "cold-cold")
    readings = dict(campaign.probings.readings)
    readings["Z"] = np.array(values * 132)
    changed = dataclasses.replace(
        campaign, probings=dataclasses.replace(campaign.probings, readings=readings)
    )
    folder = tmp_path_factory.mktemp("written") / "again"
    assert_same(read_campaign(write_campaign(changed, folder)), changed)
    shutil.rmtree(folder.parent)


def test_writer_refuses_what_the_reader_would_refuse_and_leaves_nothing(small, tmp_path):
    campaign = read_campaign(small)
    few = dataclasses.replace(campaign, probings=campaign.probings.rows(np.arange(9)))
    with pytest.raises(CampaignError, match="run 2: the scale bar was never probed at 'S2'"):
        write_campaign(few, tmp_path / "few" / "folder")
    assert list((tmp_path / "few").iterdir()) == []


def test_writer_does_not_touch_what_is_there(small):
    with pytest.raises(InputError, match="is there already; give a folder that does not exist yet"):
        write_campaign(read_campaign(small), small)


def test_writer_names_a_missing_axis(small, tmp_path):
    campaign = read_campaign(small)
    readings = {axis: values for axis, values in campaign.probings.readings.items() if axis != "C1"}
    less = dataclasses.replace(campaign, probings=dataclasses.replace(campaign.probings, readings=readings))
    with pytest.raises(InputError, match="the probings hold no readings of axis C1"):
        write_campaign(less, tmp_path / "less")


def test_writer_refuses_half_a_character(small, tmp_path):
    odd = dataclasses.replace(read_campaign(small), name="a\ud800")
    with pytest.raises(InputError, match="cannot be written: a name holds half a character"):
        write_campaign(odd, tmp_path / "odd")
