"""Turns of an axis or of the tool with one coefficient for several terms, one a file: flexure, forks, the line of
sight."""

from __future__ import annotations

from monitor.effects.registry import parse
from monitor.effects.turn import Turn
from monitor.exceptions import EffectError

__all__ = ["HEADS", "Turn", "parse_turn"]

#: What the texts of these turns begin with, before a colon; no term of a chain is called so.
HEADS = ("flexure", "fork", "sight")


def parse_turn(text: str) -> Turn | None:
    """Return the turn that a text names, None where it may still end in a driver of its own."""
    turn: Turn | None = parse(text, __name__)
    return turn


def unknown_turn(text: str) -> EffectError:
    """The error of a text that names no turn."""
    return EffectError(
        f"there is no effect '{text}'; there are flexure:tool@gravity, flexure:B@gravity (of any axis that turns), "
        "fork:B@gravity (of what carries it), sight:up:formula(1/tan(elevation)) and sight:side:formula(...)"
    )
