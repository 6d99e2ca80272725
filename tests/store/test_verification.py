"""Whatever is altered behind the store's back is seen, and named."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from monitor.records import Campaign
from monitor.store import (
    Database,
    audit,
    import_campaign,
    record_event,
    unrecorded,
    verification,
    verify_audit,
)


@pytest.fixture
def filled(something_of_everything: Database) -> Database:
    """A database with something of everything."""
    return something_of_everything


def test_untouched_database_is_in_order(filled: Database) -> None:
    verification = verify_audit(filled)
    assert verification.ok
    assert (verification.entries, len(verification.last_sha256)) == (7, 64)
    assert filled.rows("SELECT DISTINCT actor FROM audit") == [("the test",)]


def test_empty_database_is_in_order(db: Database) -> None:
    assert verify_audit(db).faults == ()


def test_what_is_stored_while_the_audit_is_compared_has_its_entry(
    tmp_path: Path, make_campaign: Callable[..., Campaign], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sessions of a server do not keep each other from writing."""
    campaign = make_campaign("one")
    with Database(tmp_path / "shop.duckdb") as db, closing(db.session("another")) as other:
        import_campaign(db, campaign)
        stored: list[str] = []

        def storing(read: Callable[[Database], Any]) -> Callable[[Database], Any]:
            def then_stored(session: Database) -> Any:
                answer = read(session)
                answer = answer if isinstance(answer, dict) else list(answer)
                record_event(
                    other, campaign.machine.id, datetime(2026, 1, 1, tzinfo=UTC), "note", f"x {len(stored)}"
                )
                stored.append(read.__name__)
                return answer

            return then_stored

        for read in (verification._audited, verification._keys):
            monkeypatch.setattr(verification, read.__name__, storing(read))
        assert unrecorded(db) == ()
        assert len(stored) == 2
        assert verify_audit(db).faults == ()
        assert len(stored) == 5
        db.execute("DELETE FROM audit WHERE entry = (SELECT max(entry) FROM audit)")
        assert unrecorded(db) == ("event 5 is in the database, but not in the audit",)


@pytest.mark.parametrize(
    ("sql", "fault"),
    [
        ("UPDATE probing SET readings = map(['X','B','C1'], [1e-9, 0.1, 0.0]) WHERE campaign_id = 2 AND position = 3",
         "campaign two was altered"),
        ("DELETE FROM probing WHERE campaign_id = 2 AND position = 6", "campaign two was altered"),
        ("DELETE FROM probing WHERE campaign_id = 2", "campaign two was altered"),
        ("UPDATE run SET warm_up = NOT warm_up WHERE campaign_id = 1 AND run = 1", "campaign one was altered"),
        ("UPDATE run SET utc_offset_s = 0 WHERE campaign_id = 1 AND run = 1", "campaign one was altered"),
        ("UPDATE source_file SET content = 'x'::BLOB WHERE campaign_id = 1 AND file = 'runs.csv'",
         "the file runs.csv of campaign one was altered"),
        ("DELETE FROM source_file WHERE campaign_id = 1", "campaign one was altered"),
        ("UPDATE imported_campaign SET campaign = 'three' WHERE campaign = 'two'",
         "campaign two is in the audit, but no longer"),
        ("UPDATE registered_machine SET topology = 'w t'", "machine HU40 'T' was altered"),
        ("UPDATE model SET effects = ['EB0C']", "model samba version 1 was altered"),
        ("DELETE FROM model", "model samba version 1 is in the audit, but no longer"),
        ("UPDATE parameter_value SET value = value * 1.0000001 WHERE run = 1 AND parameter = 'EX0C'",
         "identification 1 was altered"),
        ("UPDATE parameter_value SET u = u / 2 WHERE run = 1", "identification 1 was altered"),
        ("UPDATE parameter_value SET unit = 'nm' WHERE run = 1", "identification 1 was altered"),
        ("UPDATE identified_values SET value = list_transform(value, lambda one: list_reverse(one))",
         "identification 1 was altered"),
        ("DELETE FROM identified_values", "identification 1 was altered"),
        ("UPDATE campaign_runs SET started_at = list_reverse(started_at) WHERE campaign_id = 1",
         "the row of campaign one in campaign_runs was altered"),
        ("UPDATE campaign_runs SET conditions = list_transform(conditions, lambda one: MAP {'ambient_degC': 20.0})",
         "the row of campaign one in campaign_runs was altered"),
        ("UPDATE campaign_runs SET machine_hash = 0 WHERE campaign_id = 2",
         "the row of campaign two in campaign_runs was altered"),
        ("DELETE FROM campaign_runs WHERE campaign_id = 1", "the row of campaign one in campaign_runs was altered"),
        ("INSERT INTO campaign_runs SELECT * REPLACE (7 AS campaign_id) FROM campaign_runs WHERE campaign_id = 1",
         "the row 7 of campaign_runs was added"),
        ("UPDATE residual SET dx_mm = 0 WHERE run = 1", "identification 1 was altered"),
        ("DELETE FROM identified_run WHERE run = 1", "identification 1 was altered"),
        ("UPDATE analysis SET document = '{}'", "analysis 1 was altered"),
        ("UPDATE event SET happened_at = '2020-01-01'", "event 1 was altered"),
        ("UPDATE certificate SET state = 'draft'", "certificate entry 1, of C-1, was altered"),
        ("DELETE FROM certificate", "certificate C-1 entry 1 is in the audit, but no longer"),
        ("UPDATE audit SET actor = 'nobody' WHERE entry = 3", "audit entry 3 was altered"),
        ("DELETE FROM audit WHERE entry = 3", "audit entry 3 is missing"),
        ("DELETE FROM audit WHERE entry = 7", "event 1 is in the database, but not in the audit"),
    ],
)  # fmt: skip
def test_alteration_is_seen_and_named(filled: Database, sql: str, fault: str) -> None:
    filled.execute(sql)
    verification = verify_audit(filled)
    assert not verification.ok
    assert any(fault in found for found in verification.faults), verification.faults


def test_zeros_that_lose_or_get_a_sign_in_the_file_are_no_alteration(
    campaign: Campaign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # DuckDB keeps a run of equal values with the sign of its first, and minus zero equals zero.
    x = np.where(np.arange(len(campaign.probings)) % 3, 0.0, -0.0)
    probings = dataclasses.replace(campaign.probings, readings={**campaign.probings.readings, "X": x})
    file = tmp_path / "zeros.duckdb"
    with Database(file) as db:
        import_campaign(db, dataclasses.replace(campaign, name="zeros", probings=probings))
    with Database(file) as db:
        assert verify_audit(db).faults == ()
    # A version that hashed the signs, in a file that still has them all: its entries hold.
    plain = audit.bits
    monkeypatch.setattr(
        "monitor.store.probings.bits", lambda values, *, signed_zeros=False: plain(values, signed_zeros=True)
    )
    some = np.where(np.signbit(x), -0.0, 7.0 + np.arange(len(x)))
    only = dataclasses.replace(campaign.probings, readings={**campaign.probings.readings, "X": some})
    with Database(file) as db:
        import_campaign(db, dataclasses.replace(campaign, name="signed", probings=only))
    monkeypatch.undo()
    with Database(file) as db:
        signs = db.rows(
            "SELECT count_if(signbit(readings['X'])) FROM probing JOIN imported_campaign USING (campaign_id) "
            "WHERE campaign = 'signed'"
        )
        assert signs == [(2,)]
        assert verify_audit(db).faults == ()
