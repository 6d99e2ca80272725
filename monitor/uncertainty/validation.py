"""Validation of the GUM framework by Monte Carlo, quantity by quantity (JCGM 102:2011 clause 8).

The absolute differences of estimates, standard uncertainties, largest eigenvalue of the correlation matrix, k_p and k_q
must be no larger than their numerical tolerances. A Monte Carlo samples a known covariance, so that the framework's
factors are those of one, and its k_q is no bound but the factor that the correlations ask for. The Monte Carlo result
has to be stable to a fifth of the tolerances (8.2): where it is not, the verdict is neither yes nor no.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.exceptions import DataError
from monitor.records import ValidationVerdict
from monitor.uncertainty.framework import FrameworkResult
from monitor.uncertainty.monte_carlo.adaptive import MonteCarloResult
from monitor.uncertainty.tolerance import numerical_tolerance

#: JCGM 102 8.2: the Monte Carlo tolerance is to be no more than a fifth of that of the comparison.
STABILITY_FACTOR = 5.0


@dataclass(frozen=True)
class Comparison:
    """One quantity: both values, their difference, its tolerance and the verdict.

    ``quantity`` is ``estimate``, ``u``, ``lambda_max``, ``k_p`` or ``k_q``; ``output`` and ``unit`` are empty
    for the last three. ``stability`` is twice the Monte Carlo value's standard error.
    """

    quantity: str
    output: str
    unit: str
    framework: float
    monte_carlo: float
    tolerance: float
    stability: float

    @property
    def difference(self) -> float:
        """The absolute difference."""
        return abs(self.framework - self.monte_carlo)

    @property
    def verdict(self) -> ValidationVerdict:
        """Undecided where the Monte Carlo error could change the answer."""
        if self.stability <= self.tolerance / STABILITY_FACTOR:
            return (
                ValidationVerdict.VALIDATED
                if self.difference <= self.tolerance
                else ValidationVerdict.NOT_VALIDATED
            )
        if self.difference - self.stability > self.tolerance:
            return ValidationVerdict.NOT_VALIDATED
        if self.difference + self.stability <= self.tolerance:
            return ValidationVerdict.VALIDATED
        return ValidationVerdict.UNDECIDED


@dataclass(frozen=True)
class Validation:
    """All comparisons of one validation, to ``digits`` significant digits."""

    comparisons: tuple[Comparison, ...]
    digits: int
    trials: int

    @property
    def verdict(self) -> ValidationVerdict:
        """``validated`` only if every quantity is; ``not validated`` as soon as one is not."""
        verdicts = {comparison.verdict for comparison in self.comparisons}
        if ValidationVerdict.NOT_VALIDATED in verdicts:
            return ValidationVerdict.NOT_VALIDATED
        return (
            ValidationVerdict.UNDECIDED
            if ValidationVerdict.UNDECIDED in verdicts
            else ValidationVerdict.VALIDATED
        )

    @property
    def passed(self) -> bool:
        """Whether the GUM framework may be used for this measurement."""
        return self.verdict is ValidationVerdict.VALIDATED

    def failed(self) -> tuple[Comparison, ...]:
        """The quantities that are not validated."""
        return tuple(
            comparison
            for comparison in self.comparisons
            if comparison.verdict is not ValidationVerdict.VALIDATED
        )


def validate(framework: FrameworkResult, monte_carlo: MonteCarloResult, *, digits: int = 2) -> Validation:
    """Compare both results of the same outputs; tolerances from ``digits`` digits of the Monte Carlo values.

    Run the Monte Carlo with ``tighten=5``. Raises DataError where outputs, units or p differ.
    """
    if framework.names != monte_carlo.names or framework.units != monte_carlo.units:
        raise DataError(
            f"both results must have the same outputs and units, but one has {', '.join(framework.names)} "
            f"and the other {', '.join(monte_carlo.names)}"
        )
    if framework.p != monte_carlo.p:
        raise DataError(f"both results must have the same p, but have {framework.p} and {monte_carlo.p}")
    errors = monte_carlo.standard_errors
    rows: list[Comparison] = []
    for quantity, guf, mcm, error in (
        ("estimate", framework.estimate, monte_carlo.estimate, errors.estimate),
        ("u", framework.u, monte_carlo.u, errors.u),
    ):
        rows += [
            Comparison(
                quantity,
                name,
                unit,
                float(guf[j]),
                float(mcm[j]),
                _tolerance(float(monte_carlo.u[j]), digits),
                2.0 * float(error[j]),
            )
            for j, (name, unit) in enumerate(zip(framework.names, framework.units, strict=True))
        ]
    for quantity, first, second, deviation in (
        ("lambda_max", framework.lambda_max, monte_carlo.lambda_max, errors.lambda_max),
        ("k_p", framework.k_p, monte_carlo.k_p, max(errors.k_p, monte_carlo.k_p_error)),
        ("k_q", framework.k_q, monte_carlo.k_q, max(errors.k_q, monte_carlo.k_q_error)),
    ):
        tolerance = _tolerance(second, digits)
        rows.append(Comparison(quantity, "", "", first, second, tolerance, 2.0 * deviation))
    return Validation(tuple(rows), digits, monte_carlo.trials)


def _tolerance(value: float, digits: int) -> float:
    return numerical_tolerance(value, digits) if value > 0.0 and np.isfinite(value) else 0.0
