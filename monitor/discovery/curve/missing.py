"""The effects that a curve lacks as results: sizes, uncertainties, errors before and after, rivals, words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.discovery.curve.quality import allowed_for, bic, held_out, inflation
from monitor.discovery.curve.scene import CurveCandidate
from monitor.discovery.curve.search import SearchRound
from monitor.discovery.search.amplitudes import length_of
from monitor.discovery.search.evidence import Evidence
from monitor.discovery.search.missing import Missing, Rival, Searched
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.rivals import coincides, least_likelihood
from monitor.discovery.search.scan import Finding
from monitor.effects.curve import SEARCHED, SEQUENCE, CurveEffect, coefficient_names
from monitor.effects.curve.calendar import calendar_period
from monitor.effects.curve.words import describe_curve
from monitor.methods.curve.fit import CurveFit, fit
from monitor.records import Array
from monitor.statistics.noise import Assessed
from monitor.units import Unit


@dataclass(frozen=True)
class CurveMissing(Missing):
    """A missing effect of a curve, in the unit of the response or as its ``units`` say.

    ``fitted`` is the effect as estimated, ``effect`` how it is to be added: a searched value rounded to its
    uncertainty, or a period of the calendar that it agrees with. ``noise_alone`` is how often correlated noise alone
    would do as well, its search paid for; above the rate of the scan the effect is likely, not ``certain``, and that
    is its p-value.
    """

    fitted: CurveEffect
    certain: bool
    noise_alone: float
    bic_before: float
    bic_after: float


@dataclass(frozen=True)
class _Fits:
    """The fits before an effect, with it, and with everything; ``noise`` is what remains at last."""

    before: CurveFit
    after: CurveFit
    final: CurveFit
    noise: Assessed


def missing_effects(rounds: Sequence[SearchRound], noise: Assessed) -> tuple[CurveMissing, ...]:
    """The missing effects of all rounds as results, the most convincing of every round first."""
    final = rounds[-1].under
    missing: list[CurveMissing] = []
    before = fit(replace(rounds[0].scene.curve.problem, left_out=final.problem.left_out))
    for current in rounds:
        doubts = _doubts(current)
        for finding in current.result.findings:
            after = fit(before.settled.with_effects([finding.candidate.effect]))
            fits = _Fits(before, after, final, noise)
            doubt = doubts[finding.candidate.family]
            missing.append(_missing(current, finding, len(missing) + 1, fits, doubt))
            before = after
    return tuple(missing)


def _doubts(current: SearchRound) -> dict[str, float]:
    """The doubt of each finding by family: the rate at which noise alone would do as well.

    Beside those only that are certain already: two cycles that are plain beside each other may both be noise.
    """
    acceptance = current.acceptance
    waiting = current.result.candidates
    certain: list[CurveCandidate] = []
    doubts: dict[str, float] = {}
    for _ in range(len(waiting)):
        for candidate in waiting:
            stands = acceptance.stands(certain, candidate)
            doubts[candidate.family] = min(1.0, acceptance.doubts[candidate.family]) if stands else 1.0
            if doubts[candidate.family] <= acceptance.rate:
                certain.append(candidate)
                waiting.remove(candidate)
                break
        else:
            break
    if waiting:
        # What is not certain by itself may be together.
        together = min(1.0, acceptance.evidence.doubt(certain, waiting))
        shared = min(max(doubts[candidate.family] for candidate in waiting), together)
        doubts.update({candidate.family: shared for candidate in waiting})
    return doubts


def _missing(
    current: SearchRound, finding: Finding[CurveCandidate], rank: int, fits: _Fits, doubt: float
) -> CurveMissing:
    final, curve = fits.final, fits.final.problem.curve
    index = len(current.scene.curve.problem.base) + len(fits.before.problem.added)
    effect = final.effects[index]
    names = coefficient_names(effect, final.problem.inputs)
    coefficients_of = [at for at, name in enumerate(final.names) if name in names]
    coefficients = final.estimate[coefficients_of]
    covariance = allowed_for(final, fits.noise)[np.ix_(coefficients_of, coefficients_of)]
    amplitude, u = _amplitude(effect, coefficients, covariance)
    u_value = None
    if effect.free and np.isfinite(final.u_values[index]):
        u_value = final.u_values[index] * inflation(final, fits.noise, index)
    contribution = final.design[:, coefficients_of] @ np.nan_to_num(coefficients)
    written = _written(final, effect, u_value)
    unit = final.problem.inputs.units.get(effect.column, "")
    certain = doubt <= current.acceptance.rate
    p_value = _p_value(current, finding, fits.noise, 0.0 if certain else doubt)
    return CurveMissing(
        rank=rank,
        effect=written.text,
        description=describe_curve(written, curve.response, unit, clock=effect.column == curve.time),
        parameters=tuple(final.names[at] for at in coefficients_of),
        units=tuple(Unit(final.units[at], 1.0) for at in coefficients_of),
        coefficients=coefficients,
        covariance=covariance,
        amplitude=amplitude,
        u=u,
        peak=float(np.abs(contribution - contribution.mean()).max()),
        searched=_searched(effect, u_value, unit),
        p_value=p_value,
        q_value=min(1.0, p_value * current.acceptance.families) if certain else p_value,
        rms_before=fits.before.rms,
        rms_after=fits.after.rms,
        held_out_before=held_out(fits.before),
        held_out_after=held_out(fits.after),
        rivals=_rivals(current, finding),
        fitted=effect,
        certain=certain,
        noise_alone=doubt,
        bic_before=bic(fits.before),
        bic_after=bic(fits.after),
    )


def _p_value(current: SearchRound, finding: Finding[CurveCandidate], noise: Assessed, doubt: float) -> float:
    """The p-value of a finding, correlated noise and a ``doubt`` allowed for."""
    p_value = finding.evidence.p_value
    if noise.noticed:
        p_value = max(
            p_value, current.acceptance.evidence.p_value(_others(current, finding), finding.candidate)
        )
    return max(p_value, doubt)


def _others(current: SearchRound, finding: Finding[CurveCandidate]) -> list[CurveCandidate]:
    return [other.candidate for other in current.result.findings if other is not finding]


def _searched(effect: CurveEffect, u: float | None, unit: str) -> Searched | None:
    """The searched value of an effect, or its period of the calendar, which has no uncertainty."""
    if effect.value is None or not (effect.free or effect.shape == "sin"):
        return None
    name = SEARCHED[effect.shape]
    if not effect.free:
        return Searched(name, effect.value, None, unit or "1")
    frequency = 1.0 / effect.value if effect.shape == "sin" else None
    return Searched(name, effect.value, u, unit or ("row" if effect.column == SEQUENCE else "1"), frequency)


def _amplitude(effect: CurveEffect, coefficients: Array, covariance: Array) -> tuple[float, float]:
    """The coefficient; the length of a cosine and a sine; the root mean square of the deviations of groups."""
    if effect.shape != "group" or len(coefficients) == 1:
        return length_of(coefficients, covariance)
    size = len(coefficients) + 1
    centre = np.eye(size)[:, 1:] - 1.0 / size
    deviations = centre @ coefficients
    spread = float(np.sqrt(np.sum(deviations**2) / (size - 1)))
    slope = centre.T @ deviations / ((size - 1) * max(spread, 1e-300))
    return spread, float(np.sqrt(slope @ covariance @ slope))


def _written(fitted: CurveFit, effect: CurveEffect, u: float | None) -> CurveEffect:
    """The effect as it is to be added: rounded to its uncertainty, or a period of the calendar."""
    if not effect.free or effect.value is None:
        return effect
    clock = effect.column == fitted.problem.curve.time
    if effect.shape == "sin" and clock and u is not None:
        period = calendar_period(effect.value, u, fitted.problem.inputs.units.get(effect.column, ""))
        if period is not None:
            return replace(effect, value=period, free=False)
    if u is None or not np.isfinite(u) or u <= 0.0:
        return effect.at(float(f"{effect.value:.6g}"))
    return effect.at(float(np.round(effect.value, max(1 - int(np.floor(np.log10(u))), 0))))


def _rivals(current: SearchRound, finding: Finding[CurveCandidate]) -> tuple[Rival, ...]:
    """Effects that the rows do not rule out, and whether they coincide with the finding."""
    basis = orthonormal(current.scene.columns(_others(current, finding)))
    remainder = without(basis, finding.candidate.columns)
    least = least_likelihood(finding.evidence)
    rivals = [
        Rival(_name(rival), coincides(basis, rival.candidate, remainder))
        for rival in finding.rivals
        if rival.likelihood >= least and rival.score != -np.inf and not _same_shape(rival, finding)
    ]
    return tuple(sorted(rivals, key=lambda rival: not rival.coincides))


def _same_shape(rival: Evidence[CurveCandidate], finding: Finding[CurveCandidate]) -> bool:
    """Whether two effects differ at most by their searched value."""
    effect, other = rival.candidate.effect, finding.candidate.effect
    return (effect.column, effect.shape) == (other.column, other.shape)


def _name(rival: Evidence[CurveCandidate]) -> str:
    """The effect as written, a searched value to four digits."""
    effect = rival.candidate.effect
    return effect.at(float(f"{effect.value:.4g}")).text if effect.free and effect.value else effect.text
