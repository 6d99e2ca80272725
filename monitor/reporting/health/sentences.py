"""The sentences of a health report, each a kind with its numbers: made by the workflow, worded here.

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
    """A parameter changed by ``size`` with ``u``; ``how`` is ``step``, ``slope`` (then a day) or another."""

    parameter: str
    how: str
    size: float
    u: float
    unit: str

    def __str__(self) -> str:
        size, u = in_words(self.size, self.u, sign=True)
        if self.how == "step":
            return f"{self.parameter} stepped by {size} {self.unit} (u = {u} {self.unit})"
        if self.how == "slope":
            return f"{self.parameter} began to drift by {size} {self.unit} a day (u = {u} {self.unit} a day)"
        return f"{self.parameter}: {self.how} of {size} {self.unit} (u = {u} {self.unit})"


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
    CheckKind.NOT_EVALUATED: "now: the last run could not be evaluated",
    CheckKind.NO_RUN_THIS_WEEK: "now: no run this week",
    CheckKind.NO_RUN_YET: "now: no run yet",
    CheckKind.FIRST_RUN: "its first run",
    CheckKind.NO_TOLERANCE: "no forecast: the campaign states no tolerances",
    CheckKind.NO_FORECAST: "no forecast: fewer than three days since the last change",
    CheckKind.SHORT_HISTORY: "next week: {span:.0f} days of history allow no longer forecast",
    CheckKind.PASSED: "now: {parameter} stayed in tolerance with 95 % until {day} only",
    CheckKind.AS_FAR_AS_HISTORY: "by {day}: in tolerance as far ahead as the history is long",
    CheckKind.IN_TOLERANCE_UNTIL: "by {day}: {parameter} stays in tolerance with 95 % until then",
}


@dataclass(frozen=True)
class Factor(Sentence):
    """What expanded uncertainties hold for: factor k_q of ``count`` intervals with the joint probability ``p``."""

    k_q: float
    count: int
    p: float
    degrees_of_freedom: float | None

    def __str__(self) -> str:
        dof = self.degrees_of_freedom
        freedom = "" if dof is None else f", {dof:.0f} degrees of freedom"
        return (
            f"U = {self.k_q:.2f} u: all {self.count} intervals hold at once with {self.p * 100:g} %{freedom}"
        )


class NoFactor(Sentence):
    """No uncertainty is stated."""

    def __str__(self) -> str:
        return "no uncertainty"


@dataclass(frozen=True)
class RunNamed(Sentence):
    """The run whose numbers stand on a page, with its local start."""

    run: int
    campaign: str
    start: datetime

    def __str__(self) -> str:
        return f"run {self.run} of campaign {self.campaign}, {self.start:%Y-%m-%d %H:%M}"


@dataclass(frozen=True)
class RunsNamed(Sentence):
    """The ``count`` runs of a campaign that were compared, first and last; ``later`` ones began after the week."""

    campaign: str
    count: int
    later: int
    first: datetime
    last: datetime

    def __str__(self) -> str:
        first, last = f"{self.first:%Y-%m-%d}", f"{self.last:%Y-%m-%d}"
        days = first if first == last else f"{first} to {last}"
        if self.later:
            every = self.count + self.later
            return f"{self.count} of {every} runs of {self.campaign}, {days}; the others began after the week"
        return f"{'the one run' if self.count == 1 else f'all {self.count} runs'} of {self.campaign}, {days}"


@dataclass(frozen=True)
class BadPoint(Sentence):
    """A touch that is off along an axis by ``off_um``."""

    run: int
    touch: int
    ball: str
    axis: str
    off_um: float

    def __str__(self) -> str:
        return f"run {self.run}, touch {self.touch}, ball {self.ball}: {self.axis} is off by {self.off_um:.1f} µm"


@dataclass(frozen=True)
class ScatteringBall(Sentence):
    """A ball whose readings scatter ``times`` as much as those of the others, ``deviation_um``."""

    ball: str
    times: float
    deviation_um: float

    def __str__(self) -> str:
        return (
            f"ball {self.ball} scatters {self.times:.1f} times as much as the others "
            f"({self.deviation_um:.1f} µm): it may be loose or dirty"
        )


@dataclass(frozen=True)
class TolerancesOfType(Sentence):
    """A machine is judged by the tolerances of its type, because its campaign states none."""

    type: str
    campaign: str

    def __str__(self) -> str:
        return (
            f"its tolerances are those of the machine type '{self.type}' in the configuration: campaign "
            f"{self.campaign} states none"
        )


@dataclass(frozen=True)
class LimitWithoutMap(Sentence):
    """The volumetric error has a limit and no map that it could be judged by."""

    limit_um: float

    def __str__(self) -> str:
        return f"the volumetric error has a limit of {self.limit_um:g} µm, but no map: it is not judged against it"


class Step(Enum):
    """A part of the work for a machine's page."""

    IDENTIFICATION = auto()
    UNCERTAINTY = auto()
    COMPARISON = auto()
    MAP = auto()
    VERSIONS = auto()


@dataclass(frozen=True)
class StepFailed(Sentence):
    """A part that could not be made, and ``why``: the message of the refusal. ``campaign`` of an identification."""

    step: Step
    why: str
    campaign: str = ""

    def __str__(self) -> str:
        return f"{_FAILED[self.step].format(campaign=self.campaign)}: {self.why}"


_FAILED: Mapping[Step, str] = {
    Step.IDENTIFICATION: "campaign {campaign} could not be identified",
    Step.UNCERTAINTY: "the uncertainty of the last run could not be evaluated",
    Step.COMPARISON: "model and measurement could not be compared",
    Step.MAP: "the volumetric error could not be mapped",
    Step.VERSIONS: "the versions of the model could not be compared",
}


@dataclass(frozen=True)
class MachineNamed(Sentence):
    """A machine's maker and model, serial number and chain, empty where they are not stated."""

    manufacturer: str
    model: str
    serial_number: str
    topology: str

    def __str__(self) -> str:
        maker = " ".join(text for text in (self.manufacturer, self.model) if text)
        serial = f"serial number {self.serial_number}" if self.serial_number else ""
        return ", ".join(part for part in (maker, serial, f"chain {self.topology}") if part)


@dataclass(frozen=True)
class NothingMeasured(Sentence):
    """No machine was measured in a week."""

    week: str
    first: date
    last: date

    def __str__(self) -> str:
        return f"No machine was measured in week {self.week} ({self.first} to {self.last})."


@dataclass(frozen=True)
class ErrorOf(Sentence):
    """A version of a model whose error is shown: the effects added and removed; neither: as it is."""

    model: str
    added: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()

    def __str__(self) -> str:
        changed = [f"+ {effect}" for effect in self.added]
        changed += [f"\N{MINUS SIGN} {effect}" for effect in self.removed]
        return f"{self.model}: {' '.join(changed) or 'as it is'}"


@dataclass(frozen=True)
class ErrorWith(Sentence):
    """The error of a model with an effect that it lacks."""

    effect: str

    def __str__(self) -> str:
        return f"+ {self.effect}"


@dataclass(frozen=True)
class Region(Sentence):
    """The points of a map and where their region comes from."""

    points: int
    origin: Said

    def __str__(self) -> str:
        return f"{self.points} points of {self.origin}"


@dataclass(frozen=True)
class Position(Sentence):
    """Readings of axes by key (``x_mm``, ``b_deg``); axes that are not named stand where the map put them."""

    at: tuple[tuple[str, float], ...]

    def __str__(self) -> str:
        parts = []
        for key, value in self.at:
            axis, _, unit = key.rpartition("_")
            text = f"{axis.upper()} {value:.4g}{'°' if unit == 'deg' else ' ' + unit}"
            parts.append(text.replace("-", "\N{MINUS SIGN}"))
        return ", ".join(parts)


@dataclass(frozen=True)
class Pose(Position):
    """The readings of the rotary axes, of which there may be none."""

    def __str__(self) -> str:
        return super().__str__() or "no rotary axes"
