"""Model against measurement: where a model fails on a campaign."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from monitor.discovery import Fit, compare as compare_fit
from monitor.discovery.curve.compare import compare_curve
from monitor.documents import to_document
from monitor.methods import campaign_method
from monitor.methods.curve.fit import CurveFit
from monitor.records import Campaign, CurveCampaign, Verdict
from monitor.store import Database, StoredModel, save_analysis
from monitor.workflow.copied_readings import copied_readings
from monitor.workflow.explain.compare_answer import CompareAnswer
from monitor.workflow.explain.curve_answer import curve_comparison
from monitor.workflow.explain.machine_answer import machine_comparison
from monitor.workflow.explain.request import CompareRequest
from monitor.workflow.figure_files import make_folder
from monitor.workflow.identify.fitting import fitted
from monitor.workflow.identify.mistaken_setups import mistaken_setups
from monitor.workflow.identify.notes import elsewhere_under
from monitor.workflow.instruments.against_others import contradiction_in
from monitor.workflow.instruments.drifting import running_with_time
from monitor.workflow.instruments.instruments import disagreement
from monitor.workflow.models import label

#: Draws the figures of an answer into a folder and returns the names of the files.
Draw = Callable[[Path], Sequence[str]]


def compare(db: Database, request: CompareRequest) -> CompareAnswer:
    """Compare a model with a campaign; the answer is stored, without the names of the figures.

    Raises NotFoundError, DataError where the readings do not suffice, InputError for a folder that cannot be made.
    """
    if request.figures is not None:
        make_folder(request.figures)  # a folder that cannot be made leaves no result behind
    fit = fitted(db, request.campaign, request.model)
    model = label(fit.model)
    if isinstance(fit.fit, CurveFit) or isinstance(fit.campaign, CurveCampaign):
        assert isinstance(fit.fit, CurveFit)
        answer, draw = _compare_curve(fit.fit, model)
    else:
        answer, draw = _compare_machine(fit.fit, fit.campaign, fit.model)
    save_analysis(
        db, "comparison", to_document(answer), method=fit.campaign.method, campaign=request.campaign,
        model=fit.model.name, model_version=fit.model.version,
    )  # fmt: skip
    answer = replace(answer, copied_readings=copied_readings(db, fit.campaign))
    return answer if request.figures is None else replace(answer, figures=tuple(draw(request.figures)))


def _compare_machine(fit: Fit, campaign: Campaign, model: StoredModel) -> tuple[CompareAnswer, Draw]:
    comparison = compare_fit(fit, campaign.name, label(model))
    ability = campaign_method(campaign).instruments

    def draw(folder: Path) -> Sequence[str]:
        # Loaded here: drawing costs a second that a comparison without figures need not wait.
        from monitor.workflow.explain.figures import comparison_figures

        return comparison_figures(comparison, fit, folder)

    apart = disagreement(fit.problem, fit.solution, ability)
    beside = contradiction_in(fit, ability)
    drifting = running_with_time(fit.problem, fit.solution, ability)
    displaced = elsewhere_under(fit.problem, fit.solution)
    if (beside is not None or displaced is not None) and comparison.verdict is Verdict.EXPLAINED:
        # The residual of many rows hides what one setup of few says against all others, and without a unit of length
        # a machine of another size leaves as little.
        comparison = replace(comparison, verdict=Verdict.SOMETHING_IS_MISSING)
    mistakes = mistaken_setups(campaign, model, fit.problem, fit.solution)
    answer = CompareAnswer(
        machine_comparison(comparison, fit.problem), apart, beside, mistakes or None, drifting or None,
        fit.problem.target_word, displaced,
    )  # fmt: skip
    return answer, draw


def _compare_curve(fit: CurveFit, model: str) -> tuple[CompareAnswer, Draw]:
    def draw(folder: Path) -> Sequence[str]:
        # Loaded here, as above.
        from monitor.workflow.explain.curve_figures import curve_figures

        return curve_figures(fit, None, folder)

    return CompareAnswer(curve_comparison(compare_curve(fit), model)), draw
