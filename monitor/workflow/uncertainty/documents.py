"""The document of an evaluated uncertainty: what is shown, what is stored, what certificates state."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from monitor.discovery import Verdict, compare
from monitor.records import Array
from monitor.store import Database, StoredModel, save_analysis
from monitor.uncertainty.coverage import ellipsoid_factor, joint_coverage, rectangle_factor
from monitor.units import MICROMETRE, Unit
from monitor.workflow.campaign_parts import kind_of, method_of
from monitor.workflow.models import label

if TYPE_CHECKING:
    from monitor.workflow.uncertainty.evaluation import Evaluated

Document = dict[str, Any]


def _values(names: tuple[str, ...], units: tuple[Unit, ...], values: Array) -> Document:
    return {
        name: unit.to_display(float(value)) for name, unit, value in zip(names, units, values, strict=True)
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def document(found: Evaluated) -> Document:
    """The result as people see it."""
    result = statement(found)
    result["guf"]["joint_coverage_of_k_2_each"] = joint_coverage(found.framework.correlation).value
    return result


def statement(found: Evaluated) -> Document:
    """As ``document``, without what k = 2 each covers: sampling that takes half a second, and nobody states it."""
    guf, units = found.framework, found.units
    result: Document = {
        "campaign": found.campaign.name,
        "machine": found.campaign.machine.id,
        "run": found.run,
        "model": label(found.model),
        "p": guf.p,
        "asked": found.asked,
        "parameters": list(guf.names),
        "units": {name: unit.name for name, unit in zip(guf.names, units, strict=True)},
        "input_covariance": found.input_covariance,
        "refused": [{"parameters": list(one.parameters), "why": one.why} for one in found.refused],
        "residuals": _residuals(found),
        "guf": {
            "estimate": _values(guf.names, units, guf.estimate),
            "u": _values(guf.names, units, guf.u),
            "correlation": guf.correlation.tolist(),
            # JCGM 102:2011 6.5 as it stands: normal outputs. Beside them what so few runs allow to claim.
            "k_p": ellipsoid_factor(guf.rank, guf.p),
            "k_q": rectangle_factor(len(guf.names), guf.p),
            "lambda_max": guf.lambda_max,
            "rank": guf.rank,
            "degrees_of_freedom": _finite(guf.dof),
            "fewest_degrees_of_freedom": _finite(float(np.min(guf.dof_by_output, initial=np.inf))),
            "k_p_with_degrees_of_freedom": _finite(guf.k_p),
            "k_q_with_degrees_of_freedom": _finite(guf.k_q),
            "expanded": _values(guf.names, units, guf.expanded),
            "budget": {
                line.source: dict(zip(guf.names, map(float, shares), strict=True))
                for line, shares in zip(guf.budget, guf.budget_shares(), strict=True)
            },
        },
    }
    if found.causes:
        result["lack_of_fit_causes"] = [
            {"effect": name, "probability": probability} for name, probability in found.causes[:5]
        ]
    mcm = found.monte_carlo
    if mcm is not None:
        result["mcm"] = {
            "estimate": _values(mcm.names, units, mcm.estimate),
            "u": _values(mcm.names, units, mcm.u),
            "correlation": mcm.correlation.tolist(),
            "k_p": mcm.k_p,
            "k_q": mcm.k_q,
            "lambda_max": mcm.lambda_max,
            "trials": mcm.trials,
            "not_converged": mcm.not_converged,
            "seconds": mcm.seconds,
            "stable": mcm.stable,
            "seed": mcm.seed,
        }
    if found.validation is not None:
        result["validation"] = {
            "passed": found.validation.passed,
            "verdict": found.validation.verdict,
            "differences": {
                _what(one): _scaled(one, found, one.difference) for one in found.validation.comparisons
            },
            "tolerances": {
                _what(one): _scaled(one, found, one.tolerance) for one in found.validation.comparisons
            },
        }
    return result


def _what(one: Any) -> str:
    return f"{one.quantity} {one.output}".strip()


def _scaled(one: Any, found: Evaluated, value: float) -> float:
    if not one.output:
        return float(value)
    return found.units[found.framework.names.index(one.output)].to_display(float(value))


def _residuals(found: Evaluated) -> Document:
    """What the model leaves over of the whole campaign, what is expected of it, and of the run by target, in µm."""
    compared = compare(found.fit, found.campaign.name, found.model.name)
    context, vectors = found.fit.problem.context, found.fit.vectors
    own = context.run == found.run
    # A target touched once a run (the bar's) is followed exactly by its own coordinates: nothing checks it.
    return {
        "rms_um": MICROMETRE.to_display(compared.rms),
        "expected_rms_um": MICROMETRE.to_display(compared.expected_rms),
        "something_is_missing": compared.verdict == Verdict.SOMETHING_IS_MISSING,
        "by_target_um": {
            str(name): MICROMETRE.to_display(float(np.sqrt(np.mean(vectors[touched] ** 2))))
            for name in found.fit.problem.targets
            if int(np.sum(touched := own & (context.target == name))) > 1
        },
    }


def save_uncertainty(
    db: Database, result: Document, model: StoredModel, method: str, before: datetime | None
) -> None:
    """Keep the document of an evaluation, ``partial`` where runs from ``before`` on took no part."""
    # How long it took is no part of what is stored: the same result has the same document.
    kept = (
        {**result, "mcm": {k: v for k, v in result["mcm"].items() if k != "seconds"}}
        if "mcm" in result
        else result
    )
    save_analysis(
        db, kind_of("uncertainty", before), kept, method=method_of(method, before),
        campaign=result["campaign"], run=result["run"], model=model.name, model_version=model.version,
        seed=result["mcm"]["seed"] if "mcm" in result else None,
    )  # fmt: skip
