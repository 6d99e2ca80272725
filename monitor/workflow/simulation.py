"""Writes a virtual campaign folder, to rehearse: of the project's machine with a hidden effect, or of any machine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from monitor.documents import OMITTED
from monitor.exceptions import InputError, did_you_mean
from monitor.methods import Rehearsal, campaign_method, methods
from monitor.readers import write_campaign
from monitor.records import Campaign
from monitor.reporting import rehearsal_words
from monitor.units import MICROMETRE
from monitor.workflow.sight import EffectSight, effect_sight

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
    """What was written; ``peak_um`` is None where nothing is hidden.

    ``sight`` says what the plan shows of the hidden effect.
    """

    folder: str
    campaign: str
    effect: str | None
    peak_um: float | None
    noise_um: float
    seed: int
    runs: int
    probings: int
    message: str
    sight: EffectSight | None = field(default=None, metadata=OMITTED)


def as_virtual(campaign: Campaign) -> Campaign:
    """Return a campaign whose file says that nobody measured it."""
    return replace(campaign, machine=replace(campaign.machine, virtual=True))


def simulate(request: SimulateRequest) -> SimulateAnswer:
    """Write a virtual campaign folder. Raises InputError for an effect that the machine or robot does not have."""
    campaign = request.rehearsal.virtual_campaign(
        request.out.resolve().name,
        np.random.default_rng(request.seed),
        effect=request.effect,
        peak=MICROMETRE.to_internal(request.peak),
        noise=MICROMETRE.to_internal(request.noise),
    )
    write_campaign(as_virtual(campaign), request.out)
    runs, probings = len(campaign.runs), len(campaign.probings)
    hidden = (request.effect, request.peak) if request.effect else None
    message = rehearsal_words.virtual_written(request.out, runs, probings // runs, hidden)
    sight = None
    if request.effect is not None:
        method = campaign_method(campaign)
        problem = method.problem_of(campaign, method.own_model)
        sight = effect_sight(problem, request.effect, MICROMETRE.to_internal(request.peak))
        message += sight.words(request.effect, request.peak)
    return SimulateAnswer(
        folder=str(request.out),
        campaign=campaign.name,
        effect=request.effect,
        peak_um=request.peak if request.effect else None,
        noise_um=request.noise,
        seed=request.seed,
        runs=runs,
        probings=probings,
        message=message,
        sight=sight,
    )


#: Of an error of a simulated machine in display units: a tenth of a metre, or some 6 degrees.
LARGEST_ERROR = 1e5


@dataclass(frozen=True)
class SimulateMachineRequest:
    """A virtual campaign of a machine of a ``topology``, with the errors that are named and no others.

    ``method`` gives the plan: the same number of runs on each of the ``days``, named after ``out``. ``errors`` by
    effect (``EC0Y``, ``EXX:poly1``, ``EBB:harmonic2``) in display units (µm, µrad, µm/m), as many numbers as it has
    coefficients. ``noise_um`` is the standard deviation of a reading, the method's own where it is None.
    """

    out: Path
    topology: str
    errors: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    method: str = "samba"
    days: int = 5
    noise_um: float | None = None
    seed: int = 1

    def __post_init__(self) -> None:
        if self.noise_um is not None and not (math.isfinite(self.noise_um) and self.noise_um > 0):
            raise InputError(f"--noise {self.noise_um}: the noise of a reading must be above 0 µm")
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: a seed is a whole number from 0 on")
        for effect, sizes in self.errors.items():
            if not all(abs(size) <= LARGEST_ERROR for size in sizes):
                raise InputError(
                    f"{effect} = {', '.join(f'{size:g}' for size in sizes)}: an error is a number of at most "
                    f"{LARGEST_ERROR:g} µm, µrad or µm/m"
                )


@dataclass(frozen=True)
class SimulateMachineAnswer:
    """What was written, and the errors that the machine has: the truth to compare an identification with."""

    folder: str
    campaign: str
    topology: str
    errors: Mapping[str, tuple[float, ...]]
    noise_um: float
    seed: int
    runs: int
    probings: int
    message: str


def simulate_machine(request: SimulateMachineRequest) -> SimulateMachineAnswer:
    """Write a virtual campaign of any machine.

    Raises InputError for a method without a plan for any machine, TopologyError, EffectError, and DataError for a
    machine on which the plan cannot be measured.
    """
    rehearsals = {
        name: method.rehearsal
        for name, method in methods().items()
        if isinstance(method.rehearsal, Rehearsal) and method.rehearsal.chosen_campaign is not None
    }
    rehearsal = rehearsals.get(request.method)
    if rehearsal is None or rehearsal.chosen_campaign is None:
        raise InputError(
            f"the method '{request.method}' has no plan of its own for any machine; "
            f"{did_you_mean(request.method, rehearsals)}{', '.join(rehearsals)} has; for others: simulate --like"
        )
    noise = rehearsal.noise_um if request.noise_um is None else request.noise_um
    campaign = rehearsal.chosen_campaign(
        request.out.resolve().name,
        np.random.default_rng(request.seed),
        topology=request.topology,
        errors=request.errors,
        days=request.days,
        noise=MICROMETRE.to_internal(noise),
    )
    write_campaign(as_virtual(campaign), request.out)
    runs, probings = len(campaign.runs), len(campaign.probings)
    return SimulateMachineAnswer(
        folder=str(request.out),
        campaign=campaign.name,
        topology=campaign.machine.topology,
        errors=request.errors,
        noise_um=noise,
        seed=request.seed,
        runs=runs,
        probings=probings,
        message=rehearsal_words.virtual_machine_written(
            request.out, runs, probings // runs, list(request.errors)
        ),
    )
