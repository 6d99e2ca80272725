"""Model against measurement, and which physical effect is missing: the documents of `compare` and `explain`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

import numpy as np

from monitor.discovery import (
    ChainComparison,
    ChainMissing,
    Explanation,
    Fit,
    Mistake,
    Verdict,
    explain,
    find_mistakes,
    fit,
    is_gross,
    version_error,
)
from monitor.discovery import compare as compare_fit
from monitor.discovery.machine.steps import Step
from monitor.discovery.search.comparison import Part
from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.shared_effects import shared_parameters
from monitor.records import Campaign
from monitor.store import Database, StoredModel, is_curve, load_campaign, model_history, save_analysis
from monitor.units import DEGREE, MICROMETRE, Unit
from monitor.workflow.campaign_parts import kind_of, method_of, runs_before
from monitor.workflow.explain import curves
from monitor.workflow.explain.residuals_against import picture_documents
from monitor.workflow.models import as_model, label, resolve

Document = dict[str, Any]

# Seeds the search for steps, whose null distribution is drawn; stored with the result.
SEED = 20260302
# The false discovery rate of a search for missing effects.
RATE = 0.01
# Beyond so many stated standard uncertainties after the search nothing of it is an answer.
HOPELESS_TIMES = 100.0
# What is said first where more is left than any effect leaves, and no simple exchange brings it down.
GROSS = (
    "More is left than the effects of a machine leave: look first for exchanged columns or targets, a wrong sign or "
    "unit, or the geometry in campaign.toml; of the simple mistakes that were tried none alone explains it. "
)
ONE_RUN = (
    "with one run nobody can say what varies from run to run, what stepped between runs, or how well a reading "
    "repeats; measure the same plan again"
)


def _um(length: float | None) -> float | None:
    return None if length is None else MICROMETRE.to_display(length)


def fitted(db: Database, campaign: str, model: str | None) -> tuple[Campaign, StoredModel, Fit]:
    """A campaign, the stored model, and the model fitted to it."""
    loaded = load_campaign(db, campaign)
    stored = resolve(db, model, loaded.method)
    return loaded, stored, fit(campaign_method(loaded).problem_of(loaded, as_model(stored)))


def _parts(parts: dict[str, Part]) -> Document:
    return {
        name: {"rms_um": _um(part.rms), "largest_um": _um(part.largest), "n": part.count}
        for name, part in parts.items()
    }


def comparison_document(found: ChainComparison) -> Document:
    """A comparison as people see it."""
    test = found.lack_of_fit
    return {
        "campaign": found.campaign,
        "model": found.model,
        "rms_um": _um(found.rms),
        "largest_um": _um(float(np.abs(found.vectors[~found.left_out]).max())),
        "repeatability_um": _um(found.repeatability),
        "expected_rms_um": _um(found.expected_rms),
        "residual_deviation_um": _um(found.residual_deviation),
        "stated_uncertainty_um": _um(found.stated_uncertainty),
        "lack_of_fit": {
            "f": None if test is None else test.f,
            "p": None if test is None else test.p_value,
            "degrees_of_freedom": None if test is None else test.degrees_of_freedom,
            "pure_error_degrees_of_freedom": None if test is None else test.pure_error_degrees_of_freedom,
        },
        "excess_over_statement_p": found.excess_p_value,
        "verdict": found.verdict,
        "by": {name: _parts(dict(parts)) for name, parts in found.by.items()},
    }


def compare(db: Database, campaign: str, model: str | None = None) -> tuple[Document, Fit]:
    """Compare a model with a campaign; the document is stored. The fit serves the figures."""
    loaded, stored, found = fitted(db, campaign, model)
    document = comparison_document(compare_fit(found, campaign, label(stored)))
    document["target_word"] = found.problem.target_word
    save_analysis(
        db, "comparison", document, method=loaded.method, campaign=campaign,
        model=stored.name, model_version=stored.version,
    )  # fmt: skip
    return document, found


def _pose(pose: dict[str, float]) -> Document:
    return {f"{axis.lower()}_deg": round(DEGREE.to_display(value), 6) for axis, value in pose.items()}


def _missing(found: ChainMissing) -> Document:
    unit = found.units[0]
    document: Document = {
        "rank": found.rank,
        "effect": found.effect,
        "meaning": found.words.meaning,
        "cause": found.words.cause,
        "remedy": found.words.remedy,
        "described_in": found.words.described_in,
        "amplitude": unit.to_display(found.amplitude),
        "u": unit.to_display(found.u),
        "unit": unit.name,
        "coefficients": {
            name: {
                "value": unit.to_display(value),
                "u": unit.to_display(float(np.sqrt(variance))),
                "unit": unit.name,
            }
            for name, value, variance in zip(
                found.parameters, map(float, found.coefficients), np.diag(found.covariance), strict=True
            )
        },
        "peak_um": _um(found.peak),
        "p_value": found.p_value,
        "q_value": found.q_value,
        "rms_before_um": _um(found.rms_before),
        "rms_after_um": _um(found.rms_after),
        "heldout_before_um": _um(found.held_out_before),
        "heldout_after_um": _um(found.held_out_after),
        "heldout_days_before_um": _um(found.held_out_days_before),
        "heldout_days_after_um": _um(found.held_out_days_after),
        "indistinguishable_from": [rival.effect for rival in found.rivals],
        "coinciding": [rival.effect for rival in found.rivals if rival.coincides],
        "tell_apart_by": [_pose(dict(pose)) for pose in found.separation.poses],
        "standard_deviations_apart": {"now": found.separation.now, "then": found.separation.then},
        "varies_from_run_to_run": found.varies,
    }
    if found.searched is not None:
        document["searched"] = {
            "what": found.searched.name,
            "value": found.searched.value,
            "u": found.searched.u,
            "unit": found.searched.unit,
        }
    return document


def _change(step: Step, units: dict[str, Unit]) -> Document:
    unit = MICROMETRE if step.parameter is None else units[step.parameter]
    what = {"target": step.target} if step.parameter is None else {"parameter": step.parameter}
    return {
        **what,
        "run": step.run,
        "size": unit.to_display(step.size),
        "u": unit.to_display(step.u),
        "unit": unit.name,
        "p_value": step.p_value,
    }


def explanation_document(found: Explanation) -> Document:
    """An explanation as people see it: everything a comparison has, and what is missing."""
    problem = found.final.problem
    units = {name: effect.unit for effect in problem.base for name in effect.parameters(problem.context)}
    document = comparison_document(found.comparison)
    missing = [_missing(one) for one in found.missing]
    changes = [
        {
            "target": move.target,
            "run": move.run,
            "sequence": move.sequence,
            "size": _um(move.size),
            "shift_um": [_um(part) for part in move.shift],
            "unit": MICROMETRE.name,
            "p_value": move.p_value,
        }
        for move in found.moves
    ] + [_change(step, units) for step in found.steps]
    document["verdict"] = Verdict.SOMETHING_IS_MISSING if missing else document["verdict"]
    document |= {
        "missing": missing,
        "suspect_data": [
            {
                "run": point.run,
                "sequence": point.sequence,
                "target": point.target,
                "axis": point.axis,
                "size_um": _um(point.size),
                "p_value": point.p_value,
            }
            for point in found.suspect
        ],
        "changes": changes,
        "blind_spots": list(found.blind),
        "not_recorded": dict(found.refused),
        "target_word": problem.target_word,
        "held_out": "runs" if len(problem.runs) > 1 else "blocks of poses",
        "likely_mistakes": [
            {
                "what": one.what,
                "rms_as_recorded_um": _um(one.rms_as_recorded),
                "rms_undone_um": _um(one.rms_undone),
            }
            for one in found.mistakes
        ],
        "undecided": [ONE_RUN] if len(problem.runs) == 1 else [],
    }
    document["answer"] = (
        mistakes_in_words(found.mistakes)
        + " Nothing was changed, and no effect was looked for: correct the file first."
        if found.mistakes
        else (GROSS if found.final.rms > HOPELESS_TIMES * found.final.sigma else "") + _answer(document)
    )
    # Where nothing is missing there is nothing to picture.
    document |= (
        picture_documents(found, missing[0]["effect"] if missing else None)
        if document["verdict"] == Verdict.SOMETHING_IS_MISSING
        else {"residual_map": None, "residual_against": None}
    )
    return document


def _answer(document: Document) -> str:
    """The finding in one or two sentences, for people who look rather than read."""
    parts = []
    if document["missing"]:
        first = document["missing"][0]
        parts.append(f"The model lacks {first['effect']}: {first['meaning']}.")
        if first["varies_from_run_to_run"]:
            parts.append("It varies from run to run and no recorded column follows it.")
        if first["indistinguishable_from"]:
            others = ", ".join(first["indistinguishable_from"])
            parts.append(f"These data cannot tell it apart from {others}.")
    elif document["verdict"] == Verdict.SOMETHING_IS_MISSING:
        parts.append(
            "The model does not explain the measurements, but no effect of the catalogue explains more."
        )
    else:
        parts.append("Nothing is missing that this plan can see.")
    if document["suspect_data"]:
        count = len(document["suspect_data"])
        parts.append(f"{count} bad point{'s were' if count > 1 else ' was'} left out.")
    for change in document["changes"]:
        what = f"{document['target_word']} {change['target']}" if "target" in change else change["parameter"]
        verb = "moved" if "target" in change else "stepped"
        parts.append(f"{what} {verb} by {change['size']:.1f} {change['unit']} at run {change['run']}.")
    return " ".join(parts)


def explain_campaign(
    db: Database,
    campaign: str,
    model: str | None = None,
    rate: float = RATE,
    *,
    before: datetime | None = None,
) -> tuple[Document, Explanation]:
    """Which physical effect is missing; the document is stored, with the seed of the search for steps.

    Runs that began at or after ``before`` (local time without a zone) take no part; the document is then stored
    as ``partial explanation``.
    """
    if not 0.0 < rate < 1.0:
        raise InputError(f"the false discovery rate must lie between 0 and 1, not {rate}")
    loaded = runs_before(load_campaign(db, campaign), before)
    stored = resolve(db, model, loaded.method)
    found = explanation_of(loaded, stored, rate)
    document = explanation_document(found)
    save_explanation(db, document, loaded.method, stored, before)
    return document, found


def explanation_of(
    campaign: Campaign, model: StoredModel, rate: float = RATE, first: Fit | None = None
) -> Explanation:
    """Which physical effect a model lacks, or what looks wrong in the file; ``first`` is its fit where that is known.

    Raises DataError where the model cannot be fitted, with what looks wrong in the file where that can be told.
    """

    def problem_of(one: Campaign) -> ChainProblem:
        found: ChainProblem = campaign_method(campaign).problem_of(one, as_model(model))
        return found

    try:
        first = fit(problem_of(campaign)) if first is None else first
    except DataError as error:
        mistakes = find_mistakes(campaign, problem_of, None)
        raise DataError(f"{error}. {mistakes_in_words(mistakes)}" if mistakes else str(error)) from error
    mistakes = find_mistakes(campaign, problem_of, first) if is_gross(campaign, first) else ()
    if mistakes:
        comparison = replace(
            compare_fit(first, campaign.name, label(model)), verdict=Verdict.SOMETHING_IS_MISSING
        )
        return Explanation(comparison, (), (), (), (), (), (), first, mistakes)
    rng = np.random.default_rng(SEED)
    found = explain(campaign, first.problem, label(model), rate=rate, rng=rng, first=first)
    if found.final.rms > HOPELESS_TIMES * found.final.sigma:
        # What was found leaves nearly all of it: none of that is an answer.
        return replace(found, missing=(), suspect=(), moves=(), steps=())
    return found


def mistakes_in_words(found: Sequence[Mistake]) -> str:
    """What looks wrong in the file, in one sentence."""
    first = found[0]
    ways = " or ".join(one.what for one in found)
    before = (
        f"residual {_length(first.rms_as_recorded)} as recorded"
        if np.isfinite(first.rms_as_recorded)
        else "as recorded the readings fit no machine of this file"
    )
    return f"It looks as if {ways}: {before}, residual {_length(first.rms_undone)} with that undone."


def _length(mm: float) -> str:
    return f"{mm:.2g} mm" if mm >= 0.1 else f"{MICROMETRE.to_display(mm):.2g} µm"


def save_explanation(
    db: Database, document: Document, method: str, model: StoredModel, before: datetime | None
) -> None:
    """Keep an explanation, ``partial`` where runs from ``before`` on took no part."""
    save_analysis(
        db, kind_of("explanation", before), document, method=method_of(method, before),
        campaign=document["campaign"], model=model.name, model_version=model.version, seed=SEED,
    )  # fmt: skip


def latest_campaign(db: Database, model: StoredModel) -> str:
    """The campaign on which a line of models was last compared, explained or identified.

    Raises NotFoundError where none was.
    """
    names = {(one.name, one.version) for one in model_history(db, model.name, model.version)}
    found = db.rows(
        "SELECT campaign, model, model_version FROM ("
        "SELECT campaign, model, model_version, computed_at FROM v_analyses WHERE campaign IS NOT NULL "
        "UNION ALL SELECT campaign, model, model_version, computed_at FROM v_identifications"
        ") ORDER BY computed_at DESC"
    )
    for campaign, name, version in found:
        if (name, version) in names:
            return str(campaign)
    raise NotFoundError(
        f"model {label(model)} has not been compared with a campaign yet; name one with --campaign"
    )


def history(
    db: Database, model: str, campaign: str | None = None, *, before: datetime | None = None
) -> list[Document]:
    """The error falling: every version from the base on, fitted to one campaign.

    Runs that began at or after ``before`` (local time without a zone) take no part.
    """
    stored = resolve(db, model)
    name = campaign or latest_campaign(db, stored)
    if is_curve(db, name):
        return curves.history(db, stored, name)
    loaded = runs_before(load_campaign(db, name), before)
    return error_steps(loaded, model_history(db, stored.name, stored.version))


def error_steps(loaded: Campaign, versions: Sequence[StoredModel]) -> list[Document]:
    """The error of every version of a model on a campaign."""
    steps = []
    for version in versions:
        found = fit(campaign_method(loaded).problem_of(loaded, as_model(version)))
        error = version_error(found)
        unseen = shared_parameters(found.problem, found.solution).refused
        steps.append(
            {
                "model": label(version),
                "campaign": loaded.name,
                "added": " + ".join(version.added) or None,
                "removed": " + ".join(version.removed) or None,
                "rms_um": _um(error.rms),
                "heldout_rms_um": _um(error.held_out_rms),
                "repeatability_um": _um(error.repeatability),
                "stated_uncertainty_um": _um(error.stated_uncertainty),
                "lack_of_fit_p": error.lack_of_fit_p,
                "no_number": [{"parameters": list(one.parameters), "why": one.why} for one in unseen],
            }
        )
    return steps
