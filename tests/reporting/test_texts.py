"""The texts of the certificate: the same keys in every language, none left in a template, none of them missing."""

from __future__ import annotations

import re
import string
from datetime import date
from decimal import Decimal

import pytest
from markupsafe import Markup

from monitor.exceptions import InputError
from monitor.refusal import Advice, AdviceKind, Reason, ReasonKind, Refusal
from monitor.reporting.refused import (
    RefusedParameters,
    refusal_sentence,
    refused_parameters,
    why_refused,
)
from monitor.reporting.resources import report_text
from monitor.reporting.symbols import describe
from monitor.reporting.texts import breakable, languages, texts_of, with_bound_units, with_subscripts

ENGLISH = texts_of()


def places(text: str) -> set[str]:
    return {place for _, place, _, _ in string.Formatter().parse(text) if place}


def test_there_are_english_and_german() -> None:
    assert languages() == ("de", "en")
    with pytest.raises(InputError, match="there are no texts in 'tlh'; there are de, en"):
        texts_of("tlh")


@pytest.mark.parametrize("language", languages())
def test_every_language_has_the_same_keys_with_the_same_places(language: str) -> None:
    words = texts_of(language).sentences
    assert set(words) == set(ENGLISH.sentences)
    assert {key: places(text) for key, text in words.items()} == {
        key: places(text) for key, text in ENGLISH.sentences.items()
    }
    assert not [key for key, text in words.items() if not text.strip()]


def test_german_is_german() -> None:
    same = {key for key, text in texts_of("de").sentences.items() if text == ENGLISH.sentences[key]}
    # Words and signs that both languages have.
    signs = {"page.guard_band", "page.consumers_risk", "page.producers_risk", "record.with_uncertainty"}
    assert same == {"page.software", "page.symbol", "page.parameter", "page.map_expanded"} | signs


@pytest.mark.parametrize("template", ["certificate.html", "certificate.css", "base.css"])
def test_no_template_holds_text(template: str) -> None:
    plain = re.sub(r"{#.*?#}|{{.*?}}|{%.*?%}", "", report_text(template), flags=re.DOTALL)
    if template.endswith(".css"):
        said = [text for text in re.findall(r'"([^"]*)"', plain) if re.search("[A-Za-z]", text)]
    else:
        plain = re.sub(r"<style>.*?</style>|<[^>]*>", "|", plain, flags=re.DOTALL)
        said = [text.strip() for text in plain.split("|") if re.search(r"[^\W\d_]", text)]
    assert said == []


def test_keys_that_a_template_names_are_there() -> None:
    named = re.findall(r'texts(?:\.markup)?\("([a-z_.]+)"', report_text("certificate.html"))
    assert len(named) > 30
    assert set(named) <= set(ENGLISH.sentences)


def test_days_and_numbers_follow_the_language() -> None:
    german = texts_of("de")
    assert german.day(date(2026, 3, 9)) == "09.03.2026"
    assert ENGLISH.day(date(2026, 3, 9)) == "2026-03-09"
    assert german.number(Decimal("-1.50")) == "−1,50"
    assert ENGLISH.number(Decimal("-1.50")) == "−1.50"


@pytest.mark.parametrize(
    ("symbol", "words"),
    [
        ("EA0B", "Ausrichtung um X von Achse B"),
        ("EX0C1", "Lage in X von Spindel C1"),
        ("EYX:poly2", "Geradheitsabweichung in Y von Achse X (poly2)"),
    ],
)
def test_iso_230_1_symbol_in_german_words(symbol: str, words: str) -> None:
    assert describe(symbol, texts_of("de")) == words


def test_what_a_page_marks_stays_and_what_a_user_writes_is_escaped() -> None:
    made = ENGLISH.markup("page.number_issued", number="<b>&", day="today")
    assert str(made) == "No. <strong>&lt;b&gt;&amp;</strong>, issued on today"


#: A refusal, its English and its German sentence.
REFUSALS = [
    (
        Refusal(
            ("EX0C1",), Reason(ReasonKind.NOT_SEPARATED, ("tip x",), Advice(AdviceKind.SPINDLE_STILL, ("C1",)))
        ),
        "with this plan EX0C1 cannot be told apart from tip x: C1 stands at one angle throughout; probe also with "
        "C1 at 90, 180 and 270 degrees",
        "mit diesem Messplan nicht zu trennen: EX0C1 von Tasterspitze x: C1 steht durchweg bei einem Winkel; auch "
        "mit C1 bei 90, 180 und 270 Grad antasten",
    ),
    (
        Refusal(("EXX", "EYY"), Reason(ReasonKind.NOT_SEPARATED, (), Advice(AdviceKind.MORE_INDEXATIONS))),
        "with this plan EXX and EYY cannot be told apart; probe more indexations",
        "mit diesem Messplan nicht voneinander zu trennen: EXX und EYY; mehr Stellungen der Drehachsen antasten",
    ),
    (
        Refusal(
            ("EXX", "EZZ"),
            Reason(
                ReasonKind.NOT_SEPARATED, (), Advice(AdviceKind.BAR_DIRECTION, ("B", "EYY", "EXX", "EZZ"))
            ),
        ),
        "with this plan EXX and EZZ cannot be told apart; no more angles of B tell a length: a bar across B gives EXX "
        "and EZZ, a bar along it EYY",
        "mit diesem Messplan nicht voneinander zu trennen: EXX und EZZ; weitere Winkel von B geben keine Länge: ein "
        "Maßstab quer zu B gibt EXX und EZZ, einer längs dazu EYY",
    ),
    (
        Refusal(
            tuple(f"EXX({place})" for place in range(9)),
            Reason(ReasonKind.NOT_SEPARATED, ("lattice",), Advice(AdviceKind.PIECE_PLANES, ("XY", "YZ"))),
        ),
        "with this plan EXX at 9 places cannot be told apart from lattice; lay the piece in the XY and the YZ "
        "plane too",
        "mit diesem Messplan nicht zu trennen: EXX an 9 Stellen von lattice; das Stück auch in die Ebene XY und YZ "
        "legen",
    ),
    (
        Refusal(
            ("EX0J1",),
            Reason(ReasonKind.NOT_SEPARATED, ("tip z",), Advice(AdviceKind.STOOD_STILL, ("J1", "J2"))),
        ),
        "with this plan EX0J1 cannot be told apart from tip z: J1, J2 stood still throughout; move them too",
        "mit diesem Messplan nicht zu trennen: EX0J1 von Tasterspitze z: J1, J2 standen durchweg still; auch diese "
        "Achsen bewegen",
    ),
    (
        Refusal(
            ("EXX", "EYY"),
            Reason(ReasonKind.NOT_SEPARATED, (), Advice(AdviceKind.OWN_WORDS, text="look at the moon")),
        ),
        "with this plan EXX and EYY cannot be told apart; look at the moon",
        "mit diesem Messplan nicht voneinander zu trennen: EXX und EYY; look at the moon",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("refusal", "english", "german"), REFUSALS)
def test_why_a_parameter_is_refused_is_said_in_german(refusal: Refusal, english: str, german: str) -> None:
    assert refusal_sentence(refusal) == english
    assert refusal_sentence(refusal, texts_of("de")) == german
    assert why_refused(refused_parameters(refusal), ENGLISH) == english
    assert why_refused(refused_parameters(refusal), texts_of("de")) == german


def test_a_sentence_that_is_all_there_is_stays_as_it_is() -> None:
    refused = RefusedParameters(("EXX",), "a sentence that nobody translated")
    assert why_refused(refused, texts_of("de")) == why_refused(refused, ENGLISH) == refused.why


@pytest.mark.parametrize("kind", [*AdviceKind, *ReasonKind])
def test_every_kind_of_reason_has_a_sentence(kind: AdviceKind | ReasonKind) -> None:
    without_text = {AdviceKind.OWN_WORDS, ReasonKind.NOT_SEPARATED}
    assert (f"sentences.{kind.value}" in ENGLISH.sentences) == (kind not in without_text)


@pytest.mark.parametrize(
    ("text", "bound"),
    [
        ("Y −152,6 mm bis 191,1 mm", "Y −152,6~mm bis 191,1~mm"),
        ("EB0C (16,4 µrad, U = 4,3 µrad)", "EB0C (16,4~µrad, U~=~4,3~µrad)"),
        ("in tolerance with 95 % until then", "in tolerance with 95~% until then"),
        ("−53 µm/m and 3 runs, 12 mmx", "−53~µm/m and 3 runs, 12 mmx"),
        ("(U = 4.0, tolerance ± 20.0)", "(U~=~4.0, tolerance ±~20.0)"),
        ("a probability of > 99.9 % (< 3 runs)", "a probability of >~99.9~% (<~3 runs)"),
        ("estimate ± U, k_q> 3", "estimate ± U, k_q> 3"),
    ],
)
def test_no_line_ends_between_a_number_and_its_unit(text: str, bound: str) -> None:
    assert with_bound_units(text) == bound.replace("~", "\N{NO-BREAK SPACE}")


def test_markup_stays_markup_where_units_are_bound() -> None:
    assert with_subscripts(Markup("<b>U</b> is 3 µm")) == "<b>U</b> is 3\N{NO-BREAK SPACE}µm"
    assert with_subscripts("u < 3 µm") == "u\N{NO-BREAK SPACE}&lt;\N{NO-BREAK SPACE}3\N{NO-BREAK SPACE}µm"


@pytest.mark.parametrize(
    ("name", "pieces"),
    [
        ("EXX:step8mm(-60,110).-60mm", ["EXX:", "step8mm(-60,110)", ".-60mm"]),
        ("EXX:step8mm(-60,110).110.5mm", ["EXX:", "step8mm(-60,110)", ".110.5mm"]),
        ("EXX:cyclic171.317mm.cos", ["EXX:", "cyclic171.317mm", ".cos"]),
        ("EBX:sawtooth84.34mm(-157.25)", ["EBX:", "sawtooth84.34mm(-157.25)"]),
        ("EXX", ["EXX"]),
    ],
)
def test_the_name_of_an_effect_goes_on_at_its_parts(name: str, pieces: list[str]) -> None:
    parts = re.split("<wbr>", breakable(name))
    assert [re.sub("<[^>]*>", "", part) for part in parts] == pieces
    assert all("nowrap" in part for part in parts if part.startswith("<span"))
    assert breakable("a<b:c") == "a&lt;b:<wbr>c"
