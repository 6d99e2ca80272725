"""What a slope over a part of a year says of the season, and whether it is a drift."""

from __future__ import annotations

from enum import Enum


class Season(Enum):
    """What a slope says of the year: a season is allowed for beside the slope, or the history cannot tell the two."""

    ALLOWED_FOR = "allowed for"
    NOT_TOLD = "not told from the drift"


class SlopeVerdict(Enum):
    """What a slope that is no chance is: a drift; or a drift or a season, which the history cannot tell apart."""

    DRIFT = "drift"
    DRIFT_OR_SEASON = "drift or season cannot be told apart"
