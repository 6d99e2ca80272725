"""Uncertainty of one run's geometric errors after JCGM 102:2011: GUM framework, Monte Carlo, validation.

The inputs are the readings and the calibrated quantities: for touched balls those of the linear axes at every probing
and the length of the bar, else what every row states (``inputs``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from monitor.discovery import Fit, robust_fit
from monitor.discovery.machine.model_uncertainty import model_uncertainty
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.effects.catalogue import catalogue
from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.methods.chain.results import refusals
from monitor.records import Array, Campaign
from monitor.reporting.certificate.grounds import Ground
from monitor.reporting.certificate.model_effect import Outside
from monitor.reporting.covariance_source import CovarianceSource, TakenAsKnown
from monitor.reporting.messages import none_determined
from monitor.store import Database, StoredModel
from monitor.uncertainty import (
    FrameworkResult,
    Inputs,
    MonteCarloOptions,
    MonteCarloResult,
    OutputContribution,
    Validation,
    adaptive_monte_carlo,
    gum_framework,
    joined,
    validate,
)
from monitor.uncertainty.monte_carlo.sourced_trials import Moves
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.runs.row_run import measured_run
from monitor.uncertainty.runs.sensitivity import sensitivity_of
from monitor.units import Unit
from monitor.workflow.campaign_parts import runs_before
from monitor.workflow.copied_readings import copied_readings
from monitor.workflow.identify.fitting import explained_refusals, machine_fit, machine_problem
from monitor.workflow.measured import machine_campaign
from monitor.workflow.models import resolve_for
from monitor.workflow.selections.readings import SelectedReadings, selected_readings
from monitor.workflow.uncertainty.answer import UncertaintyAnswer
from monitor.workflow.uncertainty.beside import Linearised, beside_readings
from monitor.workflow.uncertainty.file_grounds import late_grounds, nominal_grounds
from monitor.workflow.uncertainty.grounds import grounds_of
from monitor.workflow.uncertainty.inputs import (
    calibrated_inputs,
    reading_inputs,
    with_linear_axes,
)
from monitor.workflow.uncertainty.lack_in_budget import lack_in_budget
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.result import Behind, RunUncertainty
from monitor.workflow.uncertainty.spreading import trials_of
from monitor.workflow.uncertainty.stating import answer_of
from monitor.workflow.uncertainty.stored import LACK_OF_FIT, save_uncertainty
from monitor.workflow.uncertainty.with_effects import EffectOutputs, effect_outputs, why_outside

# A validation compares within a numerical tolerance, so the Monte Carlo result has to be steadier than that. JCGM 101
# 8.2 recommends a fifth; two fifths need a sixth of the trials, and `validate` says "undecided" where that shows.
VALIDATION_TIGHTENING = 2.5
# A covariance of 4 000 readings takes 128 MB and some copies; 10 000 trials of 1 000 readings some ten minutes.
MOST_READINGS, MOST_READINGS_MCM = 4000, 1200


@dataclass(frozen=True)
class _Propagated:
    """What is propagated: a run, its inputs, where it is linearised, and the m outputs ``names`` with their ``units``.

    Those ``of_run`` are parameters of the run, the others effects of the model, which all runs determine. ``rows``
    (m, N) are their sensitivity, ``estimate`` (m,) is in internal units. ``readings`` are the inputs without the
    errors of the linear axes and without sources, which for the budget are ``contributions`` to the outputs, as lack of
    fit is.
    ``sampled`` are those that a Monte Carlo draws besides, by ``moves``.
    """

    run: MeasuredRun
    names: tuple[str, ...]
    of_run: tuple[str, ...]
    units: tuple[Unit, ...]
    rows: Array
    estimate: Array
    readings: Inputs
    inputs: Inputs
    contributions: tuple[OutputContribution, ...]
    source: CovarianceSource
    behind: Behind
    moves: Moves
    sampled: tuple[OutputContribution, ...]

    @property
    def unit_names(self) -> tuple[str, ...]:
        """The units' names (m)."""
        return tuple(unit.name for unit in self.units)

    @property
    def without_effects(self) -> _Propagated:
        """The parameters of the run alone, with what is not known of the effects in them."""
        count = len(self.of_run)

        def alone(parts: tuple[OutputContribution, ...]) -> tuple[OutputContribution, ...]:
            return tuple(replace(part, covariance=part.covariance[:count, :count]) for part in parts)

        return replace(
            self,
            names=self.of_run,
            units=self.units[:count],
            rows=self.rows[:count],
            estimate=self.estimate[:count],
            contributions=alone(self.contributions),
            sampled=alone(self.sampled),
            moves=self.moves.of_first(count),
        )

    def framework(self, p: float) -> FrameworkResult:
        """The result of the GUM framework."""
        return gum_framework(
            self.readings, self.rows, self.estimate, self.names, self.unit_names, p=p,
            contributions=self.contributions,
        )  # fmt: skip


def evaluate(db: Database, request: UncertaintyRequest) -> RunUncertainty:
    """Evaluate the uncertainty of one run. Raises InputError, DataError, NotFoundError."""
    campaign = machine_campaign(db, request.campaign, "uncertainty", lambda method: method.uncertainty)
    return evaluate_campaign(db, campaign, request)


def evaluate_campaign(db: Database, whole: Campaign, request: UncertaintyRequest) -> RunUncertainty:
    """As ``evaluate``, of a campaign that is loaded."""
    campaign = runs_before(whole, request.before)
    model = resolve_for(db, request.model, campaign.method, campaign.machine.id)
    with explained_refusals(campaign, model):
        problem = machine_problem(campaign, model)
    of_run = problem.context.run == (problem.runs[-1] if request.run is None else request.run)
    # Before the fit, which takes minutes and memory where the rows are so many: a number is a reading or more.
    _refuse_too_many(int(np.isfinite(problem.sigma[of_run]).sum()), request.method)
    fitted = machine_fit(campaign, model, problem)
    selected = None
    if request.select is not None:
        selected = selected_readings(db, request.select, campaign.name, model, fitted.problem)
    return evaluate_fit(campaign, model, fitted, request, selected)


def evaluate_fit(
    campaign: Campaign,
    model: StoredModel,
    fit: Fit,
    request: UncertaintyRequest,
    selected: SelectedReadings | None = None,
) -> RunUncertainty:
    """As ``evaluate``, of a campaign with a model fitted to it: nothing is read from the database."""
    number = int(fit.problem.runs[-1]) if request.run is None else request.run
    fixed, coefficients = fit.problem.beside_others(fit.solution, number).resolved(fit.solution.common)
    run = measured_run(fixed, number, coefficients)
    _refuse_too_many(len(run.reading_names), request.method)
    index = int(np.flatnonzero(fit.problem.runs == number)[0])
    propagated, causes = _propagated(campaign, fit, run, index, request, selected)
    framework = propagated.framework(request.p)
    outside = why_outside(fit, linear_axes=request.linear_axes is not None)
    if propagated.names != propagated.of_run and not np.isfinite(framework.k_p):
        # With the effects there are more dimensions than so few runs bound; without them there may be an ellipsoid.
        alone = propagated.without_effects
        of_run = alone.framework(request.p)
        if np.isfinite(of_run.k_p):
            propagated, framework, outside = alone, of_run, Outside.FEW_RUNS
    sampled = None if request.method == "guf" else _sampled(propagated, request)
    validation = _validated(propagated, sampled, request) if sampled and request.method == "both" else None
    advice = campaign_method(campaign).advice
    return RunUncertainty(
        campaign=campaign,
        model=model,
        fit=fit,
        run=number,
        asked=request.asked,
        framework=framework,
        units=propagated.units,
        refused=refusals(fit.problem, fit.solution.null_space[index], number, advice),
        covariance_source=propagated.source,
        monte_carlo=sampled,
        validation=validation,
        causes=causes,
        behind=propagated.behind,
        effects=propagated.names[len(propagated.of_run) :],
        effects_outside=outside,
    )


def _propagated(
    campaign: Campaign,
    fit: Fit,
    run: MeasuredRun,
    index: int,
    request: UncertaintyRequest,
    selected: SelectedReadings | None,
) -> tuple[_Propagated, tuple[tuple[str, float], ...]]:
    """What is propagated for the run at ``index`` of the fit, and the effects that lack of fit may come from."""
    asked = request.asked
    readings, source = reading_inputs(fit, campaign, run, selected, asked.holds_for)
    calibrated = calibrated_inputs(run)
    inputs = joined(readings, calibrated) if calibrated is not None else readings
    at = sensitivity_of(run, start=fit.solution.local[index])
    names = tuple(name for name in fit.problem.base_names if at.determined[at.names.index(name)])
    if not names:
        raise DataError(none_determined(fit.problem.base_names))
    units = _units(fit, names)
    places = [fit.problem.base_names.index(name) for name in names]
    outside = why_outside(fit, linear_axes=request.linear_axes is not None)
    effects = effect_outputs(fit, index, places) if outside is None else None
    linearised = Linearised(run, at, index, names, units, effects)
    added = beside_readings(campaign, fit, linearised, readings, source, asked, selected)
    estimate = at.unknowns[at.places(names)]
    propagated = _Propagated(
        run=run,
        names=names if effects is None else (*names, *effects.names),
        of_run=names,
        units=units if effects is None else (*units, *effects.units),
        rows=linearised.rows,
        estimate=estimate if effects is None else np.concatenate([estimate, effects.estimate]),
        readings=inputs,
        inputs=inputs,
        contributions=added.lines,
        source=source,
        behind=added.behind,
        moves=added.moves,
        sampled=added.sampled,
    )
    causes: tuple[tuple[str, float], ...] = ()
    if request.model_uncertainty:
        line, causes = _lack_of_fit(campaign, fit, index, names, effects, _covered(readings, run, source))
        further = () if line is None else (line,)
        propagated = replace(propagated, contributions=(*propagated.contributions, *further))
    if request.linear_axes is not None:
        inputs, of_axes = with_linear_axes(run, inputs, at, names, request.linear_axes)
        propagated = replace(propagated, inputs=inputs, contributions=(*of_axes, *propagated.contributions))
    source = replace(
        source,
        linear_axes=request.linear_axes is not None,
        taken_as_known=_taken_as_known(campaign, added.axes_covered or request.linear_axes is not None),
    )
    return replace(propagated, source=source), causes


def _taken_as_known(campaign: Campaign, axes_covered: bool) -> tuple[TakenAsKnown, ...]:
    """What the method takes as known, less the linear axes where their errors are stated."""
    assumed = [TakenAsKnown(name) for name in campaign_method(campaign).taken_as_known]
    return tuple(name for name in assumed if not (axes_covered and name is TakenAsKnown.LINEAR_AXES))


def _lack_of_fit(
    campaign: Campaign,
    fit: Fit,
    index: int,
    names: tuple[str, ...],
    shared: EffectOutputs | None,
    covered: float,
) -> tuple[OutputContribution | None, tuple[tuple[str, float], ...]]:
    """What lack of fit leaves over repeatability, as a covariance of the outputs, and its most probable causes."""
    problem = fit.problem
    pitches = {name: axis.scale_pitch for name, axis in campaign.machine.axes.items() if axis.scale_pitch}
    in_model = [effect.text for effect in (*problem.base, *problem.added)]
    # Only what depends on the time within a run, not on its day, can be the same in every run.
    effects = catalogue(problem.context.chain, in_model, ("run_time",), pitches)
    shown = filter(problem.can_show, effects)
    unexplained = model_uncertainty(
        fit, index, [variant for effect in shown for variant in variants_of(effect)], covered
    )
    if unexplained is None:
        return None, ()
    outputs = [problem.base_names.index(name) for name in names]
    covariance = unexplained.covariance
    if shared is not None:
        outputs += [len(problem.local_names) + int(column) for column in shared.columns]
        scale = np.concatenate([np.ones(len(problem.local_names)), shared.by_logarithm])
        covariance = covariance * np.outer(scale, scale)
    covariance = covariance[np.ix_(outputs, outputs)]
    return OutputContribution(LACK_OF_FIT, covariance, dof=unexplained.dof), unexplained.effects


def _covered(readings: Inputs, run: MeasuredRun, source: CovarianceSource) -> float:
    """The mean variance of a reading over the stated one, where all that residuals show is taken for noise that follows
    itself; else 0."""
    if source.neighbours is None:
        return 0.0
    return float(np.mean(np.diag(readings.covariance) / run.stated**2))


def _refuse_too_many(readings: int, method: str) -> None:
    """DataError where a run has so many readings that the evaluation would take hours or more memory than there is."""
    if readings > MOST_READINGS:
        raise DataError(
            f"a run of {readings} readings has a covariance of {readings} rows, which is not built here (up to "
            f"{MOST_READINGS}); `monitor identify` gives the standard uncertainties from the stated one, to first order"
        )
    if method != "guf" and readings > MOST_READINGS_MCM:
        raise DataError(
            f"a Monte Carlo of {readings} readings would take hours (up to {MOST_READINGS_MCM} are done here); write "
            "--method guf: errors of 1 mrad leave products of 1 µrad, so that first order is as good"
        )


def _units(fit: Fit, names: tuple[str, ...]) -> tuple[Unit, ...]:
    units = fit.problem.base_units
    return tuple(units[name] for name in names)


def _sampled(propagated: _Propagated, request: UncertaintyRequest) -> MonteCarloResult:
    tighten = VALIDATION_TIGHTENING if request.method == "both" else 1.0
    with trials_of(propagated.run, propagated.inputs, propagated.of_run, request, propagated.moves) as (
        trials,
        sampler,
        threads,
    ):
        options = MonteCarloOptions(p=request.p, digits=request.digits, tighten=tighten, workers=threads)
        return adaptive_monte_carlo(trials, sampler, propagated.names, propagated.unit_names, options)


def _validated(propagated: _Propagated, sampled: MonteCarloResult, request: UncertaintyRequest) -> Validation:
    """The framework of a known covariance, which is what a Monte Carlo samples, compared with it."""
    plain = gum_framework(
        propagated.inputs,
        propagated.rows,
        propagated.estimate,
        propagated.names,
        propagated.unit_names,
        p=request.p,
        finite_dof=False,
        contributions=propagated.sampled,
    )
    return validate(plain, sampled, digits=request.digits)


def uncertainty(db: Database, request: UncertaintyRequest) -> UncertaintyAnswer:
    """Evaluate the uncertainty of one run, store the answer and return it. Raises what ``evaluate`` raises.

    With ``request.before`` it is stored as ``partial uncertainty``: it is not the result of the whole campaign.
    """
    result = evaluate(db, request)
    answer = answer_of(result)
    answer = replace(answer, grounds=_grounds(result, answer, request))
    save_uncertainty(db, answer, result.model, request.method, request.before)
    return replace(answer, copied_readings=copied_readings(db, result.campaign))


def _grounds(
    result: RunUncertainty, answer: UncertaintyAnswer, request: UncertaintyRequest
) -> tuple[Ground, ...] | None:
    """Determine what speaks against a certificate; None where runs took no part, or no robust fit stands."""
    if request.before is not None:
        return None
    try:
        robust = robust_fit(result.fit.problem)
        grounds = grounds_of(result.campaign, robust, result.run)
    except DataError:
        return None
    of_file = (*nominal_grounds(result.campaign), *late_grounds(result.campaign, result.model, robust.fit))
    return (*of_file, *grounds, *lack_in_budget(answer))
