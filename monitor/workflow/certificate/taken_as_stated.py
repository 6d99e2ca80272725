"""What a certificate says of stated tool points, from which places of the table's axes count, and of known scales."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.methods.model import chain_of
from monitor.records import BRINGS_SCALE, Campaign, Setup
from monitor.reporting.texts import Texts


def tool_point_sentence(campaign: Campaign, names: Sequence[str], texts: Texts) -> str | None:
    """Which places of axes, of the parameters ``names``, hold for the tool points as stated, without its full stop;
    None where none does.

    A tool point of a setup that goes round with an axis on the work side, stated 0.1 mm beside itself, puts that axis
    0.1 mm beside itself, and no reading tells the two apart: ``identify`` says which coordinate moves which place.
    """
    axes = [joint.name for joint in chain_of(campaign.machine).work if joint.turns]
    setups_of = {axis: _that_turn(campaign, axis) for axis in axes}
    axis_of = {f"E{way}0{axis}": axis for axis in axes if setups_of[axis] for way in "XYZ"}
    places = [name for name in names if name in axis_of]
    if not places:
        return None
    setups = [setup for axis in dict.fromkeys(axis_of[name] for name in places) for setup in setups_of[axis]]
    instruments = dict.fromkeys(setup.instrument or setup.id for setup in setups)
    return texts("evaluation.tool_points", places=", ".join(places), instruments=", ".join(instruments))


def known_scale_sentence(campaign: Campaign, texts: Texts) -> str | None:
    """Whose scale holds as exact because the campaign states it as known, without its full stop; None for nobody's."""
    instruments = dict.fromkeys(
        setup.instrument or setup.id
        for setup in campaign.artefact.setups
        if setup.reading in BRINGS_SCALE and "scale" in setup.known
    )
    if "scale" in campaign.probe.known:
        instruments[campaign.probe.id] = None
    return texts("evaluation.known_scale", instruments=", ".join(instruments)) if instruments else None


def _that_turn(campaign: Campaign, axis: str) -> list[Setup]:
    """The setups that take their tool point as stated and in which an axis moved."""
    number = campaign.probings.channels.get("setup")
    if number is None:
        return []
    angles = campaign.probings.readings[axis]
    return [
        setup
        for index, setup in enumerate(campaign.artefact.setups, start=1)
        if setup.takes_tool_point and len(np.unique(angles[number == index])) > 1
    ]
