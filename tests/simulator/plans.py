"""Plans of probings and schedules of runs: what is measured, and when.

The two named plans have the indexations, balls and bar of the labelled sample campaigns of the project.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone

import numpy as np

EASTERN = timezone(timedelta(hours=-5))
FOUR_BALLS = {
    "1": (118.0, 6.0, 178.8),
    "2": (-4.0, 121.0, 153.4),
    "3": (-117.0, -8.0, 102.6),
    "4": (9.0, -119.0, 77.2),
}
BAR_BALLS = {"S1": (-150.0, 152.494615, 60.0), "S2": (-150.0, -152.494615, 60.0)}


@dataclass(frozen=True)
class Plan:
    """One run: targets in the order of probing, each with the readings of the rotary axes in degrees."""

    name: str
    balls: dict[str, tuple[float, float, float]]
    probings: tuple[tuple[str, dict[str, float]], ...]
    bar: tuple[str, str] | None = ("S1", "S2")
    bar_length_mm: float = 304.98923
    bar_uncertainty_mm: float = 0.0012
    ball_diameter_mm: float = 19.05
    period_s: float = 62.9
    probe_uncertainty_um: float = 1.0


@dataclass(frozen=True)
class Schedule:
    """Runs of a campaign: when each started, on which day (from 1), with which conditions."""

    started_at: tuple[datetime, ...]
    day: tuple[int, ...]
    ambient_degC: np.ndarray
    warm_up: tuple[bool, ...]

    @property
    def runs(self) -> int:
        return len(self.started_at)

    def since_first_run_s(self) -> np.ndarray:
        """(runs,) seconds from the start of the first run of the day to the start of each run."""
        first: dict[int, datetime] = {}
        for day, start in zip(self.day, self.started_at, strict=True):
            first.setdefault(day, start)
        return np.array(
            [(s - first[d]).total_seconds() for d, s in zip(self.day, self.started_at, strict=True)]
        )


def indexed_plan(
    name: str,
    indexations: Sequence[dict[str, float]],
    bar_after: int | None = None,
    balls: dict[str, tuple[float, float, float]] | None = None,
    **others: object,
) -> Plan:
    """All four (or `balls`) at every indexation; the bar's two after indexation `bar_after` (from 1)."""
    balls = dict(FOUR_BALLS if balls is None else balls)
    rows: list[tuple[str, dict[str, float]]] = []
    for number, angles in enumerate(indexations, 1):
        rows += [(ball, dict(angles)) for ball in balls]
        if number == bar_after:
            rows += [(ball, dict(angles)) for ball in BAR_BALLS]
    if bar_after is not None:
        balls |= BAR_BALLS
    else:
        others["bar"] = None
    return Plan(name, balls, tuple(rows), **others)  # type: ignore[arg-type]


def five_days_plan() -> Plan:
    """Fifteen indexations, the spindle indexed too, the bar after the third (62 probings)."""
    pairs = [(-60, -235), (0, -135), (0, 0), (0, 90), (30, 175), (90, 270), (50, 170), (0, 135)]
    pairs += [(15, 0), (0, -50), (-45, -90), (-90, -270)]
    angles = [{"B": b, "C": c, "C1": 0} for b, c in pairs]
    angles += [{"B": 0, "C": 0, "C1": c1} for c1 in (90, 180, 270)]
    return indexed_plan("five-days", angles, bar_after=3)


def cold_cold_plan() -> Plan:
    """Seven indexations, the spindle at zero, the bar after the fourth (30 probings)."""
    pairs = [(90, 270), (60, 180), (30, 90), (0, 0), (-90, -270), (-60, -180), (-30, -90)]
    angles = [{"B": b, "C": c, "C1": 0} for b, c in pairs]
    return indexed_plan(
        "cold-cold",
        angles,
        bar_after=4,
        bar_length_mm=304.6686,
        ball_diameter_mm=12.7,
        period_s=60.0,
        probe_uncertainty_um=0.7,
    )


def working_days(
    rng: np.random.Generator,
    days: int = 5,
    runs_per_day: int = 4,
    first: datetime = datetime(2026, 3, 2, 8, 30, tzinfo=EASTERN),
    spacing_s: float = 72 * 60.0,
) -> Schedule:
    """Runs on working days, a few minutes late at random, as in the five-day sample."""
    starts: list[datetime] = []
    numbers: list[int] = []
    morning = first
    for day in range(1, days + 1):
        for k in range(runs_per_day):
            starts.append(morning + timedelta(seconds=k * spacing_s + rng.uniform(0, 8 * 60)))
            numbers.append(day)
        morning += timedelta(days=3 if morning.weekday() == 4 else 1)
    hour = np.array([(s.hour + s.minute / 60) - 8.5 for s in starts])
    ambient = 22.0 + 0.5 * np.sin(2 * np.pi * hour / 5) + rng.normal(0, 0.2, len(starts))
    return Schedule(tuple(starts), tuple(numbers), np.round(ambient, 2), (False,) * len(starts))


def around_the_clock(
    rng: np.random.Generator,
    runs: int = 44,
    first: datetime = datetime(2026, 2, 17, 9, 0, tzinfo=EASTERN),
    spacing_s: float = 24 * 3600 / 44,
    warm_up: bool = False,
) -> Schedule:
    """Runs one after the other round the clock, all counted as one day, as in the cold-cold sample."""
    starts = tuple(first + timedelta(seconds=k * spacing_s) for k in range(runs))
    ambient = 22.9 + 0.1 * rng.standard_normal(runs)
    if warm_up:
        ambient = ambient + 4.0 * np.exp(-np.arange(runs) * spacing_s / 7200)
    return Schedule(starts, (1,) * runs, np.round(ambient, 2), (warm_up,) * runs)
