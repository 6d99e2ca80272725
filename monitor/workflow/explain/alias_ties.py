"""Ties of cycles that are one at positions on a grid: positions that are not even break them.

Another instrument at the same positions sees one wave as well, and so does one more grid: beside the first it has
pitches of its own that it does not tell apart. ISO 230-2 has every target position off by another part of the interval.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from monitor.discovery.machine.shapes.alias_pitches import grid_on_which_they_are_one
from monitor.effects import ChainEffect, Context, parse_effect
from monitor.effects.drivers import Always
from monitor.effects.shapes import Cyclic
from monitor.exceptions import EffectError
from monitor.workflow.explain.explain_answer import MachineExplanation
from monitor.workflow.explain.ties import Tie, TieBreak


def with_uneven_positions(explanation: MachineExplanation, context: Context) -> MachineExplanation:
    """The explanation with the positions that tell a cycle from those that are one with it on the grid of ``context``,
    where no plan selects poses for them."""
    missing = (
        replace(
            effect,
            ties=tuple(
                each for tie in effect.ties for each in ties_at_uneven_positions(effect.effect, tie, context)
            ),
        )
        for effect in explanation.missing
    )
    return replace(explanation, missing=tuple(missing))


def ties_at_uneven_positions(effect: str, tie: Tie, context: Context) -> Iterator[Tie]:
    """A tie of an effect, of the rivals that are one with it on the grid by themselves."""
    named_cycle = _cycle(effect, context)
    if tie.broken_by is not TieBreak.MORE_POSES or named_cycle is None:
        yield tie
        return
    steps = {
        rival: step
        for rival in tie.rivals
        if (cycle := _cycle(rival, context)) is not None
        and cycle.term == named_cycle.term
        and (step := grid_on_which_they_are_one([named_cycle, cycle], context)) is not None
    }
    if steps:
        step_mm = round(next(iter(steps.values())), 3)
        yield Tie(tuple(steps), TieBreak.UNEVEN_POSITIONS, axes=(named_cycle.joint.name,), step_mm=step_mm)
    if rest := tuple(rival for rival in tie.rivals if rival not in steps):
        yield replace(tie, rivals=rest)


def _cycle(text: str, context: Context) -> ChainEffect | None:
    """The cycle of a linear axis that an effect is; None for what is none, and for what follows a driver."""
    try:
        effect = parse_effect(text, context.chain)
    except EffectError:
        return None
    if not isinstance(effect, ChainEffect) or effect.joint.kind != "linear":
        return None
    return effect if isinstance(effect.shape, Cyclic) and isinstance(effect.driver, Always) else None
