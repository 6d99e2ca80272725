"""What is told of every effect that a curve lacks: sizes, uncertainties, errors before and after, rivals, words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.discovery.curve.quality import allowed_for, bic, held_out, inflation
from monitor.discovery.curve.scene import effect_of
from monitor.discovery.curve.search import Round
from monitor.discovery.machine.evidence import Evidence, orthonormal, without
from monitor.discovery.machine.scan import Finding
from monitor.discovery.machine.visible import Candidate
from monitor.discovery.search.missing import COINCIDES, UNDECIDED, Missing, Rival, Searched
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


def tell(rounds: Sequence[Round], noise: Assessed) -> tuple[CurveMissing, ...]:
    """What is told of every finding, the most convincing of every round first."""
    left_out = rounds[-1].under.problem.left_out
    told: list[CurveMissing] = []
    before = fit(replace(rounds[0].scene.fit.problem, left_out=left_out))
    for now in rounds:
        doubts = _doubts(now)
        for finding in now.result.findings:
            after = fit(before.settled.with_effects([effect_of(finding.candidate)]))
            fits = before, after, rounds[-1].under
            told.append(_missing(now, finding, len(told) + 1, fits, noise, doubts[finding.candidate.family]))
            before = after
    return tuple(told)


def _doubts(now: Round) -> dict[str, float]:
    """By finding, how often noise alone would do as well.

    Beside those only that are certain already: two cycles that are plain beside each other may both be noise.
    """
    ask = now.acceptance
    waiting = [one.candidate for one in now.result.findings]
    certain: list[Candidate] = []
    found: dict[str, float] = {}

    def doubt(others: Sequence[Candidate], one: Candidate) -> float:
        return min(1.0, ask.doubts[one.family]) if ask.stands(others, one) else 1.0

    for _ in range(len(waiting)):
        for one in waiting:
            found[one.family] = doubt(certain, one)
            if found[one.family] <= ask.rate:
                certain.append(one)
                waiting.remove(one)
                break
        else:
            break
    if waiting:
        # What is not certain by itself may be together.
        together = min(1.0, ask.doubt_of_all(certain, waiting))
        shared = min(max(found[one.family] for one in waiting), together)
        found.update({one.family: shared for one in waiting})
    return found


def _missing(
    now: Round,
    finding: Finding,
    rank: int,
    fits: tuple[CurveFit, CurveFit, CurveFit],
    noise: Assessed,
    doubt: float,
) -> CurveMissing:
    """One finding; ``fits`` are those before it, with it, and with everything."""
    before, after, final = fits
    at = len(now.scene.fit.problem.base) + len(before.problem.added)
    effect = final.effects[at]
    inputs = final.problem.inputs
    own = [n for n, name in enumerate(final.names) if name in _own_names(final, effect)]
    coefficients, covariance = final.estimate[own], allowed_for(final, noise)[np.ix_(own, own)]
    u_value = None
    if effect.free and np.isfinite(final.u_values[at]):
        u_value = final.u_values[at] * inflation(final, noise, at)
    columns = final.design[:, own]
    contribution = columns @ np.nan_to_num(coefficients)
    amplitude, u_amplitude = _amplitude(effect, coefficients, covariance)
    written = _written(final, effect, u_value)
    clock = effect.column == final.problem.curve.time
    unit = inputs.units.get(effect.column, "")
    p_value = finding.evidence.p_value
    if noise.noticed:
        others = [one.candidate for one in now.result.findings if one is not finding]
        p_value = max(p_value, now.acceptance.p_value(others, finding.candidate))
    certain = doubt <= now.acceptance.rate
    if not certain:
        p_value = max(p_value, doubt)
    return CurveMissing(
        rank=rank,
        effect=written.text,
        words=describe_curve(written, final.problem.curve.response, unit, clock=clock),
        parameters=tuple(final.names[n] for n in own),
        units=tuple(Unit(final.units[n], 1.0) for n in own),
        coefficients=coefficients,
        covariance=covariance,
        amplitude=amplitude,
        u=u_amplitude,
        peak=float(np.abs(contribution - contribution.mean()).max()),
        searched=_searched(effect, u_value, unit),
        p_value=p_value,
        q_value=min(1.0, p_value * now.acceptance.families) if certain else p_value,
        rms_before=before.rms,
        rms_after=after.rms,
        held_out_before=held_out(before),
        held_out_after=held_out(after),
        rivals=_rivals(now, finding, now.result.findings),
        fitted=effect,
        certain=certain,
        noise_alone=doubt,
        bic_before=bic(before),
        bic_after=bic(after),
    )


def _searched(effect: CurveEffect, u: float | None, unit: str) -> Searched | None:
    """The searched value of an effect, or its period of the calendar, which has no uncertainty."""
    if effect.value is None or not (effect.free or effect.shape == "sin"):
        return None
    name = SEARCHED[effect.shape]
    if not effect.free:
        return Searched(name, effect.value, None, unit or "1")
    frequency = 1.0 / effect.value if effect.shape == "sin" else None
    return Searched(name, effect.value, u, unit or ("row" if effect.column == SEQUENCE else "1"), frequency)


def _own_names(fitted: CurveFit, effect: CurveEffect) -> tuple[str, ...]:
    return coefficient_names(effect, fitted.problem.inputs)


def _amplitude(effect: CurveEffect, coefficients: Array, covariance: Array) -> tuple[float, float]:
    """The coefficient; the length of a cosine and a sine; the root mean square of the deviations of groups."""
    if len(coefficients) == 1:
        return float(coefficients[0]), float(np.sqrt(covariance[0, 0]))
    if effect.shape == "group":
        size = len(coefficients) + 1
        centre = np.eye(size)[:, 1:] - 1.0 / size
        deviations = centre @ coefficients
        spread = float(np.sqrt(np.sum(deviations**2) / (size - 1)))
        slope = centre.T @ deviations / ((size - 1) * max(spread, 1e-300))
        return spread, float(np.sqrt(slope @ covariance @ slope))
    length = float(np.linalg.norm(coefficients))
    direction = coefficients / max(length, 1e-300)
    return length, float(np.sqrt(direction @ covariance @ direction))


def _written(fitted: CurveFit, effect: CurveEffect, u: float | None) -> CurveEffect:
    """The effect as it is to be added: rounded to its uncertainty, or a period of the calendar."""
    if not effect.free or effect.value is None:
        return effect
    clock = effect.column == fitted.problem.curve.time
    if effect.shape == "sin" and clock and u is not None:
        known = calendar_period(effect.value, u, fitted.problem.inputs.units.get(effect.column, ""))
        if known is not None:
            return replace(effect, value=known, free=False)
    if u is None or not np.isfinite(u) or u <= 0.0:
        return effect.at(float(f"{effect.value:.6g}"))
    return effect.at(float(np.round(effect.value, max(1 - int(np.floor(np.log10(u))), 0))))


def _rivals(now: Round, finding: Finding, findings: Sequence[Finding]) -> tuple[Rival, ...]:
    """Effects that the rows do not rule out, and whether they coincide with the one found."""
    own = finding.evidence
    others = [one.candidate.columns for one in findings if one is not finding]
    basis = orthonormal(np.concatenate([now.visible.added, *others], axis=1))
    vector = without(basis, own.candidate.columns)
    least = max(own.likelihood - UNDECIDED, 0.0)
    chosen = effect_of(own.candidate)
    told = []
    for one in finding.rivals:
        effect = effect_of(one.candidate)
        if one.candidate is own.candidate or one.likelihood < least or one.score == -np.inf:
            continue
        if (effect.column, effect.shape) == (chosen.column, chosen.shape):
            continue
        told.append(Rival(_named(one), _share(basis, one, vector) > COINCIDES))
    return tuple(sorted(told, key=lambda rival: not rival.coincides))


def _named(one: Evidence) -> str:
    effect = effect_of(one.candidate)
    return effect.at(float(f"{effect.value:.4g}")).text if effect.free and effect.value else effect.text


def _share(basis: Array, one: Evidence, vector: Array) -> float:
    own = orthonormal(without(basis, one.candidate.columns))
    total = float(np.sum(vector**2))
    return float(np.sum((own.T @ vector) ** 2)) / max(total, 1e-300)
