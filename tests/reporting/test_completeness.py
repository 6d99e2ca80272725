"""ISO/IEC 17025:2017, 7.8.2.1 a to p and 7.8.4.1 a to f: each item as a user leaves it out of the laboratory's file."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from datetime import date, timedelta
from pathlib import Path

import pytest

from monitor.exceptions import InputError
from monitor.records import Campaign
from monitor.reporting.certificate.assembly import CertificateIdentity, certificate_record
from monitor.reporting.certificate.completeness import (
    check_complete,
    date_faults,
    gaps_of_text,
    missing_items,
)
from monitor.reporting.certificate.laboratory import read_laboratory
from monitor.reporting.certificate.record import ITEMS, CertificateRecord, NotApplicable, Replaced
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.texts import texts_of

Make = Callable[..., CertificateRecord]
CHECKOUT = Path(__file__).resolve().parents[2]
LABORATORY = (CHECKOUT / "examples" / "laboratory.toml").read_text(encoding="utf-8")

#: A line of the laboratory's file (its section and key): what the certificate then lacks.
LEFT_OUT = {
    "statements.title": "7.8.2.1 a",
    "laboratory.name": "7.8.2.1 b",
    "laboratory.address": "7.8.2.1 b",
    "laboratory.contact": "7.8.2.1 b",
    "item.place": "7.8.2.1 c",
    "customer.name": "7.8.2.1 e",
    "customer.address": "7.8.2.1 e",
    "customer.contact": "7.8.2.1 e",
    "method.document": "7.8.2.1 f",
    "item.condition": "7.8.2.1 g",
    "item.received_on": "7.8.2.1 h",
    "statements.sampling": "7.8.2.1 k",
    "statements.relates_only": "7.8.2.1 l",
    "statements.deviations": "7.8.2.1 n",
    "authorised_by.name": "7.8.2.1 o",
    "authorised_by.function": "7.8.2.1 o",
    "statements.external_results": "7.8.2.1 p",
    "statements.reproduction": "7.8.2.1 note",
    "traceability.statement": "7.8.4.1 c",
    "traceability.probe": "7.8.4.1 c",
    "statements.adjustment": "7.8.4.1 d",
    "statements.conformity": "7.8.4.1 e",
    "statements.opinions": "7.8.4.1 f",
}
STATES = ("as_found", "as_left")
#: What no laboratory's file says, and a record can lack all the same.
FROM_ELSEWHERE = {
    "number": "7.8.2.1 d",
    "performed_on": "7.8.2.1 i",
    "issued_on": "7.8.2.1 j",
    "results": "7.8.2.1 m and 7.8.4.1 a",
    "conditions": "7.8.4.1 b",
}


def changed(key: str, value: str | None) -> str:
    """The example file with another value of a key, or without its line."""
    section, _, name = key.partition(".")
    head = f"[[{section}]]" if section == "authorised_by" else f"[{section}]"
    before, found, rest = LABORATORY.partition(head)
    assert found, key
    line = rf'^{name} = (?:"""(?:.|\n)*?"""|.*)$'
    text, count = re.subn(
        line, lambda _: "" if value is None else f"{name} = {value}", rest, count=1, flags=re.M
    )
    assert count == 1, key
    return before + found + text


@pytest.fixture
def lacking(
    campaign: Campaign, make_result: Callable[..., ResultSet], tmp_path: Path
) -> Callable[[str], set[tuple[str, str]]]:
    """Clauses and parts that a certificate of a laboratory's file lacks."""

    def read(text: str) -> set[tuple[str, str]]:
        place = tmp_path / "laboratory.toml"
        place.write_text(text, encoding="utf-8")
        record = certificate_record(
            read_laboratory(place),
            campaign,
            1,
            [make_result(2)],
            CertificateIdentity("N", date(2026, 3, 3), "samba"),
        )
        return {(one.clause, one.part) for one in missing_items(record)}

    return read


def test_17025_every_letter_is_left_out_below() -> None:
    asked = {part for clause, _ in ITEMS.values() for part in clause.split(" and ")}
    tried = {
        part for clause in [*LEFT_OUT.values(), *FROM_ELSEWHERE.values()] for part in clause.split(" and ")
    }
    letters = {f"7.8.2.1 {one}" for one in "abcdefghijklmnop"} | {f"7.8.4.1 {one}" for one in "abcdef"}
    assert letters <= tried
    assert tried == asked


def test_the_example_lacks_nothing(lacking: Callable[[str], set[tuple[str, str]]]) -> None:
    assert lacking(LABORATORY) == set()


@pytest.mark.parametrize(
    "value", [None, '""', '" \\t "', '"n/a"', '"\\u2013"', '"TBD"', '"\\u200b"'], ids=lambda one: str(one)
)
@pytest.mark.parametrize("key", LEFT_OUT)
def test_17025_a_line_that_is_left_out_or_says_nothing_is_told_with_its_clause(
    key: str, value: str | None, lacking: Callable[[str], set[tuple[str, str]]]
) -> None:
    if value is not None and key.endswith(".address"):
        value = f"[{value}]"
    if value is not None and key == "item.received_on":
        value = f"{{ not_applicable = {value} }}"
    found = lacking(changed(key, value))
    assert {clause for clause, _ in found} == {LEFT_OUT[key]}, found


@pytest.mark.parametrize("name", FROM_ELSEWHERE)
def test_17025_what_the_campaign_and_the_software_know_is_asked_for_too(name: str, make_record: Make) -> None:
    missing = missing_items(dataclasses.replace(make_record(2), **{name: None}))
    assert [one.clause for one in missing] == [FROM_ELSEWHERE[name]]


def test_a_placeholder_is_quoted_where_it_stands(lacking: Callable[[str], set[tuple[str, str]]]) -> None:
    text = changed("customer.address", '["2 Example Street", "-"]').replace(
        '{ not_applicable = "no sampling took place" }', '{ not_applicable = "N/A" }'
    )
    assert lacking(text) == {
        ("7.8.2.1 e", "address: '-' says nothing"),
        ("7.8.2.1 k", "statement: 'N/A' says nothing"),
    }


@pytest.mark.parametrize("unit", ["%", "‰", "°"])
def test_a_unit_that_is_a_sign_states_something(unit: str) -> None:
    """Relative humidity, which the campaign format names, was taken for a blank: no certificate could be issued."""
    assert gaps_of_text(unit) == []
    assert gaps_of_text(f" {unit}-") != []


def test_dates_that_cannot_be_true_together_are_refused(make_record: Make) -> None:
    record = make_record(2)
    assert record.performed_on is not None
    first = record.performed_on[0]
    day = timedelta(days=1)
    assert date_faults(record) == ()
    assert date_faults(dataclasses.replace(record, received_on=first, issued_on=first)) == ()
    late = dataclasses.replace(record, received_on=first + day, issued_on=first - day)
    assert date_faults(late) == (
        "the item was received on 2026-03-03, after the calibration of 2026-03-02",
        "it was issued on 2026-03-01, before the calibration of 2026-03-02",
    )
    with pytest.raises(
        InputError, match="its dates contradict one another:\n  the item was received on 2026-03-03"
    ):
        check_complete(late)
    turned = dataclasses.replace(record, performed_on=(first, first - day))
    assert date_faults(turned)[0] == "the calibration ended on 2026-03-01, before it began on 2026-03-02"
    old = Replaced("N-1", date(2026, 3, 9), "why", "0" * 64)
    assert date_faults(dataclasses.replace(record, replaces=old)) == (
        "it replaces certificate N-1 of 2026-03-09, and was issued on 2026-03-03, before it",
    )


def test_17025_7_8_4_1_d_two_states_have_their_conditions_apart(
    make_record: Make, campaign: Campaign, make_result: Callable[..., ResultSet], tmp_path: Path
) -> None:
    (run,) = campaign.runs
    later = dataclasses.replace(
        run, run=2, started_at=run.started_at + timedelta(days=2), conditions={"ambient_degC": 20.5}
    )
    both = dataclasses.replace(campaign, runs=(run, later))
    place = tmp_path / "laboratory.toml"
    place.write_text(LABORATORY, encoding="utf-8")
    results = [
        dataclasses.replace(make_result(2), state=texts_of()(f"record.{one}"))
        for one in ("as_found", "as_left")
    ]
    record = certificate_record(
        read_laboratory(place), both, [1, 2], results, CertificateIdentity("N", date(2026, 3, 9), "samba")
    )
    assert record.performed_on == (date(2026, 3, 2), date(2026, 3, 4))
    assert record.conditions is not None
    said = {one.name: one.value for one in record.conditions}
    assert said["ambient temperature, as found"] == "22.08\N{NO-BREAK SPACE}°C"
    assert said["ambient temperature, as left"] == "20.5\N{NO-BREAK SPACE}°C"
    assert said["artefact"] == "four balls and a scale bar"  # the same for both
    assert "run" not in said
    assert missing_items(record) == ()
    assert not isinstance(record.adjustment, NotApplicable)
