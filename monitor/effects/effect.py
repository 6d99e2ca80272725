"""An effect: one entry of a model, written ``term:shape@driver``.

``parse_effect`` turns the text into an object with its basis functions at every probing, their effect on the
tip-to-target vector, and the names and units of its coefficients. Effects of the chain add to the
errors of one joint, turns to several of them; effects of the artefact shift the target.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from monitor.effects.artefact import HEADS, ArtefactChange, parse_artefact
from monitor.effects.change import Change
from monitor.effects.context import Context
from monitor.effects.driver import Driver
from monitor.effects.drivers import Always, SettlingDriver, parse_driver
from monitor.effects.instrument import HEADS as INSTRUMENT_HEADS, InstrumentChange, parse_instrument
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape, Shape
from monitor.effects.shapes import Compliance, Const, Nodes, Poly, parse_shape
from monitor.effects.turns import HEADS as TURN_HEADS, Turn, parse_turn, unknown_turn
from monitor.effects.weight import weight_driver
from monitor.exceptions import EffectError
from monitor.machine import LOCATION, MOTION, Chain, Joint, Term, parse_term
from monitor.records import Array
from monitor.units import ONE, Unit


@dataclass(frozen=True)
class ChainBasis:
    """An effect of the chain, evaluated at n probings: ``columns`` (n, k) of one error of one joint."""

    term: Term
    columns: Array

    @property
    def size(self) -> int:
        """The number of coefficients of the effect."""
        return int(self.columns.shape[-1])

    def displacement(self, by_error: Array) -> Array:
        """Return the change (n, 3, k) of the tip-to-target vector for each coefficient, from ``by_error``."""
        direction = by_error[:, :, self.term.joint, self.term.stage, self.term.component]
        change: Array = direction[:, :, None] * self.columns[:, None, :]
        return change

    def apply(self, coefficients: Array, errors: Array, target: Array) -> None:
        """Add the effect, in place, to ``errors`` (n, J, 2, 6); ``coefficients`` is (k,) or (n, k)."""
        added = np.sum(self.columns * coefficients, axis=-1)
        errors[..., self.term.joint, self.term.stage, self.term.component] += added

    def taken(self, rows: npt.NDArray[np.int64]) -> ChainBasis:
        """Return the effect at chosen rows."""
        return replace(self, columns=self.columns[rows])


@dataclass(frozen=True)
class ArtefactBasis:
    """A change of the targets, evaluated at n probings: ``shifts`` (n, 3, k) in mm."""

    shifts: Array

    @property
    def size(self) -> int:
        """The number of coefficients of the effect."""
        return int(self.shifts.shape[-1])

    def displacement(self, by_error: Array) -> Array:
        """Return the change (n, 3, k) of the tip-to-target vector for each coefficient."""
        return -self.shifts

    def apply(self, coefficients: Array, errors: Array, target: Array) -> None:
        """Shift ``target`` (n, 3) in place; ``coefficients`` is (k,) or (n, k)."""
        target += np.sum(self.shifts * np.expand_dims(coefficients, -2), axis=-1)

    def taken(self, rows: npt.NDArray[np.int64]) -> ArtefactBasis:
        """Return the change at chosen rows."""
        return replace(self, shifts=self.shifts[rows])


@dataclass(frozen=True)
class TurnBasis:
    """A turn of all that a joint carries, at n probings: ``turns`` (n, 3, k) rad about X, Y, Z of its frame after its
    motion. The three tilts are added as small ones: neglected are their products, 1e-6 for turns of 1 mrad."""

    joint: int
    turns: Array

    @property
    def size(self) -> int:
        """The number of coefficients of the effect."""
        return int(self.turns.shape[-1])

    def displacement(self, by_error: Array) -> Array:
        """Return the change (n, 3, k) of the tip-to-target vector for each coefficient, from ``by_error``."""
        return np.asarray(by_error[:, :, self.joint, MOTION, 3:] @ self.turns)

    def apply(self, coefficients: Array, errors: Array, target: Array) -> None:
        """Add the effect, in place, to ``errors`` (n, J, 2, 6); ``coefficients`` is (k,) or (n, k)."""
        errors[..., self.joint, MOTION, 3:] += np.sum(self.turns * np.expand_dims(coefficients, -2), axis=-1)

    def taken(self, rows: npt.NDArray[np.int64]) -> TurnBasis:
        """Return the turn at chosen rows."""
        return replace(self, turns=self.turns[rows])


@dataclass(frozen=True)
class InstrumentBasis:
    """A change of what instruments show, at n rows of d numbers: ``shown`` (n, d, k) in mm. The machine stays as it
    is: the problem of the readings adds it to what they should be."""

    shown: Array

    @property
    def size(self) -> int:
        """The number of coefficients of the effect."""
        return int(self.shown.shape[-1])

    def displacement(self, by_error: Array) -> Array:
        """Return the change (n, d, k) of the numbers for each coefficient."""
        return self.shown

    def apply(self, coefficients: Array, errors: Array, target: Array) -> None:
        """Leave the machine as it is."""

    def added(self, coefficients: Array) -> Array:
        """Return the change (n, d) of the numbers; ``coefficients`` is (k,) or (n, k)."""
        return np.asarray(np.sum(self.shown * np.expand_dims(coefficients, -2), axis=-1))

    def taken(self, rows: npt.NDArray[np.int64]) -> InstrumentBasis:
        """Return the change at chosen rows."""
        return replace(self, shown=self.shown[rows])


Basis = ChainBasis | ArtefactBasis | TurnBasis | InstrumentBasis


class Effect(Protocol):
    """What every effect offers, at n probings with k coefficients."""

    @property
    def text(self) -> str:
        """The effect as written."""
        ...

    def parameters(self, context: Context) -> tuple[str, ...]:
        """Return the names of the k coefficients."""
        ...

    @property
    def unit(self) -> Unit:
        """The unit of the coefficients."""
        ...

    def basis(self, context: Context) -> Basis:
        """Evaluate the effect at every probing of a context."""
        ...


def _labels_of(driver: Driver, context: Context) -> tuple[str, ...]:
    """Return a suffix for each multiplier of a driver in the campaign of some probings."""
    return driver.labels(context.campaign)


def _columns_of(driver: Driver, context: Context, joint: int | None) -> Array:
    """Return the multipliers (n, m) at some probings: which run it was, what a channel is in the mean and what went
    before on that day is told by the whole campaign."""
    campaign = context.campaign
    columns = campaign.remembered(driver, joint, lambda: driver.columns(campaign, joint))
    return context.of_campaign(columns)


@dataclass(frozen=True)
class ChainEffect:
    """An error of one joint."""

    term: Term
    joint: Joint
    shape: Shape
    shape_text: str
    driver: Driver
    driver_text: str

    @property
    def text(self) -> str:
        shape = "" if self.term.stage == LOCATION and isinstance(self.shape, Const) else f":{self.shape_text}"
        return f"{self.term.symbol}{shape}" + (f"@{self.driver_text}" if self.driver_text else "")

    @property
    def is_gain(self) -> bool:
        """Whether this is a positioning gain, the first-order term of EXX."""
        return (
            isinstance(self.shape, Poly)
            and self.shape.order == 1
            and isinstance(self.driver, Always)
            and self.term.stage == MOTION
            and not self.joint.turns
            and not self.term.is_rotation
            and self.joint.main == self.term.component
        )

    @cached_property
    def unit(self) -> Unit:
        unit = self.shape.unit(self.term.unit, self.joint)
        driver = self.driver.unit()
        return unit if driver is ONE else unit.per(driver)

    def parameters(self, context: Context) -> tuple[str, ...]:
        # The gain is named by its ISO 230-1 symbol alone; that is how certificates print it.
        # So is an error at a node of the user: EXX(-110).
        name = self.term.symbol if self.is_gain or isinstance(self.shape, Nodes) else self.text
        return tuple(f"{name}{s}{d}" for s in self.shape.labels for d in _labels_of(self.driver, context))

    def basis(self, context: Context) -> ChainBasis:
        joint = self.term.joint
        shape = context.remembered(self.shape, joint, lambda: self.shape.columns(context, joint))
        driver = _columns_of(self.driver, context, joint)
        product = (shape[:, :, None] * driver[:, None, :]).reshape(len(shape), -1)
        return ChainBasis(self.term, product)


AnyChange = TypeVar("AnyChange", bound=Change)


@dataclass(frozen=True)
class _DrivenChange(Generic[AnyChange]):
    """A change and what scales it."""

    change: AnyChange
    driver: Driver
    driver_text: str

    @property
    def text(self) -> str:
        return self.change.text + (f"@{self.driver_text}" if self.driver_text else "")

    @property
    def unit(self) -> Unit:
        driver = self.driver.unit()
        return self.change.unit if driver is ONE else self.change.unit.per(driver)

    def parameters(self, context: Context) -> tuple[str, ...]:
        return tuple(
            f"{self.text}{s}{d}"
            for s in self.change.labels(context.campaign)
            for d in _labels_of(self.driver, context)
        )


@dataclass(frozen=True)
class ArtefactEffect(_DrivenChange[ArtefactChange]):
    """A change of the targets."""

    def basis(self, context: Context) -> ArtefactBasis:
        shift = context.of_campaign(self.change.shifts(context.campaign))
        driver = _columns_of(self.driver, context, None)
        product = (shift[:, :, :, None] * driver[:, None, None, :]).reshape(len(shift), 3, -1)
        return ArtefactBasis(product)


@dataclass(frozen=True)
class TurnEffect(_DrivenChange[Turn]):
    """A turn with one coefficient for several terms."""

    def basis(self, context: Context) -> TurnBasis:
        turns = self.change.turns(context)
        driver = _columns_of(self.driver, context, self.change.joint(context.chain))
        product = (turns[:, :, :, None] * driver[:, None, None, :]).reshape(len(turns), 3, -1)
        return TurnBasis(self.change.joint(context.chain), product)


@dataclass(frozen=True)
class InstrumentEffect(_DrivenChange[InstrumentChange]):
    """A change of what an instrument shows."""

    def basis(self, context: Context) -> InstrumentBasis:
        shown = context.of_campaign(self.change.shown(context.campaign))
        driver = _columns_of(self.driver, context, None)
        if self.change.needs_driver:
            driver = self.change.since_the_first(driver, context)
        product = shown[:, :, :, None] * driver[:, None, None, :]
        return InstrumentBasis(product.reshape(*shown.shape[:2], -1))


#: Every effect that a text can name.
ParsedEffect = ChainEffect | ArtefactEffect | TurnEffect | InstrumentEffect


def _instrument_effect(text: str) -> InstrumentEffect:
    """Return the change of an instrument that a text names. Raises EffectError where it needs a driver."""
    body, driver_text = _split_driver(text)
    change = parse_instrument(body)
    if change.needs_driver and not driver_text:
        raise EffectError(f"'{text}' is what every run has of its own; name what it follows: {text}@run_time")
    return InstrumentEffect(change, parse_driver(driver_text), driver_text)


def _turn_effect(text: str, chain: Chain) -> TurnEffect:
    """Return the turn that a text names, with a driver where one follows."""
    turn, driver_text = parse_turn(text), ""
    if turn is None:
        body, driver_text = _split_driver(text)
        turn = parse_turn(body) if driver_text else None
    if turn is None:
        raise unknown_turn(text)
    turn.joint(chain)
    return TurnEffect(turn, parse_driver(driver_text), driver_text)


def parse_effect(text: str, chain: Chain) -> ParsedEffect:
    """Return the effect that a text names on a chain. Raises EffectError, which says what would be right."""
    if text.strip().partition(":")[0] in TURN_HEADS:
        return _turn_effect(text.strip(), chain)
    if text.strip().partition(":")[0] in INSTRUMENT_HEADS:
        return _instrument_effect(text.strip())
    body, driver_text = _split_driver(text.strip())
    head, _, shape_text = body.partition(":")
    if head in HEADS:
        return ArtefactEffect(parse_artefact(body), parse_driver(driver_text), driver_text)
    term = parse_term(head, chain)
    error = JointError(term, chain.joints[term.joint])
    if not shape_text:
        if not error.is_location:
            raise EffectError(
                f"'{text}' is an error motion and needs a shape: write for example {head}:poly1 or {head}:const"
            )
        shape_text = "const"
    shape = parse_shape(shape_text)
    if isinstance(shape, DescribedShape):
        shape.refuse(text, error)
        shape_text = shape.named(shape_text)
    weighed = isinstance(shape, Compliance)
    driver = weight_driver(text, driver_text, error) if weighed else parse_driver(driver_text)
    return ChainEffect(term, error.joint, shape, shape_text, driver, driver_text)


def _split_driver(text: str) -> tuple[str, str]:
    """Return body and driver; an @ inside brackets belongs to a formula."""
    at = text.rfind("@")
    if at == -1 or text.count(")", at) > text.count("(", at):
        return text, ""
    if at == len(text) - 1:
        raise EffectError(f"'{text}' ends in @ without a driver; write for example {text}warmup")
    return text[:at], text[at + 1 :]


def with_time_constant(effect: ParsedEffect, seconds: float) -> ParsedEffect:
    """Return the effect with the time constant of its driver fixed; its text keeps ``@warmup``."""
    assert isinstance(effect.driver, SettlingDriver)
    return replace(effect, driver=replace(effect.driver, time_constant_s=seconds))
