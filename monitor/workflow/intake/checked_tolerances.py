"""Refuses a campaign with a limit of an effect that its machine cannot have: it would never be asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from monitor.exceptions import CampaignError, EffectError, Fault
from monitor.readers import line_of_tolerance
from monitor.readers.machine_file import EFFECT_SIGN, not_of_effect
from monitor.records import Campaign

if TYPE_CHECKING:
    from monitor.effects.context import Context
    from monitor.machine import Chain

_FILE = "campaign.toml"
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


def _wrong(name: str, chain: Chain, context: Context) -> str:
    """Why no effect has a parameter of this name; empty where one has. A pitch may have the sign of a coefficient."""
    from monitor.effects import parse_effect

    message = ""
    for text in dict.fromkeys((name, name.rpartition(_COEFFICIENT_SIGN)[0] or name)):
        try:
            parameters = parse_effect(text, chain).parameters(context)
        except EffectError as error:
            message = str(error)
            continue
        if name in parameters:
            return ""
        message = not_of_effect(text, parameters)
    return message
