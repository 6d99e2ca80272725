"""The name of who signs, out of a subject as asn1crypto writes it."""

from __future__ import annotations

import pytest

pytest.importorskip("asn1crypto", reason="the extra [sign] is not installed")

from asn1crypto import x509

from monitor.reporting.signature.signer import Signer


@pytest.mark.parametrize(
    "attributes",
    [
        {"common_name": "Anna Miller"},
        {"common_name": "Müller, Anna", "organization_name": "Labor GmbH, Ulm"},
        {"common_name": "Anna Miller", "organization_name": "Acme, Inc.", "country_name": "US"},
        {"country_name": "DE", "organization_name": "Labor GmbH", "common_name": "Dr.-Ing. Anna Müller"},
    ],
)
def test_commas_in_a_name_are_of_the_name(attributes: dict[str, str]) -> None:
    subject = x509.Name.build(attributes)
    assert Signer(subject.human_friendly, "0" * 64).common_name == attributes["common_name"]
