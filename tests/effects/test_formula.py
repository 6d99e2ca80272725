"""Formulas typed by a user: right numbers for arithmetic, a plain refusal for everything else, and no hang."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from monitor.effects import parse_effect
from monitor.effects.formula import LONGEST, Formula
from monitor.exceptions import EffectError
from monitor.machine import parse_topology

COLUMNS = {"x_mm": np.array([-1.0, 0.0, 2.0]), "b_deg": np.array([0.0, 90.0, 180.0])}


def value(text: str) -> list[float]:
    found: list[float] = Formula(text).evaluate(COLUMNS, 3).tolist()
    return found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1", [1, 1, 1]),
        ("-x_mm**2", [-1, 0, -4]),
        ("2*x_mm - b_deg/90", [-2, -1, 2]),
        ("2**3**2", [512, 512, 512]),
        ("+x_mm", [-1, 0, 2]),
        ("x_mm > 0", [0, 0, 1]),
        ("-1 <= x_mm < 2", [1, 1, 0]),
        ("x_mm == 0", [0, 1, 0]),
        ("x_mm != 0", [1, 0, 1]),
        ("x_mm >= 0 and b_deg > 100", [0, 0, 1]),
        ("x_mm or b_deg == 90", [1, 1, 1]),
        ("not x_mm", [0, 1, 0]),
        ("(b_deg > 0) * x_mm", [0, 0, 2]),
        ("abs(x_mm) + sign(x_mm)", [0, 0, 3]),
        ("sqrt(4) + exp(0) + log(1)", [3, 3, 3]),
        ("tan(0)", [0, 0, 0]),
        ("True + 1", [2, 2, 2]),
    ],
)
def test_arithmetic_by_hand(text: str, expected: list[float]) -> None:
    assert value(text) == expected


def test_sine_and_cosine_of_pi() -> None:
    np.testing.assert_allclose(value("sin(pi*b_deg/180)"), [0.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(value("cos(pi*b_deg/180)"), [1.0, 0.0, -1.0], atol=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "x_mm.real",
        "x_mm.__class__",
        "(1).__class__.__bases__",
        "__import__('os').system('true')",
        "().__class__.__mro__",
        "sin.__globals__",
        "sin.__call__(1)",
        "open('f')",
        "eval('1')",
        "max(1, 2)",
        "sin(1, 2)",
        "sin(*x_mm)",
        "sin(x=1)",
        "sin(sin)(1)",
        "lambda: 1",
        "1 if x_mm else 2",
        "[1, 2]",
        "[x for x in x_mm]",
        "{1: 2}",
        "x_mm[0]",
        "'a' * 3",
        "b'a'",
        "f'{x_mm}'",
        "1j",
        "None",
        "...",
        "(a := 1)",
        "x_mm is x_mm",
        "x_mm in x_mm",
        "9 // 2",
        "9 % 2",
        "9 @ 2",
        "1 << 99999999",
        "5 ^ 2",
        "~1",
    ],
)
def test_what_is_not_arithmetic_is_refused_by_name(text: str) -> None:
    with pytest.raises(
        EffectError, match=r"uses '.*', which is not allowed; allowed are numbers, recorded columns"
    ):
        value(text)


@pytest.mark.parametrize(
    "text", ["", "   ", "1 +", "x_mm;1", "a = 1", "import os", "(1", "1\n+1", "\0", "2 x_mm"]
)
def test_what_cannot_be_read_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(EffectError, match=r"cannot be read; an example is sin\(2\*pi\*x_mm/20\)"):
        value(text)


@pytest.mark.parametrize("name", ["y_mm", "__builtins__", "sin", "np", "self", "X_mm"])
def test_what_was_not_recorded_is_refused_with_what_was(name: str) -> None:
    with pytest.raises(
        EffectError, match=f"names '{name}', which was not recorded; recorded are b_deg, x_mm"
    ):
        value(name)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("9**9**9**9", 3),
        ("9**9**9**9 - 9**9**9**9", 3),
        ("1e400", 3),
        ("x_mm/0", 3),
        ("1/x_mm", 1),
        ("log(x_mm)", 2),
        ("sqrt(x_mm)", 1),
        ("(-8)**(1/3)", 3),
        ("exp(b_deg*10)", 2),
    ],
)
def test_what_is_not_finite_is_refused_with_the_number_of_probings(text: str, count: int) -> None:
    with pytest.raises(EffectError, match=f"is not a finite number at {count} of 3 probings"):
        value(text)


def test_deep_signs_before_a_forbidden_one_are_refused() -> None:
    # How deep Python itself can write the formula back for the message differs between its versions.
    with pytest.raises(EffectError, match=r"nests too deeply|which is not allowed"):
        value("~" + "-" * 480 + "1")


@pytest.mark.parametrize("text", ["9" * 400, "-" + "1" * 400])
def test_whole_numbers_beyond_a_double_are_refused(text: str) -> None:
    with pytest.raises(EffectError, match="nests too deeply or holds a number too large to compute with"):
        value(text)


def test_brackets_beyond_the_parser_are_refused() -> None:
    with pytest.raises(EffectError, match="cannot be read"):
        value("(" * 249 + "1" + ")" * 249)


def test_long_formulas_are_refused_with_their_length() -> None:
    with pytest.raises(EffectError, match=rf"at most {LONGEST} characters; this one has {LONGEST + 1}"):
        value("1" + "+1" * (LONGEST // 2))


def test_long_sums_are_computed() -> None:
    assert value("1" + "+1" * 240) == [241.0] * 3


def test_the_columns_are_left_alone() -> None:
    before = COLUMNS["x_mm"].copy()
    found = Formula("x_mm").evaluate(COLUMNS, 3)
    found += 1.0
    np.testing.assert_array_equal(COLUMNS["x_mm"], before)


def test_formula_with_brackets_and_driver_is_split_at_the_right_place() -> None:
    chain = parse_topology("w C B X b Z Y (C1) t")
    effect = parse_effect("EXX:formula(sin(2*pi*x_mm/20) * (b_deg > 0))@warmup", chain)
    assert effect.driver_text == "warmup"
    assert effect.shape.text == "sin(2*pi*x_mm/20) * (b_deg > 0)"  # type: ignore[union-attr]


@settings(max_examples=300, deadline=None, derandomize=True, database=None)
@given(st.text(alphabet="xyz_m bdeg0123456789.+-*/()<>=!&|~^%@,:[]{}'\"\\pisnco\n\tλ", max_size=60))
def test_any_text_gives_finite_numbers_or_a_refusal(text: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SyntaxWarning)
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            found = Formula(text).evaluate(COLUMNS, 3)
        except EffectError:
            found = np.zeros(3)
    assert found.shape == (3,)
    assert np.isfinite(found).all()
