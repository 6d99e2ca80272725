"""The answer to the question for a run's uncertainty: what is shown, what is stored, what certificates state.

Numbers of a parameter are in its display unit. Nothing heavy is loaded here, so that what only states a stored answer
waits for neither solver nor compiler.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from monitor.documents import OMITTED, Said
from monitor.records import Array, FrameOfReference, ValidationVerdict
from monitor.reporting.budget import DayToDay, HoldsFor, LengthReference, StatedSource, Unchecked
from monitor.reporting.certificate.grounds import Ground
from monitor.reporting.certificate.model_effect import Outside
from monitor.reporting.covariance_source import CovarianceSource
from monitor.reporting.factor_sampling import FactorSampling
from monitor.reporting.refused import RefusedParameters
from monitor.workflow.uncertainty.machine_frame import MachineFrameAnswer
from monitor.workflow.uncertainty.request import Asked


@dataclass(frozen=True)
class RunResiduals:
    """RMS in µm of what the model leaves over of the whole campaign, what is expected of it, and of the run by target.

    A target that was touched once a run (the bar's) is followed exactly by its own coordinates, and left out.
    ``lack_of_fit_p`` is that of the test that allows for noise of neighbours; it is made where lack of fit is more of
    the variance of a parameter than all else, and runs follow one plan.
    """

    rms_um: float
    expected_rms_um: float
    something_is_missing: bool
    by_target_um: Mapping[str, float]
    lack_of_fit_p: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True, eq=False)
class FrameworkAnswer:
    """Results of the GUM framework (JCGM 102:2011, 6) by parameter; ``correlation`` (m, m) in their order.

    ``k_p`` and ``k_q`` are those of 6.5 for normal outputs of known covariance; those ``with_degrees_of_freedom`` are
    what so few runs allow to claim, for the sum of the budget's lines with what is known of each, and belong to the
    ``expanded`` uncertainty; ``coverage_sampling`` is theirs. None: infinite, or no joint region. ``budget`` has the
    part of every source in the variance of every parameter, the largest first, ``budget_degrees_of_freedom`` those of
    every line (None: known), ``degrees_of_freedom_by_parameter`` the effective ones of
    every variance (None: infinite). ``joint_coverage_of_k_2_each`` takes half a second of sampling and is left out
    where nobody reads it.
    """

    estimate: Mapping[str, float]
    u: Mapping[str, float]
    correlation: Array
    k_p: float
    k_q: float
    lambda_max: float
    rank: int
    degrees_of_freedom: float | None
    fewest_degrees_of_freedom: float | None
    k_p_with_degrees_of_freedom: float | None
    k_q_with_degrees_of_freedom: float | None
    expanded: Mapping[str, float]
    budget: Mapping[str, Mapping[str, float]]
    budget_degrees_of_freedom: Mapping[str, float | None] | None = field(default=None, metadata=OMITTED)
    joint_coverage_of_k_2_each: float | None = field(default=None, metadata=OMITTED)
    degrees_of_freedom_by_parameter: Mapping[str, float | None] | None = field(default=None, metadata=OMITTED)
    coverage_sampling: FactorSampling | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True, eq=False, kw_only=True)
class MonteCarloAnswer:
    """Results of the adaptive Monte Carlo (JCGM 102:2011, 7.8); ``seconds`` are no part of what is stored."""

    estimate: Mapping[str, float]
    u: Mapping[str, float]
    correlation: Array
    k_p: float
    k_q: float
    lambda_max: float
    trials: int
    not_converged: int
    seconds: float | None = field(default=None, metadata=OMITTED)
    stable: bool
    seed: int


@dataclass(frozen=True)
class ValidationAnswer:
    """Whether Monte Carlo confirms the framework (JCGM 102:2011, 8), quantity by quantity: ``u EA0B``, ``k_q``."""

    passed: bool
    verdict: ValidationVerdict
    differences: Mapping[str, float]
    tolerances: Mapping[str, float]

    @property
    def failed(self) -> tuple[str, ...]:
        """The quantities that differ by more than their tolerance."""
        return tuple(
            name for name, difference in self.differences.items() if abs(difference) > self.tolerances[name]
        )

    @property
    def confirmed(self) -> tuple[str, ...]:
        """Return the kinds of quantity of which none differs: ``estimate``, ``u``, ``lambda_max``, ``k_p``, ``k_q``."""
        kinds = dict.fromkeys(name.split()[0] for name in self.differences)
        differing = {name.split()[0] for name in self.failed}
        return tuple(kind for kind in kinds if kind not in differing)


@dataclass(frozen=True)
class LackOfFitCause:
    """An effect that lack of fit may come from, with its probability."""

    effect: str
    probability: float


@dataclass(frozen=True, kw_only=True)
class UncertaintyAnswer:
    """The uncertainty of one run's geometric errors.

    ``units`` are the display units by parameter. ``input_covariance`` says in a sentence where the covariance of the
    readings comes from, ``input_covariance_source`` as data; None in an answer that an earlier version stored, until
    it is restored (``stored.restored``). ``frames`` say what each parameter of the chain is stated relative to,
    ``machine_frame`` has the location errors in the frame of the machine; None in earlier answers. ``refused`` are
    parameters without a number. ``mcm`` and ``validation`` are left out where no Monte Carlo was asked for.
    ``holds_for`` says for which time the uncertainty holds, ``day_to_day`` how runs and days differ, ``sources`` which
    Type B sources were stated, ``length`` to what gains refer; all are None in an answer of an earlier version.
    ``unchecked`` are readings that no other checks. ``grounds`` speak against a certificate of the run; None where they
    were not determined. ``effects`` are those of the parameters that belong to the whole campaign, being added to the
    model; ``effects_outside`` says why none are. ``copied_readings`` says which runs of the campaign equal those of
    another and which rows earlier ones: it is no part of what is stored.
    """

    campaign: str
    machine: str
    run: int
    model: str
    p: float
    asked: Asked | None = field(default=None, metadata=OMITTED)
    parameters: tuple[str, ...]
    units: Mapping[str, str]
    input_covariance: str
    input_covariance_source: CovarianceSource | None = field(default=None, metadata=OMITTED)
    refused: tuple[RefusedParameters, ...]
    residuals: RunResiduals
    guf: FrameworkAnswer
    frames: Mapping[str, FrameOfReference] | None = field(default=None, metadata=OMITTED)
    machine_frame: MachineFrameAnswer | None = field(default=None, metadata=OMITTED)
    lack_of_fit_causes: tuple[LackOfFitCause, ...] | None = field(default=None, metadata=OMITTED)
    mcm: MonteCarloAnswer | None = field(default=None, metadata=OMITTED)
    validation: ValidationAnswer | None = field(default=None, metadata=OMITTED)
    holds_for: HoldsFor | None = field(default=None, metadata=OMITTED)
    day_to_day: DayToDay | None = field(default=None, metadata=OMITTED)
    sources: tuple[StatedSource, ...] | None = field(default=None, metadata=OMITTED)
    length: LengthReference | None = field(default=None, metadata=OMITTED)
    unchecked: Unchecked | None = field(default=None, metadata=OMITTED)
    grounds: tuple[Ground, ...] | None = field(default=None, metadata=OMITTED)
    effects: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    effects_outside: Outside | None = field(default=None, metadata=OMITTED)
    copied_readings: tuple[Said, ...] | None = field(default=None, metadata=OMITTED)

    @property
    def covariance(self) -> Array:
        """Covariance (m, m) of the parameters in products of their display units."""
        u = np.array([self.guf.u[name] for name in self.parameters], dtype=np.float64)
        return np.asarray(self.guf.correlation * np.outer(u, u))
