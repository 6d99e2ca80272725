"""How numbers of an answer came about, as people read it."""

from __future__ import annotations

from enum import StrEnum


class ForecastMethod(StrEnum):
    """How forecasts were made: of one parameter when they were tested, and of the volumetric error."""

    DAYS_BY_DAYS_BEFORE = (
        "days foretold by the days before them since the last change, 60 at most; "
        "the first run of each counts"
    )
    ALL_PARAMETERS = (
        "all parameters extrapolated together, each by its drift since its last change, correlated as the days are; "
        "simulated"
    )


#: By what a parameter that is out of tolerance is to be checked at once.
OUT_OF_TOLERANCE = "the latest runs are out of tolerance"


class TimeSource(StrEnum):
    """Where the time of a probing and of an indexation comes from."""

    ASSUMED = "assumed"
    CAMPAIGN = "the times of this campaign"
