"""What a map does not follow between its points stands beside it, wherever it is printed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from by_path import load

from monitor.documents import from_document, to_document
from monitor.reporting.between_points import BetweenPoints, StepPlace
from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.pictures import map_picture
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.certificate.volumetric import printed_map
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.health.page import machine_pages
from monitor.reporting.health.records import VolumetricMap
from monitor.reporting.texts import texts_of
from monitor.workflow.explain.explain_answer import StepBetween

page = load("first_page_records", Path(__file__).with_name("test_first_page.py"))
TEETH = BetweenPoints("EXX:sawtooth84mm(12)", "X", 84.0, 100.0, 6.3, "µm")
SAID = {
    "en": "Between these points, 100.0 mm apart along X: EXX:sawtooth84mm(12), up to 6.3 µm, repeats every 84.0 mm, so "
    "that the largest error may lie between them.",
    "de": "Zwischen diesen Punkten, die entlang X 100,0 mm auseinander liegen: EXX:sawtooth84mm(12), bis zu 6,3 µm, "
    "wiederholt sich alle 84,0 mm; die größte Abweichung kann zwischen ihnen liegen.",
}
STEP = StepPlace("EXX:step(12)", "X", 8.78, 39.58, 6.2, "µm", False)
PLACED = {
    (
        "en",
        False,
    ): "EXX:step(12), a step of 6.2 µm, lies somewhere between 8.8 mm and 39.6 mm of X, as far as the readings "
    "tell: points between may err by it, and all points where a workpiece's zero is set between; no U contains "
    "that.",
    (
        "en",
        True,
    ): "EXX:step(12), a step of 6.2 µm, lies somewhere between 8.8 mm and 39.6 mm of X, as far as the readings "
    "tell: points between may err by it, and all points, because the workpiece's zero lies between; no U contains "
    "that.",
    (
        "de",
        False,
    ): "EXX:step(12), eine Stufe von 6,2 µm, liegt irgendwo zwischen 8,8 mm und 39,6 mm von X, soweit die "
    "Messwerte es zeigen: Punkte dazwischen können um sie abweichen, und alle Punkte, wenn der Nullpunkt eines "
    "Werkstücks dazwischen gesetzt wird; keine Messunsicherheit U enthält das.",
    (
        "de",
        True,
    ): "EXX:step(12), eine Stufe von 6,2 µm, liegt irgendwo zwischen 8,8 mm und 39,6 mm von X, soweit die "
    "Messwerte es zeigen: Punkte dazwischen können um sie abweichen, und alle Punkte, weil der Nullpunkt des "
    "Werkstücks dazwischen liegt; keine Messunsicherheit U enthält das.",
}


@pytest.mark.parametrize(("language", "zero_between"), list(PLACED))
def test_a_certificate_and_its_digital_form_say_where_a_step_may_lie(
    make_record: Callable[..., CertificateRecord], language: str, zero_between: bool
) -> None:
    record = make_record(language=language, maps=1)
    (plain,) = record.volumetric
    stepped = replace(plain, step_places=(replace(STEP, zero_between=zero_between),))
    texts, said = texts_of(language), PLACED[language, zero_between]
    assert printed_map(stepped, texts).explained == f"{printed_map(plain, texts).explained} {said}"
    assert said in dcc_xml(replace(record, country="DE", volumetric=(stepped,))).decode()
    assert from_document(VolumetricResult, to_document(stepped)).step_places == stepped.step_places
    assert "step_places" not in to_document(plain)


OVER = {
    "en": "EXX:step(12), a step of 6.2 µm over some 20 mm, has its middle somewhere between 18.8 mm and 29.6 mm of X, "
    "as far as the readings tell: points between 8.8 mm and 39.6 mm may err by up to 3.3 µm, and all points where a "
    "workpiece's zero is set between; no U contains that.",
    "de": "EXX:step(12), eine Stufe von 6,2 µm über etwa 20 mm, hat ihre Mitte irgendwo zwischen 18,8 mm und 29,6 mm "
    "von X, soweit die Messwerte es zeigen: Punkte zwischen 8,8 mm und 39,6 mm können um bis zu 3,3 µm abweichen, und "
    "alle Punkte, wenn der Nullpunkt eines Werkstücks dazwischen gesetzt wird; keine Messunsicherheit U enthält das.",
}


@pytest.mark.parametrize("language", ["en", "de"])
def test_of_a_step_over_a_width_it_is_said_where_its_middle_may_lie(
    make_record: Callable[..., CertificateRecord], language: str
) -> None:
    (plain,) = make_record(language=language, maps=1).volumetric
    over = replace(STEP, width_mm=20.0, middle_mm=(18.78, 29.58), error=3.3)
    printed = printed_map(replace(plain, step_places=(over,)), texts_of(language)).explained
    assert printed.endswith(OVER[language])
    assert "over some 20 mm, has its middle somewhere between 18.78 and 29.58 mm of X" in str(over)
    # Of what is known to the readings around it alone points may err by the whole step.
    alone = replace(STEP, width_mm=4.0)
    assert (alone.most, alone.middle) == (STEP.size, (STEP.low_mm, STEP.high_mm))


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
    (printed,) = machine_pages([replace(page.GOOD, map=replace(error_map, step_places=(STEP,)))])
    assert ("not followed", str(TEETH)) in printed.map
    assert ("place unknown", str(STEP)) in printed.map
    assert "lies somewhere between 8.78 and 39.58 mm of X" in str(STEP)
    assert str(replace(STEP, zero_between=True)).endswith(
        "and all points, because the workpiece's zero lies between; no U contains that"
    )


def test_of_a_step_over_a_width_that_an_earlier_version_stored_the_middle_lies_half_of_it_within() -> None:
    """Was: its middle between the readings between which all of it lies."""
    assert StepBetween(5.0, 0.2, 100.0, 150.0, width_mm=20.0).middle == (110.0, 140.0)
    assert StepBetween(5.0, 0.2, 100.0, 150.0).middle == (100.0, 150.0)


@pytest.mark.parametrize(
    ("language", "said"),
    [("en", "of a machine without rotary axes"), ("de", "einer Maschine ohne Drehachsen")],
)
def test_a_map_of_linear_axes_alone_is_at_no_rotary_pose(
    make_record: Callable[..., CertificateRecord], language: str, said: str
) -> None:
    (plain,) = make_record(language=language, maps=1).volumetric
    of_0_2_0, turning, linear = (replace(plain, poses=1, turns=turns) for turns in (None, True, False))
    for texts, words in ((texts_of(), "otary axes"), (texts_of("de"), "Drehachsen")):
        captions = [map_picture(each, texts, "points.csv").caption for each in (of_0_2_0, turning, linear)]
        assert [words in caption for caption in captions] == [True, True, False]
    assert said not in printed_map(of_0_2_0, texts_of(language)).explained
    assert said not in printed_map(turning, texts_of(language)).explained
    assert said in printed_map(linear, texts_of(language)).explained


def test_a_map_that_version_0_2_0_issued_keeps_its_words(
    make_record: Callable[..., CertificateRecord],
) -> None:
    """The sentence of that release, by the text of its certificates."""
    (plain,) = make_record(maps=1).volumetric
    explained = str(printed_map(replace(plain, poses=1, turns=None), texts_of()).explained)
    assert f") at {1} rotary poses. " in explained
