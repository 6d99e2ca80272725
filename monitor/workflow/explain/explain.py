"""Which physical effect a model lacks on a campaign, or what looks wrong in its file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np

from monitor.discovery import (
    Explanation,
    Fit,
    Mistake,
    RobustFit,
    compare as compare_fit,
    explain as search,
    find_late_rows,
    find_late_rows_without_fit,
    find_mistakes,
    find_other_names,
    find_reading_mistakes,
    find_run_mistakes,
    find_setup_mistakes,
    find_still_axes,
    find_turned_passes,
    is_far,
    is_gross,
    robust_fit,
)
from monitor.discovery.curve.explain import explain_curve
from monitor.discovery.machine.mistakes.cures import Maker
from monitor.discovery.machine.shapes.variants import columns_of_pitches
from monitor.documents import to_document
from monitor.exceptions import TooFewReadingsError
from monitor.methods import campaign_method
from monitor.methods.chain.memory import TIMES_OF_FIT, TIMES_OF_SEARCH, within_memory
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.sufficiency import refuse_exact_fits
from monitor.readers.doubts.blank_rows import blank_rows, blank_words
from monitor.readers.doubts.doubts import result_doubts
from monitor.records import Campaign, CurveCampaign, Verdict
from monitor.reporting.machine_finding import doubt_sentence
from monitor.reporting.run_left_out import RunLeftOut, runs_left_out
from monitor.store import Database, StoredModel, save_analysis
from monitor.workflow.campaign_parts import kind_of, method_of, without_runs
from monitor.workflow.copied_readings import copied_readings
from monitor.workflow.explain.alias_ties import with_uneven_positions
from monitor.workflow.explain.compare import Draw
from monitor.workflow.explain.curve_answer import curve_explanation
from monitor.workflow.explain.explain_answer import CurveExplanation, ExplainAnswer, MachineExplanation
from monitor.workflow.explain.machine_answer import is_hopeless, machine_explanation
from monitor.workflow.explain.measurements import with_measurements
from monitor.workflow.explain.nominal_mistakes import pasted
from monitor.workflow.explain.planned_ties import with_plans
from monitor.workflow.explain.request import RATE, ExplainRequest
from monitor.workflow.explain.unit_mistakes import units_mistaken
from monitor.workflow.identify.fitting import curve_problem, explained_refusals, machine_problem
from monitor.workflow.identify.notes import elsewhere_under
from monitor.workflow.instruments.against_others import contradiction_in
from monitor.workflow.instruments.too_well import read_too_well
from monitor.workflow.measured import load_measured
from monitor.workflow.models import as_model, label, resolve_for, subject_of
from monitor.workflow.tool_frames import tool_frames

# Seeds the search for steps, whose null distribution is drawn; stored with the result.
SEED = 20260302


def first_fit(campaign: Campaign, model: StoredModel, times: int = TIMES_OF_FIT) -> RobustFit:
    """The model fitted to a machine's campaign, without its grossly wrong readings.

    Raises DataError where it cannot be fitted, with what looks wrong in the file where that can be said, or where what
    follows takes more memory, ``times`` that of all derivatives, than there is.
    """
    with explained_refusals(campaign, model):
        problem = machine_problem(campaign, model)
        columns = columns_of_pitches(problem.context) if times == TIMES_OF_SEARCH else 0
        with within_memory(problem, times, columns):
            first = robust_fit(problem)
        if not first.gross:
            refuse_exact_fits(problem, first.fit.solution)
    return first


def _of_all_setups(campaign: Campaign, maker: Maker, first: Fit) -> tuple[Mistake, ...]:
    """The mistakes of whole columns, where what is left is more than effects leave."""
    if is_gross(campaign, first):
        return find_mistakes(campaign, maker, first) or find_still_axes(campaign, maker)
    return find_reading_mistakes(campaign, maker, first) if is_far(first) else ()


def _enough(
    campaign: Campaign, maker: Maker, first: Fit, mistakes: tuple[Mistake, ...]
) -> tuple[Mistake, ...]:
    """The mistakes that explain all, asked for where those of single setups do not; these where none does."""
    if any(mistake.enough for mistake in mistakes):
        return mistakes
    # What comes nearest of single setups is nothing beside what explains all.
    mistakes = _of_all_setups(campaign, maker, first) or mistakes
    if any(mistake.enough for mistake in mistakes):
        return mistakes
    # On a circle a sign, or exchanged columns, do the same as the opposite order, and are likelier.
    return find_turned_passes(campaign, maker, first) or mistakes


def explanation_of(
    campaign: Campaign, model: StoredModel, robust: RobustFit, rate: float = RATE
) -> Explanation:
    """Which physical effect a model lacks, or what looks wrong in the file; ``robust`` is its fit to the campaign."""
    first = robust.fit

    def maker(changed: Campaign) -> ChainProblem:
        return machine_problem(changed, model)

    mistakes = pasted(campaign, maker, first)
    if not mistakes:
        mistakes = (*find_other_names(campaign, maker, robust), *units_mistaken(campaign, maker, first))
    if not mistakes:
        mistakes = find_late_rows(campaign, maker, first)
    if not mistakes and is_gross(campaign, first):
        mistakes = find_late_rows_without_fit(campaign, maker)
    if not mistakes:
        mistakes = find_run_mistakes(campaign, maker, first)
    if not mistakes:
        mistakes = find_setup_mistakes(campaign, maker, first)
    mistakes = _enough(campaign, maker, first, mistakes)
    if mistakes:
        comparison = replace(
            compare_fit(first, campaign.name, label(model)), verdict=Verdict.SOMETHING_IS_MISSING
        )
        return Explanation(comparison, (), (), (), (), (), (), first, mistakes)
    rng = np.random.default_rng(SEED)
    with within_memory(first.problem, TIMES_OF_SEARCH, columns_of_pitches(first.problem.context)):
        explanation = search(
            campaign, first.problem, label(model), rate=rate, rng=rng, first=first, gross=robust.points
        )
    if is_hopeless(explanation):
        # The effects of the search leave nearly all of the residual: none of them is an answer.
        return replace(explanation, missing=(), suspect=(), moves=(), steps=())
    return explanation


def explained(
    explanation: Explanation, campaign: Campaign, model: StoredModel, rate: float = RATE
) -> MachineExplanation:
    """An explanation at a ``rate`` as it is said and stored, whoever asked: its ties are asked of the plan first, and
    of the setups that one contradicts all others."""
    beside = None
    if not explanation.mistakes:
        beside = contradiction_in(explanation.final, campaign_method(campaign).instruments)
    comparison = explanation.comparison
    is_explained = comparison.verdict is Verdict.EXPLAINED
    final = explanation.final
    displaced = elsewhere_under(final.problem, final.solution)
    if beside is not None and is_explained:
        # As `compare` judges: the residual of many rows hides what one setup of few says against all others.
        comparison = replace(comparison, verdict=Verdict.SOMETHING_IS_MISSING)
        explanation = replace(explanation, comparison=comparison)
    answer = replace(machine_explanation(explanation), rate=rate)
    answer = with_uneven_positions(answer, explanation.final.problem.context)
    answer = with_plans(answer, explanation.missing, campaign, model)
    answer = _with_blank_rows(with_measurements(answer, campaign, as_model(model)), campaign)
    if not explanation.mistakes:
        too_well = read_too_well(final, campaign_method(campaign).instruments)
        first = () if too_well is None else (doubt_sentence(too_well),)
        doubted = map(doubt_sentence, result_doubts(campaign, tool_frames(campaign)))
        answer = replace(answer, answer=" ".join((*first, answer.answer, *doubted)))
    # Where several may be the wrong one, or none alone, the effects come first.
    if beside is not None and (is_explained or len(beside.suspects) == 1):
        answer = replace(answer, against_others=beside)
    if displaced is not None:
        # That the readings fit with the points there is no machine explained, though no effect is missing.
        unexplained = replace(answer.comparison, verdict=Verdict.SOMETHING_IS_MISSING)
        answer = replace(
            answer,
            comparison=unexplained,
            work_points_elsewhere=displaced,
            answer=f"{displaced} With them there: {answer.answer[0].lower()}{answer.answer[1:]}",
        )
    return answer


def _with_blank_rows(answer: MachineExplanation, campaign: Campaign) -> MachineExplanation:
    """An answer that names the rows of zeros among the readings that were left out."""
    left_out = {(reading.run, reading.sequence) for reading in answer.suspect_data}
    blank = (
        f"{sentence[0].upper()}{sentence[1:]}." for sentence in blank_words(left_out & blank_rows(campaign))
    )
    return replace(answer, answer=" ".join((answer.answer, *blank)))


def explain(db: Database, request: ExplainRequest) -> ExplainAnswer:
    """Search for the effects that a model lacks; the answer is stored, without the names of the figures.

    Raises NotFoundError, DataError where the model cannot be fitted, InputError for a folder that cannot be made.
    """
    measured = load_measured(db, request.campaign)
    model = resolve_for(db, request.model, measured.method, subject_of(measured))
    explanation, draw = (
        _search_curve(measured, model, request.rate)
        if isinstance(measured, CurveCampaign)
        else _search_machine(measured, model, request.rate)
    )
    save_explanation(db, explanation, measured.method, model)
    files = None if request.figures is None else tuple(draw(request.figures))
    return ExplainAnswer(explanation, files, copied_readings(db, measured))


def _search_machine(campaign: Campaign, model: StoredModel, rate: float) -> tuple[MachineExplanation, Draw]:
    left_out: list[RunLeftOut] = []
    first: RobustFit | None = None
    while first is None:
        try:
            # A search that has not the memory is refused before minutes of fitting.
            first = first_fit(campaign, model, TIMES_OF_SEARCH)
        except TooFewReadingsError as refusal:
            if not refusal.by_run:
                raise
            left_out += [
                RunLeftOut(run, readings, refusal.undetermined.get(run))
                for run, readings in refusal.by_run.items()
            ]
            campaign = without_runs(campaign, refusal.by_run)
    explanation = explanation_of(campaign, model, first, rate)
    answer = explained(explanation, campaign, model, rate)
    if left_out:
        sentences = f"{answer.answer} {runs_left_out(left_out)}"
        answer = replace(answer, answer=sentences, runs_left_out=tuple(left_out))

    def draw(folder: Path) -> Sequence[str]:
        # Loaded here: drawing costs a second that an explanation without figures need not wait.
        from monitor.workflow.explain.figures import comparison_figures, explanation_figures

        files = [
            *comparison_figures(explanation.comparison, first.fit, folder),
            *explanation_figures(answer, explanation, folder),
        ]
        # The residual over the workspace belongs to both.
        return list(dict.fromkeys(files))

    return answer, draw


def _search_curve(curve: CurveCampaign, model: StoredModel, rate: float) -> tuple[CurveExplanation, Draw]:
    explanation = explain_curve(curve_problem(curve, model), rate=rate)

    def draw(folder: Path) -> Sequence[str]:
        # Loaded here, as above.
        from monitor.workflow.explain.curve_figures import curve_figures

        return curve_figures(explanation.first, explanation, folder)

    return curve_explanation(explanation, label(model)), draw


def save_explanation(
    db: Database,
    explanation: MachineExplanation | CurveExplanation,
    method: str,
    model: StoredModel,
    before: datetime | None = None,
) -> None:
    """Store an explanation, as ``partial`` where runs from ``before`` on took no part.

    The seed of the search for steps is stored with that of a machine.
    """
    save_analysis(
        db, kind_of("explanation", before), to_document(explanation), method=method_of(method, before),
        campaign=explanation.comparison.campaign, model=model.name, model_version=model.version,
        seed=SEED if isinstance(explanation, MachineExplanation) else None,
    )  # fmt: skip
