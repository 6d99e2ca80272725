"""Uncertainty of one run's geometric errors after JCGM 102:2011: GUM framework, Monte Carlo, validation.

The inputs are the readings and the calibrated quantities: for touched balls those of the linear axes at every probing
and the length of the bar, else what every row tells (``uncertainty_inputs``).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import numpy as np

from monitor.discovery import Fit, fit
from monitor.discovery.machine.model_uncertainty import model_uncertainty as model_uncertainty_of
from monitor.discovery.machine.variants import variants_of
from monitor.effects.catalogue import catalogue
from monitor.exceptions import DataError, InputError
from monitor.methods import campaign_method
from monitor.methods.chain.identification import Refusal
from monitor.methods.chain.results import refusals
from monitor.records import Array, Campaign, LinearAxes
from monitor.store import Database, StoredModel, load_campaign
from monitor.uncertainty import (
    FrameworkResult,
    Inputs,
    MonteCarloResult,
    OutputContribution,
    Validation,
    adaptive_monte_carlo,
    gum_framework,
    joined,
    validate,
)
from monitor.uncertainty.row_problem import run_problem
from monitor.uncertainty.sensitivity import Sensitivity, sensitivity_of
from monitor.units import Unit
from monitor.workflow.campaign_parts import runs_before
from monitor.workflow.models import as_model, resolve
from monitor.workflow.selections import selected_readings
from monitor.workflow.uncertainty.documents import document, save_uncertainty
from monitor.workflow.uncertainty.evaluations import COVERAGE, LACK_OF_FIT, wished
from monitor.workflow.uncertainty.inputs import (
    SelectedReadings,
    calibrated_inputs,
    left_out,
    reading_inputs,
    with_linear_axes,
)
from monitor.workflow.uncertainty.spreading import trials_of

Document = dict[str, Any]

# A validation compares within a numerical tolerance, so the Monte Carlo result has to be steadier than that. JCGM 101
# 8.2 recommends a fifth; two fifths need a sixth of the trials, and `validate` says "undecided" where that shows.
VALIDATION_TIGHTENING = 2.5


@dataclass(frozen=True)
class Evaluated:
    """What was evaluated for one run; ``units`` are the display units of ``framework.names``.

    ``causes`` are the effects that lack of fit may come from, with their probabilities; ``asked`` is what was
    asked for (``evaluations.wished``).
    """

    campaign: Campaign
    model: StoredModel
    fit: Fit
    run: int
    framework: FrameworkResult
    units: tuple[Unit, ...]
    refused: tuple[Refusal, ...]
    input_covariance: str
    monte_carlo: MonteCarloResult | None
    validation: Validation | None
    causes: tuple[tuple[str, float], ...] = ()
    asked: Document = field(default_factory=dict)


# A covariance of 4 000 readings takes 128 MB and some copies; 10 000 trials of 1 000 readings some ten minutes.
MOST_READINGS, MOST_READINGS_MCM = 4000, 1200


def _lack_of_fit(
    found: Fit, place: int, outputs: Array, pitches: dict[str, float]
) -> tuple[OutputContribution | None, tuple[tuple[str, float], ...]]:
    """What lack of fit leaves over repeatability, as a covariance of the outputs, and its most probable causes."""
    chain, known = found.problem.context.chain, [effect.text for effect in found.problem.base]
    known += [effect.text for effect in found.problem.added]
    # Only what depends on the time within a run, not on its day, can be the same in every run.
    effects = catalogue(chain, known, ("run_time",), pitches)
    left = model_uncertainty_of(found, place, [one for effect in effects for one in variants_of(effect)])
    if left is None:
        return None, ()
    covariance = left.covariance[np.ix_(outputs, outputs)]
    return OutputContribution(LACK_OF_FIT, covariance, dof=left.dof), left.effects


def evaluate(
    db: Database,
    campaign: str,
    run: int | None = None,
    *,
    model: str | None = None,
    method: str = "both",
    digits: int = 2,
    seed: int = 1,
    p: float = COVERAGE,
    model_uncertainty: bool = True,
    workers: int | None = None,
    cluster: str | None = None,
    select: str | None = None,
    before: datetime | None = None,
    linear_axes: LinearAxes | None = None,
) -> Evaluated:
    """Evaluate the uncertainty of one run (the last by default). Raises InputError, DataError, NotFoundError.

    ``select`` names a stored selection, or a campaign of the same plan: its runs give the covariance of the readings.
    ``linear_axes`` adds what errors of the linear axes do, for a method that takes those axes as known.
    Runs that began at or after ``before`` (local time without a zone) take no part.
    The trials go to ``workers`` processes or the Dask scheduler at the address ``cluster``, else to threads.
    """
    _check(method, digits, seed, p)
    loaded = runs_before(load_campaign(db, campaign), before)
    stored = resolve(db, model, loaded.method)
    found = fit(campaign_method(loaded).problem_of(loaded, as_model(stored)))
    chosen = None
    if select is not None:
        chosen = SelectedReadings(select, *selected_readings(db, select, loaded.name, stored, found.problem))
    return evaluate_fit(
        loaded, stored, found, run, method=method, digits=digits, seed=seed, p=p,
        model_uncertainty=model_uncertainty, workers=workers, cluster=cluster, chosen=chosen,
        linear_axes=linear_axes,
    )  # fmt: skip


def evaluate_fit(
    loaded: Campaign,
    stored: StoredModel,
    found: Fit,
    run: int | None = None,
    *,
    method: str = "both",
    digits: int = 2,
    seed: int = 1,
    p: float = COVERAGE,
    model_uncertainty: bool = True,
    workers: int | None = None,
    cluster: str | None = None,
    chosen: SelectedReadings | None = None,
    linear_axes: LinearAxes | None = None,
) -> Evaluated:
    """As ``evaluate``, of a campaign with a model fitted to it: nothing is read from the database."""
    number = int(found.problem.runs[-1]) if run is None else run
    # The uncertainty of shared effects and time constants is not propagated into a run's own parameters.
    fixed, coefficients = found.problem.resolved(found.solution.common)
    one = run_problem(fixed, number, coefficients)
    _refuse_too_many(len(one.reading_names), method)
    readings, words = reading_inputs(found, loaded, one, chosen)
    calibrated = calibrated_inputs(one)
    inputs = joined(readings, calibrated) if calibrated is not None else readings
    place = int(np.flatnonzero(found.problem.runs == number)[0])
    at = sensitivity_of(one, start=found.solution.local[place])
    names = tuple(name for name in found.problem.base_names if at.determined[at.names.index(name)])
    units = _units(found, names)
    outputs = np.array([found.problem.base_names.index(name) for name in names])
    extra: OutputContribution | None = None
    causes: tuple[tuple[str, float], ...] = ()
    if model_uncertainty:
        extra, causes = _lack_of_fit(
            found,
            place,
            outputs,
            {name: axis.scale_pitch for name, axis in loaded.machine.axes.items() if axis.scale_pitch},
        )
    contributions = [] if extra is None else [extra]
    readings_only = inputs
    if linear_axes is not None:
        inputs, of_axes = with_linear_axes(one, inputs, at, names, linear_axes)
        words += "; and the errors of the linear axes as stated"
        contributions = [*of_axes, *contributions]
    words += left_out(campaign_method(loaded).taken_as_known, linear_axes is not None)
    framework = _framework(at, readings_only, names, units, p, contributions)
    mcm = validation = None
    if method != "guf":
        with trials_of(one, inputs, names, seed, workers, cluster) as (trials, sampler, threads):
            mcm = adaptive_monte_carlo(
                trials,
                sampler,
                names,
                framework.units,
                p=p,
                digits=digits,
                tighten=VALIDATION_TIGHTENING if method == "both" else 1.0,
                workers=threads,
            )
    if mcm is not None and method == "both":
        plain = gum_framework(
            inputs,
            at.rows(names),
            at.unknowns[at.places(names)],
            names,
            framework.units,
            p=p,
            finite_dof=False,
        )
        validation = validate(plain, mcm, digits=digits)
    advice = campaign_method(loaded).advice
    refused = refusals(found.problem, found.solution.null_space[place], number, advice)
    asked = wished(p, None if chosen is None else chosen.name, model_uncertainty, linear_axes)
    return Evaluated(
        loaded, stored, found, number, framework, units, refused, words, mcm, validation, causes, asked
    )


def _check(method: str, digits: int, seed: int, p: float) -> None:
    if method not in ("guf", "mcm", "both"):
        raise InputError(f"--method {method}: choose guf, mcm or both")
    if not 1 <= digits <= 4:
        raise InputError(f"--digits {digits}: choose 1 to 4 significant digits")
    if not 0 <= seed < 2**63:
        raise InputError(f"--seed {seed}: a seed is a whole number from 0 to 9223372036854775807")
    if not 0.0 < p < 1.0:
        raise InputError(f"-p {p}: a coverage probability lies between 0 and 1")


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


def _units(found: Fit, names: tuple[str, ...]) -> tuple[Unit, ...]:
    units = {
        name: effect.unit
        for effect in found.problem.base
        for name in effect.parameters(found.problem.context)
    }
    return tuple(units[name] for name in names)


def _framework(
    at: Sensitivity,
    inputs: Inputs,
    names: tuple[str, ...],
    units: tuple[Unit, ...],
    p: float,
    contributions: list[OutputContribution],
) -> FrameworkResult:
    return gum_framework(
        inputs,
        at.rows(names),
        at.unknowns[at.places(names)],
        names,
        [unit.name for unit in units],
        p=p,
        contributions=contributions,
    )


def uncertainty(db: Database, campaign: str, run: int | None = None, **options: Any) -> Document:
    """Evaluate, store and return the document. ``options`` are those of ``evaluate``.

    With ``before`` it is stored as ``partial uncertainty``: it is not the result of the whole campaign.
    """
    before = options.get("before")
    found = evaluate(db, campaign, run, **options)
    result = document(found)
    save_uncertainty(db, result, found.model, options.get("method", "both"), before)
    return result
