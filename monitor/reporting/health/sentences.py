"""What a health report names beside its news: runs, machines, points, steps, factors and remarks, with their numbers.

Made by the workflow, worded here; times are as the shop's clock showed them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, datetime
from enum import Enum, auto

from monitor.documents import Said, Sentence


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
    """The ``count`` runs of a campaign that were compared, first and last; ``later`` ones began after the week, and the
    numbers ``left_out`` are of runs that were broken off, say."""

    campaign: str
    count: int
    later: int
    first: datetime
    last: datetime
    left_out: tuple[int, ...] = ()

    def __str__(self) -> str:
        first, last = f"{self.first:%Y-%m-%d}", f"{self.last:%Y-%m-%d}"
        days = first if first == last else f"{first} to {last}"
        if self.later or self.left_out:
            every = self.count + self.later + len(self.left_out)
            numbers = ", ".join(map(str, self.left_out))
            which = "run" if len(self.left_out) == 1 else "runs"
            without = f", without {which} {numbers}" if self.left_out else ""
            others = "; the others began after the week" if self.later else ""
            return f"{self.count} of {every} runs of {self.campaign}{without}, {days}{others}"
        return f"{'the one run' if self.count == 1 else f'all {self.count} runs'} of {self.campaign}, {days}"


@dataclass(frozen=True)
class BadPoint(Sentence):
    """A touch of a ball that is off along an axis by ``off_um``, or what the method calls a row (``row_word``) and a
    target (``target_word``)."""

    run: int
    touch: int
    ball: str
    axis: str
    off_um: float
    row_word: str = "touch"
    target_word: str = "ball"

    def __str__(self) -> str:
        where = f"run {self.run}, {self.row_word} {self.touch}"
        target = f", {self.target_word} {self.ball}" if self.ball else ""
        return f"{where}{target}: {self.axis} is off by {self.off_um:.1f} µm"


@dataclass(frozen=True)
class ScatteringBall(Sentence):
    """A ball, or what the method calls a target (``target_word``), whose readings scatter ``times`` as much as those of
    the others, ``deviation_um``."""

    ball: str
    times: float
    deviation_um: float
    target_word: str = "ball"

    def __str__(self) -> str:
        return (
            f"{self.target_word} {self.ball} scatters {self.times:.1f} times as much as the others "
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
class LimitsWithoutParameter(Sentence):
    """Limits of the type of a machine are of none of its parameters: ``sentence`` says which."""

    sentence: str

    def __str__(self) -> str:
        return self.sentence


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
    """A machine's maker and model, serial number and chain, empty where they are not stated.

    ``simulated`` where nobody measured some of its campaigns.
    """

    manufacturer: str
    model: str
    serial_number: str
    topology: str
    simulated: bool = False

    def __str__(self) -> str:
        maker = " ".join(text for text in (self.manufacturer, self.model) if text)
        serial = f"serial number {self.serial_number}" if self.serial_number else ""
        readings = "simulated readings" if self.simulated else ""
        return ", ".join(part for part in (maker, serial, f"chain {self.topology}", readings) if part)


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


#: The pose of a machine that has none; stored records hold these words.
NO_ROTARY_AXES = "no rotary axes"


@dataclass(frozen=True)
class Pose(Position):
    """The readings of the rotary axes, of which there may be none."""

    def __str__(self) -> str:
        return super().__str__() or NO_ROTARY_AXES
