"""Results kept as documents, and events: what was stored comes back, the latest first, and bad input is refused."""

from __future__ import annotations

import json
from datetime import datetime, timedelta, timezone

import pytest

from monitor import __version__
from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.records import Campaign
from monitor.store import (
    Database,
    import_campaign,
    latest_text,
    list_events,
    load_analysis,
    record_event,
    save_analysis,
)

DOCUMENT = {"guf": {"k_p": 4.73, "u": {"EA0B": 1 / 3}}, "note": 'weiß "nicht"', "runs": [1, 2]}


def test_document_comes_back_with_seed_and_version(db: Database, campaign: Campaign) -> None:
    import_campaign(db, campaign)
    seed = 2**127 + 1
    save_analysis(db, "uncertainty", DOCUMENT, method="mcm", campaign=campaign.name, run=2, seed=seed)
    stored = load_analysis(db, "uncertainty", campaign=campaign.name, run=2)
    assert (stored.document, stored.seed, stored.software_version) == (DOCUMENT, seed, __version__)
    assert stored.model is None


def test_latest_of_its_kind_is_given_and_the_earlier_stays(db: Database, campaign: Campaign) -> None:
    import_campaign(db, campaign)
    for number, method in enumerate(("guf", "mcm", "guf"), start=1):
        assert (
            save_analysis(db, "uncertainty", {"n": number}, method=method, campaign=campaign.name) == number
        )
    save_analysis(db, "comparison", {"n": 4}, method="lack of fit", campaign=campaign.name, model="samba")
    assert load_analysis(db, "uncertainty").number == 3
    assert load_analysis(db, "uncertainty", method="mcm").number == 2
    assert load_analysis(db, "comparison", machine=campaign.machine.id, model="samba").number == 4
    numbers = db.rows("SELECT analysis_id FROM v_analyses WHERE kind = 'uncertainty' ORDER BY ALL")
    assert numbers == [(1,), (2,), (3,)]


def test_result_that_is_the_latest_already_is_not_stored_again(db: Database, campaign: Campaign) -> None:
    import_campaign(db, campaign)

    def save(document: dict[str, object], **subject: str) -> int:
        return save_analysis(
            db, "trend", document, method="m", seed=3, repeated=False, machine=campaign.machine.id, **subject
        )

    first = save(DOCUMENT)
    entries = db.rows("SELECT count(*) FROM audit")
    assert save(DOCUMENT) == first
    assert db.rows("SELECT count(*) FROM audit") == entries
    # Of another subject, another document, and the first again after it: each is news.
    assert [save(DOCUMENT, model="samba"), save({"n": 1}), save(DOCUMENT)] == [
        first + 1,
        first + 2,
        first + 3,
    ]
    assert load_analysis(db, "trend").document == DOCUMENT


def test_a_latest_result_that_was_read_before_is_not_read_again(
    db: Database, campaign: Campaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    import_campaign(db, campaign)
    machine = campaign.machine.id
    assert latest_text(db, "trend", method="m", machine=machine) is None
    first = save_analysis(db, "trend", DOCUMENT, method="m", seed=3, machine=machine)
    assert latest_text(db, "trend", method="m") is None
    latest = latest_text(db, "trend", method="m", machine=machine)
    assert latest is not None
    assert (latest.number, json.loads(latest.text), latest.seed) == (first, DOCUMENT, "3")

    def save(document: dict[str, object], seed: int) -> int:
        return save_analysis(
            db, "trend", document, method="m", seed=seed, repeated=False, machine=machine, latest=latest
        )

    with monkeypatch.context() as nothing_is_asked:
        nothing_is_asked.setattr(db, "rows", None)
        assert save(DOCUMENT, 3) == first
    # Another seed or another document is news.
    assert [save(DOCUMENT, 4), save({"n": 1}, 3)] == [first + 1, first + 2]


def test_document_that_is_not_json(db: Database) -> None:
    with pytest.raises(DataError, match=r"the trend result cannot be kept as JSON: [Oo]ut of range float"):
        save_analysis(db, "trend", {"slope": float("nan")}, method="robust")
    with pytest.raises(DataError, match="the trend result cannot be kept as JSON"):
        save_analysis(db, "trend", {"slope": object()}, method="robust")
    with pytest.raises(InputError, match="a result needs a kind"):
        save_analysis(db, "", {}, method="robust")


def test_result_of_what_is_not_there(db: Database, campaign: Campaign) -> None:
    with pytest.raises(NotFoundError, match="there is no campaign 'x'"):
        save_analysis(db, "trend", {}, method="m", campaign="x")
    with pytest.raises(NotFoundError, match="there is no machine 'x'"):
        save_analysis(db, "trend", {}, method="m", machine="x")
    with pytest.raises(NotFoundError, match="no stored trend result of x, run 2 yet"):
        load_analysis(db, "trend", campaign="x", run=2)


def test_event_is_kept_with_the_shops_clock(db: Database, campaign: Campaign) -> None:
    import_campaign(db, campaign)
    at = datetime(2026, 3, 5, 23, 30, tzinfo=timezone(timedelta(hours=-5)))
    later = record_event(db, campaign.machine.id, at, "repair", "B zero reset; it's fine")
    first = record_event(db, campaign.machine.id, at - timedelta(days=1), "crash", "")
    assert [event.event_id for event in list_events(db, campaign.machine.id)] == [first, later]
    assert db.rows(
        "SELECT CAST(happened_at AS VARCHAR), CAST(happened_at_local AS VARCHAR), kind, description "
        "FROM v_events WHERE event_id = ?",
        [later],
    ) == [("2026-03-06 04:30:00", "2026-03-05 23:30:00", "repair", "B zero reset; it's fine")]


def test_event_needs_machine_kind_and_offset(db: Database, campaign: Campaign) -> None:
    import_campaign(db, campaign)
    at = datetime(2026, 3, 5, 23, 30)
    with pytest.raises(InputError, match="needs its offset from UTC; 2026-03-05T23:30:00 has none"):
        record_event(db, campaign.machine.id, at, "repair", "")
    with pytest.raises(InputError, match="an event needs a kind"):
        record_event(db, campaign.machine.id, at.astimezone(), " ", "")
    with pytest.raises(NotFoundError, match="there is no machine 'x'; there are HU40 'T'"):
        record_event(db, "x", at.astimezone(), "repair", "")
