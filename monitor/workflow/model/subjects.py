"""What has the effects of a model: the machines of the database under a calibration method, or its curves."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from monitor.effects import InstrumentEffect, ParsedEffect, parse_effect
from monitor.effects.context import ReadBy
from monitor.effects.curve import inputs_of, parse_curve_effect
from monitor.effects.curve.words import describe_curve
from monitor.effects.words import describe
from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.machine import Chain
from monitor.methods import ChainMethod, CurveMethod, methods
from monitor.methods.chain.base_effects import base_effects
from monitor.methods.instruments.readings import readings
from monitor.methods.model import SHARED_BASE, SHARED_BASE_MEANING, Model, chain_of
from monitor.reporting import messages
from monitor.store import (
    Database,
    StoredModel,
    curve_names,
    described_machines,
    described_setups,
    load_curve,
    load_model,
)
from monitor.workflow.uncertainty.machine_frame import refers_to

Subject = TypeVar("Subject")
Found = TypeVar("Found")


class Subjects(Protocol):
    """Everything in the database that can have the effects of a model."""

    def base(self) -> dict[str, tuple[str, ...]]:
        """Return the base effects of each of them."""

    def meaning(self, effects: Sequence[str]) -> dict[str, str]:
        """Return the meaning of effects on the first subject that has them; effects that none has are left out."""

    def refers_to(self, effects: Sequence[str]) -> dict[str, dict[str, str]]:
        """Return what base effects and ``effects`` are stated relative to on each of them that has a chain."""

    def canonical(self, effect: str, campaign: str | None) -> str:
        """Return the text of an effect in its own words.

        Raises NotFoundError without any subject, EffectError where none has the effect, InputError for a base effect.
        """


@dataclass(frozen=True)
class Machines:
    """The machines that a calibration method applies to; with None a model that descends from no method's own."""

    db: Database
    method: ChainMethod | None

    def base(self) -> dict[str, tuple[str, ...]]:
        return {machine: base for machine, _, base in self._calibrated()}

    def meaning(self, effects: Sequence[str]) -> dict[str, str]:
        meaning: dict[str, str] = {}
        for _, chain, _ in self._calibrated():
            for text in effects:
                if text == SHARED_BASE:
                    meaning[text] = SHARED_BASE_MEANING
                    continue
                try:
                    meaning.setdefault(text, describe(parse_effect(text, chain)).meaning)
                except InputError:
                    continue
        return meaning

    def refers_to(self, effects: Sequence[str]) -> dict[str, dict[str, str]]:
        return {machine: refers_to((*base, *effects), chain) for machine, chain, base in self._calibrated()}

    def canonical(self, effect: str, campaign: str | None) -> str:
        chains = tuple(dict.fromkeys(chain_of(machine) for machine in described_machines(self.db)))
        if not chains:
            raise NotFoundError("there is no machine yet that could have an effect; import a campaign first")
        if effect == SHARED_BASE:
            if self.method is None or not self.method.shares_base:
                raise InputError(
                    f"{SHARED_BASE}: only where a machine is seen from outside (tracker) can its base effects be "
                    "shared by all runs of a campaign; elsewhere they are what is followed from run to run"
                )
            return effect
        parsed = _first(chains, lambda chain: parse_effect(effect, chain))
        self._refuse_nobodys(parsed, campaign)
        text = parsed.text
        bases = [base for _, _, base in self._calibrated()]
        if bases and all(text in base for base in bases):
            raise InputError(f"{text} is free in every run already, whatever the model; add another effect")
        return text

    def _refuse_nobodys(self, effect: ParsedEffect, campaign: str | None) -> None:
        """Raise EffectError for a change of a setup or an instrument that no campaign has, or not ``campaign``."""
        if isinstance(effect, InstrumentEffect):
            setups = (
                ReadBy(
                    setup.id, setup.instrument or "", setup.reading, len(readings()[setup.reading].columns)
                )
                for setup in described_setups(self.db, campaign)
            )
            effect.change.among(setups, messages.who_has(campaign))

    def _calibrated(self) -> Iterator[tuple[str, Chain, tuple[str, ...]]]:
        """Yield the machines that the method can calibrate: name, chain, and the effects that are free in every run."""
        base_of = base_effects if self.method is None else self.method.base_effects
        for machine in described_machines(self.db):
            chain = chain_of(machine)
            try:
                base = base_of(chain)
            except DataError:
                # A method that a machine cannot be calibrated by has no base on it.
                continue
            yield machine.id, chain, base


@dataclass(frozen=True)
class Curves:
    """The curves of the database."""

    db: Database
    method: CurveMethod

    def base(self) -> dict[str, tuple[str, ...]]:
        return {name: (load_curve(self.db, name).base,) for name in curve_names(self.db)}

    def meaning(self, effects: Sequence[str]) -> dict[str, str]:
        meaning: dict[str, str] = {}
        for name in curve_names(self.db):
            curve = load_curve(self.db, name)
            for text in effects:
                try:
                    effect = parse_curve_effect(text, inputs_of(curve))
                except InputError:
                    continue
                unit, clock = curve.units.get(effect.column, ""), effect.column == curve.time
                meaning.setdefault(text, describe_curve(effect, curve.response, unit, clock=clock).meaning)
        return meaning

    def refers_to(self, effects: Sequence[str]) -> dict[str, dict[str, str]]:
        return {}

    def canonical(self, effect: str, campaign: str | None) -> str:
        """Return the text as the protocol says; only the curve ``campaign`` counts where it is named."""
        names = curve_names(self.db) if campaign is None else (campaign,)
        if not names:
            raise NotFoundError(
                "there is no curve yet that could have an effect; import a campaign of one first"
            )

        def text_on(name: str) -> str:
            curve = load_curve(self.db, name)
            text = parse_curve_effect(effect, inputs_of(curve)).text
            self.method.problem_of(curve, Model(name, added=(text,)))
            return text

        return _first(names, text_on)


def _first(subjects: Sequence[Subject], on: Callable[[Subject], Found]) -> Found:
    """What is ``on`` the first subject that has it. Raises the fault of the first where none has it."""
    fault: InputError | None = None
    for subject in subjects:
        try:
            return on(subject)
        except InputError as error:
            fault = fault or error
    assert fault is not None
    raise fault


def subjects_of(db: Database, model: StoredModel) -> Subjects:
    """The subjects of the method that a model descends from."""
    while model.parent is not None:
        model = load_model(db, *model.parent)
    method = methods().get(model.name)
    return Curves(db, method) if isinstance(method, CurveMethod) else Machines(db, method)
