"""The results that a certificate or a report prints, in display units, as they were stored.

A ``ResultSet`` is what one evaluation says of one state of the machine (as found, as left). ``result_set``
makes it from numbers in internal units; nothing is evaluated here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from monitor.documents import OMITTED
from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.budget import Budget, HoldsFor
from monitor.reporting.certificate.machine_frame_result import MachineFrameResult
from monitor.reporting.certificate.model_effect import ModelEffect
from monitor.reporting.factor_sampling import FactorSampling
from monitor.reporting.refused import RefusedParameters
from monitor.reporting.symbols import describe
from monitor.reporting.texts import Texts
from monitor.units import Unit


@dataclass(frozen=True)
class ResidualSummary:
    """RMS of the residuals over groups of probings, and the probe's stated standard uncertainty, all in µm.

    ``by`` says in words what the groups are: target, setup, axis or run.
    """

    by: str
    labels: tuple[str, ...]
    rms_um: tuple[float, ...]
    probe_um: float | None = None


@dataclass(frozen=True, eq=False)
class ResultSet:
    """Estimates and joint uncertainty of m parameters, in their display units.

    ``state`` of the machine that they describe: as found, as left. ``estimate`` (m,), ``covariance`` (m, m) in
    products of the display units. ``k_q`` is the coverage factor of the hyper-rectangle, ``k_p`` that of the
    hyper-ellipsoid of ``rank`` dimensions, both for probability ``p`` (JCGM 102:2011 6.5). ``evaluation`` names the
    way the uncertainty was evaluated, with its clause. ``trials`` and ``validation`` belong to Monte Carlo.
    ``tolerances`` (m,) are limits of absolute values, NaN where there is none. ``dof``: degrees of freedom of the
    covariance as a whole; not finite where it is known. ``sampling`` is that of the factors; None in a result of an
    earlier version, whose factors hold for ``dof`` (Student, Hotelling). ``machine_frame`` has the location errors in
    the frame of the machine, ``budget`` what stands behind u; both are None in a result of an earlier version.
    ``effects`` are those that were added to the model; None where it has none, and in a result of an earlier version.
    """

    state: str
    names: tuple[str, ...]
    descriptions: tuple[str, ...]
    units: tuple[str, ...]
    estimate: Array
    covariance: Array
    p: float
    k_p: float
    k_q: float
    rank: int
    evaluation: str
    refused: tuple[RefusedParameters, ...] = ()
    residuals: ResidualSummary | None = None
    trials: int | None = None
    validation: str | None = None
    tolerances: Array | None = None
    dof: float = math.inf
    machine_frame: MachineFrameResult | None = field(default=None, metadata=OMITTED)
    budget: Budget | None = field(default=None, metadata=OMITTED)
    sampling: FactorSampling | None = None
    effects: tuple[ModelEffect, ...] | None = field(default=None, metadata=OMITTED)

    @property
    def k_p_error(self) -> float:
        """Standard error of the sampling of k_p, which decides its digits; zero where none is stored."""
        return 0.0 if self.sampling is None else self.sampling.k_p_standard_error

    @property
    def k_q_error(self) -> float:
        """Standard error of the sampling of k_q, which decides its digits; zero where none is stored."""
        return 0.0 if self.sampling is None else self.sampling.k_q_standard_error

    @property
    def u(self) -> Array:
        """Standard uncertainties (m,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def expanded(self) -> Array:
        """U = k_q u (m,)."""
        return self.k_q * self.u

    @property
    def correlation(self) -> Array:
        """Correlation matrix (m, m), exactly 1 on its diagonal."""
        u = self.u
        matrix = self.covariance / np.outer(u, u)
        np.fill_diagonal(matrix, 1.0)
        return np.asarray(matrix)

    @property
    def has_ellipsoid(self) -> bool:
        """Whether the covariance is known well enough for a hyper-ellipsoid."""
        return math.isfinite(self.k_p)

    @property
    def half_axes(self) -> Array:
        """Half-axes of the ellipsoid in the coordinates (y_j - estimate_j)/u_j, the longest first."""
        return np.asarray(self.k_p * np.sqrt(np.clip(np.linalg.eigvalsh(self.correlation)[::-1], 0.0, None)))

    def gaps(self) -> tuple[str, ...]:
        """Which statements a certificate needs and this result lacks."""
        needed = {
            "state of the machine (as found, as left)": self.state,
            "how the uncertainty was evaluated": self.evaluation,
            "at least one parameter with a number": self.names,
        }
        return tuple(
            what for what, value in needed.items() if not (value.strip() if isinstance(value, str) else value)
        )


@dataclass(frozen=True)
class JointEstimate:
    """Estimates (m,) of m parameters and their covariance (m, m), in internal units; ``units`` are those to print."""

    names: Sequence[str]
    units: Sequence[Unit]
    estimate: npt.ArrayLike
    covariance: npt.ArrayLike


@dataclass(frozen=True)
class CoverageFactors:
    """The coverage factors of a result for probability ``p``, as ``ResultSet`` has them."""

    p: float
    k_p: float
    k_q: float
    rank: int
    dof: float = math.inf
    sampling: FactorSampling | None = None


@dataclass(frozen=True, kw_only=True)
class ResultStatements:
    """What a result states besides its numbers, as ``ResultSet`` has it.

    ``tolerances`` are in display units by name. ``descriptions`` are words for parameters by name.
    """

    state: str
    evaluation: str
    refused: Sequence[RefusedParameters] = ()
    residuals: ResidualSummary | None = None
    trials: int | None = None
    validation: str | None = None
    tolerances: Mapping[str, float] | None = None
    descriptions: Mapping[str, str] = field(default_factory=dict)
    machine_frame: MachineFrameResult | None = None
    budget: Budget | None = None


def result_set(
    joint: JointEstimate, factors: CoverageFactors, statements: ResultStatements, texts: Texts | None = None
) -> ResultSet:
    """A result to print from numbers in internal units.

    Parameters that are refused are left out of the numbers. What has no word in the statements' descriptions is
    described in the language of ``texts`` (English without). Raises DataError where shapes differ, a number is not
    finite, a factor is not positive or a variance is not positive: such a result cannot be certified.
    """
    estimate = np.asarray(joint.estimate, dtype=np.float64)
    covariance = np.asarray(joint.covariance, dtype=np.float64)
    count = len(joint.names)
    if estimate.shape != (count,) or covariance.shape != (count, count) or len(joint.units) != count:
        raise DataError(
            f"{count} parameters need as many units and estimates and a covariance of shape ({count}, {count}), "
            f"not {len(joint.units)}, {estimate.shape} and {covariance.shape}"
        )
    refused = {name for refusal in statements.refused for name in refusal.parameters}
    printed = [index for index, name in enumerate(joint.names) if name not in refused]
    factor = np.array([joint.units[index].factor for index in printed])
    names = tuple(joint.names[index] for index in printed)
    estimate = estimate[printed] / factor
    covariance = covariance[np.ix_(printed, printed)] / np.outer(factor, factor)
    _check_numbers(names, estimate, covariance)
    over_campaign = statements.budget is not None and statements.budget.holds_for is HoldsFor.CAMPAIGN
    _check_factors(factors, ellipsoid=not over_campaign)
    limits = statements.tolerances
    descriptions = statements.descriptions
    return ResultSet(
        state=statements.state,
        names=names,
        descriptions=tuple(descriptions.get(name, describe(name, texts)) for name in names),
        units=tuple(joint.units[index].name for index in printed),
        estimate=estimate,
        covariance=covariance,
        p=factors.p,
        k_p=factors.k_p,
        k_q=factors.k_q,
        rank=factors.rank,
        evaluation=statements.evaluation,
        refused=tuple(statements.refused),
        residuals=statements.residuals,
        trials=statements.trials,
        validation=statements.validation,
        tolerances=None if limits is None else np.array([limits.get(name, math.nan) for name in names]),
        dof=factors.dof,
        machine_frame=statements.machine_frame,
        budget=None if statements.budget is None else statements.budget.of(printed),
        sampling=factors.sampling,
    )


def _check_numbers(names: tuple[str, ...], estimate: Array, covariance: Array) -> None:
    for index, name in enumerate(names):
        if not math.isfinite(estimate[index]) or not np.all(np.isfinite(covariance[index])):
            raise DataError(f"parameter {name} has no finite number; name it among the refused parameters")
        if not covariance[index, index] > 0.0:
            raise DataError(
                f"parameter {name} has the variance {covariance[index, index]:g}; it must be positive"
            )


def _check_factors(factors: CoverageFactors, *, ellipsoid: bool) -> None:
    if not 0.0 < factors.p < 1.0:
        raise DataError(f"the coverage probability p must lie between 0 and 1, but is {factors.p}")
    for symbol, factor in (("k_p", factors.k_p), ("k_q", factors.k_q)):
        # A few days bound intervals and no ellipsoid.
        unbounded = symbol == "k_p" and not ellipsoid and factor == math.inf
        if not (math.isfinite(factor) and factor > 0.0) and not unbounded:
            raise DataError(f"the coverage factor {symbol} must be positive and finite, but is {factor}")
