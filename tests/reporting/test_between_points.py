"""What a map does not follow between its points stands beside it, wherever it is printed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from by_path import load

from monitor.documents import from_document, to_document
from monitor.reporting.between_points import BetweenPoints
from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.certificate.volumetric import printed_map
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.health.page import machine_pages
from monitor.reporting.health.records import VolumetricMap
from monitor.reporting.texts import texts_of

page = load("first_page_records", Path(__file__).with_name("test_first_page.py"))
TEETH = BetweenPoints("EXX:sawtooth84mm(12)", "X", 84.0, 100.0, 6.3, "µm")
SAID = {
    "en": "Between these points, 100.0 mm apart along X: EXX:sawtooth84mm(12), up to 6.3 µm, repeats every 84.0 mm, so "
    "that the largest error may lie between them.",
    "de": "Zwischen diesen Punkten, die entlang X 100,0 mm auseinander liegen: EXX:sawtooth84mm(12), bis zu 6,3 µm, "
    "wiederholt sich alle 84,0 mm; die größte Abweichung kann zwischen ihnen liegen.",
}


@pytest.mark.parametrize("language", ["en", "de"])
def test_a_certificate_and_its_digital_form_say_it(
    make_record: Callable[..., CertificateRecord], language: str
) -> None:
    record = make_record(language=language, maps=1)
    (plain,) = record.volumetric
    toothed = replace(plain, between_points=(TEETH,))
    texts = texts_of(language)
    assert printed_map(toothed, texts).explained == f"{printed_map(plain, texts).explained} {SAID[language]}"
    assert SAID[language] in dcc_xml(replace(record, country="DE", volumetric=(toothed,))).decode()
    assert from_document(VolumetricResult, to_document(toothed)).between_points == (TEETH,)
    assert "between_points" not in to_document(plain)


def test_a_health_report_says_it() -> None:
    error_map = VolumetricMap(1, "16 points", "A -90°", 5.0, 1.0, 2.0, (), between_points=(TEETH,))
    (printed,) = machine_pages([replace(page.GOOD, map=error_map)])
    assert ("not followed", str(TEETH)) in printed.map
