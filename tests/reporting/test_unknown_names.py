"""Names of a run's own unknowns: every unknown of every method's example has its German word."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from monitor.methods import method_named
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting.texts import texts_of
from monitor.reporting.unknown_names import unknown_words

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
GERMAN = texts_of("de")


@pytest.mark.parametrize(
    "example",
    [
        "ball-bar",
        "five-days",
        "four-instruments",
        "l-shape",
        "laser",
        "r-test",
        "tilting-table",
        "tracked-robot",
    ],
)
def test_every_unknown_of_a_run_has_its_german_word(example: str) -> None:
    campaign = read_campaign(EXAMPLES / example)
    assert isinstance(campaign, Campaign)
    names = method_named(campaign.method).problem_of(campaign).own_names
    assert names
    english = re.compile(
        r"\b(ball|height|module|reflector|target|radius|beam|cosine|frame|length|shift|slope|tip|turn|work|point|zero)\b"
    )
    left = [words for words in (unknown_words(name, GERMAN) for name in names) if english.search(words)]
    assert left == []
    assert [unknown_words(name, texts_of("en")) for name in names] == list(names)


@pytest.mark.parametrize(
    ("name", "german"),
    [
        ("work point x", "werkstückseitiger Punkt x"),
        ("bar-xy work point z", "bar-xy werkstückseitiger Punkt z"),
        ("module A2 tilt u", "Modul A2 Kippung u"),
        ("ball S1 radius", "Kugel S1 Radius"),
        ("tracker target R1 a", "tracker Messziel R1 a"),
        ("laser-X beam a", "laser-X Strahl a"),
        # The user's words stay: a ball that is called zero, the errors of a machine.
        ("ball zero x", "Kugel zero x"),
        ("EXX(400)", "EXX(400)"),
        ("EYX:poly2", "EYX:poly2"),
    ],
)
def test_what_a_user_named_stays(name: str, german: str) -> None:
    assert unknown_words(name, GERMAN) == german
