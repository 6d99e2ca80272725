"""ISO/IEC 17025:2017, 7.8.2.1 a to p and 7.8.4.1 a to f: every item is asked for, none is invented."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from datetime import date

import numpy as np
import pytest

from monitor.exceptions import DataError, NotFoundError
from monitor.records import Campaign
from monitor.reporting.certificate.assembly import CertificateIdentity, certificate_record
from monitor.reporting.certificate.completeness import (
    IncompleteCertificateError,
    check_complete,
    missing_items,
)
from monitor.reporting.certificate.laboratory import LaboratoryFile
from monitor.reporting.certificate.record import (
    ITEMS,
    CertificateRecord,
    NotApplicable,
    Replaced,
)
from monitor.reporting.certificate.results import (
    CoverageFactors,
    JointEstimate,
    ResultSet,
    ResultStatements,
    result_set,
)
from monitor.reporting.pdf.render import certificate_pdf
from monitor.reporting.refused import RefusedParameters
from monitor.units import MICROMETRE, MICRORADIAN

Make = Callable[..., CertificateRecord]


def test_17025_every_letter_of_both_clauses_has_a_field() -> None:
    clauses = " and ".join(clause for clause, _ in ITEMS.values()).split(" and ")
    assert {f"7.8.2.1 {letter}" for letter in "abcdefghijklmnop"} <= set(clauses)
    assert {f"7.8.4.1 {letter}" for letter in "abcdef"} <= set(clauses)
    assert set(ITEMS) == {place.name for place in dataclasses.fields(CertificateRecord)} - {
        "accepted",
        "accreditation",
        "accredited",
        "mark",
        "standards",
        "anchor",
        "dcc_version",
        "draft",
        "signer",
        "country",
        "replaces",
        "volumetric",
        "language",
    }


def test_17025_a_complete_record_lacks_nothing(make_record: Make) -> None:
    assert missing_items(make_record()) == ()


@pytest.mark.parametrize("name", sorted(ITEMS))
def test_17025_item_that_is_missing_is_named_with_its_clause(name: str, make_record: Make) -> None:
    clause, item = ITEMS[name]
    missing = missing_items(dataclasses.replace(make_record(), **{name: None}))
    assert [(one.clause, one.item, one.part) for one in missing] == [(clause, item, "")]
    key = f": write {missing[0].key}" if missing[0].key else ""
    assert str(missing[0]) == f"{item}{key} (ISO/IEC 17025:2017, {clause})"


@pytest.mark.parametrize("name", sorted(ITEMS))
def test_17025_no_item_has_a_default(name: str, make_record: Make) -> None:
    given = {
        place.name: getattr(make_record(), place.name) for place in dataclasses.fields(CertificateRecord)
    }
    del given[name]
    with pytest.raises(TypeError, match=f"missing 1 required keyword-only argument: '{name}'"):
        CertificateRecord(**given)


def test_17025_blank_text_and_blank_reason_count_as_missing(make_record: Make) -> None:
    record = dataclasses.replace(make_record(), title="  ", sampling=NotApplicable(""), results=())
    assert [(one.clause, one.part) for one in missing_items(record)] == [
        ("7.8.2.1 a", ""),
        ("7.8.2.1 k", "statement"),
        ("7.8.2.1 m and 7.8.4.1 a", ""),
    ]


def test_17025_missing_part_of_an_item_is_named(make_record: Make) -> None:
    record = make_record()
    assert record.customer is not None
    assert record.references is not None
    customer = dataclasses.replace(record.customer, address=(), contact=None)
    probe = dataclasses.replace(record.references[1], certificate=None)
    broken = dataclasses.replace(record, customer=customer, references=(record.references[0], probe))
    assert [(one.item, one.part) for one in missing_items(broken)] == [
        ("customer", "address"),
        ("customer", "contact"),
        ("standards that carry the traceability", "certificate of probe probe-1 (touch-trigger probe)"),
    ]


def test_17025_result_without_state_or_evaluation_is_incomplete(make_record: Make) -> None:
    record = make_record()
    assert record.results is not None
    result = dataclasses.replace(record.results[0], state="", evaluation=" ")
    parts = [one.part for one in missing_items(dataclasses.replace(record, results=(result,)))]
    assert parts == ["state of the machine (as found, as left)", "how the uncertainty was evaluated"]


def test_17025_7_8_8_a_replacing_certificate_without_number_or_reason_is_incomplete(
    make_record: Make,
) -> None:
    record = make_record()
    assert (
        missing_items(dataclasses.replace(record, replaces=Replaced("N", date(2026, 1, 1), "why", "ab")))
        == ()
    )
    missing = missing_items(dataclasses.replace(record, replaces=Replaced(None, None, " ", None)))
    assert [one.part for one in missing] == ["number", "issued_on", "reason", "sha256"]
    assert {one.clause for one in missing} == {"7.8.8.1 and 7.8.8.3"}


def test_incomplete_certificate_is_refused_with_the_whole_list(make_record: Make) -> None:
    record = dataclasses.replace(make_record(), number=None, opinions=None)
    expected = (
        r"the certificate is refused: 2 items are missing\n"
        r"  unique number of the certificate \(ISO/IEC 17025:2017, 7\.8\.2\.1 d\)\n"
        r"  opinions and interpretations or that it does not apply: write \[statements\] opinions "
        r"\(ISO/IEC 17025:2017, 7\.8\.4\.1 f\)\n"
        r"the keys are those of the laboratory's file where no other is named"
    )
    with pytest.raises(IncompleteCertificateError, match=expected):
        check_complete(record)
    with pytest.raises(IncompleteCertificateError, match="2 items are missing"):
        certificate_pdf(record)


def test_assembly_takes_each_item_from_its_one_origin(
    laboratory: LaboratoryFile, campaign: Campaign, make_result: Callable[..., ResultSet]
) -> None:
    record = certificate_record(
        laboratory,
        campaign,
        1,
        [make_result()],
        CertificateIdentity("N", date(2026, 3, 3), "samba, version 1"),
    )
    assert record.item is not None
    assert record.conditions is not None
    assert record.references is not None
    assert record.item.identification == "HU40-T"
    assert record.item.description == "Mitsui Seiki HU40-T, chain w C B X b Z Y (C1) t"
    assert record.performed_on == (date(2026, 3, 2), date(2026, 3, 2))
    assert ("ambient temperature", "22.08\N{NO-BREAK SPACE}°C") in [
        (one.name, one.value) for one in record.conditions
    ]
    assert record.conditions[0].value == "1 of campaign five-days, day 1, begun 2026-03-02 08:37 (UTC-05:00)"
    assert [one.certificate for one in record.references] == [
        "bar certificate 2016-04",
        NotApplicable("null indicator"),
    ]


def test_assembly_invents_nothing_that_neither_file_nor_campaign_knows(
    laboratory: LaboratoryFile, campaign: Campaign, make_result: Callable[..., ResultSet]
) -> None:
    silent = LaboratoryFile(**dict.fromkeys(laboratory.__dataclass_fields__))
    record = certificate_record(silent, campaign, 1, [make_result()], CertificateIdentity(None, None, None))
    missing = {(one.clause, one.part) for one in missing_items(record)}
    assert missing == {
        *((f"7.8.2.1 {letter}", "") for letter in "abcdehjklnop"),
        ("7.8.2.1 note", ""),
        ("7.8.2.1 f", "document"),
        ("7.8.2.1 f", "model"),
        ("7.8.2.1 g", "condition"),
        ("7.8.4.1 c", ""),
        ("7.8.4.1 c", "certificate of probe probe-1 (touch-trigger probe)"),
        *((f"7.8.4.1 {letter}", "") for letter in "def"),
    }


def test_assembly_of_an_unknown_run_says_which_there_are(
    laboratory: LaboratoryFile, campaign: Campaign
) -> None:
    with pytest.raises(NotFoundError, match="campaign five-days has no run 7; it has 1"):
        certificate_record(laboratory, campaign, 7, [], CertificateIdentity(None, None, None))


def test_result_set_converts_to_display_units_and_leaves_refused_parameters_out() -> None:
    refusal = RefusedParameters(("EX0C1",), "the spindle stood still")
    result = result_set(
        JointEstimate(
            ["EA0B", "EX0C1", "EX0C"],
            [MICRORADIAN, MICROMETRE, MICROMETRE],
            [4e-6, np.nan, 2e-3],
            [[4e-12, np.nan, 1e-9], [np.nan] * 3, [1e-9, np.nan, 1e-6]],
        ),
        CoverageFactors(p=0.95, k_p=2.45, k_q=2.24, rank=2),
        ResultStatements(state="as found", evaluation="GUM", refused=[refusal], tolerances={"EX0C": 20.0}),
    )
    assert result.names == ("EA0B", "EX0C")
    np.testing.assert_allclose(result.estimate, [4.0, 2.0])
    np.testing.assert_allclose(result.u, [2.0, 1.0])
    np.testing.assert_allclose(result.expanded, [4.48, 2.24])
    np.testing.assert_allclose(result.correlation, [[1.0, 0.5], [0.5, 1.0]])
    np.testing.assert_allclose(result.half_axes, 2.45 * np.sqrt([1.5, 0.5]))
    np.testing.assert_array_equal(result.tolerances, [np.nan, 20.0])


def test_result_set_that_cannot_be_certified_is_refused() -> None:
    def make(estimate: float = 1.0, variance: float = 1.0, k_p: float = 2.0, p: float = 0.95) -> ResultSet:
        return result_set(
            JointEstimate(["EX0C"], [MICROMETRE], [estimate], [[variance]]),
            CoverageFactors(p=p, k_p=k_p, k_q=2.0, rank=1),
            ResultStatements(state="as found", evaluation="GUM"),
        )

    with pytest.raises(DataError, match="parameter EX0C has no finite number; name it among the refused"):
        make(estimate=float("nan"))
    with pytest.raises(DataError, match="parameter EX0C has the variance 0; it must be positive"):
        make(variance=0.0)
    with pytest.raises(DataError, match="k_p must be positive and finite, but is inf"):
        make(k_p=float("inf"))
    with pytest.raises(DataError, match=r"p must lie between 0 and 1, but is 95\.0"):
        make(p=95.0)
    with pytest.raises(DataError, match=r"1 parameters need as many units and estimates"):
        result_set(
            JointEstimate(["EX0C"], [], [1.0], [[1.0]]),
            CoverageFactors(p=0.95, k_p=2.0, k_q=2.0, rank=1),
            ResultStatements(state="as found", evaluation="GUM"),
        )
