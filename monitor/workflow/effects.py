"""The catalogue of effects in words, searchable: of a topology, or of what a campaign's machine and columns allow."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import astuple, dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path

from monitor.documents import INLINED, OMITTED
from monitor.effects import ParsedEffect, parse_effect
from monitor.effects.catalogue import (
    at_searched_places,
    catalogue,
    drivers_of,
    of_balls,
    of_ram,
    of_single_touches,
    of_tool_end,
    of_tracker,
    of_work_end,
)
from monitor.effects.curve import CurveEffect
from monitor.effects.curve.words import describe_curve
from monitor.effects.description import Description
from monitor.effects.words import describe, describe_searched
from monitor.exceptions import InputError
from monitor.machine import Chain, parse_topology
from monitor.methods import campaign_method
from monitor.methods.chain.base_effects import base_effects
from monitor.methods.curve.catalogue import catalogue as curve_catalogue
from monitor.methods.curve.fit import fit
from monitor.methods.curve.problem import CurveProblem, grid, problem_of as curve_problem_of
from monitor.readers import read_campaign
from monitor.records import Campaign, CurveCampaign
from monitor.store import Database
from monitor.workflow.measured import load_measured

# Those that every campaign has, and two channels as examples.
DRIVERS = ("warmup", "settling", "run_time", "ambient_degC", "x_axis_degC")
DEFAULT_TOPOLOGY = "w C B X b Z Y (C1) t"


@dataclass(frozen=True)
class EffectsRequest:
    """The effects of a topology, or of a campaign folder that need not be imported, that contain a text."""

    topology: str | None = None
    folder: Path | None = None
    text: str | None = None

    def __post_init__(self) -> None:
        if (self.topology is None) == (self.folder is None):
            raise InputError("give a topology or a campaign folder, one of the two")


@dataclass(frozen=True)
class CampaignEffectsRequest:
    """The effects of a campaign of the database that contain a text."""

    campaign: str
    text: str | None = None


@dataclass(frozen=True)
class CatalogueEffect:
    """An effect, the unit of its coefficients, and its description."""

    effect: str
    unit: str
    description: Description = field(metadata=INLINED)

    def contains(self, text: str) -> bool:
        """Return whether any of the fields contains a text, in upper or lower case."""
        return text.lower() in " ".join((self.effect, self.unit, *astuple(self.description))).lower()


@dataclass(frozen=True)
class EffectsAnswer:
    """The effects of the catalogue, beside those of the base model.

    A topology has neither campaign nor machine and drivers; a curve has a campaign alone. ``nearest`` is the word of an
    effect that is nearest to one that none contains.
    """

    campaign: str | None = field(default=None, metadata=OMITTED)
    machine: str | None = field(default=None, metadata=OMITTED)
    topology: str | None = field(default=None, metadata=OMITTED)
    drivers: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    base: tuple[str, ...] = ()
    effects: tuple[CatalogueEffect, ...] = ()
    nearest: str | None = field(default=None, metadata=OMITTED)


def effects(request: EffectsRequest) -> EffectsAnswer:
    """Return the effects of a topology or of a campaign folder.

    Raises TopologyError, CampaignError, and DataError where the readings of a folder do not suffice.
    """
    if request.folder is not None:
        return _selected(_of_campaign(read_campaign(request.folder)), request.text)
    assert request.topology is not None  # the request has one of the two
    chain = parse_topology(request.topology)
    base = tuple(base_effects(chain))
    others = (
        *of_balls(DRIVERS),
        *of_single_touches(),
        *of_tool_end(chain, DRIVERS),
        *of_work_end(chain, DRIVERS),
        *of_ram(chain, base, DRIVERS),
        *of_tracker(chain, DRIVERS),
    )
    described = (*_described(catalogue(chain, base, DRIVERS, more=others)), *_searched(chain))
    return _selected(EffectsAnswer(topology=chain.topology, base=base, effects=described), request.text)


def campaign_effects(db: Database, request: CampaignEffectsRequest) -> EffectsAnswer:
    """Return every effect that `explain` looks for in a campaign of the database.

    Raises NotFoundError, and DataError where the readings do not suffice.
    """
    return _selected(_of_campaign(load_measured(db, request.campaign)), request.text)


def _selected(answer: EffectsAnswer, text: str | None) -> EffectsAnswer:
    """Leave out the effects that do not contain a text in any of their fields."""
    if text is None:
        return answer
    selected = tuple(effect for effect in answer.effects if effect.contains(text))
    return replace(answer, effects=selected, nearest=None if selected else _nearest(answer.effects, text))


def _nearest(effects: Iterable[CatalogueEffect], text: str) -> str | None:
    """Return the word of a name or a description that is nearest to a text; None where none is near."""
    terms = {
        word
        for effect in effects
        for word in re.findall(
            r"[\w:@.-]{3,}", " ".join((effect.effect, *astuple(effect.description))).lower()
        )
    }
    near = get_close_matches(text[:100].lower(), sorted(terms), n=1, cutoff=0.7)
    return near[0] if near else None


def _of_campaign(campaign: Campaign | CurveCampaign) -> EffectsAnswer:
    """Return the effects of a machine's own axes, freely positioned ones too, of the method and of the columns.

    Those of a curve are the effects of its columns.
    """
    if isinstance(campaign, CurveCampaign):
        return _of_curve(campaign)
    problem = campaign_method(campaign).problem_of(campaign)
    chain, drivers = problem.context.chain, drivers_of(problem.context)
    pitches = {
        name: axis.scale_pitch for name, axis in campaign.machine.axes.items() if axis.scale_pitch is not None
    }
    base = tuple(effect.text for effect in problem.base)
    return EffectsAnswer(
        campaign=campaign.name,
        machine=campaign.machine.id,
        topology=chain.topology,
        drivers=drivers,
        base=base,
        effects=(
            *_described(catalogue(chain, base, drivers, pitches, problem.method_effects(drivers))),
            *_searched(chain),
        ),
    )


def _described(effects: Iterable[ParsedEffect]) -> tuple[CatalogueEffect, ...]:
    return tuple(CatalogueEffect(effect.text, effect.unit.name, describe(effect)) for effect in effects)


def _searched(chain: Chain) -> tuple[CatalogueEffect, ...]:
    """Return steps and teeth at places that stand for those that are searched."""
    effects = [parse_effect(text, chain) for text in at_searched_places(chain)]
    return tuple(CatalogueEffect(each.text, each.unit.name, describe_searched(each)) for each in effects)


def _of_curve(curve: CurveCampaign) -> EffectsAnswer:
    problem = curve_problem_of(curve)
    fit(problem)  # refuses readings that do not suffice
    unit = curve.units.get(curve.response, "") or "1"
    descriptions = ((effect, _describe_of_curve(effect, problem)) for effect in curve_catalogue(problem))
    return EffectsAnswer(
        campaign=curve.name,
        base=(curve.base,),
        effects=tuple(
            CatalogueEffect(effect.text, unit, description)
            for effect, description in descriptions
            if description is not None
        ),
    )


def _describe_of_curve(effect: CurveEffect, problem: CurveProblem) -> Description | None:
    """Describe an effect of a curve; None for a searched one where the column has no value to search."""
    curve = problem.curve
    unit, is_time = problem.inputs.units.get(effect.column, ""), effect.column == curve.time
    if not effect.free:
        return describe_curve(effect, curve.response, unit, clock=is_time)
    values = grid(effect, problem.inputs)
    if len(values) == 0:
        return None
    return describe_curve(effect.at(float(values[0])), curve.response, unit, clock=is_time, searched=True)
