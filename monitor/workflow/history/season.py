"""What a slope over a part of a year says of the season."""

from __future__ import annotations

from enum import Enum


class Season(Enum):
    """What a slope says of the year: a season is allowed for beside the slope, or the history cannot tell the two."""

    ALLOWED_FOR = "allowed for"
    NOT_TOLD = "not told from the drift"
