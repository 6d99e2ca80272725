"""A model: the effects that are free in every run and those that all runs of a campaign share."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.effects import ParsedEffect, parse_effect
from monitor.exceptions import EffectError
from monitor.machine import Chain, chain_of_axes, parse_topology
from monitor.methods.chain.base_effects import base_effects
from monitor.records import Machine

#: Among the added effects: all base effects, one number for all runs of a campaign instead of one in each.
SHARED_BASE = "base@all_runs"
SHARED_BASE_MEANING = "the base effects, each one number for all runs of a campaign"


@dataclass(frozen=True)
class Model:
    """A named list of effects. ``base`` empty means: the complete and minimal set of the machine's chain.

    With ``SHARED_BASE`` among the ``added`` effects the base is shared by all runs (one session of a robot whose
    tracker was set up several times), and none of it is free in a run.
    """

    name: str
    base: tuple[str, ...] = ()
    added: tuple[str, ...] = ()

    def base_of(self, chain: Chain, outside: bool | None = None) -> tuple[ParsedEffect, ...]:
        """The effects that are free in every run; ``outside`` as for ``base_effects``."""
        return () if SHARED_BASE in self.added else self._whole_base(chain, outside)

    def _whole_base(self, chain: Chain, outside: bool | None) -> tuple[ParsedEffect, ...]:
        return tuple(parse_effect(text, chain) for text in (self.base or base_effects(chain, outside)))

    def added_to(self, chain: Chain, outside: bool | None = None) -> tuple[ParsedEffect, ...]:
        """The effects that all runs share; EffectError where one is in the base already or named twice."""
        effects = tuple(parse_effect(text, chain) for text in self.added if text != SHARED_BASE)
        base = self._whole_base(chain, outside)
        texts = [effect.text for effect in (*base, *effects)]
        twice = sorted({text for text in texts if texts.count(text) > 1})
        if twice:
            raise EffectError(f"model {self.name} has {twice[0]} already; name an effect once")
        return (*base, *effects) if SHARED_BASE in self.added else effects


def chain_of(machine: Machine) -> Chain:
    """The chain that a machine's file describes."""
    signs = {name: axis.sign for name, axis in machine.axes.items() if axis.sign is not None}
    if machine.chain:
        return chain_of_axes(machine.chain, signs, machine.gravity)
    return parse_topology(machine.topology, signs, machine.gravity)
