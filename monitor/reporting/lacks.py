"""Why a part of an answer is not there, as data, and the sentence that says so.

An answer carries the kinds and numbers; ``documents.WORDED`` writes the sentence under the key of the field, and kinds
and numbers beside it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from monitor.documents import OMITTED

#: Why a limit of the volumetric error is not judged, and what judges it.
NO_MAP_STORED = "no map is stored (monitor map CAMPAIGN)"


class Part(StrEnum):
    """What is not there."""

    BACKTEST = "backtest"
    CHANGES = "changes"
    CHART = "chart"
    COMPONENTS = "components"
    CONDITIONS = "conditions"
    CYCLES = "cycles"
    DAY_DRIFT = "day_drift"
    DRIFT = "drift"
    FORECAST = "forecast"
    VECTOR_CHART = "vector_chart"
    VOLUMETRIC_BACKTEST = "volumetric_backtest"
    VOLUMETRIC_FORECAST = "volumetric_forecast"
    WARM_UP = "warm_up"


class Cause(StrEnum):
    """Why it is not there. ``OWN_WORDS`` is what a method says that refuses the numbers."""

    ALL_IN_REFERENCE = "all_in_reference"
    ALL_SINCE_EVENT_IN_REFERENCE = "all_since_event_in_reference"
    DOES_NOT_SETTLE = "does_not_settle"
    FEW_DAYS = "few_days"
    FEW_POINTS = "few_points"
    FEW_RUNS = "few_runs"
    NO_CYCLE_SEEN = "no_cycle_seen"
    NO_DRIFT = "no_drift"
    NO_DRIFT_TO_TEST = "no_drift_to_test"
    NO_LIMIT = "no_limit"
    NO_PARAMETER_DRIFTS = "no_parameter_drifts"
    NO_TOLERANCE = "no_tolerance"
    NO_TOOL_PLACE = "no_tool_place"
    NO_WARM_UP_RUNS = "no_warm_up_runs"
    NONE_IN_REFERENCE = "none_in_reference"
    NOTHING_VARIES = "nothing_varies"
    OWN_WORDS = "own_words"
    SAME_VALUE = "same_value"
    TOO_SHORT = "too_short"


@dataclass(frozen=True)
class Lack:
    """A part that is not there, and why.

    ``count`` are the days or points there were, ``after`` those behind the reference period, ``parameters`` how many
    parameters they are of, ``needed`` (days, points, or hours and days of a cycle) what would do; ``name`` is the
    parameter or what the points are; ``split`` says that the history begins at a change or an event. ``text`` belongs
    to OWN_WORDS.
    """

    part: Part
    cause: Cause
    count: int | None = field(default=None, metadata=OMITTED)
    after: int | None = field(default=None, metadata=OMITTED)
    parameters: int | None = field(default=None, metadata=OMITTED)
    needed: tuple[float, ...] | None = field(default=None, metadata=OMITTED)
    name: str | None = field(default=None, metadata=OMITTED)
    split: bool | None = field(default=None, metadata=OMITTED)
    text: str | None = field(default=None, metadata=OMITTED)

    def __str__(self) -> str:
        """The sentence."""
        if self.cause is Cause.TOO_SHORT:
            return _too_short(self)
        subject = _SUBJECTS[self.part] + (f" of {self.name}" if self.cause is Cause.SAME_VALUE else "")
        needed = [f"{number:g}" for number in self.needed or ()]
        return f"{subject}: " + _CAUSES[self.cause].format(
            count=self.count, after=self.after, parameters=self.parameters, needed=needed, name=self.name,
            text=self.text,
        )  # fmt: skip


_SUBJECTS = {
    Part.BACKTEST: "no backtest",
    Part.CHANGES: "no search for changes",
    Part.CHART: "no chart",
    Part.COMPONENTS: "no components of variance",
    Part.CONDITIONS: "no dependence",
    Part.CYCLES: "no cycles",
    Part.DAY_DRIFT: "no drift within a day",
    Part.DRIFT: "no drift",
    Part.FORECAST: "no forecast",
    Part.VECTOR_CHART: "no chart of the vector",
    Part.VOLUMETRIC_BACKTEST: "no backtest of the volumetric error",
    Part.VOLUMETRIC_FORECAST: "no forecast of the volumetric error",
    Part.WARM_UP: "no warm-up",
}
_CAUSES = {
    Cause.ALL_IN_REFERENCE: "all {count} {name} are the reference period",
    Cause.ALL_SINCE_EVENT_IN_REFERENCE: "all {count} {name} since the last event are the reference period",
    Cause.DOES_NOT_SETTLE: "nothing settles within the {needed[0]} h recorded of a day",
    Cause.FEW_DAYS: (
        "{count} days since the last change or event are too few to hold any out; {needed[0]} are needed"
    ),
    Cause.FEW_POINTS: (
        "{count} {name} in the reference period and {after} after it for {parameters} parameters; at least {needed[0]} "
        "and one are needed (--reference FROM..TO)"
    ),
    Cause.FEW_RUNS: "too few runs ({count}); at least {needed[0]} are needed",
    Cause.NO_CYCLE_SEEN: (
        "a daily one needs runs over {needed[0]} hours of the clock, a yearly one {needed[1]} days of history"
    ),
    Cause.NO_DRIFT: "there is no drift to extrapolate",
    Cause.NO_DRIFT_TO_TEST: "there is no drift whose forecasts could be looked at",
    Cause.NO_LIMIT: "no limit is stated (volumetric in the machine's tolerances)",
    Cause.NO_PARAMETER_DRIFTS: "no parameter has a drift to extrapolate",
    Cause.NO_TOLERANCE: "the machine file states no tolerance for it",
    Cause.NO_TOOL_PLACE: "it needs the place of the tool, which this method does not find; a map does not need it",
    Cause.NO_WARM_UP_RUNS: "no campaign of six runs or more has runs marked warm_up",
    Cause.NONE_IN_REFERENCE: "no run of the history lies in the reference period",
    Cause.NOTHING_VARIES: "no recorded condition varies over six runs or more",
    Cause.OWN_WORDS: "{text}",
    Cause.SAME_VALUE: "it has the same value in every run",
}


def refused(part: Part, error: Exception) -> Lack:
    """A part whose method refuses the numbers, in its words."""
    return Lack(part, Cause.OWN_WORDS, text=str(error))


def _too_short(lack: Lack) -> str:
    """The sentence for a history of so many days."""
    assert lack.count is not None
    assert lack.needed is not None
    since = " since the last change or event" if lack.split else ""
    days, verb = ("day", "is") if lack.count == 1 else ("days", "are")
    return (
        f"{lack.count} {days} of history{since} {verb} too short for a slope a year; at least {lack.needed[0]:g} are "
        "needed"
    )


class Undecided(StrEnum):
    """Why it is not decided whether a parameter moved, and what would decide it."""

    ONE_DAY_EACH = "one_day_each"
    DAYS_MAY_DO = "days_may_do"
    FEW_DAYS = "few_days"
    DRIFT_MAY_DO = "drift_may_do"
    INSTRUMENTS_MAY_DO = "instruments_may_do"

    def __str__(self) -> str:
        """The words behind the name of the parameter."""
        return _UNDECIDED[self]


_UNDECIDED = {
    Undecided.ONE_DAY_EACH: (
        "not decided: one day on each side cannot tell a change from days that differ; measure a second day"
    ),
    Undecided.DAYS_MAY_DO: (
        "not decided: more than independent days that scatter alike explain, but days that follow each other, a side "
        "whose days scatter more, or campaigns that differ by more than their days may do as much; further days and "
        "campaigns without an event between them show how much the machine moves by itself, and decide it"
    ),
    Undecided.FEW_DAYS: (
        "not decided: too few days on a side to tell a step of one of many parameters from days that differ; measure "
        "further days"
    ),
    Undecided.DRIFT_MAY_DO: (
        "not decided: a drift that goes on through the event, or a machine that moves as much between campaigns "
        "without one, may do as much; further campaigns without an event between them show how much it moves by "
        "itself, and decide it"
    ),
    Undecided.INSTRUMENTS_MAY_DO: (
        "not decided: other instruments measured after it than before, or the same with other certificates, and may be "
        "off by as much; one campaign by those of before decides it"
    ),
}
