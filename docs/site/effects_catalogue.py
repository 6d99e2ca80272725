"""The reference of effects: the catalogue of a five-axis machine and of a robot, in the program's own words."""

# ruff: noqa: E501 -- prose of pages
from __future__ import annotations

from pathlib import Path

from markdown import code, table
from sources import CHECKOUT

from monitor.workflow.effects import EffectsRequest, effects

HEAD = """# Catalogue of effects

What `monitor explain` looks for, printed by `monitor effects`. How an effect is written, and what each number of a finding means: [effects](../effects.md).

"""
MACHINES = {
    "A horizontal five-axis machining centre: `w C B X b Z Y (C1) t`": EffectsRequest(
        topology="w C B X b Z Y (C1) t"
    ),
    "A robot seen by a tracker: `examples/tracked-robot`": EffectsRequest(
        folder=Path(CHECKOUT, "examples/tracked-robot")
    ),
    "A mount: `examples/mount-mmt-2021-08`": EffectsRequest(
        folder=Path(CHECKOUT, "examples/mount-mmt-2021-08")
    ),
}


def page() -> str:
    """Return the page."""
    parts = [HEAD]
    for title, request in MACHINES.items():
        listed = effects(request).effects
        rows = [
            (code(row.effect), row.description.meaning, row.description.cause, row.description.remedy)
            for row in listed
        ]
        parts.append(
            f"## {title}\n\n{len(rows)} effects.\n\n{table(('effect', 'meaning', 'usual cause', 'remedy'), rows)}"
        )
    return "\n".join(parts)
