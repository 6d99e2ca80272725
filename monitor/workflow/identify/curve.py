"""The coefficients of a curve under a model, in the unit of its response and in micrometres where that is a length."""

from __future__ import annotations

import numpy as np

from monitor.discovery.curve.quality import allowed_for, bic, inflation, noise_of
from monitor.effects.curve import SEARCHED
from monitor.methods.curve.fit import CurveFit
from monitor.records import CurveCampaign
from monitor.reporting.refused import refused_parameters
from monitor.statistics.noise import Assessed, effective_number
from monitor.units import MICROMETRE
from monitor.workflow.identify.answer import (
    CurveEstimate,
    CurveNoise,
    CurveRun,
    IdentifyAnswer,
    ResponseOverInputs,
)

#: Lengths in millimetres, for the keys that end in _um.
LENGTHS = {"pm": 1e-9, "nm": 1e-6, "um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1e3, "km": 1e6, "in": 25.4}


def in_micrometres(curve: CurveCampaign, value: float | None) -> float | None:
    """A number in the unit of the response in micrometres; None where that is no length."""
    factor = LENGTHS.get(curve.units.get(curve.response, ""))
    return None if factor is None or value is None else MICROMETRE.to_display(value * factor)


def response_unit(curve: CurveCampaign) -> str:
    """The unit of the response, 1 where the file names none."""
    return curve.units.get(curve.response, "") or "1"


def input_unit(curve: CurveCampaign, column: str) -> str:
    """The unit of an input; that of the row number is a row."""
    return curve.units.get(column, "") or ("row" if column == "sequence" else "1")


def curve_noise(assessed: Assessed, fit: CurveFit) -> CurveNoise:
    """The noise of the rows that have weight; that of independent rows where no resemblance was noticed."""
    rows = int((~fit.problem.left_out).sum())
    if not assessed.noticed:
        return CurveNoise(False, assessed.p_value, 0.0, 0.0, 1.0, rows, float(rows))
    noise = assessed.noise
    return CurveNoise(
        True, assessed.p_value, noise.lag_one, noise.slow, noise.independent, rows, effective_number(noise, rows)
    )  # fmt: skip


def curve_answer(fit: CurveFit, model: str) -> IdentifyAnswer:
    """The coefficients of a fitted curve, with standard uncertainties that allow for correlated noise."""
    curve, noise = fit.problem.curve, noise_of(fit)
    parameters = _coefficients(fit, noise) | _searched_values(fit, noise)
    base = set(fit.settled.columns(fit.settled.base)[0])
    return IdentifyAnswer(
        campaign=curve.name,
        model=model,
        machine=curve.instrument.id,
        method=curve.method,
        curve=ResponseOverInputs(curve.base, curve.response, response_unit(curve)),
        runs=(_run(fit, parameters),),
        added={name: estimate for name, estimate in parameters.items() if name not in base},
        added_refused=(),
        autocorrelation=curve_noise(noise, fit),
    )


def _coefficients(fit: CurveFit, noise: Assessed) -> dict[str, CurveEstimate]:
    u = np.sqrt(np.diag(allowed_for(fit, noise)))
    u_independent = np.sqrt(np.diag(fit.covariance))
    rows = zip(fit.names, fit.estimate, u, fit.units, u_independent, strict=True)
    return {
        name: CurveEstimate(float(value), float(u_value), unit, float(u_independent_rows))
        for name, value, u_value, unit, u_independent_rows in rows
        if np.isfinite(value)
    }


def _searched_values(fit: CurveFit, noise: Assessed) -> dict[str, CurveEstimate]:
    """Periods, constants and places of steps that were searched for in the data."""
    estimates = {}
    for index, effect in enumerate(fit.effects):
        if not effect.free or effect.value is None:
            continue
        u_independent = fit.u_values[index]
        has_u = bool(np.isfinite(u_independent))
        estimates[f"{effect.column}:{effect.shape}~{effect.value:.6g}.{SEARCHED[effect.shape]}"] = (
            CurveEstimate(
                value=float(effect.value),
                u=u_independent * inflation(fit, noise, index) if has_u else None,
                unit=input_unit(fit.problem.curve, effect.column),
                u_independent_rows=u_independent if has_u else None,
            )
        )
    return estimates


def _run(fit: CurveFit, parameters: dict[str, CurveEstimate]) -> CurveRun:
    curve = fit.problem.curve
    stated, largest = curve.standard_uncertainty, float(np.abs(fit.residual).max())
    return CurveRun(
        run=1,
        parameters=parameters,
        refused=tuple(map(refused_parameters, fit.refused)),
        rms_um=in_micrometres(curve, fit.rms),
        rms=fit.rms,
        largest_um=in_micrometres(curve, largest),
        largest=largest,
        residual_deviation_um=in_micrometres(curve, fit.deviation),
        residual_deviation=fit.deviation,
        chi_square=None if stated is None else fit.sum_of_squares / stated**2,
        degrees_of_freedom=fit.degrees_of_freedom,
        bic=bic(fit),
        iterations=fit.iterations,
    )
