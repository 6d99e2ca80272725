"""Comparison and explanation of a curve as documents.

They have the keys of machines. Numbers stand in the unit of the response (keys without a unit, ``unit`` names it);
keys that end in ``_um`` hold the same in micrometres where the response is a length, else null.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from monitor.discovery.curve.compare import CurveComparison, compare_curve
from monitor.discovery.curve.explain import CurveExplanation
from monitor.discovery.curve.missing import CurveMissing
from monitor.discovery.curve.quality import bic
from monitor.discovery.search.comparison import Part, Verdict
from monitor.methods.curve.fit import CurveFit
from monitor.methods.curve.problem import NAME
from monitor.records import CurveCampaign
from monitor.statistics.noise import Assessed, effective_number
from monitor.units import MICROMETRE
from monitor.workflow.explain.curve_answer import answer

Document = dict[str, Any]
#: Lengths in millimetres, for the keys that end in _um.
LENGTHS = {"pm": 1e-9, "nm": 1e-6, "um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1e3, "km": 1e6, "in": 25.4}


def _um(curve: CurveCampaign, value: float | None) -> float | None:
    factor = LENGTHS.get(curve.units.get(curve.response, ""))
    return None if factor is None or value is None else MICROMETRE.to_display(value * factor)


def both(curve: CurveCampaign, key: str, value: float | None) -> Document:
    """A number in the unit of the response, and in micrometres where that is a length."""
    return {f"{key}_um": _um(curve, value), key: value}


def noise_document(found: Assessed, rows: int) -> Document:
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


def rows_kept(found: CurveFit) -> int:
    return int((~found.problem.left_out).sum())


def comparison_document(found: CurveComparison, model: str) -> Document:
    """A comparison as people see it."""
    curve, test = found.fit.problem.curve, found.lack_of_fit

    def parts(of: Mapping[str, Part]) -> Document:
        return {
            name: {**both(curve, "rms", part.rms), **both(curve, "largest", part.largest), "n": part.count}
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
        **both(curve, "rms", found.fit.rms),
        **both(curve, "largest", float(np.abs(found.fit.residual).max())),
        **both(curve, "repeatability", found.repeatability),
        **both(curve, "expected_rms", found.expected_rms),
        **both(curve, "residual_deviation", found.fit.deviation),
        **both(curve, "stated_uncertainty", curve.standard_uncertainty),
        "degrees_of_freedom": found.fit.degrees_of_freedom,
        "bic": bic(found.fit),
        "lack_of_fit": {
            "f": None if test is None else test.f,
            "p": None if test is None else test.p_value,
            "degrees_of_freedom": None if test is None else test.degrees_of_freedom,
            "pure_error_degrees_of_freedom": None if test is None else test.pure_error_degrees_of_freedom,
        },
        "excess_over_statement_p": found.excess_p_value,
        "autocorrelation": noise_document(found.noise, rows_kept(found.fit)),
        "verdict": found.verdict,
        "by": {name: parts(of) for name, of in found.by.items()},
    }


def _missing(curve: CurveCampaign, found: CurveMissing) -> Document:
    document: Document = {
        "rank": found.rank,
        "effect": found.effect,
        "certain": found.certain,
        "noise_alone_p": found.noise_alone,
        "meaning": found.words.meaning,
        "cause": found.words.cause,
        "remedy": found.words.remedy,
        "described_in": found.words.described_in,
        "amplitude": found.amplitude,
        "u": found.u,
        "unit": found.units[0].name,
        "coefficients": {
            name: {"value": float(value), "u": float(u), "unit": unit.name}
            for name, value, u, unit in zip(
                found.parameters, found.coefficients, found.u_coefficients, found.units, strict=True
            )
        },
        **both(curve, "peak", found.peak),
        "p_value": found.p_value,
        "q_value": found.q_value,
        **both(curve, "rms_before", found.rms_before),
        **both(curve, "rms_after", found.rms_after),
        **both(curve, "heldout_before", found.held_out_before),
        **both(curve, "heldout_after", found.held_out_after),
        "bic_before": found.bic_before,
        "bic_after": found.bic_after,
        "indistinguishable_from": [rival.effect for rival in found.rivals],
        "coinciding": [rival.effect for rival in found.rivals if rival.coincides],
        "tell_apart_by": [],
        "varies_from_run_to_run": False,
    }
    if found.searched is not None:
        document["searched"] = {
            "what": found.searched.name,
            "value": found.searched.value,
            "u": found.searched.u,
            "unit": found.searched.unit,
        }
        if found.searched.frequency is not None:
            document["searched"]["frequency"] = found.searched.frequency
    return document


def explanation_document(found: CurveExplanation, model: str) -> Document:
    """An explanation as people see it: everything a comparison has, and what is missing."""
    curve = found.first.problem.curve
    compared = compare_curve(found.first, lacks=bool(found.missing))
    document = comparison_document(compared, model)
    document["missing"] = [_missing(curve, one) for one in found.missing]
    if found.missing:
        document["verdict"] = Verdict.SOMETHING_IS_MISSING
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
            **both(curve, "size", one.size),
            "p_value": one.p_value,
        }
        for one in found.suspect
    ]
    document["changes"] = []
    document["blind_spots"] = list(found.blind)
    document["not_recorded"] = dict(found.refused)
    document["autocorrelation_after"] = noise_document(found.noise, rows_kept(found.final))
    document["answer"] = answer(document, found)
    return document
