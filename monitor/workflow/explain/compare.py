"""Model against measurement: where a model fails on a campaign."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from monitor.discovery import Fit
from monitor.discovery import compare as compare_fit
from monitor.discovery.curve.compare import compare_curve
from monitor.documents import to_document
from monitor.methods.curve.fit import CurveFit
from monitor.store import Database, save_analysis
from monitor.workflow.explain.compare_answer import CompareAnswer
from monitor.workflow.explain.curve_answer import curve_comparison
from monitor.workflow.explain.machine_answer import machine_comparison
from monitor.workflow.explain.request import CompareRequest
from monitor.workflow.identify.fitting import fitted
from monitor.workflow.models import label


def compare_answer(fit: Fit | CurveFit, campaign: str, model: str) -> CompareAnswer:
    """The comparison of a fitted model with its campaign."""
    if isinstance(fit, CurveFit):
        return CompareAnswer(curve_comparison(compare_curve(fit), model))
    return CompareAnswer(machine_comparison(compare_fit(fit, campaign, model)), fit.problem.target_word)


def compare(db: Database, request: CompareRequest) -> CompareAnswer:
    """Compare a model with a campaign; the answer is stored, without the names of the figures.

    Raises NotFoundError, DataError where the readings do not suffice, InputError for a folder that cannot be made.
    """
    fit = fitted(db, request.campaign, request.model)
    answer = compare_answer(fit.fit, request.campaign, label(fit.model))
    save_analysis(
        db, "comparison", to_document(answer), method=fit.campaign.method, campaign=request.campaign,
        model=fit.model.name, model_version=fit.model.version,
    )  # fmt: skip
    if request.figures is None:
        return answer
    return replace(answer, figures=_figures(answer, fit.fit, request.figures))


def _figures(answer: CompareAnswer, fit: Fit | CurveFit, folder: Path) -> tuple[str, ...]:
    # Loaded here: drawing costs a second that a comparison without figures need not wait.
    from monitor.workflow.explain.curve_figures import curve_figures
    from monitor.workflow.explain.figures import comparison_figures

    if isinstance(fit, CurveFit):
        return tuple(curve_figures(fit, None, folder))
    return tuple(comparison_figures(to_document(answer), fit, folder))
