"""Refuses a limit of an effect that a machine cannot have: it would never be asked for.

A campaign states its machine. A machine type of the configuration does not: what no machine can have is refused.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from monitor.exceptions import CampaignError, EffectError, Fault
from monitor.readers import line_of_tolerance
from monitor.readers.campaign.machine_file import EFFECT_SIGN, TERM, not_of_effect
from monitor.records import Campaign

if TYPE_CHECKING:
    from monitor.effects.context import Context
    from monitor.machine import Chain

_FILE = "campaign.toml"
#: Axes that the effects of a machine type may be of, beside the one that a term names.
_USUAL_AXES = ("X", "Y", "Z", "A", "B", "C")
_DIRECTIONS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
#: Stands between an effect and which of its coefficients a parameter is: ``EBB:harmonic2.cos``.
_COEFFICIENT_SIGN = "."


def check_tolerances(campaign: Campaign) -> None:
    """Raise CampaignError with every limit of a parameter that is none of an effect of the machine, by its line."""
    names = [name for name in campaign.machine.tolerances if EFFECT_SIGN in name]
    if not names:
        return
    # Loaded here: hardly any campaign limits an effect, and the language takes a tenth of a second.
    from monitor.effects import context_of
    from monitor.methods.model import chain_of

    chain = chain_of(campaign.machine)
    context = context_of(campaign, chain)
    content = next((file.content for file in campaign.files if file.name == _FILE), b"")
    faults = []
    for name in names:
        message = _wrong(name, chain, context)
        if message:
            faults.append(
                Fault(_FILE, line_of_tolerance(content, name), f"machine.tolerances.{name}", message)
            )
    if faults:
        raise CampaignError(campaign.name, faults)


def wrong_on_any_machine(name: str) -> str:
    """Return why no machine has an effect with a parameter of this name; empty where one may have.

    Its axis is taken to be there, its coefficients, which depend on the campaign, as they are written.
    """
    from monitor.machine import chain_of_axes
    from monitor.records import ChainAxis

    term = TERM.fullmatch(name.partition(EFFECT_SIGN)[0])
    named = () if term is None else (term[3],)
    axes = []
    for axis in dict.fromkeys((*_USUAL_AXES, *named)):
        letter = axis[0].upper()
        # An axis of a robot is named freely: it turns.
        direction = _DIRECTIONS[("XYZ" if letter in "XYZ" else "ABC").find(letter)]
        axes.append(ChainAxis(axis, "linear" if letter in "XYZ" else "rotary", "tool", direction))
    return _wrong(name, chain_of_axes(axes), None)


def _wrong(name: str, chain: Chain, context: Context | None) -> str:
    """Why no effect has a parameter of this name; empty where one has. A pitch may have the sign of a coefficient.

    Without a ``context`` nobody knows the coefficients of an effect.
    """
    from monitor.effects import parse_effect

    message = ""
    for text in dict.fromkeys((name, name.rpartition(_COEFFICIENT_SIGN)[0] or name)):
        try:
            effect = parse_effect(text, chain)
            if context is None:
                return ""
            parameters = effect.parameters(context)
        except EffectError as error:
            message = str(error)
            continue
        if name in parameters:
            return ""
        message = not_of_effect(text, parameters)
    return message
