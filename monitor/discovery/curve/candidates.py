"""The effects that a curve may lack as candidates of the scan, and searched values at their best."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy

from monitor.discovery.curve.scene import CurveCandidate, CurveScene, WhitenedCurve, variant_of
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scan import except_for
from monitor.effects.curve import PLACED, CurveEffect, group_names
from monitor.methods.curve.catalogue import catalogue
from monitor.methods.curve.problem import SHORTEST_CONSTANT, CurveProblem, grid
from monitor.records import Array

#: Numbers in all candidates together: 160 MB. Beyond, only the values that explain most by themselves are looked at;
#: the search over all of them is still paid for.
MOST_NUMBERS = 20_000_000
#: Periods looked at for one input; a series of 4000 rows has as many, a longer one is not searched below
#: range / 2000.
MOST_PERIODS = 6000


def tries_of(effect: CurveEffect, values: Array) -> list[int]:
    """The price of the search for each value: the inverse of its probability beforehand.

    Periods are as likely between 5 and 10 as between 50 and 100 (even in the logarithm), constants and places all
    the same.
    """
    if effect.shape != "sin":
        return [len(values)] * len(values)
    total = float(np.sum(values))
    return [int(np.ceil(total / value)) for value in values]


def scene_of(curve: WhitenedCurve) -> CurveScene:
    """All candidates, and the residual that they may explain."""
    residual = without(curve.basis, curve.measured[:, None])[:, 0]
    candidates: list[CurveCandidate] = []
    refused: list[tuple[str, str]] = []
    for effect in catalogue(curve.problem):
        refusal = _refusal(curve.problem, effect)
        if refusal is not None:
            refused.append((effect.text, f"{effect.column} {refusal}"))
        else:
            candidates += curve.candidates(list(_variants(curve, residual, effect)))
    return CurveScene(curve, residual, tuple(candidates), tuple(refused))


def _refusal(problem: CurveProblem, effect: CurveEffect) -> str | None:
    """Why a column does not allow an effect; None where it does."""
    if effect.free:
        return None if len(grid(effect, problem.inputs)) else "takes too few values to search it"
    if effect.order and len(np.unique(problem.inputs.numbers[effect.column])) <= effect.order:
        return "takes too few values"
    if effect.shape == "group":
        labels = problem.inputs.groups[effect.column]
        if not 1 < len(group_names(labels)) <= len(labels) / 2:
            return "has one label, or a label of its own in nearly every row"
    return None


def _variants(curve: WhitenedCurve, residual: Array, effect: CurveEffect) -> Iterator[Variant[CurveEffect]]:
    """The effect itself, or at every value that is looked at."""
    if not effect.free:
        yield variant_of(effect)
        return
    inputs = curve.problem.inputs
    values = grid(effect, inputs)[:MOST_PERIODS]
    tries = dict(zip(values.tolist(), tries_of(effect, values), strict=True))
    room = MOST_NUMBERS // max(len(residual), 1) // 2 // len(inputs.numbers)
    if len(values) > room:
        values = _promising(curve, residual, effect, values, room)
    yield from (variant_of(effect.at(value), tries[value]) for value in values.tolist())


def _promising(curve: WhitenedCurve, residual: Array, effect: CurveEffect, values: Array, most: int) -> Array:
    """The values that explain most of the residual, each by itself."""
    explained = np.empty(len(values))
    for index, value in enumerate(values):
        columns = without(curve.basis, curve.whitened(curve.columns(effect.at(float(value)))))
        explained[index] = float(np.sum((orthonormal(columns).T @ residual) ** 2))
    return values[np.sort(np.argsort(-explained)[:most])]


def at_best_value(scene: CurveScene, selected: Sequence[CurveCandidate], index: int) -> CurveCandidate:
    """The candidate at an index with its searched value at its best, the other selected ones fitted along.

    Its family then holds the value, so that a second period of the same input can be found after it.
    """
    candidate = selected[index]
    effect = candidate.effect
    if not effect.free:
        return candidate
    if effect.shape in PLACED or effect.value is None:
        return _with_value(candidate, effect)
    curve, tries = scene.curve, candidate.variant.tries
    others = scene.columns(except_for(selected, index))

    def badness(rate: float) -> float:
        trial = curve.candidate(variant_of(effect.at(1.0 / rate), tries))
        (evidence,) = weigh([trial], scene.residual, others, scene.degrees_of_freedom)
        return -evidence.explained

    rate = 1.0 / effect.value
    low, high = _rates_between(curve.problem, effect, rate)
    if high <= low:
        return _with_value(candidate, effect)
    best = scipy.optimize.minimize_scalar(
        badness, bounds=(low, high), method="bounded", options={"xatol": 1e-4 * (high - low), "maxiter": 40}
    )
    better = effect.at(1.0 / float(best.x)) if best.fun <= badness(rate) else effect
    return _with_value(curve.candidate(variant_of(better, tries)), better)


def _rates_between(problem: CurveProblem, effect: CurveEffect, rate: float) -> tuple[float, float]:
    """The rates (inverse of period or constant) between the neighbours of one on the grid."""
    x = np.unique(problem.inputs.numbers[effect.column])
    span = float(x[-1] - x[0])
    if effect.shape == "sin":
        return max(rate - 1.0 / (3.0 * span), 1.0 / span), rate + 1.0 / (3.0 * span)
    # Never shorter than the distance of the rows.
    most = 1.0 / (SHORTEST_CONSTANT * float(np.median(np.diff(x))))
    low, high = sorted((0.6 * rate, float(np.clip(1.6 * rate, -most, most))))
    return low, high


def _with_value(candidate: CurveCandidate, effect: CurveEffect) -> CurveCandidate:
    """The candidate with its value in the name of its family."""
    return replace(candidate, variant=Variant(effect.text, effect, candidate.variant.tries))
