"""What is new on a machine in a week and when it is measured next, as sentences of the health report.

Quantities are in display units, times as the shop's clock showed them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, datetime
from enum import Enum, auto

from monitor.documents import Said, Sentence
from monitor.reporting.health.words import in_words
from monitor.reporting.lacks import Undecided
from monitor.reporting.messages import DRIFT_OR_SEASON


@dataclass(frozen=True)
class ParameterChanged(Sentence):
    """A parameter changed by ``size`` with ``u``; ``how`` is ``step``, ``slope`` (then a day) or another.

    ``besides`` is a sentence on other instruments that measure from a step on, empty without any.
    """

    parameter: str
    how: str
    size: float
    u: float
    unit: str
    besides: str = ""

    def __str__(self) -> str:
        size, u = in_words(self.size, self.u, sign=True)
        if self.how == "step":
            besides = f"; {self.besides}" if self.besides else ""
            return f"{self.parameter} stepped by {size} {self.unit} (u = {u} {self.unit}){besides}"
        if self.how == "slope":
            return f"{self.parameter} began to drift by {size} {self.unit} a day (u = {u} {self.unit} a day)"
        return f"{self.parameter}: {self.how} of {size} {self.unit} (u = {u} {self.unit})"


@dataclass(frozen=True)
class StillUnexplained(Sentence):
    """A change of a week before this one that no event explains and that was not put right."""

    what: Said
    at: datetime

    def __str__(self) -> str:
        return f"{self.what} on {self.at:%Y-%m-%d}, and no event explains it"


@dataclass(frozen=True)
class SteppedAtEvent(Sentence):
    """A parameter differs before and after an event; ``undecided`` says why this may be no step.

    ``drift`` is what its machine drifts by in 30 days beside the step, in the same unit.
    """

    parameter: str
    event: str
    size: float
    u: float
    unit: str
    undecided: Undecided | None
    drift: float | None = None

    def __str__(self) -> str:
        size, u = in_words(self.size, self.u, sign=True)
        event, u = f"the event '{self.event}'", f"u = {u} {self.unit}"
        if self.drift is not None:
            u += f"; beside a drift of {self.drift:+.3g} {self.unit} in 30 days"
        if self.undecided is None:
            return f"{self.parameter} stepped by {size} {self.unit} at {event} ({u})"
        by_runs = " by the runs alone" if self.undecided is Undecided.ONE_DAY_EACH else ""
        differs = f"{self.parameter} differs by {size} {self.unit} before and after {event}"
        return f"{differs} ({u}{by_runs}): {self.undecided}"

    @property
    def brief(self) -> str:
        """The sentence for a cell of a table: why it is not decided stands on the machine's page."""
        if self.undecided is None:
            return str(self)
        size, _ = in_words(self.size, self.u, sign=True)
        return f"{self.parameter} may have stepped by {size} {self.unit} (not decided)"


@dataclass(frozen=True)
class BallMoved(Sentence):
    """A ball stands elsewhere since a run; the whole piece where no ``target`` is named."""

    target: str
    size: float
    unit: str
    run: int

    def __str__(self) -> str:
        what = f"ball {self.target}" if self.target else "the piece on the table"
        return f"{what} moved by {self.size:.1f} {self.unit} (run {self.run})"


@dataclass(frozen=True)
class EventNoted(Sentence):
    """An event that people recorded."""

    kind: str
    description: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.description}"


@dataclass(frozen=True)
class ModelLacks(Sentence):
    """An effect that the model lacks."""

    effect: str

    def __str__(self) -> str:
        return f"the model lacks {self.effect}"


@dataclass(frozen=True)
class Drifting(Sentence):
    """A parameter that makes the state of its machine drifts, by ``per_year`` with ``u_per_year``; or it moves, where
    a season can be all of it."""

    parameter: str
    per_year: float
    u_per_year: float
    unit: str
    season_not_told: bool = False

    def __str__(self) -> str:
        month, _ = in_words(self.per_year / 12.0, self.u_per_year / 12.0, sign=True)
        if self.season_not_told:
            return f"{self.parameter} moves by {month} {self.unit} a month ({DRIFT_OR_SEASON})"
        return f"{self.parameter} drifts by {month} {self.unit} a month"


@dataclass(frozen=True)
class ImportsRefused(Sentence):
    """Imports that were refused and did not come in since, the last on ``last``."""

    count: int
    last: datetime

    def __str__(self) -> str:
        if self.count == 1:
            return f"an import was refused on {self.last:%Y-%m-%d}"
        return f"{self.count} imports were refused, the last on {self.last:%Y-%m-%d}"


@dataclass(frozen=True)
class NewThisWeek(Sentence):
    """What is new: the first of it, how many are not named, what the model lacks, and what drifts on."""

    named: tuple[Said, ...]
    more: int = 0
    lacking: tuple[ModelLacks, ...] = ()
    drifting: tuple[Drifting, ...] = ()

    def __str__(self) -> str:
        rest = [f"and {self.more} more"] if self.more else []
        named = [what.brief if isinstance(what, SteppedAtEvent) else str(what) for what in self.named]
        return (
            "; ".join([*named, *rest, *map(str, self.lacking), *map(str, self.drifting)])
            or "nothing this week"
        )


@dataclass(frozen=True)
class NotMeasured(Sentence):
    """A machine has no run in the week.

    ``last`` run before it, in ``campaign``, with the alarm that ``state`` was then; or ``first`` run after it; or none
    at all. ``refused`` imports are named beside it.
    """

    campaign: str | None = None
    last: datetime | None = None
    first: datetime | None = None
    state: str | None = None
    refused: tuple[ImportsRefused, ...] = ()

    def __str__(self) -> str:
        return "; ".join([self._sentence(), *map(str, self.refused)])

    def _sentence(self) -> str:
        if self.last is not None:
            alarm = "" if self.state is None else f", when it was reported as: {self.state}"
            return f"no run this week; its last run was on {self.last:%Y-%m-%d} ({self.campaign}){alarm}"
        if self.first is not None:
            return (
                f"not yet measured in this week: its first run was on {self.first:%Y-%m-%d} ({self.campaign})"
            )
        return "not yet measured: the database holds no run of it"


class CheckKind(Enum):
    """When to measure a machine again, and why."""

    ALARM = auto()
    NOT_EVALUATED = auto()
    NO_RUN_THIS_WEEK = auto()
    NO_RUN_YET = auto()
    FIRST_RUN = auto()
    ONE_DAY = auto()
    ONE_DAY_NO_TOLERANCE = auto()
    NO_TOLERANCE = auto()
    NO_FORECAST = auto()
    SHORT_HISTORY = auto()
    PASSED = auto()
    AS_FAR_AS_HISTORY = auto()
    IN_TOLERANCE_UNTIL = auto()


@dataclass(frozen=True)
class NextCheck(Sentence):
    """When to measure again: by ``day``, until which ``parameter`` stays in tolerance; ``span`` days of history."""

    kind: CheckKind
    parameter: str = ""
    day: date | None = None
    span: float = 0.0

    def __str__(self) -> str:
        return _CHECKS[self.kind].format(parameter=self.parameter, day=self.day, span=self.span)


_CHECKS: Mapping[CheckKind, str] = {
    CheckKind.ALARM: "now",
    CheckKind.NOT_EVALUATED: "now: what was measured last could not be evaluated",
    CheckKind.NO_RUN_THIS_WEEK: "now: no run this week",
    CheckKind.NO_RUN_YET: "now: no run yet",
    CheckKind.FIRST_RUN: "its first run",
    CheckKind.ONE_DAY: "now: the latest day alone shows the step of {parameter}",
    CheckKind.ONE_DAY_NO_TOLERANCE: "now: the latest day alone shows the step of {parameter}; no tolerances are stated",
    CheckKind.NO_TOLERANCE: "no forecast: the campaign states no tolerances",
    CheckKind.NO_FORECAST: "no forecast: fewer than three days since the last change",
    CheckKind.SHORT_HISTORY: "next week: {span:.0f} days of history allow no longer forecast",
    CheckKind.PASSED: "now: {parameter} stayed in tolerance with 95 % until {day} only",
    CheckKind.AS_FAR_AS_HISTORY: "by {day}: in tolerance as far ahead as the history is long",
    CheckKind.IN_TOLERANCE_UNTIL: "by {day}: {parameter} stays in tolerance with 95 % until then",
}
