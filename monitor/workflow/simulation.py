"""Writes a virtual campaign folder, to rehearse."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from monitor.exceptions import InputError
from monitor.methods import Rehearsal, methods
from monitor.readers import write_campaign
from monitor.reporting import messages
from monitor.units import MICROMETRE

#: Largest displacement of a hidden effect where the request names none, µm.
PEAK_UM = 5.0


@dataclass(frozen=True)
class SimulateRequest:
    """A virtual campaign: its folder, the hidden effect with its largest displacement, and the noise of a reading.

    The campaign is named after ``out``. ``robot`` asks for a robot that a tracker observes instead of a machine tool
    that a probe touches.
    """

    out: Path
    effect: str | None = None
    peak_um: float | None = None
    noise_um: float | None = None
    seed: int = 1
    robot: bool = False

    def __post_init__(self) -> None:
        if self.noise <= 0 or not math.isfinite(self.noise):
            raise InputError(f"--noise {self.noise}: the noise of a reading must be above 0 µm")
        if self.peak_um is not None and (not math.isfinite(self.peak_um) or self.peak_um <= 0):
            raise InputError(f"--peak {self.peak_um}: the peak must be a number of µm above 0")
        if self.peak_um is not None and self.effect is None:
            raise InputError(f"--peak {self.peak_um:g} needs --effect, the effect that has it")
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: a seed is a whole number from 0 on")

    @property
    def noise(self) -> float:
        """The noise in µm, that of the instrument where the request names none."""
        if self.noise_um is not None:
            return self.noise_um
        return self.rehearsal.noise_um

    @property
    def peak(self) -> float:
        """The largest displacement of the effect in µm."""
        return PEAK_UM if self.peak_um is None else self.peak_um

    @property
    def rehearsal(self) -> Rehearsal:
        """The virtual machine of the first method that has one of the kind."""
        machine = "robot" if self.robot else "machine tool"
        rehearsals = (method.rehearsal for method in methods().values())
        return next(
            rehearsal
            for rehearsal in rehearsals
            if isinstance(rehearsal, Rehearsal) and rehearsal.machine == machine
        )


@dataclass(frozen=True)
class SimulateAnswer:
    """What was written; ``peak_um`` is None where nothing is hidden."""

    folder: str
    campaign: str
    effect: str | None
    peak_um: float | None
    noise_um: float
    seed: int
    runs: int
    probings: int
    message: str


def simulate(request: SimulateRequest) -> SimulateAnswer:
    """Write a virtual campaign folder. Raises InputError for an effect that the machine or robot does not have."""
    campaign = request.rehearsal.virtual_campaign(
        request.out.resolve().name,
        np.random.default_rng(request.seed),
        effect=request.effect,
        peak=MICROMETRE.to_internal(request.peak),
        noise=MICROMETRE.to_internal(request.noise),
    )
    write_campaign(campaign, request.out)
    runs, probings = len(campaign.runs), len(campaign.probings)
    hidden = (request.effect, request.peak) if request.effect else None
    return SimulateAnswer(
        folder=str(request.out),
        campaign=campaign.name,
        effect=request.effect,
        peak_um=request.peak if request.effect else None,
        noise_um=request.noise,
        seed=request.seed,
        runs=runs,
        probings=probings,
        message=messages.virtual_written(request.out, runs, probings // runs, hidden),
    )
