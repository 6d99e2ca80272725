"""Flexible competitors: everything that the error of one axis could do, whatever its shape.

An effect that the catalogue does not have leaves, beside the nearest one that it has, a rest that effects of other
errors mimic. Once an error is named, what it could do in any shape is taken out before other errors are believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, scene_of
from monitor.discovery.machine.shapes.variants import constants_of
from monitor.discovery.search.candidate import Variant
from monitor.effects import ChainEffect, with_time_constant
from monitor.effects.drivers import Always, parse_driver
from monitor.effects.shapes.free import Free
from monitor.machine import MOTION


def error_of(candidate: ChainCandidate) -> str:
    """The error that a candidate is a shape of: its symbol, or the whole effect where it is no error of an axis."""
    effect = candidate.effect
    return effect.term.symbol if isinstance(effect, ChainEffect) else candidate.family.partition("@")[0]


class FlexibleErrors:
    """What the errors of selected candidates could do in any shape, computed once for each."""

    def __init__(self, scene: ChainScene, drivers: Sequence[str]) -> None:
        self.scene = scene
        self.drivers = drivers
        self._competitors: dict[str, tuple[ChainCandidate, ...]] = {}

    def competitors(self, candidates: Sequence[ChainCandidate]) -> list[ChainCandidate]:
        """The flexible competitors of candidates."""
        parts = {self._key(candidate): candidate for candidate in candidates}
        for key, candidate in parts.items():
            if key not in self._competitors:
                self._competitors[key] = scene_of(self.scene.fit, self._variants(candidate)).candidates
        return [competitor for key in parts for competitor in self._competitors[key]]

    def _key(self, candidate: ChainCandidate) -> str:
        """What candidates with the same competitor have in common."""
        effect = candidate.effect
        if isinstance(effect.driver, Always):
            return error_of(candidate)
        return f"{error_of(candidate)}:{candidate.family.partition('@')[0]}@"

    def _variants(self, candidate: ChainCandidate) -> list[ChainVariant]:
        """The error in any shape and, where it follows a driver, its shape with every driver."""
        effect = candidate.effect
        variants: list[ChainVariant] = []
        if isinstance(effect, ChainEffect) and effect.term.stage == MOTION:
            free = replace(effect, shape=Free(), shape_text="free", driver=Always(), driver_text="")
            variants.append(Variant(free.text, free))
        if isinstance(effect.driver, Always):
            return variants
        for name in self.drivers:
            driven = replace(effect, driver=parse_driver(name), driver_text=name)
            effects = [with_time_constant(driven, tau) for tau in constants_of(driven.driver)] or [driven]
            variants += [Variant(f"{name} {number}", each) for number, each in enumerate(effects)]
        return variants
