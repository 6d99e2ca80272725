"""The catalogue of effects in words, searchable: of a topology, or of what a campaign's machine and columns allow."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from monitor.discovery.curve.candidates import catalogue as curve_catalogue
from monitor.effects import ArtefactEffect, ChainEffect
from monitor.effects.catalogue import catalogue, drivers_of, of_balls, of_tracker
from monitor.effects.curve import SEARCHED
from monitor.effects.curve_words import describe_curve
from monitor.effects.words import Words, describe
from monitor.machine import parse_topology
from monitor.methods import campaign_method
from monitor.methods.chain.base_effects import base_effects
from monitor.methods.curve.fit import fit
from monitor.methods.curve.problem import grid
from monitor.methods.curve.problem import problem_of as curve_problem_of
from monitor.readers import read_campaign
from monitor.records import Campaign, CurveCampaign
from monitor.store import Database, is_curve, load_campaign, load_curve

Document = dict[str, Any]

# Those that every campaign has, and two channels as examples.
DRIVERS = ("warmup", "run_time", "ambient_degC", "x_axis_degC")


def _told(effect: str, unit: str, words: Words) -> Document:
    return {
        "effect": effect,
        "unit": unit,
        "meaning": words.meaning,
        "cause": words.cause,
        "remedy": words.remedy,
        "described_in": words.described_in,
    }


def _of_chain(effects: Iterable[ChainEffect | ArtefactEffect]) -> list[Document]:
    return [_told(effect.text, effect.unit.name, describe(effect)) for effect in effects]


def _with(found: list[Document], text: str | None) -> list[Document]:
    """Those that contain ``text`` in any of their words."""
    if text is None:
        return found
    return [one for one in found if text.lower() in " ".join(one.values()).lower()]


def effects(topology: str, text: str | None = None) -> Document:
    """Every effect of the catalogue on a chain whose name or words contain ``text``; TopologyError."""
    chain = parse_topology(topology)
    base = base_effects(chain)
    more = (*of_balls(DRIVERS), *of_tracker(chain, DRIVERS))
    found = _of_chain(catalogue(chain, base, DRIVERS, more=more))
    return {"topology": chain.topology, "base": list(base), "effects": _with(found, text)}


def effects_of_folder(folder: Path, text: str | None = None) -> Document:
    """As ``effects_of``, of a campaign folder that need not be imported. Raises CampaignError."""
    return effects_of(read_campaign(folder), text)


def effects_of_campaign(db: Database, name: str, text: str | None = None) -> Document:
    """As ``effects_of``, of a campaign of the database. Raises NotFoundError."""
    return effects_of(load_curve(db, name) if is_curve(db, name) else load_campaign(db, name), text)


def effects_of(campaign: Campaign | CurveCampaign, text: str | None = None) -> Document:
    """Every effect that `explain` looks for in a campaign: those of its machine's own axes, freely placed ones too, of
    its method and of the columns that were recorded. Of a curve, those of its columns.

    Raises DataError where the readings do not suffice.
    """
    if isinstance(campaign, CurveCampaign):
        problem = curve_problem_of(campaign)
        fit(problem)
        unit = campaign.units.get(campaign.response, "") or "1"
        found = []
        for effect in curve_catalogue(problem):
            own = problem.inputs.units.get(effect.column, "")
            shown = effect
            if effect.free:
                values = grid(effect, problem.inputs)
                if len(values) == 0:
                    continue
                shown = effect.at(float(values[0]))
            words = describe_curve(shown, campaign.response, own, clock=effect.column == campaign.time)
            if effect.free:
                what = SEARCHED[effect.shape]
                words = replace(
                    words,
                    meaning=f"{effect.shape} of {effect.column} in {campaign.response}, its {what} searched",
                )
            found.append(_told(effect.text, unit, words))
        return {"campaign": campaign.name, "base": [campaign.base], "effects": _with(found, text)}
    machine = campaign_method(campaign).problem_of(campaign)
    drivers = drivers_of(machine.context)
    pitches = {
        name: axis.scale_pitch for name, axis in campaign.machine.axes.items() if axis.scale_pitch is not None
    }
    base = [effect.text for effect in machine.base]
    looked_for = catalogue(machine.context.chain, base, drivers, pitches, machine.method_effects(drivers))
    return {
        "campaign": campaign.name,
        "machine": campaign.machine.id,
        "topology": machine.context.chain.topology,
        "drivers": list(drivers),
        "base": base,
        "effects": _with(_of_chain(looked_for), text),
    }
