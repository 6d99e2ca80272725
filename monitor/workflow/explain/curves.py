"""Curves through the same verbs as machines: identify, compare, explain, and the history of a model."""

from __future__ import annotations

import numpy as np

from monitor.discovery.curve.compare import compare_curve, lack_of_fit
from monitor.discovery.curve.explain import CurveExplanation, explain_curve
from monitor.discovery.curve.quality import allowed_for, bic, held_out, inflation, noise_of
from monitor.effects.curve import SEARCHED
from monitor.exceptions import DataError, InputError
from monitor.methods.curve.fit import CurveFit, fit
from monitor.methods.curve.problem import NAME, problem_of
from monitor.records import CurveCampaign
from monitor.store import Database, StoredModel, load_curve, model_history, save_analysis
from monitor.workflow.explain.curve_documents import (
    Document,
    both,
    comparison_document,
    explanation_document,
    noise_document,
    rows_kept,
)
from monitor.workflow.models import as_model, label, resolve


def fitted(db: Database, campaign: str, model: str | None) -> tuple[CurveCampaign, StoredModel, CurveFit]:
    """A curve, the stored model, and the model fitted to it."""
    curve = load_curve(db, campaign)
    stored = resolve(db, model, NAME)
    return curve, stored, fit(problem_of(curve, as_model(stored)))


def compare(db: Database, campaign: str, model: str | None = None) -> tuple[Document, CurveFit]:
    """Compare a model with a curve; the document is stored."""
    curve, stored, found = fitted(db, campaign, model)
    document = comparison_document(compare_curve(found), label(stored))
    save_analysis(
        db, "comparison", document, method=NAME, campaign=curve.name,
        model=stored.name, model_version=stored.version,
    )  # fmt: skip
    return document, found


def explain(
    db: Database, campaign: str, model: str | None = None, rate: float = 0.01
) -> tuple[Document, CurveExplanation]:
    """Which effect a curve lacks; the document is stored."""
    if not 0.0 < rate < 1.0:
        raise InputError(f"the false discovery rate must lie between 0 and 1, not {rate}")
    curve = load_curve(db, campaign)
    stored = resolve(db, model, NAME)
    found = explain_curve(problem_of(curve, as_model(stored)), rate=rate)
    document = explanation_document(found, label(stored))
    save_analysis(
        db, "explanation", document, method=NAME, campaign=curve.name,
        model=stored.name, model_version=stored.version,
    )  # fmt: skip
    return document, found


def identify(db: Database, campaign: str, model: str | None = None, run: int | None = None) -> Document:
    """The coefficients of a curve under a model, with standard uncertainties, stored."""
    if run not in (None, 1):
        raise DataError(f"campaign {campaign} is a curve with one run, number 1, not {run}")
    curve, stored, found = fitted(db, campaign, model)
    noise = noise_of(found)
    u = np.sqrt(np.diag(allowed_for(found, noise)))
    independent = np.sqrt(np.diag(found.covariance))
    parameters = {
        name: {"value": float(value), "u": float(own), "unit": unit, "u_independent_rows": float(plain)}
        for name, value, own, unit, plain in zip(
            found.names, found.estimate, u, found.units, independent, strict=True
        )
        if np.isfinite(value)
    }
    searched = {}
    for place, effect in enumerate(found.effects):
        if not effect.free or effect.value is None:
            continue
        unit = curve.units.get(effect.column, "") or ("row" if effect.column == "sequence" else "1")
        plain = found.u_values[place]
        known = bool(np.isfinite(plain))
        searched[f"{effect.column}:{effect.shape}~{effect.value:.6g}.{SEARCHED[effect.shape]}"] = {
            "value": float(effect.value),
            "u": plain * inflation(found, noise, place) if known else None,
            "unit": unit,
            "u_independent_rows": plain if known else None,
        }
    base = set(found.settled.columns(found.settled.base)[0])
    document = {
        "campaign": campaign,
        "model": label(stored),
        "machine": curve.instrument.id,
        "method": NAME,
        "base": curve.base,
        "response": curve.response,
        "unit": curve.units.get(curve.response, "") or "1",
        "runs": [
            {
                "run": 1,
                "parameters": {**parameters, **searched},
                "refused": [{"parameters": list(one.parameters), "why": one.why} for one in found.refused],
                **both(curve, "rms", found.rms),
                **both(curve, "largest", float(np.abs(found.residual).max())),
                **both(curve, "residual_deviation", found.deviation),
                "chi_square": None
                if curve.standard_uncertainty is None
                else found.sum_of_squares / curve.standard_uncertainty**2,
                "degrees_of_freedom": found.degrees_of_freedom,
                "bic": bic(found),
                "iterations": found.iterations,
            }
        ],
        "added": {name: one for name, one in {**parameters, **searched}.items() if name not in base},
        "added_refused": [],
        "autocorrelation": noise_document(noise, rows_kept(found)),
    }
    save_analysis(
        db, "identification", document, method=NAME, campaign=curve.name,
        model=stored.name, model_version=stored.version,
    )  # fmt: skip
    return document


def history(db: Database, stored: StoredModel, campaign: str) -> list[Document]:
    """The error falling: every version from the base on, fitted to one curve."""
    curve = load_curve(db, campaign)
    steps = []
    for version in model_history(db, stored.name, stored.version):
        found = fit(problem_of(curve, as_model(version)))
        test, repeatability = lack_of_fit(found)
        steps.append(
            {
                "model": label(version),
                "campaign": campaign,
                "method": NAME,
                "unit": curve.units.get(curve.response, "") or "1",
                "added": " + ".join(version.added) or None,
                "removed": " + ".join(version.removed) or None,
                **both(curve, "rms", found.rms),
                **both(curve, "residual_deviation", found.deviation),
                **both(curve, "heldout_rms", held_out(found)),
                **both(curve, "repeatability", repeatability),
                **both(curve, "stated_uncertainty", curve.standard_uncertainty),
                "lack_of_fit_f": None if test is None else test.f,
                "lack_of_fit_p": None if test is None else test.p_value,
                "bic": bic(found),
                "no_number": [{"parameters": list(one.parameters), "why": one.why} for one in found.refused],
            }
        )
    return steps
