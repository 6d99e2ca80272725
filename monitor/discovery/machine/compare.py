"""Model against measurement: how large the residual is, how large it should be, and where it is too large.

Two yardsticks, because each is blind to something. Repeatability, the scatter of the same probing's residual
over the runs, does not see what varies from run to run as an error; the probe's stated standard uncertainty
does, but is only as good as the statement. Lack of fit is tested against the first (Draper and Smith, Applied
regression analysis, section 2.1: F of lack of fit over pure error), the total against the second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.noise.plan_cells import plan_cells, readings_a_visit, revisited_cells
from monitor.discovery.search.comparison import (
    Comparison,
    LackOfFit,
    Part,
    excess_p_value,
    lack_of_fit_test,
    part_of,
    split,
    verdict_of,
)
from monitor.records import Array

# Poses beyond this number are too many indexations to be read one by one.
MOST_INDEXATIONS = 200


@dataclass(frozen=True)
class ChainComparison(Comparison):
    """A model against a campaign; lengths in mm.

    ``rms`` is that of all coordinates of the residual ``vectors`` (n, d); ``left_out`` (n,) marks rows without weight.
    """

    expected_rms: float
    stated_uncertainty: float
    excess_p_value: float
    campaign: str
    model: str
    vectors: Array
    left_out: npt.NDArray[np.bool_]


def pure_error(fit: Fit) -> tuple[float, float, float]:
    """Sum of squares and degrees of freedom of the whitened residual over the runs, and the lack-of-fit sum.

    In a single run the readings of poses to which it came back are compared: the fit is the same at each, so that no
    degree of freedom of theirs is lost.
    """
    weighted, read = ~fit.left_out, fit.has_weight
    white = fit.vectors[weighted] / fit.problem.sigma[weighted]
    if len(fit.problem.runs) == 1:
        error, lack, repeated = split(white, revisited_cells(fit.problem)[weighted], read[weighted])
        return error, float(repeated), lack
    error, lack, repeated = split(white, plan_cells(fit.problem)[weighted], read[weighted])
    # The runs' own unknowns take their part of the scatter in proportion to the numbers.
    return error, repeated / fit.readings * fit.degrees_of_freedom, lack


def lack_of_fit(fit: Fit) -> tuple[LackOfFit | None, float | None]:
    """The test of lack of fit and the repeatability in mm; None where no probing was repeated."""
    error, freedom, lack = pure_error(fit)
    together = readings_a_visit(fit.problem) if len(fit.problem.runs) == 1 else 1.0
    test = lack_of_fit_test(lack, fit.degrees_of_freedom - freedom, error, freedom, together)
    return test, None if test is None else fit.sigma * float(np.sqrt(error / freedom))


def _breakdown(fit: Fit) -> dict[str, dict[str, Part]]:
    context, weighted = fit.problem.context, ~fit.left_out
    vectors = fit.vectors

    def by(labels: npt.NDArray[np.str_]) -> dict[str, Part]:
        # In the order in which they first occur.
        names = dict.fromkeys(str(label) for label in labels[weighted])
        return {name: part_of(vectors[weighted & (labels == name)]) for name in names}

    turning = [index for index, joint in enumerate(context.chain.joints) if joint.turns]
    signs = np.array([context.chain.joints[index].sign for index in turning])
    degrees = np.round(np.rad2deg(context.positions[:, turning] * signs), 4) + 0.0
    names = [context.chain.joints[index].name for index in turning]
    angles = np.array(
        [" ".join(f"{name}={value:g}" for name, value in zip(names, row, strict=True)) for row in degrees]
    )
    halves = np.where(context.run_time < 0.5, "first half", "second half")
    breakdown = {
        "target": by(context.target),
        "axis": {
            name: part_of(vectors[weighted][:, [axis]]) for axis, name in enumerate(fit.problem.components)
        },
        "run": by(context.run.astype(str)),
        "time_in_run": by(halves),
    }
    if turning and len(np.unique(angles)) <= MOST_INDEXATIONS:
        breakdown["indexation"] = by(angles)
    return breakdown


def compare(fit: Fit, campaign: str, model: str) -> ChainComparison:
    """Compare a fitted model with its campaign."""
    test, repeatability = lack_of_fit(fit)
    excess = excess_p_value(fit.sum_of_squares, fit.degrees_of_freedom)
    return ChainComparison(
        rms=fit.rms,
        expected_rms=fit.sigma * float(np.sqrt(fit.degrees_of_freedom / fit.readings)),
        repeatability=repeatability,
        residual_deviation=fit.sigma * fit.scale,
        stated_uncertainty=fit.sigma,
        lack_of_fit=test,
        excess_p_value=excess,
        verdict=verdict_of(test, fit.scale, 1.0, excess),
        by=_breakdown(fit),
        campaign=campaign,
        model=model,
        vectors=fit.vectors,
        left_out=fit.left_out,
    )
