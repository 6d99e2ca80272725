"""Parses the language of a curve's effects and models."""

from __future__ import annotations

import math
import re

from monitor.effects.curve.effect import PLACED, SEARCHED, CurveEffect, Inputs
from monitor.effects.formula import Formula
from monitor.exceptions import EffectError

_TEXT = re.compile(
    r"(?P<column>[A-Za-z]\w*)(?::(?P<shape>poly[1-9]|drift|loop|group|(?P<searched>sin|exp|step|knee)(?P<free>~)?"
    r"(?P<value>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)?))?",
    re.ASCII,
)
EXAMPLES = (
    "load_N:poly2, date:drift, month:sin12, month:sin, time_s:exp, load_N:step, load_N:knee, load_N:loop, "
    "probe:group"
)
#: What stands before a + that is the sign of a number or of its exponent.
SIGN_OF_NUMBER = re.compile(r"([\d.][eE]|(sin|exp|step|knee)~?)$")


def parse_curve_effect(text: str, inputs: Inputs | None = None) -> CurveEffect:
    """Return the effect that a text names. Raises EffectError, which says what would be right.

    Without ``inputs`` only the language is checked.
    """
    typed = text.strip()
    if typed.startswith("formula(") and typed.endswith(")"):
        return _formula(typed[8:-1].strip(), inputs)
    match = _TEXT.fullmatch(typed)
    if not match:
        raise EffectError(f"'{text}' is no effect of a curve; write for example {EXAMPLES}")
    column = match["column"]
    shape = match["shape"] or ("group" if inputs is not None and column in inputs.groups else "poly1")
    if inputs is not None:
        _refuse_column(text, column, shape, inputs)
    if match["searched"] is None:
        return CurveEffect(column, shape)
    return _searched(text, match)


def _formula(text: str, inputs: Inputs | None) -> CurveEffect:
    formula = Formula(text)
    formula.check()
    if inputs is not None:
        formula.evaluate(inputs.numbers, inputs.count)
    return CurveEffect(formula.text, "formula")


def _refuse_column(text: str, column: str, shape: str, inputs: Inputs) -> None:
    """Raise EffectError for a column that is no input, or that does not hold what the shape needs."""
    if column not in inputs.numbers and column not in inputs.groups:
        raise EffectError(
            f"'{text}' names the column {column}, which is no input; there are {inputs.names()}"
        )
    grouped = column in inputs.groups
    if grouped != (shape == "group"):
        content = "labels: only" if grouped else "numbers: it is an input, not"
        raise EffectError(f"'{text}': the column {column} holds {content} {column}:group")


def _searched(text: str, match: re.Match[str]) -> CurveEffect:
    """Return an effect whose value is written or searched."""
    column, shape, estimated = match["column"], match["searched"], match["free"] is not None
    if match["value"] is None:
        if estimated:
            raise EffectError(
                f"'{text}': after ~ comes the {SEARCHED[shape]} to begin from, for example {shape}~12"
            )
        return CurveEffect(column, shape, None, True)
    value = float(match["value"])
    if not math.isfinite(value) or (shape not in PLACED and value == 0.0):
        raise EffectError(f"'{text}': the {SEARCHED[shape]} must be a finite number other than 0")
    if shape == "sin" and value < 0.0:
        raise EffectError(f"'{text}': a period is above 0; write {column}:sin{-value:g}")
    return CurveEffect(column, shape, value, estimated)


def parse_base(text: str, response: str, inputs: Inputs) -> tuple[bool, tuple[CurveEffect, ...]]:
    """Parse a one-line model, ``response ~ 1 + load_N + month:sin12``: whether it has a constant, and its effects.

    The constant is there unless 0 is among the terms. Raises EffectError.
    """
    written, tilde, right = text.partition("~")
    example = f"{response} ~ 1 + {next(iter(inputs.numbers))}"
    if not tilde or not right.strip():
        raise EffectError(f"'{text}' is no model; write the response, ~, and its terms, such as {example}")
    if written.strip() != response:
        raise EffectError(
            f"'{text}' begins with '{written.strip()}'; the response is {response}: write {example}"
        )
    constant, effects = True, []
    for term in _terms(right):
        if term in ("0", "1"):
            constant = constant and term == "1"
        elif term:
            effects.append(parse_curve_effect(term, inputs))
        else:
            raise EffectError(f"'{text}' has an empty term: between two + stands an effect")
    texts = [effect.text for effect in effects]
    twice = sorted({text for text in texts if texts.count(text) > 1})
    if twice:
        raise EffectError(f"'{text}' names {twice[0]} twice; name an effect once")
    if not constant and not effects:
        raise EffectError(f"'{text}' leaves nothing to fit; write {example}")
    return constant, tuple(effects)


def _terms(text: str) -> list[str]:
    """Return the terms between the + that stand outside brackets and outside numbers such as 1e+3."""
    terms, depth, start = [], 0, 0
    for index, character in enumerate(text):
        depth += (character == "(") - (character == ")")
        if character == "+" and depth == 0 and not SIGN_OF_NUMBER.search(text[start:index]):
            terms.append(text[start:index].strip())
            start = index + 1
    return [*terms, text[start:].strip()]
