"""What is missing of a certificate names the key that answers it, in whatever language the certificate is written."""

from __future__ import annotations

import pytest

from monitor.reporting.certificate.laboratory_keys import ARTEFACT_KEY, key_of
from monitor.reporting.texts import languages, texts_of


@pytest.mark.parametrize("language", languages())
@pytest.mark.parametrize(
    ("words", "places", "key"),
    [
        # Names of things that hold words of other kinds.
        ("record.probe", {"id": "P1", "model": "OMP60"}, "[traceability] probe"),
        ("record.probe", {"id": "instrument 3", "model": "Maßstab"}, "[traceability] probe"),
        ("record.bar", {"first": "S1", "second": "probe 2"}, "[traceability] scale_bar"),
        ("record.instrument", {"name": "probe of the laser", "setups": "S1"}, "[traceability] instruments"),
    ],
)
def test_the_key_of_a_reference(language: str, words: str, places: dict[str, str], key: str) -> None:
    texts = texts_of(language)
    name = texts(words, **places)
    for part in (f"certificate of {name}", f"statement of certificate of {name}", f"{name}: 'tbd' says nothing"):
        assert key_of("references", part, texts) == key


@pytest.mark.parametrize("language", languages())
def test_the_key_of_an_artefact_without_a_name(language: str) -> None:
    texts = texts_of(language)
    assert key_of("conditions", f"value of {texts('record.artefact')}", texts) == ARTEFACT_KEY
    assert key_of("conditions", f"value of {texts('record.ambient')}", texts) == ""
