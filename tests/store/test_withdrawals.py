"""A withdrawn campaign counts nowhere, nothing of it is deleted, and its name is free again."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from monitor.exceptions import CampaignError, InputError, NotFoundError
from monitor.records import Campaign
from monitor.store import (
    Database,
    StoredIdentification,
    campaign_notes,
    copied_campaigns,
    copied_runs,
    export_tables,
    import_campaign,
    latest_documents,
    list_campaigns,
    list_withdrawn,
    load_campaign,
    load_certificate,
    machine_history,
    mark_certificate,
    noted_campaigns,
    record_event,
    restore,
    save_analysis,
    save_certificate,
    save_identification,
    take_backup,
    verify_audit,
    withdraw_campaign,
)
from monitor.store.catalogue import campaigns_of_machine
from monitor.store.import_notes import run_fingerprints


@pytest.fixture
def filled(
    db: Database,
    make_campaign: Callable[..., Campaign],
    make_identification: Callable[..., StoredIdentification],
) -> Database:
    """A machine with the campaigns ``one`` and ``two``, both identified, one of them certified."""
    for name in ("one", "two"):
        campaign = make_campaign(name)
        import_campaign(db, campaign, notes=[f"something about {name}"])
        save_identification(db, make_identification(campaign))
        save_analysis(db, "uncertainty", {"of": name}, method="guf", campaign=name)
    save_certificate(db, "C-1", "issued", "one", [1], {"a": 1}, b"pdf")
    return db


def test_a_withdrawn_campaign_counts_nowhere(
    filled: Database, make_campaign: Callable[..., Campaign]
) -> None:
    machine = make_campaign("one").machine.id
    done = withdraw_campaign(filled, "one", " wrong file ")
    assert (done.campaign, done.machine, done.reason, done.certificates) == (
        "one", machine, "wrong file", ("C-1",),
    )  # fmt: skip
    assert [row.campaign for row in list_campaigns(filled)] == ["two"]
    assert set(machine_history(filled, machine).campaign) == {"two"}
    campaigns = machine_history(filled, machine).campaigns
    assert latest_documents(filled, "uncertainty", campaigns) == {"two": {"of": "two"}}
    for view in ("v_runs", "v_probings", "v_parameters", "v_residuals", "v_identifications", "v_analyses",
                 "v_tolerances", "v_import_notes"):  # fmt: skip
        assert {name for (name,) in filled.rows(f"SELECT DISTINCT campaign FROM {view}")} == {"two"}, view
    assert int(filled.frame("SELECT * FROM v_machines")["campaigns"][0]) == 1
    with pytest.raises(
        NotFoundError, match=r"there is no campaign 'one'; it was withdrawn on .* \(wrong file\)"
    ):
        load_campaign(filled, "one")
    assert [row.reason for row in list_withdrawn(filled)] == ["wrong file"]


def test_nothing_of_it_is_deleted_and_the_audit_knows(filled: Database) -> None:
    tables = ("imported_campaign", "source_file", "run", "probing", "identification", "parameter_value", "analysis",
              "import_note", "run_fingerprint")  # fmt: skip
    before = [filled.rows(f"SELECT count(*) FROM {name}") for name in tables]
    withdraw_campaign(filled, "one", "wrong file")
    assert [filled.rows(f"SELECT count(*) FROM {name}") for name in tables] == before
    assert verify_audit(filled).faults == ()
    last = filled.rows("SELECT action, subject, key FROM audit ORDER BY entry DESC LIMIT 1")
    assert last == [("withdraw", "withdrawn campaign", "1")]


@pytest.mark.parametrize(
    ("sql", "fault"),
    [
        ("UPDATE withdrawn_campaign SET reason = 'none'", "withdrawn campaign 1 was altered"),
        ("DELETE FROM withdrawn_campaign", "withdrawn campaign 1 is in the audit, but no longer"),
        ("DELETE FROM probing WHERE campaign_id = 1", "campaign one was altered"),
        ("DELETE FROM probing WHERE campaign_id = 3", r"campaign one \(import 2 of that name\) was altered"),
        ("DELETE FROM import_note WHERE campaign_id = 1", "import notes 1 is in the audit, but no longer"),
    ],
)
def test_verification_sees_what_is_altered_about_it(
    filled: Database, make_campaign: Callable[..., Campaign], sql: str, fault: str
) -> None:
    withdraw_campaign(filled, "one", "wrong file")
    import_campaign(filled, make_campaign("one", location="hall 4"))
    assert verify_audit(filled).faults == ()
    filled.execute(sql)
    faults = "; ".join(verify_audit(filled).faults)
    with pytest.raises(AssertionError, match=fault):
        raise AssertionError(faults)


def test_its_name_is_free_for_the_corrected_folder(
    filled: Database, make_campaign: Callable[..., Campaign]
) -> None:
    corrected = make_campaign("one", location="hall 4", files=(("campaign.toml", b"format = 2\n"),))
    with pytest.raises(CampaignError, match=r"differs from the file.*monitor withdraw one --reason"):
        import_campaign(filled, corrected)
    withdraw_campaign(filled, "one", "wrong hall")
    assert import_campaign(filled, corrected).state == "imported"
    assert load_campaign(filled, "one").machine.location == "hall 4"
    assert filled.rows("SELECT campaign_id FROM campaign WHERE campaign = 'one'") == [(3,)]
    assert verify_audit(filled).faults == ()
    # The latest may be withdrawn as well, and its number is not used again.
    withdraw_campaign(filled, "one", "once more")
    import_campaign(filled, corrected)
    assert filled.rows("SELECT campaign_id FROM campaign WHERE campaign = 'one'") == [(4,)]
    assert verify_audit(filled).faults == ()


def test_a_wrong_topology_goes_with_the_last_campaign_of_the_machine(
    filled: Database, make_campaign: Callable[..., Campaign]
) -> None:
    other = make_campaign("three", topology="w C A b X Y Z (C1) t")
    withdraw_campaign(filled, "one", "wrong topology")
    with pytest.raises(CampaignError, match="the axes of a machine do not change"):
        import_campaign(filled, other)
    withdraw_campaign(filled, "two", "wrong topology")
    assert list(filled.frame("SELECT * FROM v_machines")["machine"]) == []
    import_campaign(filled, other)
    assert list(filled.frame("SELECT * FROM v_machines")["topology"]) == ["w C A b X Y Z (C1) t"]
    assert verify_audit(filled).faults == ()


def test_a_machine_with_an_event_stays(filled: Database, make_campaign: Callable[..., Campaign]) -> None:
    machine = make_campaign("one").machine.id
    record_event(filled, machine, datetime(2026, 1, 1, tzinfo=UTC), "crash", "x")
    for name in ("one", "two"):
        withdraw_campaign(filled, name, "wrong")
    assert list(filled.frame("SELECT * FROM v_machines")["machine"]) == [machine]
    assert len(machine_history(filled, machine).run) == 0


def test_the_campaigns_of_a_machine_are_those_of_the_view(
    filled: Database, make_campaign: Callable[..., Campaign]
) -> None:
    machine = make_campaign("one").machine.id
    import_campaign(filled, make_campaign("three", machine_id="other"))
    withdraw_campaign(filled, "one", "wrong file")
    import_campaign(filled, make_campaign("one", location="hall 4"))
    withdraw_campaign(filled, "three", "wrong machine")
    import_campaign(filled, make_campaign("four", machine_id="other"))
    for name in (machine, "other"):
        right = filled.rows(
            "SELECT campaign_id, campaign, method FROM campaign WHERE machine = ? ORDER BY campaign_id",
            [name],
        )
        found = campaigns_of_machine(filled, name)
        assert [(number, *head) for number, head in found.items()] == right
        assert machine_history(filled, name).campaigns == {number: name for number, name, _ in right}
    assert [name for name, _ in campaigns_of_machine(filled, machine).values()] == ["two", "one"]


def test_a_machine_whose_campaigns_are_all_withdrawn_is_none(
    filled: Database, make_campaign: Callable[..., Campaign]
) -> None:
    machine = make_campaign("one").machine.id
    import_campaign(filled, make_campaign("three", machine_id="other"))
    for name in ("one", "two"):
        withdraw_campaign(filled, name, "wrong")
    refusal = re.escape(f"there is no machine {machine!r}; there are other")
    with pytest.raises(NotFoundError, match=refusal):
        machine_history(filled, machine)
    with pytest.raises(NotFoundError, match=refusal):
        save_analysis(filled, "trend", {}, method="all", machine=machine)
    with pytest.raises(NotFoundError, match=refusal):
        record_event(filled, machine, datetime(2026, 1, 1, tzinfo=UTC), "crash", "x")


def test_its_certificates_stay_and_can_be_withdrawn(filled: Database) -> None:
    withdraw_campaign(filled, "one", "wrong file")
    found = load_certificate(filled, "C-1")
    assert (found.state, found.campaign, found.campaign_withdrawn) == ("issued", "one", "wrong file")
    assert filled.rows("SELECT campaign_withdrawn_at IS NOT NULL FROM v_certificates") == [(True,)]
    mark_certificate(filled, "C-1", "withdrawn", "its campaign was wrong")
    assert load_certificate(filled, "C-1").state == "withdrawn"
    assert verify_audit(filled).faults == ()


def test_a_reason_is_needed_and_a_campaign_that_is_there(filled: Database) -> None:
    with pytest.raises(InputError, match="say why campaign one is withdrawn"):
        withdraw_campaign(filled, "one", "  ")
    with pytest.raises(NotFoundError, match="there is no campaign 'three'; there are one, two"):
        withdraw_campaign(filled, "three", "wrong")
    assert [row.campaign for row in list_withdrawn(filled)] == []


def test_backup_and_export_hold_the_withdrawn_too(
    filled: Database, make_campaign: Callable[..., Campaign], tmp_path: Path
) -> None:
    withdraw_campaign(filled, "one", "wrong file")
    import_campaign(filled, make_campaign("one", location="hall 4"))
    take_backup(filled, tmp_path / "copy.duckdb")
    restore(tmp_path / "copy.duckdb", tmp_path / "back.duckdb")
    with Database(tmp_path / "back.duckdb") as back:
        assert verify_audit(back).faults == ()
        assert [row.campaign for row in list_campaigns(back)] == ["two", "one"]
        assert [row.campaign for row in list_withdrawn(back)] == ["one"]
    written = {path.name for path in export_tables(filled, tmp_path / "tables")}
    assert {
        "imported_campaign.csv",
        "campaign.csv",
        "withdrawn_campaign.csv",
        "v_withdrawn_campaigns.csv",
    } <= written
    assert len((tmp_path / "tables" / "imported_campaign.csv").read_text(encoding="utf-8").splitlines()) == 4


def long_campaign(make: Callable[..., Campaign], name: str, machine: str = "M") -> Campaign:
    """Two runs of 15 touches with readings of their own."""
    small = make(name, machine_id=machine)
    probings = small.probings.rows([0, 1, 2] * 5 + [3, 4, 5] * 5)
    steps = {axis: values + 1e-3 * (1 + k) for k, (axis, values) in enumerate(probings.readings.items())}
    return replace(small, probings=replace(probings, readings=steps))


def test_runs_that_came_in_before_are_named_until_one_of_both_is_withdrawn(
    db: Database, make_campaign: Callable[..., Campaign]
) -> None:
    import_campaign(db, long_campaign(make_campaign, "one"))
    import_campaign(db, long_campaign(make_campaign, "two", machine="N"))
    # Nobody can tell from the readings which of two machines was measured.
    (note,) = campaign_notes(db, "one")
    assert note.startswith("2 runs of one equal those of campaign two of machine N in every reading")
    (note,) = campaign_notes(db, "two")
    assert note == (
        "2 runs of two equal those of campaign one of machine M in every reading, which two measurements never do: "
        "run 1 (there 1), 2 (there 2); withdraw the copy (monitor withdraw)"
    )
    withdraw_campaign(db, "one", "a copy")
    assert campaign_notes(db, "two") == ()


@pytest.mark.parametrize(("copies", "last"), [(2, "c01, run 1 (there 1), 2 (there 2)"), (14, "and 9 more")])
def test_many_copies_are_one_sentence(
    db: Database, make_campaign: Callable[..., Campaign], copies: int, last: str
) -> None:
    for name in [f"c{number:02}" for number in range(copies)] + ["x"]:
        import_campaign(db, long_campaign(make_campaign, name))
    (note,) = campaign_notes(db, "x")
    assert note.startswith(
        f"2 runs of x equal those of {copies} campaigns in every reading, which two measurements never do: "
        "c00, run 1 (there 1), 2 (there 2); c01, run 1"
    )
    assert note.endswith(f"; {last}. Withdraw the copies (monitor withdraw)")


def test_a_temperature_of_its_own_makes_no_other_measurement(
    db: Database, make_campaign: Callable[..., Campaign]
) -> None:
    import_campaign(db, long_campaign(make_campaign, "one"))
    other = long_campaign(make_campaign, "two")
    warmer = {name: values + 0.1 for name, values in other.probings.channels.items()}
    import_campaign(db, replace(other, probings=replace(other.probings, channels=warmer)))
    assert len(campaign_notes(db, "two")) == 1
    third = long_campaign(make_campaign, "three")
    moved = {axis: values + 1e-6 for axis, values in third.probings.readings.items()}
    import_campaign(db, replace(third, probings=replace(third.probings, readings=moved)))
    assert campaign_notes(db, "three") == ()


def test_campaigns_of_short_runs_are_no_copies_of_each_other(
    db: Database, make_campaign: Callable[..., Campaign]
) -> None:
    for number, name in enumerate(("one", "two")):
        short = make_campaign(name)
        moved = {axis: values + 0.01 * number for axis, values in short.probings.readings.items()}
        import_campaign(db, replace(short, probings=replace(short.probings, readings=moved)))
        assert campaign_notes(db, name) == ()


def test_campaigns_from_before_the_hashes_are_compared_too(
    db: Database, make_campaign: Callable[..., Campaign]
) -> None:
    import_campaign(db, long_campaign(make_campaign, "one"))
    db.execute("DELETE FROM run_fingerprint")
    import_campaign(db, long_campaign(make_campaign, "two"))
    assert len(campaign_notes(db, "two")) == 1


def test_copies_are_told_of_campaigns_that_have_no_hashes_yet(
    db: Database, make_campaign: Callable[..., Campaign]
) -> None:
    """As in a file of version 0.1.0 into which nothing was imported since."""
    for name, machine in (("one", "M"), ("two", "N"), ("again", "N")):
        import_campaign(db, long_campaign(make_campaign, name, machine=machine))
    told = {name: copied_runs(db, name) for name in ("one", "two", "again")}
    db.execute("DELETE FROM run_fingerprint WHERE campaign_id <> 2")
    assert {name: copied_runs(db, name) for name in told} == told
    db.execute("DELETE FROM run_fingerprint")
    assert {name: copied_runs(db, name) for name in told} == told
    assert [(run.campaign, run.is_of_another, run.is_earlier) for run in told["again"]] == [
        ("one", True, True), ("one", True, True), ("two", False, True), ("two", False, True),
    ]  # fmt: skip
    # Of one machine the first is taken for the measured one.
    assert {run.campaign for run in told["two"]} == {"one"}
    assert db.rows("SELECT count(*) FROM run_fingerprint") == [(0,)]


def test_campaigns_that_hold_runs_of_others_are_listed_beside_the_first(
    db: Database, make_campaign: Callable[..., Campaign]
) -> None:
    for name, machine in (("one", "M"), ("two", "N"), ("three", "M")):
        import_campaign(db, long_campaign(make_campaign, name, machine=machine), ["a note"] * (name == "two"))
    import_campaign(db, make_campaign("short"))
    listed = copied_campaigns(db)
    assert [(each.campaign, each.runs, each.same_as_campaign) for each in listed] == [
        ("two", 2, "one"), ("three", 2, "one"),
    ]  # fmt: skip
    assert str(listed[0]) == (
        "2 runs of two equal those of one of machine M in every reading, which two measurements never do: withdraw the "
        "copy (monitor withdraw)"
    )
    assert [each.campaign for each in copied_campaigns(db, [2])] == ["two"]
    assert copied_campaigns(db, [1]) == listed
    assert copied_campaigns(db, [4]) == copied_campaigns(db, []) == ()
    assert noted_campaigns(db, [1, 2, 3]) == {"two": 1}
    withdraw_campaign(db, "one", "a copy")
    assert [(each.campaign, each.same_as_campaign) for each in copied_campaigns(db)] == [("three", "two")]


def signed(campaign: Campaign, zero: float) -> Campaign:
    """The campaign with a ``zero`` of either sign as its first reading of X."""
    x = campaign.probings.readings["X"].copy()
    x[0] = zero
    return replace(
        campaign, probings=replace(campaign.probings, readings={**campaign.probings.readings, "X": x})
    )


def test_the_sign_of_a_zero_makes_no_other_measurement(
    db: Database, make_campaign: Callable[..., Campaign]
) -> None:
    """A workbook writes 0 where a program writes -0.0."""
    import_campaign(db, signed(long_campaign(make_campaign, "csv"), -0.0))
    import_campaign(db, signed(long_campaign(make_campaign, "xlsx"), 0.0))
    (note,) = campaign_notes(db, "xlsx")
    assert note.startswith("2 runs of xlsx equal those of campaign csv in every reading")


def test_hashes_from_before_in_which_the_sign_counts_stay_and_are_found_again(
    db: Database, make_campaign: Callable[..., Campaign], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = signed(long_campaign(make_campaign, "before"), -0.0)
    with monkeypatch.context() as as_before:
        as_before.setattr(
            "monitor.store.import_notes.run_fingerprints",
            lambda touches, **_: run_fingerprints(touches, signed_zeros=True),
        )
        import_campaign(db, before)
    stored = db.rows("SELECT * FROM run_fingerprint ORDER BY ALL")
    import_campaign(db, replace(before, name="again"))
    (note,) = campaign_notes(db, "again")
    assert note.startswith("2 runs of again equal those of campaign before in every reading")
    assert db.rows("SELECT * FROM run_fingerprint WHERE campaign_id = 1 ORDER BY ALL") == stored


def test_the_hash_of_a_run_does_not_depend_on_how_much_of_it_is_hashed_at_a_time(
    make_campaign: Callable[..., Campaign], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that are stored stay what they are."""
    probings = long_campaign(make_campaign, "one").probings
    whole = run_fingerprints(probings)
    monkeypatch.setattr("monitor.store.import_notes.ROWS_AT_ONCE", 7)
    assert run_fingerprints(probings) == whole
