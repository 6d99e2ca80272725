"""The question for the volumetric error of a machine over its strokes."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from datetime import datetime
from pathlib import Path

from monitor.exceptions import InputError
from monitor.workflow.uncertainty.request import COVERAGE, UncertaintyRequest

# Points along each axis: an error of a serial machine with straight axes bends with the square of the position at
# most, so five show the worst; more make a finer picture.
POINTS = 7
COMPENSATION_FORMATS = ("positioning-csv", "volumetric-csv")


@dataclass(frozen=True)
class VolumetricRequest:
    """The volumetric error of one ``run`` (the last by default) on a grid of ``points`` along every linear axis.

    The workpiece's zero is set in the middle of the strokes with the rotary axes at zero, unless ``absolute``. Runs
    that began at or after ``before`` (with an offset, or by the clock of the shop) take no part. Slices are drawn into
    the folder ``figures``; tables of the format ``compensation`` are written into the folder ``out``.

    Raises InputError for a number of points or a format that there is not.
    """

    campaign: str
    run: int | None = None
    _: KW_ONLY
    model: str | None = None
    p: float = COVERAGE
    points: int = POINTS
    absolute: bool = False
    model_uncertainty: bool = True
    before: datetime | None = None
    figures: Path | None = None
    compensation: str | None = None
    out: Path = Path(".")

    def __post_init__(self) -> None:
        if not 2 <= self.points <= 41:
            raise InputError(f"--points {self.points}: choose 2 to 41 points along each axis")
        if self.compensation not in (None, *COMPENSATION_FORMATS):
            formats = " and ".join(COMPENSATION_FORMATS)
            raise InputError(f"--compensation {self.compensation}: there are {formats}")

    @property
    def uncertainty(self) -> UncertaintyRequest:
        """The question for the uncertainty that the map rests on."""
        return UncertaintyRequest(
            self.campaign,
            self.run,
            model=self.model,
            method="guf",
            p=self.p,
            model_uncertainty=self.model_uncertainty,
            before=self.before,
        )
