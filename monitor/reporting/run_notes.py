"""What is noted of runs and campaigns whose numbers one should not use as they are: kinds with their numbers.

Sizes are in internal units (mm, rad).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from monitor.documents import Sentence
from monitor.reporting.messages import joined_by_and, simulated
from monitor.units import MICROMETRE

#: A number that a wrong reading moves by less than this many standard uncertainties is still one of its run.
STILL_HELD = 1.0


@dataclass(frozen=True)
class AxisAt:
    """The reading of an axis, in degrees where it ``turns``, else in mm."""

    axis: str
    reading: float
    turns: bool

    def __str__(self) -> str:
        return f"{self.axis}={self.reading:.6g}{'°' if self.turns else ' mm'}"


@dataclass(frozen=True)
class GrossReadingNoted(Sentence):
    """A reading that is wrong beyond doubt: where it stands in the file; ``others`` may be the wrong one instead.

    ``is_along_surface``: the touch stands elsewhere on its surface than in the other runs. ``row`` says which row to
    correct, by its file; ``moves`` by how many standard uncertainties it moves the number that it moves most, None
    where that is not known.
    """

    run: int
    sequence: int
    target_word: str
    target: str
    pose: tuple[AxisAt, ...]
    size: float
    axis: str
    others: tuple[int, ...]
    is_along_surface: bool = False
    row: str = "the row in probings.csv"
    moves: float | None = None

    def __str__(self) -> str:
        stands = f" at {' '.join(map(str, self.pose))}" if self.pose else ""
        small = abs(self.size) < 0.1
        size = f"{MICROMETRE.to_display(self.size):+.3g} µm" if small else f"{self.size:+.3g} mm"
        others = ", ".join(map(str, self.others))
        instead = f" (or sequence {others}: these readings cannot say which)" if others else ""
        holds = "no number of this run holds"
        if self.is_along_surface:
            holds = "the other runs touched the surface elsewhere, and only a flat one hides that"
        elif self.moves is not None and self.moves < STILL_HELD:
            moves = max(round(self.moves, 2), 0.01)
            holds = f"it moves the geometric errors of this run by up to {moves:.2g} times the stated u"
        return (
            f"run {self.run}: sequence {self.sequence}, {self.target_word} {self.target}{stands}, is off by {size} in "
            f"{self.axis}{instead}: {holds}; correct or remove {self.row}, withdraw the campaign and import it again"
        )


@dataclass(frozen=True)
class UnsearchedNoted(Sentence):
    """Rows of a run were not looked at for gross readings: their part of very many is no plan of its own."""

    run: int

    def __str__(self) -> str:
        return (
            f"run {self.run}: some of its rows were not looked at for wrong readings: of so many rows these are looked "
            "for in parts, and a part of this run cannot be identified by itself, as without the scale bar"
        )


@dataclass(frozen=True)
class ResidualsNoted(Sentence):
    """The residuals are ``times`` what the stated uncertainties leave: much more, or far less (below 1)."""

    run: int
    times: float

    def __str__(self) -> str:
        if self.times < 1.0:
            return (
                f"run {self.run}: the residuals are far smaller than the stated uncertainties leave ({self.times:.1g} "
                "of it): check the units of the columns and the statement"
            )
        return (
            f"run {self.run}: the residuals are {self.times:.2g} times what the stated uncertainties leave, so u does "
            "not hold; compare and explain say where the model fails and what is missing"
        )


@dataclass(frozen=True)
class AngleNoted(Sentence):
    """A location error of a joint that is more than an error of a machine."""

    run: int
    parameter: str
    angle: float
    joint: str

    def __str__(self) -> str:
        return (
            f"run {self.run}: {self.parameter} comes to {math.degrees(self.angle):.2g} degrees, more than an error of "
            f"a machine: check the zero, the direction and the sign of {self.joint} in campaign.toml"
        )


@dataclass(frozen=True)
class OffsetNoted(Sentence):
    """An offset of a joint, ``length`` from the axis before it, that is more than an error of a machine."""

    run: int
    parameter: str
    offset: float
    joint: str
    length: float

    def __str__(self) -> str:
        stands = f"{self.length:.4g} mm from the axis before it" if self.length else "on the axis before it"
        return (
            f"run {self.run}: {self.parameter} comes to {self.offset:.4g} mm, where campaign.toml puts {self.joint} "
            f"{stands}: more than an error of a machine; check offset_mm of {self.joint} and of its neighbours, and "
            "their units"
        )


@dataclass(frozen=True)
class WorkPointsElsewhere(Sentence):
    """Work points that come out elsewhere than campaign.toml states them: ``setups``, and the largest ``distances`` in
    mm over the runs."""

    setups: tuple[str, ...]
    distances: tuple[float, ...]

    def __str__(self) -> str:
        points = joined_by_and(
            [
                f"setup {setup} by {distance:.3g} mm"
                for setup, distance in zip(self.setups, self.distances, strict=True)
            ]
        )
        return (
            f"The work points come out elsewhere than work_point_mm says, that of {points}. Check the signs, units and "
            "columns of the axes, and the points in campaign.toml, before you use any number."
        )


@dataclass(frozen=True)
class CopiedRunsNoted(Sentence):
    """Runs that are equal in every reading because nothing in them is noise: residuals of ``rms``."""

    runs: tuple[tuple[int, ...], ...]
    rms: float

    def __str__(self) -> str:
        named = "; ".join(joined_by_and(runs) for runs in self.runs)
        return (
            f"runs {named} are equal in every reading, and their residuals ({self.rms * 1e6:.2g} nm) are no "
            "measurement's: simulated without noise they count as runs, but their scatter means nothing"
        )


@dataclass(frozen=True)
class SameHoursNoted(Sentence):
    """Campaigns whose runs are of the same hours, and whose numbers are mixed."""

    campaigns: tuple[str, ...]

    def __str__(self) -> str:
        return (
            f"campaigns {joined_by_and(self.campaigns)} hold runs of the same hours, which one machine cannot have "
            "made; the numbers here mix them: name the one that counts with --campaign"
        )


@dataclass(frozen=True)
class LeftOutNoted(Sentence):
    """A campaign that was left out because of another whose time its runs lie in."""

    campaign: str
    overlapped: str

    def __str__(self) -> str:
        return (
            f"campaign {self.campaign} was left out: its runs lie within the time of {self.overlapped}, which was "
            "imported first"
        )


@dataclass(frozen=True)
class SimulatedNoted(Sentence):
    """Campaigns among those ``of`` a machine that nobody measured."""

    campaigns: tuple[str, ...]
    of: int

    def __str__(self) -> str:
        return simulated(self.campaigns, self.of)


@dataclass(frozen=True)
class RunsOfSeveralPlans(Sentence):
    """The runs do not follow one plan, so that their coordinates cannot be compared one by one."""

    def __str__(self) -> str:
        return "the runs do not follow one plan"


@dataclass(frozen=True)
class RowsRepeated(Sentence):
    """So many ``rows`` of a run, from sequence ``first`` on, equal those from sequence ``of`` on in all but their
    times; they ``may_be_passes`` where the display hides what readings scatter."""

    run: int
    rows: int
    first: int
    of: int
    may_be_passes: bool

    def __str__(self) -> str:
        equal = (
            f"{self.rows} rows of run {self.run}, from sequence {self.first} on, equal those from sequence "
            f"{self.of} on in every number"
        )
        counted = (
            "u and the repeatability come out too small, the degrees of freedom and the lack of fit too large"
        )
        if self.may_be_passes:
            return (
                f"{equal}: either they are copies, which count here as independent readings ({counted}), or the "
                "display hides the scatter and they say nothing of repeatability"
            )
        return (
            f"{equal}: copies count here as independent readings, so {counted}. Take them out of the file, "
            "withdraw the campaign and import it again"
        )
