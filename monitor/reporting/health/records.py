"""What a health report states of a machine in one week: typed records, filled by the workflow, printed as they are.

Numbers are in display units, times as the shop's clock showed them. Nothing is computed here, and a statement
that could not be made is a text that says why, never an empty place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from enum import StrEnum

from monitor.documents import OMITTED, Said
from monitor.records import AuditAnchor
from monitor.reporting.between_points import BetweenPoints, StepPlace
from monitor.reporting.health.comparison import ModelHealth
from monitor.reporting.health.news import StillUnexplained
from monitor.reporting.svg.map_slices import Slice


class State(StrEnum):
    """What the fleet table says of a machine in one word or two, the most urgent first."""

    OUT_OF_TOLERANCE = "out of tolerance"
    MAY_BE_OUT_OF_TOLERANCE = "may be out of tolerance"
    NOT_EVALUATED = "not evaluated"
    CHANGED = "changed"
    MODEL_FAILS = "model fails"
    DRIFTS = "drifts"
    SUSPECT_DATA = "suspect data"
    NOT_MEASURED = "not measured"
    IN_TOLERANCE = "in tolerance"
    NO_CHANGE_SEEN = "no change seen"


class ChangeKind(StrEnum):
    """How a change is known: found by the statistics, one of those that passes again (and makes no machine's state), a
    step at a recorded event, or the event itself."""

    CHANGE = "change"
    SETTLING = "settling"
    EVENT_STEP = "event step"
    EVENT = "event"


#: The states by urgency, the most urgent first, and what each means.
STATES: dict[State, str] = {
    State.OUT_OF_TOLERANCE: "a parameter or the volumetric error is more likely beyond its tolerance than within it",
    State.MAY_BE_OUT_OF_TOLERANCE: "the probability that a parameter or the volumetric error is beyond its tolerance "
    "exceeds the stated limit",
    State.NOT_EVALUATED: "what was measured last could not be evaluated: nothing is known of its tolerances",
    State.CHANGED: "a parameter or an artefact changed this week; or a parameter stepped before, and no event "
    "explains it",
    State.MODEL_FAILS: "the model does not explain the measurements: an effect is missing, or the "
    "campaign's file states something else than was measured",
    State.DRIFTS: "a parameter without a tolerance drifts, or follows a season that the history is too short to "
    "tell from a drift",
    State.SUSPECT_DATA: "bad points, or a ball that scatters, were found and count by less; nothing else",
    State.NOT_MEASURED: "no run this week",
    State.IN_TOLERANCE: "every parameter is within its tolerance and nothing changed",
    State.NO_CHANGE_SEEN: "nothing changed; not every parameter has a tolerance to be judged by",
}
#: How a machine is named that its drift may have taken out of tolerance since it was measured, and what that means.
DUE = "due for a check"
DUE_MEANS = "nothing is wrong so far, but by its drift it need not be in tolerance any more"
#: The states that `--fail-on-alarm` answers with exit status 1.
ALARMS: tuple[State, ...] = (State.OUT_OF_TOLERANCE, State.MAY_BE_OUT_OF_TOLERANCE, State.NOT_EVALUATED)


@dataclass(frozen=True)
class History:
    """The runs of one parameter: times, values, standard uncertainties and whether each run belongs to the week."""

    times: tuple[datetime, ...]
    values: tuple[float, ...]
    u: tuple[float, ...]
    this_week: tuple[bool, ...]


@dataclass(frozen=True)
class Drift:
    """A drift per year, its standard uncertainty and 95 % interval; when the limit is reached (None: no sign of it).

    ``crosses_between`` are the ends of the interval of that time, None where open. ``at_last`` is the line's value at
    the last run and ``since`` the first of the runs that it was found from; None in records of older versions.
    ``season_not_told``: a season can be all of it, the history is too short to tell; None where it cannot.
    """

    per_year: float
    u_per_year: float
    between: tuple[float, float]
    p_value: float
    crosses_at: date | None
    crosses_between: tuple[date | None, date | None]
    at_last: float | None = field(default=None, metadata=OMITTED)
    since: datetime | None = field(default=None, metadata=OMITTED)
    season_not_told: bool | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class ParameterHealth:
    """One parameter: estimate, standard and expanded uncertainty, tolerance of its absolute value, history.

    ``probability_out`` of lying beyond the tolerance; ``out_since`` the first of the runs without a break whose
    value lies beyond it. ``changed_at`` are the times of changes that were found. ``in_words`` is its name on the shop
    floor.
    """

    name: str
    description: str
    unit: str
    estimate: float
    u: float
    expanded: float
    tolerance: float | None
    probability_out: float | None
    out_since: datetime | None
    history: History
    changed_at: tuple[datetime, ...]
    drift: Drift | None
    in_words: str

    @property
    def reaches_soon(self) -> bool:
        """Whether the drift reaches the limit within as many days as it was watched for."""
        if self.drift is None or self.drift.crosses_at is None:
            return False
        last = self.history.times[-1]
        watched = last - (self.drift.since or self.history.times[0])
        return self.drift.crosses_at <= (last + watched).date()


@dataclass(frozen=True)
class Change:
    """Something that happened: found by the statistics (with its p-value) or recorded by people (kind ``event``).

    What a parameter stepped by at a recorded event is an ``event step``: said like a change, but explained, so that it
    does not make the state of the machine. ``is_open``: a step of an earlier week that no event explains and that was
    not put right (None: none, or of an older record).
    """

    kind: ChangeKind
    after: datetime | None
    at: datetime
    what: Said
    p_value: float | None
    this_week: bool
    is_open: bool | None = field(default=None, metadata=OMITTED)

    @property
    def counts(self) -> bool:
        """Whether it makes the state of the machine: found by the statistics, of this week or still open."""
        return self.kind is ChangeKind.CHANGE and bool(self.this_week or self.is_open)

    @property
    def now(self) -> Said:
        """What is said of it this week: of one that is still open since when."""
        return StillUnexplained(self.what, self.at) if self.is_open else self.what


@dataclass(frozen=True)
class ConditionRange:
    """A recorded condition over the runs of the week."""

    name: str
    unit: str
    lowest: float
    mean: float
    highest: float


@dataclass(frozen=True)
class RefusedImport:
    """A folder that was refused this week, with its first faults; ``imported_at`` (UTC) where it came in well since."""

    at: datetime
    folder: str
    campaign: str | None
    machine: str | None
    fault_count: int
    faults: tuple[str, ...]
    imported_at: datetime | None


@dataclass(frozen=True)
class DataQuality:
    """What the data are worth: counts, bad points, what the plan cannot see, what got no number, what never came in."""

    runs: int
    probings: int
    warm_up_runs: int
    suspect: tuple[Said, ...]
    refused: tuple[tuple[str, str], ...]
    blind_spots: tuple[str, ...]
    remarks: tuple[Said, ...]
    refused_imports: tuple[RefusedImport, ...]


@dataclass(frozen=True)
class PoseError:
    """The volumetric error over the linear strokes with the rotary axes at one pose, in µm."""

    pose: Said
    worst_um: float
    rms_um: float


@dataclass(frozen=True)
class MapShare:
    """What a parameter adds to the worst error of a map, in µm along its vector; below zero where it shortens it."""

    parameter: str
    error_um: float


@dataclass(frozen=True)
class VolumetricMap:
    """The stored volumetric error map: where it is worst, its expanded uncertainty there, and pose by pose (µm).

    ``slices`` are its middle with the rotary axes at zero; empty where the machine has no three linear axes. Their
    expanded uncertainties hold with the coverage factor ``k`` for the probability ``p``. ``limit_um`` of the
    machine's file for the worst of them, and the probability to be beyond it. ``by_parameter`` is what each parameter
    adds to the worst error, the largest first; ``between_points`` are
    the errors that its points do not follow, ``step_places`` the steps of whose place the range alone is known. None in
    older records.
    """

    run: int
    region: Said
    worst_at: Said
    worst_um: float
    expanded_um: float
    rms_um: float
    by_pose: tuple[PoseError, ...]
    slices: tuple[Slice, ...] = ()
    k: float = 2.0
    p: float = 0.95
    limit_um: float | None = field(default=None, metadata=OMITTED)
    probability_out: float | None = field(default=None, metadata=OMITTED)
    by_parameter: tuple[MapShare, ...] | None = field(default=None, metadata=OMITTED)
    between_points: tuple[BetweenPoints, ...] | None = field(default=None, metadata=OMITTED)
    step_places: tuple[StepPlace, ...] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class MachineHealth:
    """One machine in one week. ``run`` is the run whose numbers stand in ``parameters``, ``basis`` how they were found.

    ``probability_out`` that any parameter with a tolerance is beyond it, jointly. What a new record says are kinds with
    numbers (``sentences.py``), what a stored one says are their words. ``due`` names the parameter whose drift may have
    taken a machine out of tolerance with which nothing was wrong when it was measured; None in older records.
    """

    machine: str
    description: Said
    location: str
    state: State
    changed: Said
    since: datetime | None
    probability_out: float | None
    next_check: Said
    run: Said
    basis: str
    factor: Said
    parameters: tuple[ParameterHealth, ...]
    changes: tuple[Change, ...]
    conditions: tuple[ConditionRange, ...]
    model: ModelHealth | None
    quality: DataQuality
    map: VolumetricMap | None
    due: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class FleetRow:
    """A machine in the fleet table; ``due`` as in ``MachineHealth``."""

    machine: str
    location: str
    state: State
    changed: Said
    since: datetime | None
    probability_out: float | None
    next_check: Said
    due: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class Fleet:
    """The first page: the week, when the report was made, and the machines by urgency.

    ``refused_imports`` are those of the week that stand on no machine's page: their machine is not known. ``ended``
    says whether the week had, by the shop's clock, when the report was made. ``attention`` are the records of the most
    urgent machines, for the pictures and answers of the first page; ``alike`` names by machine the others of which the
    same is found. ``noticed``: machine and sentence of what was noticed in the week under weekly looks at the fleet.
    ``anchor`` is the last entry of the audit when the report was
    made.
    """

    week: str
    first_day: date
    last_day: date
    made_at: datetime
    software: str
    risk: float
    rows: tuple[FleetRow, ...]
    refused_imports: tuple[RefusedImport, ...] = ()
    ended: bool = True
    noticed: tuple[tuple[str, str], ...] = ()
    attention: tuple[MachineHealth, ...] = ()
    alike: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    anchor: AuditAnchor | None = None


def fleet_row(health: MachineHealth) -> FleetRow:
    """A machine's line in the fleet table."""
    return FleetRow(
        health.machine,
        health.location,
        health.state,
        health.changed,
        health.since,
        health.probability_out,
        health.next_check,
        health.due,
    )


def is_due(machine: FleetRow | MachineHealth) -> bool:
    """Return whether nothing is wrong with a machine so far, but by its drift it need not be in tolerance any more."""
    return machine.due is not None


def state_in_words(machine: FleetRow | MachineHealth) -> str:
    """Return the state of a machine as it is printed: one that is due is not said to be unchanged."""
    return DUE if is_due(machine) else machine.state


def by_urgency(row: FleetRow) -> tuple[float, float, str]:
    """The key that sorts machines: the most urgent state (what is due for a check before all that is fine), then the
    larger probability, then the name."""
    states = list(STATES)
    rank = states.index(State.IN_TOLERANCE) - 0.5 if is_due(row) else states.index(row.state)
    return rank, -(row.probability_out or 0.0), row.machine
