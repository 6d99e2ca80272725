"""The least-squares problem of a curve under a model: its rows, its columns, and the values that a search tries."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.effects.curve import (
    CurveEffect,
    Inputs,
    coefficient_names,
    coefficient_unit,
    curve_columns,
    inputs_of,
    parse_base,
    parse_curve_effect,
)
from monitor.exceptions import EffectError
from monitor.methods.model import Model
from monitor.records import Array, CurveCampaign

NAME = "curve"
DEFAULT_MODEL = Model(NAME)
CONSTANT = "constant"

#: A period is searched from twice the mean spacing to the whole range, three steps a resolvable period; a constant
#: from a fiftieth of the range to all of it; places where at least three rows lie on either side.
FREQUENCY_STEPS = 3.0
CONSTANTS = tuple(0.02 * 50.0 ** (step / 9.0) for step in range(10))
FEWEST_ON_A_SIDE = 3
#: The part of the range, about its middle, where a knee is looked for.
KNEE_WITHIN = 0.8
SHORTEST_CONSTANT = 1.0
MOST_PLACES = 400


@dataclass(frozen=True)
class CurveProblem:
    """A curve under a model: rows with weight are those not ``left_out`` (n,)."""

    curve: CurveCampaign
    inputs: Inputs
    constant: bool
    base: tuple[CurveEffect, ...]
    added: tuple[CurveEffect, ...]
    left_out: npt.NDArray[np.bool_]

    @property
    def effects(self) -> tuple[CurveEffect, ...]:
        """Base and added."""
        return (*self.base, *self.added)

    @cached_property
    def order(self) -> npt.NDArray[np.int64]:
        """The rows that have weight, in the order in which they were measured."""
        weighted = np.flatnonzero(~self.left_out)
        if self.curve.time is None:
            return weighted
        return weighted[np.argsort(self.inputs.numbers[self.curve.time][weighted], kind="stable")]

    def with_effects(self, effects: Sequence[CurveEffect]) -> CurveProblem:
        """The problem with further effects."""
        return replace(self, added=(*self.added, *effects))

    def columns(self, effects: Sequence[CurveEffect]) -> tuple[tuple[str, ...], tuple[str, ...], Array]:
        """Names, units and columns (n, k) of the coefficients; lower powers come along, nothing comes twice."""
        unit = self.curve.units.get(self.curve.response, "")
        names, units, columns = [], [], []
        if self.constant:
            names, units, columns = [CONSTANT], [unit or "1"], [np.ones((len(self.curve), 1))]
        for effect in _with_lower_powers(effects):
            coefficients = coefficient_names(effect, self.inputs)
            if coefficients[0] in names:
                continue
            names += coefficients
            units += [coefficient_unit(effect, self.inputs, unit)] * len(coefficients)
            columns.append(curve_columns(effect, self.inputs))
        stacked = np.concatenate(columns, axis=1) if columns else np.zeros((len(self.curve), 0))
        return tuple(names), tuple(units), stacked


def _with_lower_powers(effects: Sequence[CurveEffect]) -> Iterator[CurveEffect]:
    for effect in effects:
        for power in range(1, effect.order):
            yield CurveEffect(effect.column, f"poly{power}")
        yield CurveEffect(effect.column, "poly1") if effect.shape == "drift" else effect


def problem_of(campaign: CurveCampaign, model: Model = DEFAULT_MODEL) -> CurveProblem:
    """The least-squares problem of a curve under a model. Raises EffectError for an effect that it does not have."""
    inputs = inputs_of(campaign)
    constant, base = parse_base(campaign.base, campaign.response, inputs)
    added = tuple(parse_curve_effect(text, inputs) for text in model.added)
    texts = [effect.text for effect in base]
    for effect in added:
        if effect.text in texts:
            raise EffectError(f"model {model.name} has {effect.text} already; name an effect once")
        texts.append(effect.text)
    return CurveProblem(campaign, inputs, constant, base, added, np.zeros(len(campaign), dtype=bool))


def grid(effect: CurveEffect, inputs: Inputs) -> Array:
    """The values (g,) of a searched effect to look at; empty where the input takes too few values."""
    x = np.unique(inputs.numbers[effect.column])
    span = float(x[-1] - x[0])
    if len(x) < 2 * FEWEST_ON_A_SIDE + 2 or span == 0.0:
        return np.zeros(0)
    if effect.shape == "sin":
        count = int(FREQUENCY_STEPS * (len(x) - 1) / 2.0)
        return span / np.arange(FREQUENCY_STEPS, max(count, FREQUENCY_STEPS) + 1.0) * FREQUENCY_STEPS
    if effect.shape == "exp":
        # A constant shorter than the distance of the rows would follow single values of the input.
        constants = span * np.array(CONSTANTS)
        constants = constants[constants >= SHORTEST_CONSTANT * float(np.median(np.diff(x)))]
        return np.concatenate([constants, -constants])
    ordered = np.sort(inputs.numbers[effect.column])
    middles = (x[1:] + x[:-1]) / 2.0
    below = np.searchsorted(ordered, middles)
    inside = middles[(below >= FEWEST_ON_A_SIDE) & (len(ordered) - below >= FEWEST_ON_A_SIDE)]
    if effect.shape == "knee":
        # Near an end another slope is the slope of nearly all rows, or of nearly none.
        inside = inside[np.abs(inside - (x[0] + x[-1]) / 2.0) <= KNEE_WITHIN * span / 2.0]
    if len(inside) > MOST_PLACES:
        inside = inside[np.linspace(0, len(inside) - 1, MOST_PLACES).astype(int)]
    return inside
