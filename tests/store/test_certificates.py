"""The life of a certificate: issued once, never changed, amended or withdrawn with a reason."""

from __future__ import annotations

import hashlib

import pytest

from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.records import Campaign
from monitor.store import (
    Database,
    certificates_in_force,
    find_certificate,
    import_campaign,
    list_certificates,
    load_certificate,
    mark_certificate,
    save_certificate,
    withdraw_campaign,
)
from monitor.store.certificates import certificate_faults

RECORD = {"laboratory": "Prüflabor", "u": {"EA0B_urad": 1 / 3}}


@pytest.fixture(autouse=True)
def _campaign(db: Database, campaign: Campaign) -> None:
    import_campaign(db, campaign)


def _issue(db: Database, campaign: Campaign, number: str, pdf: bytes = b"%PDF-1.7\x00\xff") -> None:
    save_certificate(db, number, "issued", campaign.name, [2, 1], RECORD, pdf)


def test_issued_one_comes_back_byte_for_byte(db: Database, campaign: Campaign) -> None:
    _issue(db, campaign, "C-1")
    stored = load_certificate(db, "C-1")
    assert (stored.state, stored.pdf, stored.record, stored.runs) == (
        "issued",
        b"%PDF-1.7\x00\xff",
        RECORD,
        (2, 1),
    )
    assert stored.pdf_sha256 == hashlib.sha256(stored.pdf).hexdigest()
    assert find_certificate(db, stored.pdf_sha256) == "C-1"
    assert find_certificate(db, "0" * 64) is None


def test_draft_may_change_until_it_is_issued(db: Database, campaign: Campaign) -> None:
    for pdf in (b"one", b"two"):
        save_certificate(db, "C-1", "draft", campaign.name, [1], RECORD, pdf)
    assert (load_certificate(db, "C-1").state, load_certificate(db, "C-1").pdf) == ("draft", b"two")
    _issue(db, campaign, "C-1", b"three")
    assert (load_certificate(db, "C-1").state, load_certificate(db, "C-1").pdf) == ("issued", b"three")


@pytest.mark.parametrize("state", ["draft", "issued"])
def test_issued_one_never_changes(db: Database, campaign: Campaign, state: str) -> None:
    _issue(db, campaign, "C-1")
    with pytest.raises(InputError, match=f"C-1 is issued; it can become amended or withdrawn, not {state}"):
        save_certificate(db, "C-1", state, campaign.name, [1], RECORD, b"other")
    assert load_certificate(db, "C-1").pdf == b"%PDF-1.7\x00\xff"


def test_amended_one_names_its_successor_and_keeps_its_document(db: Database, campaign: Campaign) -> None:
    _issue(db, campaign, "C-1", b"old")
    _issue(db, campaign, "C-2", b"new")
    mark_certificate(db, "C-1", "amended", "customer's name", "C-2")
    stored = load_certificate(db, "C-1")
    assert (stored.state, stored.reason, stored.replaced_by, stored.pdf) == (
        "amended",
        "customer's name",
        "C-2",
        b"old",
    )
    assert list(list_certificates(db)["state"]) == ["amended", "issued"]
    with pytest.raises(InputError, match="C-1 is amended; that is final, nothing can be changed"):
        mark_certificate(db, "C-1", "withdrawn", "again")


def test_marking_needs_reason_successor_and_number(db: Database, campaign: Campaign) -> None:
    _issue(db, campaign, "C-1")
    with pytest.raises(InputError, match="C-1 can be withdrawn only with a reason"):
        mark_certificate(db, "C-1", "withdrawn", " ")
    with pytest.raises(InputError, match="C-1 is amended by one of another number"):
        mark_certificate(db, "C-1", "amended", "typo", "C-1")
    with pytest.raises(NotFoundError, match="there is no certificate 'C-9'; there are C-1"):
        mark_certificate(db, "C-1", "amended", "typo", "C-9")
    with pytest.raises(InputError, match="a certificate needs a number"):
        save_certificate(db, "", "issued", campaign.name, [1], RECORD, b"x")
    with pytest.raises(DataError, match="the record of certificate C-3 cannot be kept as JSON"):
        save_certificate(db, "C-3", "issued", campaign.name, [1], {"u": float("inf")}, b"x")


@pytest.mark.parametrize(
    ("sql", "fault"),
    [
        (
            "UPDATE certificate SET pdf = 'forged'::BLOB WHERE entry = 2",
            "the document of certificate C-2 was altered",
        ),
        ("UPDATE certificate SET record = '{}' WHERE entry = 2", "entry 2, of C-2, was altered"),
        ("DELETE FROM certificate WHERE entry = 2", "certificate entry 2 is missing"),
    ],
)
def test_chain_shows_what_was_altered(db: Database, campaign: Campaign, sql: str, fault: str) -> None:
    for number in ("C-1", "C-2", "C-3"):
        _issue(db, campaign, number, number.encode())
    assert certificate_faults(db) == ()
    db.execute(sql)
    assert any(fault in found for found in certificate_faults(db))


@pytest.mark.parametrize("reason", ["-", " ", "...", "1"])
def test_a_reason_is_said_in_words(db: Database, campaign: Campaign, reason: str) -> None:
    """Of a withdrawal for "-" the certificate said ``campaign_withdrawn: -``, which reads as no."""
    _issue(db, campaign, "C-1")
    with pytest.raises(InputError, match="C-1 can be withdrawn only with a reason in words"):
        mark_certificate(db, "C-1", "withdrawn", reason)
    with pytest.raises(InputError, match="say why campaign"):
        withdraw_campaign(db, campaign.name, reason)
    with pytest.raises(InputError, match=r"the reason holds the character U\+202E, which nobody sees"):
        mark_certificate(db, "C-1", "withdrawn", "wrong \u202ebar")


def test_the_certificates_in_force_are_those_issued_and_neither_amended_nor_withdrawn(
    db: Database, campaign: Campaign
) -> None:
    for number in ("C-1", "C-2", "C-3"):
        _issue(db, campaign, number)
    mark_certificate(db, "C-1", "amended", "a word", "C-2")
    mark_certificate(db, "C-3", "withdrawn", "the bar was wrong")
    assert [number for number, _ in certificates_in_force(db, campaign.name)] == ["C-2"]
