"""What a map does not follow between its points, as its answer, its pages and its tables say it."""

from __future__ import annotations

from dataclasses import dataclass


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
