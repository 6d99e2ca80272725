"""Model against measurement: how large the residual is, how large it should be, and where it is too large.

Two yardsticks, because each is blind to something. Repeatability, the scatter of the same probing's residual
over the runs, does not see what varies from run to run as an error; the probe's stated standard uncertainty
does, but is only as good as the statement. Lack of fit is tested against the first (Draper and Smith, Applied
regression analysis, section 2.1: F of lack of fit over pure error), the total against the second.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.anomalies import plan_places
from monitor.discovery.machine.fit import Fit
from monitor.records import Array

# Lack of fit is called below this p-value: one false alarm in a thousand campaigns, so that it adds little to
# the scan's own one in a hundred.
LACK_OF_FIT_LEVEL = 1e-3
# A standard uncertainty from ten observations is itself known to 24 % (JCGM 100:2008, table E.1), and few probes
# were tested with more; what exceeds the statement by less than that is no finding.
STATEMENT_TOLERANCE = 1.25
# Poses beyond this number are no indexations that somebody would read one by one.
MOST_INDEXATIONS = 200
EXPLAINED, SOMETHING_IS_MISSING = "explained", "something is missing"


@dataclass(frozen=True)
class LackOfFit:
    """F of lack of fit over pure error on (``degrees_of_freedom``, ``pure_error_degrees_of_freedom``)."""

    f: float
    p_value: float
    degrees_of_freedom: float
    pure_error_degrees_of_freedom: float


@dataclass(frozen=True)
class Part:
    """Root mean square and largest coordinate of the residual over a part of the probings, in mm."""

    rms: float
    largest: float
    count: int


@dataclass(frozen=True)
class Comparison:
    """A model against a campaign; lengths in mm.

    ``rms`` is that of all coordinates of the residual; ``expected_rms`` what the probe's stated standard
    uncertainty would leave after the fit; ``repeatability`` the standard deviation of a coordinate over the
    runs (None with one run or plans that differ); ``residual_deviation`` the root mean square per degree of
    freedom, comparable with repeatability and with the stated uncertainty. ``by`` breaks the residual down.
    """

    campaign: str
    model: str
    rms: float
    expected_rms: float
    repeatability: float | None
    residual_deviation: float
    stated_uncertainty: float
    lack_of_fit: LackOfFit | None
    excess_p_value: float
    verdict: str
    by: Mapping[str, Mapping[str, Part]]
    vectors: Array
    left_out: npt.NDArray[np.bool_]


def split(residual: Array, places: npt.NDArray[np.int64]) -> tuple[float, float, int]:
    """Sums of squares of residuals (n, d) about the mean of their place and of those means, and how many rows
    (n - places) the first rests on."""
    _, place, count = np.unique(places, return_inverse=True, return_counts=True)
    total = np.stack([np.bincount(place, weights=column) for column in residual.T], axis=1)
    mean = total / count[:, None]
    scatter = float(np.sum((residual - mean[place]) ** 2))
    return scatter, float(np.sum(count[:, None] * mean**2)), len(residual) - len(count)


def pure_error(fit: Fit) -> tuple[float, float, float]:
    """Sum of squares and degrees of freedom of the whitened residual over the runs, and the lack-of-fit sum."""
    kept = ~fit.left_out
    white = fit.vectors[kept] / fit.problem.sigma[kept]
    error, lack, repeated = split(white, plan_places(fit)[kept])
    # The runs' own unknowns take their part of the scatter in proportion to the rows.
    return error, repeated / len(white) * fit.degrees_of_freedom, lack


def lack_of_fit(fit: Fit) -> tuple[LackOfFit | None, float | None]:
    """The test of lack of fit and the repeatability in mm; None where no probing was repeated."""
    error, freedom, lack = pure_error(fit)
    own = fit.degrees_of_freedom - freedom
    if freedom < 1 or own < 1 or error <= 0:
        return None, None
    f = (lack / own) / (error / freedom)
    test = LackOfFit(float(f), float(scipy.special.fdtrc(own, freedom, f)), float(own), float(freedom))
    return test, fit.sigma * float(np.sqrt(error / freedom))


def _part(vectors: Array) -> Part:
    return Part(float(np.sqrt(np.mean(vectors**2))), float(np.abs(vectors).max()), len(vectors))


def _breakdown(fit: Fit) -> dict[str, dict[str, Part]]:
    context, kept = fit.problem.context, ~fit.left_out
    vectors = fit.vectors

    def by(labels: npt.NDArray[np.str_]) -> dict[str, Part]:
        # In the order in which they first occur.
        names = dict.fromkeys(str(label) for label in labels[kept])
        return {name: _part(vectors[kept & (labels == name)]) for name in names}

    turning = [place for place, joint in enumerate(context.chain.joints) if joint.turns]
    signs = np.array([context.chain.joints[place].sign for place in turning])
    degrees = np.round(np.rad2deg(context.positions[:, turning] * signs), 4) + 0.0
    names = [context.chain.joints[place].name for place in turning]
    angles = np.array(
        [" ".join(f"{name}={value:g}" for name, value in zip(names, row, strict=True)) for row in degrees]
    )
    halves = np.where(context.run_time < 0.5, "first half", "second half")
    found = {
        "target": by(context.target),
        "axis": {name: _part(vectors[kept][:, [axis]]) for axis, name in enumerate(fit.problem.components)},
        "run": by(context.run.astype(str)),
        "time_in_run": by(halves),
    }
    if turning and len(np.unique(angles)) <= MOST_INDEXATIONS:
        found["indexation"] = by(angles)
    return found


def compare(fit: Fit, campaign: str, model: str) -> Comparison:
    """Compare a fitted model with its campaign."""
    test, repeatability = lack_of_fit(fit)
    excess = float(scipy.special.chdtrc(fit.degrees_of_freedom, fit.sum_of_squares))
    missing = test is not None and test.p_value < LACK_OF_FIT_LEVEL
    too_much = fit.scale > STATEMENT_TOLERANCE and excess < LACK_OF_FIT_LEVEL
    readings = fit.readings
    return Comparison(
        campaign=campaign,
        model=model,
        rms=fit.rms,
        expected_rms=fit.sigma * float(np.sqrt(fit.degrees_of_freedom / readings)),
        repeatability=repeatability,
        residual_deviation=fit.sigma * fit.scale,
        stated_uncertainty=fit.sigma,
        lack_of_fit=test,
        excess_p_value=excess,
        verdict=SOMETHING_IS_MISSING if missing or too_much else EXPLAINED,
        by=_breakdown(fit),
        vectors=fit.vectors,
        left_out=fit.left_out,
    )
