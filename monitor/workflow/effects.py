"""The catalogue of effects in words, searchable."""

from __future__ import annotations

from typing import Any

from monitor.effects.catalogue import catalogue, of_balls, of_tracker
from monitor.effects.words import describe
from monitor.machine import parse_topology
from monitor.methods.base_effects import base_effects

# Those that every campaign has, and two channels as examples.
DRIVERS = ("warmup", "run_time", "ambient_degC", "x_axis_degC")


def effects(topology: str, text: str | None = None) -> dict[str, Any]:
    """Every effect of the catalogue on a chain whose name or words contain ``text``; TopologyError."""
    chain = parse_topology(topology)
    found = []
    for effect in catalogue(
        chain, base_effects(chain), DRIVERS, more=(*of_balls(DRIVERS), *of_tracker(chain, DRIVERS))
    ):
        words = describe(effect)
        one = {
            "effect": effect.text,
            "unit": effect.unit.name,
            "meaning": words.meaning,
            "cause": words.cause,
            "remedy": words.remedy,
            "described_in": words.described_in,
        }
        if text is None or text.lower() in " ".join(one.values()).lower():
            found.append(one)
    return {"topology": chain.topology, "base": list(base_effects(chain)), "effects": found}
