"""Comparison and explanation of a curve in the unit of its response, and in micrometres where that is a length."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.discovery.curve.compare import CurveComparison as Comparison, compare_curve
from monitor.discovery.curve.explain import CurveExplanation as Explanation
from monitor.discovery.curve.missing import CurveMissing as Missing
from monitor.discovery.curve.quality import bic
from monitor.discovery.search.comparison import Part
from monitor.methods.curve.problem import problem_of
from monitor.records import CurveCampaign, Verdict
from monitor.reporting.curve_finding import (
    CurveFinding,
    Exchanged,
    LikelyEffect,
    NeighbourNoise,
    curve_sentences,
)
from monitor.workflow.explain.compare_answer import CurveComparison, CurvePart
from monitor.workflow.explain.explain_answer import BadRow, CurveExplanation, CurveMissing
from monitor.workflow.explain.shared_answer import (
    coefficients,
    coinciding,
    lack_of_fit_test,
    rivals,
    searched_value,
)
from monitor.workflow.identify.curve import curve_noise, in_micrometres, response_unit

#: So many rows on average at each value of a column make it look set rather than read.
ROWS_A_SETTING = 4


def _part(curve: CurveCampaign, part: Part) -> CurvePart:
    return CurvePart(
        in_micrometres(curve, part.rms),
        part.rms,
        in_micrometres(curve, part.largest),
        part.largest,
        part.count,
    )


def curve_comparison(comparison: Comparison, model: str) -> CurveComparison:
    """The comparison of a curve with the model of that name."""
    fit = comparison.fit
    curve = fit.problem.curve
    largest = float(np.abs(fit.residual).max())
    return CurveComparison(
        campaign=curve.name,
        model=model,
        method=curve.method,
        base=curve.base,
        response=curve.response,
        unit=response_unit(curve),
        rows=len(curve),
        rms_um=in_micrometres(curve, fit.rms),
        rms=fit.rms,
        largest_um=in_micrometres(curve, largest),
        largest=largest,
        repeatability_um=in_micrometres(curve, comparison.repeatability),
        repeatability=comparison.repeatability,
        expected_rms_um=in_micrometres(curve, comparison.expected_rms),
        expected_rms=comparison.expected_rms,
        residual_deviation_um=in_micrometres(curve, fit.deviation),
        residual_deviation=fit.deviation,
        stated_uncertainty_um=in_micrometres(curve, curve.standard_uncertainty),
        stated_uncertainty=curve.standard_uncertainty,
        degrees_of_freedom=fit.degrees_of_freedom,
        bic=bic(fit),
        lack_of_fit=lack_of_fit_test(comparison.lack_of_fit),
        excess_over_statement_p=comparison.excess_p_value,
        autocorrelation=curve_noise(comparison.noise, fit),
        verdict=comparison.verdict,
        by={
            column: {name: _part(curve, part) for name, part in parts.items()}
            for column, parts in comparison.by.items()
        },
    )


def _curve_missing(curve: CurveCampaign, effect: Missing) -> CurveMissing:
    return CurveMissing(
        rank=effect.rank,
        effect=effect.effect,
        certain=effect.certain,
        noise_alone_p=effect.noise_alone,
        description=effect.description,
        amplitude=effect.amplitude,
        u=effect.u,
        unit=effect.units[0].name,
        coefficients=coefficients(effect),
        peak_um=in_micrometres(curve, effect.peak),
        peak=effect.peak,
        p_value=effect.p_value,
        q_value=effect.q_value,
        rms_before_um=in_micrometres(curve, effect.rms_before),
        rms_before=effect.rms_before,
        rms_after_um=in_micrometres(curve, effect.rms_after),
        rms_after=effect.rms_after,
        heldout_before_um=in_micrometres(curve, effect.held_out_before),
        heldout_before=effect.held_out_before,
        heldout_after_um=in_micrometres(curve, effect.held_out_after),
        heldout_after=effect.held_out_after,
        bic_before=effect.bic_before,
        bic_after=effect.bic_after,
        indistinguishable_from=rivals(effect),
        coinciding=coinciding(effect),
        tell_apart_by=(),
        varies_from_run_to_run=False,
        searched=searched_value(effect),
    )


def curve_explanation(explanation: Explanation, model: str) -> CurveExplanation:
    """The explanation of a curve: what a comparison says, what the model lacks, and the rows that were left out."""
    curve = explanation.first.problem.curve
    comparison = curve_comparison(compare_curve(explanation.first, lacks=bool(explanation.missing)), model)
    if explanation.suspect and not explanation.missing:
        # An outlier is reported as such: the verdict is that of the fit without it.
        verdict = compare_curve(explanation.final, lacks=False).verdict
        comparison = replace(comparison, verdict=verdict)
    missing = tuple(_curve_missing(curve, effect) for effect in explanation.missing)
    suspect_data = tuple(
        BadRow(
            run=1,
            sequence=outlier.row + 1,
            line=int(curve.lines[outlier.row]),
            target=None,
            axis=curve.response,
            value=float(curve.measured[outlier.row]),
            size_um=in_micrometres(curve, outlier.size),
            size=outlier.size,
            p_value=outlier.p_value,
        )
        for outlier in explanation.suspect
    )
    noise = curve_noise(explanation.noise, explanation.final)
    return CurveExplanation(
        comparison=comparison,
        missing=missing,
        suspect_data=suspect_data,
        blind_spots=tuple(explanation.blind),
        not_recorded=dict(explanation.refused),
        autocorrelation_after=noise,
        answer=curve_sentences(
            CurveFinding(
                response=comparison.response,
                explained=comparison.verdict is not Verdict.SOMETHING_IS_MISSING,
                exact=(explanation.final if missing else explanation.first).exact,
                missing=[
                    LikelyEffect(
                        effect.effect,
                        effect.description.meaning,
                        effect.certain,
                        effect.noise_alone_p,
                        effect.indistinguishable_from,
                    )
                    for effect in missing
                ],
                exchanged=_exchanged(explanation.first.problem.curve),
                noise=NeighbourNoise(noise.lag_one, noise.slow, noise.rows, noise.effective_rows)
                if noise.noticed
                else None,
                outliers=[row.sequence for row in suspect_data],
            )
        ),
    )


def _exchanged(curve: CurveCampaign) -> Exchanged | None:
    """Whether the response looks like what was set and an input of the base like what was read."""
    values = len(np.unique(curve.measured))
    if values * ROWS_A_SETTING > len(curve):
        return None
    for effect in problem_of(curve).base:
        levels = len(np.unique(curve.columns[effect.column])) if effect.column in curve.columns else 0
        if effect.column != curve.time and 2 * levels > len(curve):
            return Exchanged(values, effect.column, levels)
    return None
