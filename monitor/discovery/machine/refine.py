"""Time constants, pitches and orders of gears, from the grid of the scan to the best value and its u."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from monitor.discovery.machine.evidence import orthonormal, weigh, without
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.gears import STEP as ORDER_STEP
from monitor.discovery.machine.scan import ScanResult, amplitudes
from monitor.discovery.machine.variants import TIME_CONSTANTS_S
from monitor.discovery.machine.visible import Candidate, Variant, Visible, see
from monitor.discovery.search.missing import Searched
from monitor.effects import ChainEffect, with_time_constant
from monitor.effects.catalogue import SCREW_LEADS_MM
from monitor.effects.drivers import WarmUp
from monitor.effects.shapes import Cyclic, Harmonic
from monitor.records import Array

# Neighbours on the grid of time constants differ by a factor of two, on that of pitches by a two-hundredth of
# 1/mm or so; the best value lies between the neighbours of the best of the grid.
GRID_FACTOR = TIME_CONSTANTS_S[1] / TIME_CONSTANTS_S[0]
# Relative step of the numerical derivative by the searched value.
STEP = 1e-3


@dataclass(frozen=True)
class Refined:
    """A candidate at its best value; ``slope`` (M, 0 or 1) is how its part of the residual moves with it."""

    candidate: Candidate
    searched: Searched | None
    slope: Array


def _maker(candidate: Candidate) -> tuple[str, str, float, Callable[[float], Variant]] | None:
    """Name, unit and present value of what was searched, and the variant for any other value."""
    effect, family = candidate.variant.effect, candidate.family
    if candidate.variant.tries == 1:
        return None
    driver = effect.driver
    if isinstance(driver, WarmUp) and driver.time_constant_s is not None:
        return (
            "time constant",
            "min",
            driver.time_constant_s / 60.0,
            lambda minutes: replace(candidate.variant, effect=with_time_constant(effect, 60.0 * minutes)),
        )
    if isinstance(effect, ChainEffect) and isinstance(effect.shape, Cyclic) and family.endswith(":cyclic"):
        return (
            "pitch",
            "mm",
            effect.shape.pitch,
            lambda pitch: replace(candidate.variant, effect=_with_pitch(effect, pitch)),
        )
    if (
        isinstance(effect, ChainEffect)
        and isinstance(effect.shape, Harmonic)
        and family.endswith(":harmonic")
    ):
        return (
            "periods a turn",
            "1",
            float(effect.shape.order),
            lambda order: replace(candidate.variant, effect=_with_order(effect, order)),
        )
    return None


def _with_order(effect: ChainEffect, order: float) -> ChainEffect:
    return replace(effect, shape=Harmonic(order), shape_text=f"harmonic{order:.6g}")


def _with_pitch(effect: ChainEffect, pitch: float) -> ChainEffect:
    return replace(effect, shape=Cyclic(pitch), shape_text=f"cyclic{pitch:.6g}mm")


def refine_all(fit: Fit, visible: Visible, result: ScanResult) -> list[Refined]:
    """All findings of a scan at their best values, the most convincing first."""
    chosen = [finding.candidate for finding in result.findings]
    refined: list[Refined] = []
    for place in range(len(chosen)):
        refined.append(refine(fit, visible, chosen, place))
        chosen[place] = refined[-1].candidate
    return refined


def refine(fit: Fit, visible: Visible, chosen: Sequence[Candidate], place: int) -> Refined:
    """The candidate at ``place`` with its searched value refined, the other chosen ones fitted along."""
    candidate = chosen[place]
    made = _maker(candidate)
    none = np.zeros((len(visible.residual), 0))
    if made is None:
        return Refined(candidate, None, none)
    name, unit, start, variant = made
    others = np.concatenate(
        [visible.added, *(one.columns for other, one in enumerate(chosen) if other != place)], axis=1
    )

    def at(value: float) -> Candidate:
        return see(fit, [variant(value)]).candidates[0]

    def badness(logarithm: float) -> float:
        found = weigh([at(float(np.exp(logarithm)))], visible.residual, others, visible.degrees_of_freedom)
        return -found[0].explained

    width = 0.5 * start / 400.0
    if name == "time constant":
        width = np.log(GRID_FACTOR)
    elif name == "periods a turn":
        width = ORDER_STEP / start
    best = scipy.optimize.minimize_scalar(
        badness,
        bounds=(np.log(start) - width, np.log(start) + width),
        method="bounded",
        options={"xatol": 1e-3 if name == "time constant" else 1e-5, "maxiter": 30},
    )
    value = float(np.exp(best.x))
    now = at(value)
    estimate = amplitudes(visible, [now]).estimate
    high, low = at(value * (1.0 + STEP)), at(value * (1.0 - STEP))
    slope = ((high.columns - low.columns) @ estimate / (2.0 * STEP * value))[:, None]
    u = _uncertainty(visible, now, slope, others)
    if name == "periods a turn" and abs(round(value) - value) < 2.0 * u:
        value = float(round(value))
        now = at(value)
    if name == "pitch":
        near = [lead for lead in SCREW_LEADS_MM if abs(lead - value) < 2.0 * u]
        if near:
            value = min(near, key=lambda lead: abs(lead - value))
            now = at(value)
    return Refined(now, Searched(name, value, u if np.isfinite(u) else None, unit), slope)


def _uncertainty(visible: Visible, candidate: Candidate, slope: Array, others: Array) -> float:
    basis = orthonormal(np.concatenate([others, candidate.columns], axis=1))
    left = without(basis, slope)
    residual = without(basis, visible.residual[:, None])
    length = float(np.linalg.norm(left))
    variance = float(np.sum(residual**2)) / visible.degrees_of_freedom
    return float(np.sqrt(variance)) / length if length > 0 else float("inf")
