"""One import is one transaction; what comes back equals what went in, to the last digit and byte."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
from hypothesis import given, strategies as st

from monitor.exceptions import CampaignError, DataError, NotFoundError
from monitor.records import Campaign, Machine, Probings, Run
from monitor.store import (
    Database,
    import_campaign,
    list_campaigns,
    list_runs,
    load_campaign,
)
from monitor.store.probings import as_record, printed
from monitor.units import DEGREE

Make = Callable[..., Campaign]
TURNING = Machine("M", "w B b X (C1) t")


def _assert_same_arrays(one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> None:
    assert list(one) == list(other)
    for name in one:
        assert one[name].dtype == other[name].dtype
        np.testing.assert_array_equal(one[name], other[name], strict=True)
        np.testing.assert_array_equal(np.signbit(one[name]), np.signbit(other[name]))


def _assert_same(one: Campaign, other: Campaign) -> None:
    _assert_same_arrays(one.probings.readings, other.probings.readings)
    _assert_same_arrays(one.probings.channels, other.probings.channels)
    for field in ("run", "sequence", "time", "target"):
        np.testing.assert_array_equal(
            getattr(one.probings, field), getattr(other.probings, field), strict=True
        )
    empty = dataclasses.replace(one, probings=other.probings)
    assert empty == other
    assert [run.started_at.utcoffset() for run in one.runs] == [
        run.started_at.utcoffset() for run in other.runs
    ]


def _tables(db: Database) -> dict[str, int]:
    names = [name for (name,) in db.rows("SELECT table_name FROM duckdb_tables()")]
    return {name: db.rows(f"SELECT count(*) FROM {name}")[0][0] for name in names}


def test_what_comes_back_equals_what_went_in(db: Database, campaign: Campaign) -> None:
    import_campaign(db, campaign)
    _assert_same(load_campaign(db, campaign.name), campaign)


def test_what_comes_back_equals_what_went_in_after_closing(path: object, campaign: Campaign) -> None:
    with Database(str(path)) as db:
        import_campaign(db, campaign)
    with Database(str(path), read_only=True) as db:
        _assert_same(load_campaign(db, campaign.name), campaign)


def test_bare_campaign_without_channels_conditions_and_bar(db: Database, campaign: Campaign) -> None:
    bare = dataclasses.replace(
        campaign,
        machine=dataclasses.replace(campaign.machine, axes={}, tolerances={}),
        probe=dataclasses.replace(campaign.probe, tip=None, certificate=None),
        artefact=dataclasses.replace(campaign.artefact, scale_bar=None),
        probings=dataclasses.replace(campaign.probings, channels={}),
        files=(),
    )
    import_campaign(db, bare)
    _assert_same(load_campaign(db, bare.name), bare)
    assert import_campaign(db, bare).state == "unchanged"
    with pytest.raises(CampaignError, match="its content differs from that imported on"):
        import_campaign(db, dataclasses.replace(bare, method="rotary-probing"))


def test_readings_are_kept_in_the_digits_that_the_controller_printed(
    db: Database, campaign: Campaign
) -> None:
    import_campaign(db, campaign)
    rows = db.rows("SELECT x_mm, b_deg FROM v_probings ORDER BY run DESC, sequence")
    assert [str(x) for x, _ in rows] == ["191.060674", "-72.530157", "0.1", "26.519621", "1e-06", "-0.3"]
    assert [str(b) for _, b in rows] == ["-60.0", "-235.123456", "0.1", "29.9998", "359.99999", "123.4567"]


@given(st.integers(-(10**11), 10**11), st.integers(0, 9))
def test_any_printed_degree_returns_to_the_last_digit(digits: int, decimals: int) -> None:
    degrees = float(f"{digits}e-{decimals}")
    radians = np.array([degrees * DEGREE.factor])
    one = np.array([1])
    rows = printed(Probings(one, one, np.zeros(1), np.array(["S1"]), {"B": radians}), TURNING)
    assert rows.readings["B"][0] * DEGREE.factor == radians[0]
    np.testing.assert_array_equal(as_record(rows, TURNING).readings["B"], radians)
    # A shorter number that gives the same radians may stand for it: then both are the same to a double.
    assert abs(rows.readings["B"][0] - degrees) <= np.spacing(abs(degrees))


def test_reading_that_no_degree_gives_is_kept_to_one_unit_of_the_last_place() -> None:
    radians = np.random.default_rng(3).uniform(-7, 7, 2000)
    count = np.arange(len(radians))
    rows = printed(Probings(count, count, radians, np.array(["S1"] * len(radians)), {"C1": radians}), TURNING)
    assert np.all(np.abs(as_record(rows, TURNING).readings["C1"] - radians) <= np.spacing(np.abs(radians)))


def test_every_file_is_kept_byte_for_byte_and_hashed(db: Database, campaign: Campaign) -> None:
    import_campaign(db, campaign)
    stored = db.rows("SELECT file, content, sha256 FROM source_file ORDER BY file")
    assert stored == [(f.name, f.content, hashlib.sha256(f.content).hexdigest()) for f in campaign.files]


def test_importing_again_changes_nothing_and_says_so(db: Database, campaign: Campaign) -> None:
    first = import_campaign(db, campaign)
    before = _tables(db)
    again = import_campaign(db, campaign)
    assert (first.state, again.state) == ("imported", "unchanged")
    assert str(first).endswith(": imported, 2 runs, 6 probings")
    assert "was imported before with the same content, nothing changed" in str(again)
    assert _tables(db) == before


def test_same_name_other_content_names_the_files_that_differ(db: Database, make_campaign: Make) -> None:
    import_campaign(db, make_campaign())
    before = _tables(db)
    other = make_campaign(
        files=(("campaign.toml", b"format = 1\n"), ("probings.csv", b"changed"), ("notes.txt", b"new"))
    )
    with pytest.raises(CampaignError, match="nothing of it was kept: 3 faults") as refusal:
        import_campaign(db, other)
    said = {fault.file: fault.message for fault in refusal.value.faults}
    assert set(said) == {"notes.txt", "probings.csv", "runs.csv"}
    assert said["notes.txt"].startswith("was not there when imported on")
    assert said["probings.csv"].startswith("differs from the file imported on")
    assert said["runs.csv"].startswith("is missing; it was imported on")
    assert _tables(db) == before


def test_topology_of_a_machine_does_not_change(db: Database, make_campaign: Make) -> None:
    import_campaign(db, make_campaign("one"))
    before = _tables(db)
    with pytest.raises(
        CampaignError, match=r"machine HU40 'T' is known as 'w C B X b Z Y \(C1\) t', here it is"
    ):
        import_campaign(db, make_campaign("two", topology="w X Y b Z t"))
    assert _tables(db) == before


def test_machine_is_described_by_its_latest_campaign_whatever_the_order_of_import(
    db: Database, make_campaign: Make
) -> None:
    late = datetime(2027, 1, 1, tzinfo=timezone(timedelta(hours=1)))
    newer = make_campaign("newer", location="hall 9", start=late)
    import_campaign(db, newer)
    older = make_campaign("older", location="hall 1")
    import_campaign(db, older)
    table = db.frame("SELECT * FROM v_machines")
    assert list(table["location"]) == ["hall 9"]
    assert list(table["latest_campaign"]) == ["newer"]
    assert load_campaign(db, "older").machine == older.machine


def test_failure_in_the_middle_keeps_nothing(
    db: Database, campaign: Campaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("pulled the plug")

    monkeypatch.setattr("monitor.store.campaigns.audit.record", fail)
    before = _tables(db)
    with pytest.raises(RuntimeError, match="pulled the plug"):
        import_campaign(db, campaign)
    assert _tables(db) == before


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_reading_that_is_not_finite(db: Database, campaign: Campaign, wrong: float) -> None:
    readings = {**campaign.probings.readings, "X": np.array([1.0, 2.0, wrong, 0.0, 0.0, 0.0])}
    bad = dataclasses.replace(campaign, probings=dataclasses.replace(campaign.probings, readings=readings))
    with pytest.raises(DataError, match="X must be a finite number; row 3 of the probings has"):
        import_campaign(db, bad)


def test_channel_that_is_infinite(db: Database, campaign: Campaign) -> None:
    channels = {"x_axis_degC": np.array([1.0, np.inf, 0.0, 0.0, 0.0, 0.0])}
    bad = dataclasses.replace(campaign, probings=dataclasses.replace(campaign.probings, channels=channels))
    with pytest.raises(DataError, match="channel x_axis_degC must be finite or empty; row 2 has inf"):
        import_campaign(db, bad)


def test_run_without_offset_or_with_a_condition_that_is_no_number(db: Database, campaign: Campaign) -> None:
    naive = Run(1, datetime(2026, 3, 2), 1, False)
    with pytest.raises(DataError, match=r"run 1 starts at .*, without its offset from UTC"):
        import_campaign(db, dataclasses.replace(campaign, runs=(naive,)))
    hot = dataclasses.replace(campaign.runs[0], conditions={"ambient_degC": float("inf")})
    with pytest.raises(DataError, match="condition ambient_degC of run 2 must be a finite number, not inf"):
        import_campaign(db, dataclasses.replace(campaign, runs=(hot,)))


def test_campaign_without_a_touch(db: Database, campaign: Campaign) -> None:
    none = campaign.probings.rows(np.zeros(6, dtype=bool))
    with pytest.raises(DataError, match="needs at least one probing"):
        import_campaign(db, dataclasses.replace(campaign, probings=none))


def test_unknown_campaign_lists_what_is_there(db: Database, make_campaign: Make) -> None:
    with pytest.raises(NotFoundError, match=r"there is no campaign 'x'; the database .* is still empty"):
        load_campaign(db, "x")
    import_campaign(db, make_campaign("one"))
    import_campaign(db, make_campaign("two"))
    with pytest.raises(NotFoundError, match=r"there is no campaign 'x'; there are one, two"):
        list_runs(db, "x")


def test_views_show_units_and_the_shops_clock(db: Database, campaign: Campaign) -> None:
    import_campaign(db, campaign)
    (row,) = list_campaigns(db)
    assert (row.runs, row.probings, row.days) == (2, 6, 2)
    assert (row.probe_u_um, row.scale_bar_mm) == (1.0, 304.98923)
    assert db.rows("SELECT CAST(started_at_local AS VARCHAR), ambient_degc FROM v_runs WHERE run = 2") == [
        ("2026-03-02 08:37:06.421766", 22.08)
    ]
    assert [row.run for row in list_runs(db, campaign.name)] == [2, 1]
    assert db.rows("SELECT parameter, tolerance FROM v_tolerances ORDER BY ALL") == [
        ("EC0Y", 20.0),
        ("EXX", 0.1),
    ]
