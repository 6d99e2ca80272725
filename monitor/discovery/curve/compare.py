"""A curve's model against its rows: how large the residual is, how large it should be, and where it is too large.

Rows with equal inputs are repeats: their scatter is pure error, and lack of fit is tested against it (Draper and
Smith, Applied regression analysis, section 2.1; NIST/SEMATECH e-Handbook 4.6.1.5). Rows at different times whose
scatter resembles that of their neighbours are none: the test rests on independent repeats. Where nothing speaks
against the model, the search for a missing effect has the last word, so that `compare` and `explain` agree.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from monitor.discovery.curve.explain import explain_curve
from monitor.discovery.curve.quality import noise_of
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
from monitor.effects.curve import SEQUENCE
from monitor.methods.curve.fit import CurveFit
from monitor.records import Verdict
from monitor.statistics.noise import Assessed, assess

# A breakdown by an input shows where it fails in so many parts of equal numbers of rows.
PARTS = 5


@dataclass(frozen=True)
class CurveComparison(Comparison):
    """A model against a curve, in the unit of the response; ``noise`` is how neighbouring rows resemble each other
    under the model."""

    fit: CurveFit
    noise: Assessed


def cells_of(fit: CurveFit) -> npt.NDArray[np.int64]:
    """The cell (n,) of every row: the same number for rows that agree in every column that the model uses."""
    inputs = fit.problem.inputs
    used = {effect.column for effect in fit.effects}
    if any(effect.shape == "formula" for effect in fit.effects):
        used |= {name for name in inputs.numbers if name != SEQUENCE}
    cell = np.zeros(inputs.count, dtype=np.int64)
    for name in sorted(used):
        values = inputs.numbers.get(name, inputs.groups.get(name))
        if values is not None:
            level = np.unique(values, return_inverse=True)[1]
            cell = np.unique(cell * (level.max() + 1) + level, return_inverse=True)[1]
    return np.asarray(cell, dtype=np.int64)


def lack_of_fit(fit: CurveFit) -> tuple[LackOfFit | None, float | None]:
    """F of lack of fit over pure error, and the repeatability; None where no row was repeated, or the model has no
    input that could be equal, or the repeats lie at different times and drift between them."""
    weighted = ~fit.problem.left_out
    if not fit.effects or fit.exact or _repeats_drift(fit):
        return None, None
    scatter, lack, repeated = split(fit.residual[weighted, None], cells_of(fit)[weighted])
    if repeated < 1:
        return None, None
    test = lack_of_fit_test(lack, fit.degrees_of_freedom - repeated, scatter, repeated)
    return test, float(np.sqrt(scatter / repeated))


def _repeats_drift(fit: CurveFit) -> bool:
    """Whether the deviations of repeats from their mean resemble those of the rows before them in time."""
    clock, rows = fit.problem.curve.time, fit.problem.order
    if clock is None or any(effect.column == clock for effect in fit.effects):
        return False
    _, cell, count = np.unique(cells_of(fit)[rows], return_inverse=True, return_counts=True)
    residual = fit.residual[rows]
    deviation = residual - (np.bincount(cell, weights=residual) / count)[cell]
    deviation = deviation[count[cell] > 1]
    assessed = assess(deviation, np.ones((len(deviation), 1)))
    return assessed.noticed and assessed.noise.lag_one > 0.0


def _breakdown(fit: CurveFit) -> dict[str, dict[str, Part]]:
    weighted, inputs = ~fit.problem.left_out, fit.problem.inputs
    breakdown: dict[str, dict[str, Part]] = {}
    for name, values in inputs.numbers.items():
        edges = np.unique(np.quantile(values[weighted], np.linspace(0.0, 1.0, PARTS + 1)))
        parts = {}
        for number, (low, high) in enumerate(pairwise(edges)):
            last = number == len(edges) - 2
            inside = weighted & (values >= low) & ((values <= high) if last else (values < high))
            if inside.any():
                parts[f"{low:.6g} to {high:.6g}"] = part_of(fit.residual[inside])
        if len(parts) > 1:
            breakdown[name] = parts
    for name, labels in inputs.groups.items():
        breakdown[name] = {
            str(label): part_of(fit.residual[weighted & (labels == label)])
            for label in dict.fromkeys(labels[weighted].tolist())
        }
    return breakdown


def compare_curve(fit: CurveFit, *, rate: float = 0.01, lacks: bool | None = None) -> CurveComparison:
    """Compare a fitted model with its curve; ``lacks`` says whether a search has found a missing effect already."""
    problem, rows = fit.problem, fit.problem.order
    test, repeatability = lack_of_fit(fit)
    stated = problem.curve.standard_uncertainty
    expected = excess = None
    if stated is not None:
        expected = stated * float(np.sqrt(fit.degrees_of_freedom / len(rows)))
        excess = excess_p_value(fit.sum_of_squares / stated**2, fit.degrees_of_freedom)
    verdict = Verdict.SOMETHING_IS_MISSING if lacks else verdict_of(test, fit.deviation, stated, excess)
    if lacks is None and verdict is Verdict.EXPLAINED and explain_curve(problem, rate=rate).missing:
        verdict = Verdict.SOMETHING_IS_MISSING
    return CurveComparison(
        rms=fit.rms,
        expected_rms=expected,
        repeatability=repeatability,
        residual_deviation=fit.deviation,
        stated_uncertainty=stated,
        lack_of_fit=test,
        excess_p_value=excess,
        verdict=verdict,
        by=_breakdown(fit),
        fit=fit,
        noise=noise_of(fit),
    )
