"""Time constants, pitches and orders of gears, from the grid of the scan to the best value and its u."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, scene_of
from monitor.discovery.machine.shapes.gears import STEP as ORDER_STEP
from monitor.discovery.machine.shapes.grids_askew import other_bounds
from monitor.discovery.machine.shapes.variants import (
    BEND_PERIODS,
    TIME_CONSTANTS_S,
    frequency_step,
    longest_pitch,
    pitch_limits,
    with_drivers,
)
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_in
from monitor.discovery.search.missing import Searched
from monitor.discovery.search.plausible import is_determined
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scan import except_for
from monitor.effects import ChainEffect, Context, with_time_constant
from monitor.effects.catalogue import SCREW_LEADS_MM
from monitor.effects.drivers import SettlingDriver, parse_driver
from monitor.effects.shapes import Cyclic, Harmonic, WindUp
from monitor.effects.shapes.windup import unit_of_width
from monitor.records import Array

# Neighbours on the grid of time constants differ by a factor of two; the best value lies between the neighbours of the
# best of the grid.
GRID_FACTOR = TIME_CONSTANTS_S[1] / TIME_CONSTANTS_S[0]
# Relative step of the numerical derivative by the searched value, and at most which part of the half range: a pitch
# that differs by a thousandth is a third of a period off after 3 m.
STEP, STEP_OF_WIDTH = 1e-3, 0.04
# Twice the logarithm of the likelihood ratio that a value exceeds in 5 % (chi-square with one degree of freedom).
LIMIT = 3.84
# Values that are tried for a limit differ by this factor.
LIMIT_FACTOR = 2.0**0.25
# So often it goes on below the grid, to a 250th of its shortest; an optimum as near to an end, as a part of the range,
# is that end.
MOST_BELOW_GRID, AT_END = 8, 0.02
# Widths that are tried between the neighbours on the grid.
WIDTHS_TRIED = 9
# Among so many pitches near one those are looked for that would be the bend of another axis.
OTHER_PITCHES = 41
# Names of pitches have six digits.
NAMED_TO = 1e-5
# A warm-up has settled after so few readings that no data show how.
SETTLED_READINGS = 1.0


@dataclass(frozen=True)
class Refined:
    """A candidate at its best value; ``slope`` (M, 0 or 1) is how its part of the residual moves with it."""

    candidate: ChainCandidate
    searched: Searched | None
    slope: Array


@dataclass(frozen=True)
class _Range:
    """A value that is searched: its name, unit and start, the half ``width`` of its range in the logarithm and the
    tolerance there, the variant for any other value, the nearest value that is likelier beforehand, and its limits."""

    name: str
    unit: str
    start: float
    width: float
    tolerance: float
    variant: Callable[[float], ChainVariant]
    likely: Callable[[float], float | None]
    limits: tuple[float, float] = (0.0, float("inf"))


def _range_of(candidate: ChainCandidate) -> _Range | None:
    """The value that is searched of a candidate; None where there is none."""
    effect, family, variant = candidate.effect, candidate.family, candidate.variant
    if variant.tries == 1:
        return None
    if isinstance(effect.driver, SettlingDriver) and effect.driver.time_constant_s is not None:
        return _Range(
            "time constant",
            "min",
            effect.driver.time_constant_s / 60.0,
            float(np.log(GRID_FACTOR)),
            1e-3,
            lambda minutes: replace(variant, effect=with_time_constant(effect, 60.0 * minutes)),
            lambda minutes: None,
        )
    if not isinstance(effect, ChainEffect):
        return None
    if isinstance(effect.shape, Cyclic) and family.endswith(":cyclic"):
        pitch = effect.shape.pitch
        context = candidate.fit.problem.context
        shortest, travel = pitch_limits(context)[effect.joint.name]
        width = pitch * frequency_step(travel)
        near = pitch * np.exp(np.linspace(-width, width, OTHER_PITCHES))
        low, high = other_bounds(pitch, near, effect.term.joint, context)
        return _Range(
            "pitch",
            "mm",
            pitch,
            width,
            1e-5,
            lambda pitch: replace(variant, effect=_with_pitch(effect, pitch)),
            lambda pitch: min(SCREW_LEADS_MM, key=lambda lead: abs(lead - pitch)),
            (max(min(shortest, pitch), low), min(_longest_from(pitch, travel), high)),
        )
    if isinstance(effect.shape, WindUp):
        return _Range(
            "width",
            effect.shape.width_unit,
            effect.shape.width,
            float(np.log(GRID_FACTOR)),
            1e-3,
            lambda width: replace(variant, effect=_with_width(effect, width)),
            lambda width: None,
        )
    if isinstance(effect.shape, Harmonic) and family.endswith(":harmonic"):
        order = float(effect.shape.order)
        return _Range(
            "periods a turn",
            "1",
            order,
            ORDER_STEP / order,
            1e-5,
            lambda order: replace(variant, effect=_with_order(effect, order)),
            lambda order: float(round(order)),
        )
    return None


def _longest_from(pitch: float, travel: float) -> float:
    """The longest pitch in mm that is sought from one: half of the travel; from beyond, two thirds."""
    half = longest_pitch(travel)
    return max(pitch, half if pitch <= (1.0 + NAMED_TO) * half else travel / BEND_PERIODS)


def _with_order(effect: ChainEffect, order: float) -> ChainEffect:
    return replace(effect, shape=Harmonic(order), shape_text=f"harmonic{order:.6g}")


def _with_width(effect: ChainEffect, width: float) -> ChainEffect:
    shape = WindUp(width, unit_of_width(effect.joint))
    return replace(effect, shape=shape, shape_text=shape.text)


def _with_pitch(effect: ChainEffect, pitch: float) -> ChainEffect:
    return replace(effect, shape=Cyclic(pitch), shape_text=f"cyclic{pitch:.6g}mm")


def refine_all(scene: ChainScene, candidates: Sequence[ChainCandidate]) -> list[Refined]:
    """Refine all findings of a scan, the most convincing first."""
    selected = list(candidates)
    refined: list[Refined] = []
    for index in range(len(selected)):
        refined.append(_with_limit(scene, selected, index, refine(scene, selected, index)))
        selected[index] = refined[-1].candidate
    return refined


def refine(scene: ChainScene, selected: Sequence[ChainCandidate], index: int) -> Refined:
    """Refine the searched value of the candidate at an index, the other selected ones fitted along."""
    candidate = selected[index]
    searched = _range_of(candidate)
    if searched is None:
        return Refined(candidate, None, np.zeros((len(scene.residual), 0)))
    variant = searched.variant
    others = except_for(selected, index)
    beside = scene.remainders.beside(others)

    def at(value: float) -> ChainCandidate:
        return scene_of(scene.fit, [variant(value)]).candidates[0]

    def badness(logarithm: float) -> float:
        trial = at(float(np.exp(logarithm)))
        (evidence,) = weigh_in(beside, [trial])
        return -evidence.explained

    value = float(np.exp(_best_logarithm(badness, searched)))
    refined = at(value)
    estimate = amplitudes(scene, [refined]).estimate
    step = min(STEP, STEP_OF_WIDTH * searched.width)
    high, low = at(value * (1.0 + step)), at(value * (1.0 - step))
    slope = ((high.columns - low.columns) @ estimate / (2.0 * step * value))[:, None]
    u = _uncertainty(scene, refined, slope, scene.columns(others))
    likely = searched.likely(value)
    if likely is not None and abs(likely - value) < 2.0 * u:
        value, refined = likely, at(likely)
    if searched.unit == "min" and 60.0 * value < SETTLED_READINGS * _between_readings(scene):
        # It has settled before the second reading: what it follows at once.
        return Refined(_settled(scene, candidate), None, np.zeros((len(scene.residual), 0)))
    if searched.unit == "min" and counts_readings(scene.fit.problem.context):
        return Refined(refined, None, slope)
    return Refined(refined, Searched(searched.name, value, u if u < value else None, searched.unit), slope)


def _best_logarithm(badness: Callable[[float], float], searched: _Range) -> float:
    """The logarithm of the best value between the neighbours on the grid. Below the grid's shortest time constant there
    is no neighbour: it goes on by that factor as long as shorter ones are better. All widths below a step of the axis
    are one, and the best may stand beside that plain: it is sought from the best of a few widths."""
    middle = float(np.log(searched.start))
    if searched.name == "width":
        widths = np.linspace(middle - searched.width, middle + searched.width, WIDTHS_TRIED)
        middle = float(widths[int(np.argmin([badness(width) for width in widths.tolist()]))])
        searched = replace(searched, width=float(widths[1] - widths[0]))
    for _ in range(MOST_BELOW_GRID if searched.unit == "min" else 1):
        with np.errstate(divide="ignore"):
            least, most = np.log(searched.limits).tolist()
        low, high = max(middle - searched.width, least), middle + searched.width
        best = scipy.optimize.minimize_scalar(
            badness,
            bounds=(low, min(high, most)),
            method="bounded",
            options={"xatol": searched.tolerance, "maxiter": 30},
        )
        middle = float(best.x)
        if middle - low > AT_END * searched.width:
            break
    return middle


def _with_limit(
    scene: ChainScene, selected: Sequence[ChainCandidate], index: int, refined: Refined
) -> Refined:
    """A refined candidate with the limit of a time constant that the data do not determine; without a searched value of
    another kind that they do not determine."""
    searched = refined.searched
    if searched is None:
        return refined
    if searched.unit != "min":
        return replace(refined, searched=searched if searched.u is not None else None)
    if searched.u is not None and is_determined(searched.value, searched.u):
        return refined
    at_least = _at_least(scene, selected, index, searched.value)
    return replace(refined, searched=replace(searched, u=None, at_least=at_least))


def _at_least(
    scene: ChainScene, selected: Sequence[ChainCandidate], index: int, value: float
) -> float | None:
    """The value in min that a time constant exceeds, the other selected effects fitted along; None where the shortest
    would do."""
    searched = _range_of(selected[index])
    assert searched is not None
    lowest = TIME_CONSTANTS_S[0] / 60.0 / GRID_FACTOR
    steps = int(np.ceil(np.log(max(value / lowest, 1.0)) / np.log(LIMIT_FACTOR)))
    values = [value / LIMIT_FACTOR**step for step in range(steps + 1)]
    variants = [searched.variant(trial) for trial in values]
    beside = scene.remainders.beside(except_for(selected, index))
    total = float(beside.residual @ beside.residual)
    best = 0.0
    for number, candidate in enumerate(scene_of(scene.fit, variants).candidates):
        columns = orthonormal(without(beside.basis, candidate.columns))
        rest = max(total - float(np.sum((columns.T @ beside.residual) ** 2)), 1e-300)
        best = rest if number == 0 else min(best, rest)
        if beside.degrees_of_freedom * np.log(rest / best) > LIMIT:
            return values[number]
    return None


def at_rest(scene: ChainScene, candidate: ChainCandidate) -> ChainCandidate:
    """A candidate that follows a driver, without it; that of the scene where it has it, at the price of its pitch."""
    (bare,) = with_drivers(candidate.effect, ()) or [candidate.variant]
    searched = (each for each in scene.candidates if each.effect.text == bare.effect.text)
    return next(searched, None) or scene_of(scene.fit, [bare]).candidates[0]


def _settled(scene: ChainScene, candidate: ChainCandidate) -> ChainCandidate:
    """A candidate whose driver settles at once: with the channel that it follows, or without a driver."""
    driver = candidate.effect.driver
    if isinstance(driver, SettlingDriver) and driver.settled:
        effect = replace(candidate.effect, driver=parse_driver(driver.settled), driver_text=driver.settled)
        return scene_of(scene.fit, [Variant(effect.text, effect)]).candidates[0]
    return at_rest(scene, candidate)


def _between_readings(scene: ChainScene) -> float:
    """The usual time in s between two readings of a run."""
    context = scene.fit.problem.context
    steps = np.diff(context.time)[np.diff(context.run) == 0]
    return float(np.median(steps)) if len(steps) else 0.0


def counts_readings(context: Context) -> bool:
    """Whether the column of times is no time but a number: no constant in minutes comes from it.

    It is one where it goes with the sequence number, or where it grows by nothing or by exactly 1 s from row to row:
    the number of the row, or of the pose that several rows share.
    """
    together = np.diff(context.run) == 0
    steps = np.diff(context.time)[together]
    if not steps.any():
        return True
    numbered = np.array_equal(steps, np.diff(context.sequence)[together])
    return bool(numbered or np.all((steps == 0.0) | (steps == 1.0)))


def _uncertainty(scene: ChainScene, candidate: ChainCandidate, slope: Array, others: Array) -> float:
    basis = orthonormal(np.concatenate([others, candidate.columns], axis=1))
    remainder = without(basis, slope)
    residual = without(basis, scene.residual[:, None])
    length = float(np.linalg.norm(remainder))
    variance = float(np.sum(residual**2)) / scene.degrees_of_freedom
    return float(np.sqrt(variance)) / length if length > 0 else float("inf")
