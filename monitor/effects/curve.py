"""Effects of a curve: one response over its inputs. The same language, ``column:shape``, for a load cell or a clock.

| written | what |
| --- | --- |
| ``load_N`` or ``load_N:poly1`` | in proportion to an input |
| ``load_N:poly2`` ... ``poly9`` | a power of it; lower powers that the model lacks come along: no origin matters |
| ``date:drift`` | in proportion to the time, or to ``sequence``, the number of the row |
| ``month:sin12`` | a cosine and a sine of exactly this period |
| ``month:sin~44.3`` | the same with a period that is found from the data, near this value; ``month:sin`` searches it |
| ``time_s:exp~120``, ``exp`` | exp(-x/constant), x from the smallest value on; a negative constant grows |
| ``load_N:step~50``, ``step`` | a step at this place |
| ``probe`` or ``probe:group`` | every group has its own mean |
| ``formula(log(load_N))`` | typed by the user over the columns |
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.effects.formula import Formula
from monitor.exceptions import EffectError
from monitor.records import Array, CurveCampaign

#: The input that every curve has: the number of the row, from 1.
SEQUENCE = "sequence"
#: Shapes with a value that can be searched, and what that value is called.
SEARCHED = {"sin": "period", "exp": "constant", "step": "place"}
COLUMN = re.compile(r"[A-Za-z]\w*", re.ASCII)
_TEXT = re.compile(
    r"(?P<column>[A-Za-z]\w*)(?::(?P<shape>poly[1-9]|drift|group|(?:sin|exp|step)(?P<free>~)?"
    r"(?P<value>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)?))?",
    re.ASCII,
)
EXAMPLES = "load_N:poly2, date:drift, month:sin12, month:sin, time_s:exp, load_N:step, probe:group"


@dataclass(frozen=True)
class CurveEffect:
    """One effect. ``value`` is the period, constant or place, None where it is to be searched; ``free`` says that
    it is found from the data."""

    column: str
    shape: str
    value: float | None = None
    free: bool = False

    @property
    def text(self) -> str:
        """The effect as written; 15 digits of a searched value, so that nothing of it is lost."""
        if self.shape == "formula":
            return f"formula({self.column})"
        value = "" if self.value is None else f"{'~' if self.free else ''}{self.value:.15g}"
        return f"{self.column}:{self.shape}{value}"

    @property
    def family(self) -> str:
        """The effect without its searched value."""
        return f"{self.column}:{self.shape}" if self.free else self.text

    @property
    def order(self) -> int:
        """The power of a polynomial, 1 for a drift, 0 for everything else."""
        if self.shape == "drift":
            return 1
        return int(self.shape[4:]) if self.shape.startswith("poly") else 0

    def at(self, value: float) -> CurveEffect:
        """The effect with another searched value."""
        return replace(self, value=value, free=True)


@dataclass(frozen=True)
class Inputs:
    """What effects are computed from: numbers (n,) and labels (n,) by name, n rows, and the unit of each number."""

    numbers: Mapping[str, Array]
    groups: Mapping[str, npt.NDArray[np.str_]]
    units: Mapping[str, str]
    count: int

    def names(self) -> str:
        """The columns, for a message."""
        return ", ".join([*(name for name in self.numbers if name != SEQUENCE), *self.groups])


def inputs_of(curve: CurveCampaign) -> Inputs:
    """The inputs of a curve, the number of the row among them."""
    count = len(curve)
    numbers = {name: values for name, values in curve.columns.items() if name != curve.response}
    return Inputs({**numbers, SEQUENCE: np.arange(1.0, count + 1.0)}, curve.groups, curve.units, count)


def parse_curve_effect(text: str, inputs: Inputs | None = None) -> CurveEffect:
    """The effect that a text names; EffectError says what is wrong and what would be right.

    Without ``inputs`` only the language is checked.
    """
    typed = text.strip()
    if typed.startswith("formula(") and typed.endswith(")"):
        formula = Formula(typed[8:-1].strip())
        formula.check()
        if inputs is not None:
            formula.evaluate(inputs.numbers, inputs.count)
        return CurveEffect(formula.text, "formula")
    found = _TEXT.fullmatch(typed)
    if not found:
        raise EffectError(f"'{text}' is no effect of a curve; write for example {EXAMPLES}")
    column, shape = found["column"], found["shape"]
    if inputs is not None and column not in inputs.numbers and column not in inputs.groups:
        raise EffectError(
            f"'{text}' names the column {column}, which is no input; there are {inputs.names()}"
        )
    grouped = inputs is not None and column in inputs.groups
    if shape is None:
        shape = "group" if grouped else "poly1"
    elif inputs is not None and grouped != (shape == "group"):
        words = "labels: only" if grouped else "numbers: it is an input, not"
        raise EffectError(f"'{text}': the column {column} holds {words} {column}:group")
    if found["shape"] is None or not shape.startswith(tuple(SEARCHED)):
        return CurveEffect(column, shape)
    bare = re.match("sin|exp|step", shape)
    assert bare is not None
    value = None if found["value"] is None else float(found["value"])
    if value is None and found["free"]:
        raise EffectError(
            f"'{text}': after ~ comes the {SEARCHED[bare[0]]} to begin from, for example {bare[0]}~12"
        )
    if value is not None and (not np.isfinite(value) or (bare[0] != "step" and value == 0.0)):
        raise EffectError(f"'{text}': the {SEARCHED[bare[0]]} must be a finite number other than 0")
    if bare[0] == "sin" and value is not None and value < 0.0:
        raise EffectError(f"'{text}': a period is above 0; write {column}:sin{-value:g}")
    return CurveEffect(column, bare[0], value, value is None or found["free"] is not None)


def curve_columns(effect: CurveEffect, inputs: Inputs, value: float | None = None) -> Array:
    """Columns (n, k) of an effect, at ``value`` instead of its own where one is given.

    A polynomial has its own power alone, in the unit of the input; a group one column a label but the first.
    Raises EffectError for a formula that is not finite.
    """
    if effect.shape == "formula":
        return Formula(effect.column).evaluate(inputs.numbers, inputs.count)[:, None]
    if effect.shape == "group":
        labels = inputs.groups[effect.column]
        return np.stack([labels == name for name in group_names(labels)[1:]], axis=1).astype(float)
    x = inputs.numbers[effect.column]
    if effect.order:
        return np.asarray(x[:, None] ** effect.order, dtype=np.float64)
    at = effect.value if value is None else value
    assert at is not None, f"the value of {effect.text} has not been searched yet"
    if effect.shape == "sin":
        phase = 2.0 * np.pi * x / at
        return np.column_stack([np.cos(phase), np.sin(phase)])
    if effect.shape == "exp":
        # From the end at which it is 1, so that nothing overflows.
        start = x.min() if at > 0 else x.max()
        return np.asarray(np.exp(-(x - start) / at)[:, None], dtype=np.float64)
    return np.asarray((x > at)[:, None], dtype=np.float64)


def group_names(labels: Iterable[str]) -> list[str]:
    """The labels of a group in the order in which they first occur."""
    return list(dict.fromkeys(map(str, labels)))


def coefficient_names(effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
    """A name for each coefficient of an effect."""
    if effect.shape == "group":
        first, *others = group_names(inputs.groups[effect.column])
        return tuple(f"{effect.column}={name} - {first}" for name in others)
    if effect.shape == "sin":
        return (f"{effect.text}.cos", f"{effect.text}.sin")
    if effect.shape in ("poly1", "drift"):
        return (effect.column,)
    return (effect.text,)


def coefficient_unit(effect: CurveEffect, inputs: Inputs, response: str) -> str:
    """The unit of its coefficients: that of the response, over a power of that of the input."""
    of_input = inputs.units.get(effect.column, "")
    if effect.column == SEQUENCE and effect.order:
        of_input = "row"
    if not effect.order or not of_input:
        return response or "1"
    power = {1: "", 2: "²", 3: "³"}.get(effect.order, f"^{effect.order}")
    return f"{response or '1'}/{of_input}{power}"


def parse_base(text: str, response: str, inputs: Inputs) -> tuple[bool, tuple[CurveEffect, ...]]:
    """A one-line model, ``response ~ 1 + load_N + month:sin12``: whether it has a constant, and its effects.

    The constant is there unless 0 is among the terms. Raises EffectError.
    """
    left, tilde, right = text.partition("~")
    example = f"{response} ~ 1 + {next(iter(inputs.numbers))}"
    if not tilde or not right.strip():
        raise EffectError(f"'{text}' is no model; write the response, ~, and its terms, such as {example}")
    if left.strip() != response:
        raise EffectError(
            f"'{text}' begins with '{left.strip()}'; the response is {response}: write {example}"
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
    twice = sorted({one for one in texts if texts.count(one) > 1})
    if twice:
        raise EffectError(f"'{text}' names {twice[0]} twice; name an effect once")
    if not constant and not effects:
        raise EffectError(f"'{text}' leaves nothing to fit; write {example}")
    return constant, tuple(effects)


def _terms(text: str) -> list[str]:
    """The terms between the + that stand outside brackets and outside numbers such as 1e+3."""
    found, depth, start = [], 0, 0
    for place, sign in enumerate(text):
        depth += (sign == "(") - (sign == ")")
        exponent = re.search(r"[\d.][eE]$", text[start:place]) is not None
        if (
            sign == "+"
            and depth == 0
            and not exponent
            and not re.search(r"(sin|exp|step)~?$", text[start:place])
        ):
            found.append(text[start:place].strip())
            start = place + 1
    return [*found, text[start:].strip()]
