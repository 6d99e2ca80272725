"""Rules between the parts of a digital certificate that no schema states, by a Schematron run (ISO/IEC 19757-3)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.record import CertificateRecord

etree = pytest.importorskip("lxml.etree", reason="lxml runs Schematron")
isoschematron = pytest.importorskip("lxml.isoschematron", reason="lxml runs Schematron")

Make = Callable[..., CertificateRecord]
RULES = Path(__file__).resolve().parents[1] / "references" / "dcc" / "rules.sch"


@pytest.fixture(scope="module")
def rules() -> Any:
    return isoschematron.Schematron(
        etree.parse(RULES), store_report=True, error_finder=isoschematron.Schematron.ASSERTS_ONLY
    )


def broken(rules: Any, xml: bytes) -> list[str]:
    """The rules that a certificate breaks, in words."""
    rules.validate(etree.fromstring(xml))
    path = "//svrl:failed-assert/svrl:text/text()"
    return sorted(rules.validation_report.xpath(path, namespaces={"svrl": "http://purl.oclc.org/dsdl/svrl"}))


@pytest.mark.parametrize("draft", [False, True])
@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("count", [1, 13])
def test_iso_19757_3_a_certificate_breaks_no_rule(
    make_record: Make, rules: Any, count: int, language: str, draft: bool
) -> None:
    record = make_record(count, language=language, maps=1)
    assert record.results is not None
    as_left = dataclasses.replace(record.results[0], state="as left")
    record = dataclasses.replace(
        record, country="DE", dcc_version="3.3.0", results=(record.results[0], as_left), draft=draft
    )
    assert broken(rules, dcc_xml(record)) == []


@pytest.mark.parametrize(
    ("old", "new", "rule"),
    [
        (b'lang="en"', b'lang="fr"', "a text has a language that the certificate does not declare"),
        (
            b"</dcc:usedLangCodeISO639_1>",
            b"</dcc:usedLangCodeISO639_1><dcc:usedLangCodeISO639_1>de</dcc:usedLangCodeISO639_1>",
            "a text is not there once in each declared language",
        ),
        (b"<dcc:usedMethods>", b"<dcc:otherMethods>", "a result has no method"),
        (b"<si:labelXMLList>", b"<si:labelXMLList>one ", "values and labels differ in number"),
        (b"<si:valueXMLList>", b"<si:valueXMLList> ", "a list is not separated by single spaces"),
    ],
)
def test_a_broken_certificate_breaks_its_rule(
    make_record: Make, rules: Any, old: bytes, new: bytes, rule: str
) -> None:
    xml = dcc_xml(dataclasses.replace(make_record(3), country="DE", dcc_version="3.3.0"))
    assert old in xml
    xml = xml.replace(old, new, 1)
    if b"Methods" in old:
        xml = xml.replace(b"</dcc:usedMethods>", b"</dcc:otherMethods>", 1)
    assert rule in broken(rules, xml)
