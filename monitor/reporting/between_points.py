"""What a map does not follow between its points, and what no position tells it, as answers, pages and tables say it."""

from __future__ import annotations

from dataclasses import dataclass, field

from monitor.documents import OMITTED


@dataclass(frozen=True)
class BetweenPoints:
    """An error in the map, up to ``size`` along its ``axis``, that repeats every ``pitch_mm`` where the points of the
    map are ``spacing_mm`` apart: what it does between them is in no number of the map."""

    effect: str
    axis: str
    pitch_mm: float
    spacing_mm: float
    size: float
    unit: str

    def __str__(self) -> str:
        return (
            f"between the points of the map, {self.spacing_mm:.4g} mm apart along {self.axis}: {self.effect}, up to "
            f"{self.size:.1f} {self.unit}, repeats every {self.pitch_mm:g} mm, so that the largest error may lie "
            "between them"
        )


@dataclass(frozen=True)
class StepPlace:
    """A step of the map that lies somewhere from ``low_mm`` to ``high_mm`` of its ``axis``, as far as readings tell:
    points between may err by its ``size``, and all points where ``zero_between``, because the workpiece's zero lies
    there. No U contains that.

    ``width_mm`` is the way over which it goes, None for a step at once: its middle is known to what is left between the
    ends, and points err by that part of its size.
    """

    parameter: str
    axis: str
    low_mm: float
    high_mm: float
    size: float
    unit: str
    zero_between: bool
    width_mm: float | None = field(default=None, metadata=OMITTED)

    @property
    def middle_mm(self) -> tuple[float, float]:
        """From where to where the middle of the step may lie."""
        half = (self.width_mm or 0.0) / 2.0
        return self.low_mm + half, self.high_mm - half

    @property
    def error(self) -> float:
        """How far points between may err, in ``unit``."""
        if not self.width_mm:
            return self.size
        first, last = self.middle_mm
        return self.size * min(1.0, max(last - first, 0.0) / self.width_mm)

    def __str__(self) -> str:
        all_points = (
            ", because the workpiece's zero lies between"
            if self.zero_between
            else " where a workpiece's zero is set between"
        )
        step = f"{self.parameter}, a step of {self.size:.1f} {self.unit}"
        if not self.width_mm:
            return (
                f"{step}, lies somewhere between {self.low_mm:.2f} and "
                f"{self.high_mm:.2f} mm of {self.axis}, as far as the readings tell: points between may err by it, and "
                f"all points{all_points}; no U contains that"
            )
        first, last = self.middle_mm
        return (
            f"{step} over {self.width_mm:g} mm, has its middle somewhere between {first:.2f} and {last:.2f} mm of "
            f"{self.axis}, as far as the readings tell: points between {self.low_mm:.2f} and {self.high_mm:.2f} mm may "
            f"err by up to {self.error:.1f} {self.unit}, and all points{all_points}; no U contains that"
        )
