"""What the weekly report says to do where the limit of the volumetric error binds, and of unjudged drifts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from by_path import load

from monitor.documents import from_document, to_document
from monitor.reporting.health.answers import answers, reason, to_do
from monitor.reporting.health.concern import concern
from monitor.reporting.health.news import Drifting
from monitor.reporting.health.page import fleet_context
from monitor.reporting.health.records import (
    MachineHealth,
    MapShare,
    State,
    VolumetricMap,
    by_urgency,
    fleet_row,
)

first_page = load("first_page", Path(__file__).with_name("test_first_page.py"))

#: As the adversary's machine had it: EXX has a tolerance and no part in the error, EC0Y drifts, EYY shortens the error.
MAP = VolumetricMap(
    1, "points", "X 0 mm", 91.3, 2.0, 60.0, (), limit_um=90.0, probability_out=0.95,
    by_parameter=(
        MapShare("EX0C1", 27.2), MapShare("EC0Y", 17.9), MapShare("EXX", 1.6), MapShare("EYY", -12.0),
    ),
)  # fmt: skip
EXX = replace(first_page.parameter("EXX", value=-12.0, per_month=0.0, tolerance=300.0), probability_out=0.0)
EC0Y = first_page.parameter("EC0Y", per_month=22.0, tolerance=None)
EX0C1 = first_page.parameter("EX0C1", value=-30.0, per_month=0.0, tolerance=None)


def bound(state: str = "out of tolerance", error_map: VolumetricMap = MAP) -> MachineHealth:
    return first_page.machine("VOLM", state, EXX, EC0Y, EX0C1, map=error_map, probability_out=0.95)


def test_advice_card_and_picture_are_of_what_adds_most_to_the_worst_error() -> None:
    health = bound()
    chosen = concern(health)
    assert chosen is not None
    assert chosen.name == "EX0C1"
    advice = to_do(health)
    assert advice == (
        "Adjust or compensate position in X of spindle C1 (EX0C1, +27.2 µm), squareness X-Y (EC0Y, +17.9 µm) and "
        "measure again now."
    )
    assert "EC0Y grows by 22.00 µrad a month" in reason(health)
    (card,) = fleet_context(first_page.fleet(health)[0])["cards"]
    assert card.to_do == advice
    assert "EXX" not in card.reason
    assert "(EX0C1) / µrad" in card.picture


def test_near_the_limit_it_is_the_volumetric_error_that_cannot_be_judged() -> None:
    health = bound("may be out of tolerance", replace(MAP, worst_um=89.5, probability_out=0.3))
    assert "the volumetric error is too near its limit to be judged" in to_do(health)


def test_a_tolerance_that_is_passed_more_surely_than_the_limit_binds() -> None:
    out = replace(EXX, estimate=400.0, probability_out=0.999)
    health = first_page.machine("VOLM", "out of tolerance", out, EC0Y, EX0C1, map=MAP, probability_out=1.0)
    chosen = concern(health)
    assert chosen is not None
    assert chosen.name == "EXX"
    assert to_do(health) == "Adjust or compensate positioning gain of axis X (EXX) and measure again now."
    assert "the volumetric error reaches 91.3 µm" in reason(health)


def test_a_record_of_before_names_no_parameter_by_chance() -> None:
    health = bound(error_map=replace(MAP, by_parameter=None))
    assert concern(health) is None
    assert to_do(health).startswith(
        "Adjust or compensate what makes the volumetric error (monitor map names it)"
    )
    document = to_document(health)
    assert "by_parameter" not in document["map"]
    assert to_document(from_document(MachineHealth, document)) == document


GROWN = first_page.parameter("EXX:reversal", value=5.85, per_month=0.62, tolerance=None)
STILL = first_page.parameter("EB0C", value=12.0, per_month=0.0, tolerance=None)


def test_a_machine_that_drifts_without_a_tolerance_is_not_fine() -> None:
    health = first_page.machine("GROW", "drifts", STILL, GROWN)
    fleet = first_page.fleet(health, first_page.GOOD)[0]
    said = {answer.kind: answer.sentence for answer in answers(fleet)}
    assert said["worst"] == "GROW (hall 1): drifts."
    assert "(EXX:reversal) is +5.8 µrad (U = 4.0) and grows by 0.62 µrad a month" in said["why"]
    assert said["do"].startswith("State a tolerance for ")
    assert said["fine"] == "1 of 2 machines: Good."
    assert "No tolerances are stated for 1 of 2 machines evaluated: GROW" in said["unjudged"]
    assert "No parameter changed" not in " ".join(said.values())


def test_a_drift_comes_before_what_is_fine_and_after_what_is_wrong() -> None:
    rows = [fleet_row(first_page.machine(state, state)) for state in State]
    order = [row.machine for row in sorted(rows, key=by_urgency)]
    assert order.index("model fails") < order.index("drifts") < order.index("suspect data")


@pytest.mark.parametrize(
    ("season", "words"),
    [
        (False, "EXX:reversal drifts by +0.622 µm a month"),
        (True, "EXX:reversal moves by +0.622 µm a month (drift or season cannot be told apart)"),
    ],
)
def test_the_words_of_a_drift_are_those_of_trend(season: bool, words: str) -> None:
    assert str(Drifting("EXX:reversal", 7.47, 0.5, "µm", season)) == words
