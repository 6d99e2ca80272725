"""What a map does not follow between its points, and what no position tells it, as answers, pages and tables say it."""

from __future__ import annotations

from dataclasses import dataclass, field

from monitor.documents import OMITTED

#: A smaller step, in µm or µrad, is printed as none: points between do not err by it.
LEAST_STEP = 0.05


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

    ``width_mm`` is the way over which it goes where it says most, None for a step at once: with all of its way it lies
    between the ends, its middle within ``middle_mm``, and points err by up to ``error`` in ``unit``.
    """

    parameter: str
    axis: str
    low_mm: float
    high_mm: float
    size: float
    unit: str
    zero_between: bool
    width_mm: float | None = field(default=None, metadata=OMITTED)

    middle_mm: tuple[float, float] | None = field(default=None, metadata=OMITTED)
    error: float | None = field(default=None, metadata=OMITTED)

    @property
    def middle(self) -> tuple[float, float]:
        """From where to where in mm the middle of the step may lie."""
        return self.middle_mm or (self.low_mm, self.high_mm)

    @property
    def most(self) -> float:
        """How far points between may err, in ``unit``."""
        return self.size if self.error is None else self.error

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
        first, last = self.middle
        return (
            f"{step} over some {self.width_mm:g} mm, has its middle somewhere between {first:.2f} and {last:.2f} mm of "
            f"{self.axis}, as far as the readings tell: points between {self.low_mm:.2f} and {self.high_mm:.2f} mm may "
            f"err by up to {self.most:.1f} {self.unit}, and all points{all_points}; no U contains that"
        )
