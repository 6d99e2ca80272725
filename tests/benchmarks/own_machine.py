"""A five-axis machine of plain 4x4 matrices, and campaigns measured on it; nothing is shared with the package.

Errors are written into the matrices as ISO 230-1 names them: a location error before an axis, an error motion behind
it. Readings are those of the linear axes at which the tip stands on a ball, found by Newton's method. ``noisy`` adds
what a trial is about: the law of the noise, its memory along the probings, outliers, the resolution of the scales.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

import numpy as np

from monitor.records import Artefact, AxisSettings, Ball, Campaign, Machine, Probe, Probings, Run, ScaleBar

TOPOLOGY = "w C B X b Z Y (C1) t"
#: From the bed outwards: name and direction.
WORK = (("X", 0), ("B", 1), ("C", 2))
TOOL = (("Z", 2), ("Y", 1), ("C1", 2))
#: Which way a reading moves its branch.
SIGNS = dict.fromkeys(("X", "Y", "Z", "B", "C", "C1"), 1)
BALLS = {
    "1": (116.0, 9.0, 171.0), "2": (-7.0, 118.0, 149.0), "3": (-119.0, -4.0, 98.0), "4": (12.0, -121.0, 81.0),
    "S1": (-148.0, 151.5, 57.0), "S2": (-148.0, -151.5, 57.0),
}  # fmt: skip
BAR_MM, BAR_U_MM, BAR_PER_K = 303.0, 1.2e-3, 11.5e-6
INDEXATIONS = (
    (-60, -235), (0, -130), (0, 0), (0, 95), (30, 170), (90, 265), (50, 165), (0, 140), (15, 5), (0, -55),
    (-45, -95), (-90, -265),
)  # fmt: skip
SPINDLE = (90.0, 180.0, 270.0)

Errors = Mapping[str, float]
#: Errors in µrad, µm, µm/m.
TRUE: Errors = {
    "EXX": -20.0, "EYY": 6.0, "EZZ": -11.0, "EA0B": 7.0, "EC0B": -12.0, "EX0C": -38.0, "EA0C": -4.0, "EB0C": 14.0,
    "EB0Z": -19.0, "EA0Y": -3.0, "EC0Y": 16.0, "EX0C1": -28.0, "EY0C1": 21.0,
}  # fmt: skip


@dataclass(frozen=True)
class Plan:
    """Targets and set angles (n,) in degrees of the probings of a run."""

    target: np.ndarray
    angles: Mapping[str, np.ndarray]

    def __len__(self) -> int:
        return len(self.target)


def plan(signs: Mapping[str, int] = SIGNS) -> Plan:
    """Four balls at every indexation, the bar once, three turns of the spindle; the same places whatever the signs."""
    rows = [(ball, b, c, 0.0) for b, c in INDEXATIONS for ball in "1234"]
    rows[12:12] = [("S1", 0, 0, 0.0), ("S2", 0, 0, 0.0)]
    rows += [(ball, 0, 0, turn) for turn in SPINDLE for ball in "1234"]
    columns = list(zip(*rows, strict=True))
    return Plan(
        np.array(columns[0]),
        {
            name: signs[name] * np.array(column, float)
            for name, column in zip(("B", "C", "C1"), columns[1:], strict=True)
        },
    )


def _turn(axis: int, angle: np.ndarray) -> np.ndarray:
    matrix = np.tile(np.eye(4), (len(angle), 1, 1))
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix[:, i, i] = matrix[:, j, j] = np.cos(angle)
    matrix[:, i, j], matrix[:, j, i] = -np.sin(angle), np.sin(angle)
    return matrix


def _shift(vector: np.ndarray) -> np.ndarray:
    matrix = np.tile(np.eye(4), (len(vector), 1, 1))
    matrix[:, :3, 3] = vector
    return matrix


def _small(errors: np.ndarray) -> np.ndarray:
    """Errors (n, 6): three shifts in mm, three turns in rad."""
    turned = _turn(2, errors[:, 5]) @ _turn(1, errors[:, 4]) @ _turn(0, errors[:, 3])
    return _shift(errors[:, :3]) @ turned


@dataclass(frozen=True, eq=False)
class OwnMachine:
    """The machine with its location errors and gains, and further error motions of an axis by a function of reading,
    direction of approach and temperature: (n, 6) in mm and rad."""

    errors: Errors = field(default_factory=lambda: dict(TRUE))
    motions: Mapping[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = field(
        default_factory=dict
    )
    signs: Mapping[str, int] = field(default_factory=lambda: SIGNS)

    def _axis(self, name: str, axis: int, reading: np.ndarray, side: np.ndarray, warm: np.ndarray):
        sign = self.signs[name]
        location, motion = np.zeros((len(reading), 6)), np.zeros((len(reading), 6))
        for index, letter in enumerate("XYZABC"):
            unit = 1e-3 if index < 3 else 1e-6
            location[:, index] = unit * self.errors.get(f"E{letter}0{name}", 0.0)
        if name in "XYZ":
            motion[:, "XYZ".index(name)] = 1e-6 * self.errors.get(f"E{name}{name}", 0.0) * sign * reading
        if name in self.motions:
            motion += self.motions[name](reading, side, warm)
        if name in "XYZ":
            moved = _shift(np.outer(sign * reading, np.eye(3)[axis]))
        else:
            moved = _turn(axis, np.radians(sign * reading))
        return _small(location) @ moved @ _small(motion)

    def _branch(self, axes, readings, sides, warm) -> np.ndarray:
        count = len(warm)
        matrix = np.tile(np.eye(4), (count, 1, 1))
        none = np.zeros(count)
        for name, axis in axes:
            matrix = matrix @ self._axis(name, axis, readings[name], sides.get(name, none), warm)
        return matrix

    def away(self, readings, sides, warm, ball) -> np.ndarray:
        """From the ball to the tip (n, 3), in the workpiece's frame."""
        tip = np.tile([0.0, 0.0, 0.0, 1.0], (len(ball), 1))[:, :, None]
        seen = np.linalg.solve(
            self._branch(WORK, readings, sides, warm), self._branch(TOOL, readings, sides, warm) @ tip
        )
        return seen[:, :3, 0] - ball

    def touched(self, plan: Plan, warm: np.ndarray, bar_mm: float = BAR_MM) -> np.ndarray:
        """Readings (n, 3) of X, Y, Z on the balls, approached as the plan goes from one to the next."""
        places = {name: np.array(place) for name, place in BALLS.items()}
        places["S1"][1], places["S2"][1] = bar_mm / 2, -bar_mm / 2
        ball = np.array([places[name] for name in plan.target])
        linear = np.zeros((len(plan), 3))
        sides = {name: np.ones(len(plan)) for name in "XYZ"}
        for _ in range(8):
            step = self._newton(plan, linear, sides, warm, ball)
            linear = linear + step
            sides = {name: _sides(linear[:, axis]) for axis, name in enumerate("XYZ")}
        return linear

    def _newton(self, plan: Plan, linear, sides, warm, ball) -> np.ndarray:
        def at(values):
            readings = {**plan.angles, **dict(zip("XYZ", values.T, strict=True))}
            return self.away(readings, sides, warm, ball)

        here = at(linear)
        slopes = np.stack([(at(linear + 1e-3 * np.eye(3)[axis]) - here) / 1e-3 for axis in range(3)], axis=2)
        return -np.linalg.solve(slopes, here[:, :, None])[:, :, 0]


def _sides(values: np.ndarray) -> np.ndarray:
    """+1 where an axis came from below, -1 from above, as before where it stood."""
    sides = np.ones(len(values))
    for row in range(1, len(values)):
        move = values[row] - values[row - 1]
        sides[row] = sides[row - 1] if abs(move) < 0.1 else np.sign(move)
    return sides


def recorded(
    plan: Plan,
    readings: np.ndarray,
    days: np.ndarray,
    *,
    stated_um: float = 1.0,
    bar_mm: float = BAR_MM,
    ambient: np.ndarray | None = None,
    name: str = "own",
    signs: Mapping[str, int] = SIGNS,
) -> Campaign:
    """The record of readings (R, n, 3) in mm of runs on ``days`` (R,), as a reader of files makes it.

    With ``ambient`` (R,) in degrees the bar is of steel and its expansion is corrected.
    """
    runs = len(readings)
    start = datetime(2026, 3, 2, 8, tzinfo=UTC)
    each = np.tile(np.arange(1, len(plan) + 1), runs)
    of_day: dict[int, int] = {}
    records = []
    for run, day in enumerate(days):
        turn = of_day[int(day)] = of_day.get(int(day), -1) + 1
        conditions = {} if ambient is None else {"ambient_degC": float(ambient[run])}
        records.append(
            Run(run + 1, start + timedelta(days=int(day), hours=2 * turn), int(day) + 1, False, conditions)
        )
    angles = {axis: np.radians(np.tile(values, runs)) for axis, values in plan.angles.items()}
    linear = dict(zip("XYZ", readings.reshape(-1, 3).T, strict=True))
    probings = Probings(
        np.repeat(np.arange(1, runs + 1), len(plan)),
        each,
        60.0 * (each - 1.0),
        np.tile(plan.target, runs),
        {**linear, **angles},
        {},
    )
    expansion = {} if ambient is None else {"expansion_coefficient": BAR_PER_K, "reference_temperature": 20.0}
    bar = ScaleBar(("S1", "S2"), bar_mm, BAR_U_MM, "own", **expansion)
    axes = {axis: AxisSettings(axis, sign) for axis, sign in signs.items()}
    balls = tuple(Ball(ball, place, 19.05) for ball, place in BALLS.items())
    return Campaign(
        name, "samba", Machine("OWN", TOPOLOGY, axes=axes), Probe("P", "p", stated_um * 1e-3),
        Artefact("A", balls, bar), tuple(records), probings,
    )  # fmt: skip
