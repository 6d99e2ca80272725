"""Why an effect that stands out of independent noise is not named."""

from __future__ import annotations

from enum import StrEnum


class Refusal(StrEnum):
    """The rule that refuses an effect."""

    NOISE = "noise"
    POSES = "poses"
    RUNS = "runs"
    OTHER_SHAPES = "other_shapes"
    WANDER = "wander"
    SIZE = "size"
    HELD_OUT = "held_out"
    FLIPS = "flips"
    UNSETTLED = "unsettled"
    STEPPED = "stepped"
