"""Curves through the same verbs as machines: identify, compare, explain, and the history of a model.

The documents have the keys of machines. Numbers stand in the unit of the response (keys without a unit, ``unit``
names it); keys that end in ``_um`` hold the same in micrometres where the response is a length, else null.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from monitor.discovery.compare import SOMETHING_IS_MISSING, Part
from monitor.discovery.curve_compare import CurveComparison, compare_curve, lack_of_fit
from monitor.discovery.curve_explain import (
    CurveExplanation,
    CurveMissing,
    allowed_for,
    bic,
    explain_curve,
    held_out,
    inflation,
    noise_of,
)
from monitor.effects.curve import SEARCHED
from monitor.exceptions import DataError, InputError
from monitor.methods.curve import NAME, CurveFit, fit, problem_of
from monitor.records import CurveCampaign
from monitor.statistics.noise import Assessed, effective_number
from monitor.store import Database, StoredModel, load_curve, model_history, save_analysis
from monitor.units import MICROMETRE
from monitor.workflow.models import as_model, label, resolve

Document = dict[str, Any]
#: Lengths in millimetres, for the keys that end in _um.
#: So many rows on average at each value of a column make it look set rather than read.
ROWS_A_SETTING = 4
LENGTHS = {"pm": 1e-9, "nm": 1e-6, "um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1e3, "km": 1e6, "in": 25.4}


def _um(curve: CurveCampaign, value: float | None) -> float | None:
    factor = LENGTHS.get(curve.units.get(curve.response, ""))
    return None if factor is None or value is None else MICROMETRE.to_display(value * factor)


def _both(curve: CurveCampaign, key: str, value: float | None) -> Document:
    """A number in the unit of the response, and in micrometres where that is a length."""
    return {f"{key}_um": _um(curve, value), key: value}


def fitted(db: Database, campaign: str, model: str | None) -> tuple[CurveCampaign, StoredModel, CurveFit]:
    """A curve, the stored model, and the model fitted to it."""
    curve = load_curve(db, campaign)
    stored = resolve(db, model, NAME)
    return curve, stored, fit(problem_of(curve, as_model(stored)))


def _noise(found: Assessed, rows: int) -> Document:
    seen = found.noticed
    return {
        "noticed": seen,
        "p_value": found.p_value,
        "lag_one": found.noise.lag_one if seen else 0.0,
        "slow": found.noise.slow if seen else 0.0,
        "independent_share": found.noise.independent if seen else 1.0,
        "rows": rows,
        "effective_rows": effective_number(found.noise, rows) if seen else float(rows),
    }


def correlation(noise: Document) -> str:
    """The noise in words: both of its numbers, for what a mean is worth depends on how slowly it fades."""
    told = f"correlation {noise['lag_one']:.2f}"
    return f"{told}, times {noise['slow']:.2f} with each further row" if noise["lag_one"] > 0.0 else told


def _kept(found: CurveFit) -> int:
    return int((~found.problem.left_out).sum())


def comparison_document(found: CurveComparison, model: str) -> Document:
    """A comparison as people see it."""
    curve, test = found.fit.problem.curve, found.lack_of_fit

    def parts(of: Mapping[str, Part]) -> Document:
        return {
            name: {**_both(curve, "rms", part.rms), **_both(curve, "largest", part.largest), "n": part.count}
            for name, part in of.items()
        }

    return {
        "campaign": curve.name,
        "model": model,
        "method": NAME,
        "base": curve.base,
        "response": curve.response,
        "unit": curve.units.get(curve.response, "") or "1",
        "rows": len(curve),
        **_both(curve, "rms", found.fit.rms),
        **_both(curve, "largest", float(np.abs(found.fit.residual).max())),
        **_both(curve, "repeatability", found.repeatability),
        **_both(curve, "expected_rms", found.expected_rms),
        **_both(curve, "residual_deviation", found.fit.deviation),
        **_both(curve, "stated_uncertainty", curve.standard_uncertainty),
        "degrees_of_freedom": found.fit.degrees_of_freedom,
        "bic": bic(found.fit),
        "lack_of_fit": {
            "f": None if test is None else test.f,
            "p": None if test is None else test.p_value,
            "degrees_of_freedom": None if test is None else test.degrees_of_freedom,
            "pure_error_degrees_of_freedom": None if test is None else test.pure_error_degrees_of_freedom,
        },
        "excess_over_statement_p": found.excess_p_value,
        "autocorrelation": _noise(found.noise, _kept(found.fit)),
        "verdict": found.verdict,
        "by": {name: parts(of) for name, of in found.by.items()},
    }


def compare(db: Database, campaign: str, model: str | None = None) -> tuple[Document, CurveFit]:
    """Compare a model with a curve; the document is stored."""
    curve, stored, found = fitted(db, campaign, model)
    document = comparison_document(compare_curve(found), label(stored))
    save_analysis(
        db, "comparison", document, method=NAME, campaign=curve.name,
        model=stored.name, model_version=stored.version,
    )  # fmt: skip
    return document, found


def _missing(curve: CurveCampaign, rank: int, found: CurveMissing) -> Document:
    document: Document = {
        "rank": rank,
        "effect": found.written,
        "meaning": found.words.meaning,
        "cause": found.words.cause,
        "remedy": found.words.remedy,
        "described_in": found.words.described_in,
        "amplitude": found.amplitude,
        "u": found.u_amplitude,
        "unit": found.units[0],
        "coefficients": {
            name: {"value": float(value), "u": float(u), "unit": unit}
            for name, value, u, unit in zip(
                found.names, found.coefficients, found.u, found.units, strict=True
            )
        },
        **_both(curve, "peak", found.peak),
        "p_value": found.p_value,
        "q_value": found.q_value,
        **_both(curve, "rms_before", found.rms_before),
        **_both(curve, "rms_after", found.rms_after),
        **_both(curve, "heldout_before", found.held_out_before),
        **_both(curve, "heldout_after", found.held_out_after),
        "bic_before": found.bic_before,
        "bic_after": found.bic_after,
        "indistinguishable_from": [name for name, _ in found.rivals],
        "coinciding": [name for name, coincides in found.rivals if coincides],
        "tell_apart_by": [],
        "varies_from_run_to_run": False,
    }
    if found.effect.free and found.effect.value is not None:
        value = found.effect.value
        document["searched"] = {
            "what": SEARCHED[found.effect.shape],
            "value": value,
            "u": found.u_value,
            "unit": curve.units.get(found.effect.column, "")
            or ("row" if found.effect.column == "sequence" else "1"),
        }
        if found.effect.shape == "sin":
            document["searched"]["frequency"] = 1.0 / value
    elif found.effect.shape == "sin":
        document["searched"] = {
            "what": SEARCHED["sin"], "value": found.effect.value, "u": None,
            "unit": curve.units.get(found.effect.column, "") or "1",
        }  # fmt: skip
    return document


def explanation_document(found: CurveExplanation, model: str) -> Document:
    """An explanation as people see it: everything a comparison has, and what is missing."""
    curve = found.first.problem.curve
    compared = compare_curve(found.first, lacks=bool(found.missing))
    document = comparison_document(compared, model)
    document["missing"] = [_missing(curve, rank, one) for rank, one in enumerate(found.missing, start=1)]
    if found.missing:
        document["verdict"] = SOMETHING_IS_MISSING
    elif found.suspect:
        # A bad reading is told as that: what counts is the verdict without it.
        document["verdict"] = compare_curve(found.final, lacks=False).verdict
    document["suspect_data"] = [
        {
            "run": 1,
            "sequence": one.row + 1,
            "line": int(curve.lines[one.row]),
            "target": None,
            "axis": curve.response,
            "value": float(curve.measured[one.row]),
            **_both(curve, "size", one.size),
            "p_value": one.p_value,
        }
        for one in found.suspect
    ]
    document["changes"] = []
    document["blind_spots"] = list(found.blind)
    document["not_recorded"] = dict(found.refused)
    document["autocorrelation_after"] = _noise(found.noise, _kept(found.final))
    document["answer"] = _answer(document, found)
    return document


def _exchanged(curve: CurveCampaign) -> str | None:
    """A hint where the response looks like what was set and an input of the base like what was read."""
    values = len(np.unique(curve.measured))
    if values * ROWS_A_SETTING > len(curve):
        return None
    for effect in problem_of(curve).base:
        taken = len(np.unique(curve.columns[effect.column])) if effect.column in curve.columns else 0
        if effect.column != curve.time and 2 * taken > len(curve):
            return (
                f"{curve.response} takes only {values} different values and {effect.column} {taken}: if "
                f"{curve.response} was set and {effect.column} was read, exchange them in response and base."
            )
    return None


def _answer(document: Document, found: CurveExplanation) -> str:
    """The finding in a few sentences."""
    parts = []
    missing = document["missing"]
    if missing:
        parts.append(f"The model lacks {missing[0]['effect']}: {missing[0]['meaning']}.")
        if len(missing) > 1:
            parts.append(f"After that {', then '.join(one['effect'] for one in missing[1:])}.")
        if missing[0]["indistinguishable_from"]:
            parts.append(
                f"These rows cannot rule out {', '.join(missing[0]['indistinguishable_from'])} in its place."
            )
    elif document["verdict"] == SOMETHING_IS_MISSING:
        parts.append(
            "The model does not explain the measurements, but no effect that the columns allow explains more."
        )
    elif found.first.exact:
        parts.append("The model fits exactly, to the rounding of the numbers; nothing is left to explain.")
    else:
        parts.append("Nothing is missing that these rows can show.")
    hint = _exchanged(found.first.problem.curve)
    if hint is not None:
        parts.append(hint)
    if missing and found.final.exact:
        parts.append("With all of it the model fits exactly, to the rounding of the numbers.")
    noise = document["autocorrelation_after"]
    if noise["noticed"]:
        resembles = "resemble" if noise["lag_one"] > 0 else "alternate against"
        parts.append(
            f"Neighbouring rows {resembles} each other ({correlation(noise)}): "
            + (
                f"for a mean they are worth {noise['effective_rows']:.0f} of {noise['rows']} rows, and "
                if noise["lag_one"] > 0
                else ""
            )
            + "all uncertainties and tests allow for it."
        )
    if document["suspect_data"]:
        rows = ", ".join(str(one["sequence"]) for one in document["suspect_data"])
        one = len(document["suspect_data"]) == 1
        parts.append(f"{'Row' if one else 'Rows'} {rows} {'contradicts' if one else 'contradict'} the rest and "
                     f"{'was' if one else 'were'} left out.")  # fmt: skip
    return " ".join(parts)


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
                **_both(curve, "rms", found.rms),
                **_both(curve, "largest", float(np.abs(found.residual).max())),
                **_both(curve, "residual_deviation", found.deviation),
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
        "autocorrelation": _noise(noise, _kept(found)),
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
                **_both(curve, "rms", found.rms),
                **_both(curve, "residual_deviation", found.deviation),
                **_both(curve, "heldout_rms", held_out(found)),
                **_both(curve, "repeatability", repeatability),
                **_both(curve, "stated_uncertainty", curve.standard_uncertainty),
                "lack_of_fit_f": None if test is None else test.f,
                "lack_of_fit_p": None if test is None else test.p_value,
                "bic": bic(found),
                "no_number": [{"parameters": list(one.parameters), "why": one.why} for one in found.refused],
            }
        )
    return steps
