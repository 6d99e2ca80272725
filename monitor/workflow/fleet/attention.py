"""The classes of attention of the fleet: pages name them without loading what computes the fleet."""

from __future__ import annotations

from enum import StrEnum

from monitor.reporting.lacks import NO_MAP_STORED


class Attention(StrEnum):
    """Why a parameter needs attention, the most urgent first; the last is of a limit of the volumetric error."""

    OUT = "out of tolerance"
    MAY_BE_OUT = "may be out of tolerance"
    DUE = "may be out of tolerance at the next check"
    DRIFTS_OUT = "drifts out of tolerance within a year"
    STANDS_OUT = "the latest day stands out"
    DRIFTS = "drifts"
    DAYS_DIFFER = "days differ much more than runs"
    AS_USUAL = "as usual"
    ONE_DAY = "one day only, nothing to compare it with"
    UNJUDGED = f"limit not judged: {NO_MAP_STORED}"


class Onset(StrEnum):
    """What began at the moment since which a row holds."""

    BEYOND = "the first of the runs beyond the limit"
    LATEST = "the latest day"
    DIFFERS = "where the days before and after differ most"
    EVENT = "the last event"
    FIRST = "the first run"
    MAPPED = "the first of the mapped runs beyond the limit"
    LAST_MAP = "the run of its last map"


#: The classes by their number.
ATTENTION = tuple(Attention)
