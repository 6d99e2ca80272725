"""What the standards of machine tools call their figures, and what is noted of a test that lacks what they ask."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from monitor.documents import Sentence

#: Kind of a figure of an axis: symbol and name of ISO 230-2:2014, clause 3. The arrows are + and - here.
AXIS_FIGURES: Mapping[str, tuple[str, str]] = {
    "reversal": ("B", "reversal error of the axis"),
    "mean_reversal": ("B mean", "mean reversal error of the axis"),
    "repeatability_forward": ("R+", "unidirectional positioning repeatability, forward"),
    "repeatability_backward": ("R-", "unidirectional positioning repeatability, backward"),
    "repeatability": ("R", "bi-directional positioning repeatability"),
    "systematic_forward": ("E+", "unidirectional systematic positioning error, forward"),
    "systematic_backward": ("E-", "unidirectional systematic positioning error, backward"),
    "systematic": ("E", "bi-directional systematic positioning error"),
    "mean_deviation": ("M", "mean bi-directional positioning error"),
    "accuracy_forward": ("A+", "unidirectional positioning accuracy, forward"),
    "accuracy_backward": ("A-", "unidirectional positioning accuracy, backward"),
    "accuracy": ("A", "bi-directional positioning accuracy"),
}
#: Kind of a figure of a circle: symbol and name of ISO 230-4:2005, clause 3, with the plane and the sense of rotation.
_CIRCLE_FIGURES: Mapping[str, tuple[str, str]] = {
    "circular": ("G_{plane}", "circular deviation about its least-squares circle, {sense}"),
    "minimum_zone": ("G_{plane} zone", "circular deviation between minimum-zone circles, {sense}"),
    "largest": ("F_{plane} max", "largest radial deviation about the centre of G, {sense}"),
    "smallest": ("F_{plane} min", "smallest radial deviation about the centre of G, {sense}"),
    "both": ("G(b)", "bi-directional circular deviation about the least-squares circle of both senses"),
    "hysteresis": ("H", "circular hysteresis about the centre of G(b)"),
}


def circle_figure(kind: str, plane: str, way: int = 1) -> tuple[str, str]:
    """Return symbol and name of a figure of a circle in a plane such as XY; ``way`` is 1 from X to Y, -1 back."""
    symbol, name = _CIRCLE_FIGURES[kind]
    sense = "counter-clockwise" if way > 0 else "clockwise"
    return symbol.format(plane=plane[::way]), name.format(sense=sense)


def rotation_figure(name: str, error: str, kind: str) -> tuple[str, str]:
    """Return symbol and name of a value of an error motion: symbol of the ``error`` (EXC), its ``kind`` (radial)."""
    return f"{error} {name}", f"{name} {kind} error motion value"


#: Which rows of a test of axes that move together: symbol and name, with the direction of the readings.
_FOLLOWED_FIGURES: Mapping[str, tuple[str, str]] = {
    "whole": ("{direction}", "range of the deviations, {direction}"),
    "forward": ("{direction}+", "range of the deviations, {direction}, {axis} turning up"),
    "backward": ("{direction}-", "range of the deviations, {direction}, {axis} turning down"),
}
#: Kind of a figure of a part: its name, with the datum.
_PART_FIGURES: Mapping[str, str] = {
    "straightness": "straightness",
    "straightness_zone": "straightness, minimum zone",
    "perpendicularity": "perpendicularity to {datum}",
    "parallelism": "parallelism to {datum}",
    "angularity": "angularity to {datum}",
    "circularity": "circularity",
    "circularity_zone": "circularity, minimum zone",
    "concentricity": "concentricity to {datum}, diameter of the zone",
    "position": "position beside the first circle along {datum}, diameter of the zone",
    "profile": "profile of the line beside the tool's axis, offset free",
    "profile_zone": "profile of the line beside the tool's axis, offset free, minimum zone",
    "flatness": "flatness",
    "flatness_zone": "flatness, minimum zone",
    "half_angle": "half apex angle of the cone with {datum}, less the programmed one",
}


def followed_figure(rows: str, direction: str, axis: str) -> tuple[str, str]:
    """Return symbol and name of the range in a direction of the ``rows`` of a test of axes that move together."""
    symbol, name = _FOLLOWED_FIGURES[rows]
    return symbol.format(direction=direction), name.format(direction=direction, axis=axis)


def part_figure(kind: str, element: str, datum: str) -> tuple[str, str]:
    """Return symbol and name of a figure of an element of a part: the element itself is its symbol."""
    return element, _PART_FIGURES[kind].format(datum=datum)


@dataclass(frozen=True)
class OneSenseOfTurning(Sentence):
    """A rotary axis that linear ones follow turned in one sense."""

    axis: str

    def __str__(self) -> str:
        return f"{self.axis} turned in one sense: what it loses on turning back is not in these figures"


@dataclass(frozen=True)
class NoDatum(Sentence):
    """A part has circles beside each other and no straight side, so that their places have nothing to go by."""

    def __str__(self) -> str:
        return "no straight side was measured: no circle has a position beside the others"


@dataclass(frozen=True)
class NoProfile(Sentence):
    """Paths of a part that are neither lines, circles, profiles nor faces."""

    elements: tuple[str, ...]

    def __str__(self) -> str:
        return (
            f"{', '.join(self.elements)}: no figure: a profile turns by 30 degrees or more and its wall stands off the "
            "tool's axis, a face is plane, across that axis and measured in three numbers"
        )


@dataclass(frozen=True)
class FewPoints(Sentence):
    """Paths of a part with fewer points than a figure needs: ``of_line`` on a straight path, ``of_circle`` on a circle,
    ``of_path`` on any other."""

    elements: tuple[str, ...]
    points: tuple[int, ...]
    of_line: int
    of_circle: int
    of_path: int

    def __str__(self) -> str:
        named = ", ".join(f"{name} ({count})" for name, count in zip(self.elements, self.points, strict=True))
        return (
            f"{named}: too few points for a figure: a straight path needs {self.of_line}, a circle {self.of_circle} "
            f"over half a turn or more, any other path {self.of_path}"
        )


@dataclass(frozen=True)
class OneRevolution(Sentence):
    """Some angle of an axis of rotation was read once."""

    def __str__(self) -> str:
        return "one revolution: no asynchronous error motion"


@dataclass(frozen=True)
class OneSideApproached(Sentence):
    """Some targets were approached from one side only."""

    def __str__(self) -> str:
        return "some targets were approached from one side only: no reversal, no bi-directional figure"


@dataclass(frozen=True)
class FewRunsEachWay(Sentence):
    """The ``fewest`` runs in a direction are fewer than the ``usual`` number of ISO 230-2, 5.3.2."""

    fewest: int
    usual: int

    def __str__(self) -> str:
        return f"ISO 230-2, 5.3.2 asks for {self.usual} runs in each direction; the fewest here are {self.fewest}"


@dataclass(frozen=True)
class OneSenseOfRotation(Sentence):
    """A circle was run in one sense of rotation."""

    def __str__(self) -> str:
        return "one sense of rotation: no hysteresis, no bi-directional deviation"


@dataclass(frozen=True)
class LengthWithoutUncertainty(Sentence):
    """The length of the bar has no stated uncertainty."""

    def __str__(self) -> str:
        return "the bar's length has no stated uncertainty: radial deviations F have none either"


@dataclass(frozen=True)
class ScaleTakenAsExact(Sentence):
    """Nothing is stated of how well the unit of length of an instrument is known."""

    instrument: str

    def __str__(self) -> str:
        return (
            f"the scale of {self.instrument} is taken as exact: u does not say how well it is known "
            "(state scale_standard_uncertainty_um_per_m)"
        )
