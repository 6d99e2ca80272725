"""A hash on a certificate goes on in the next line without a hyphen: whoever copies it has the hash."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace

import pypdf
import pytest

from monitor.records import AuditAnchor
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.pdf.render import certificate_pdf

#: Of a German certificate, where a rule of German hyphenation found a syllable in it.
SHA256 = "ed7afeee36cbc476e9c68858c64d65b387ead41059473a213266f5eeac3b3c46"


@pytest.mark.parametrize("entry", [6, 123456])
def test_a_german_certificate_breaks_the_hash_of_the_audit_without_a_hyphen(
    make_record: Callable[..., CertificateRecord], entry: int
) -> None:
    record = replace(make_record(1, language="de"), anchor=AuditAnchor(entry, SHA256))
    pages = pypdf.PdfReader(io.BytesIO(certificate_pdf(record))).pages
    text = "".join("".join(page.extract_text().split()) for page in pages)
    assert f"Nummer{entry}undSHA-256{SHA256}" in text
