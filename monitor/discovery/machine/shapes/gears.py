"""Gears of unknown ratio: the orders at which a rotary joint's own error repeats, found by a periodogram.

The turn of a joint that a gear causes shows in each row as one number, the part of the residual along the way that
the joint moves the tool. So the whole range of orders is looked at for the price of one, and only what stands out
becomes a candidate of the scan, where it pays for the search. The rows of few indexations may repeat at several orders:
those that have more than two indexations a period pay for themselves alone, those above for the whole range, and these
are looked at only where the positions scatter enough about their grid to tell them from the lower ones.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.approach import ONE_TARGET_RAD
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.machine import COMPONENTS, MOTION
from monitor.records import Array

# From beyond the low harmonics of bearings and wheels to twice the ratio of a reduction gear of robots (50 to 160
# mostly). Over a travel of half a turn orders closer than one cannot be separated; the grid is twice as fine.
LOWEST, HIGHEST, STEP = 4.0, 330.0, 0.5
# So many different positions fix any of these orders; fewer, of which there have to be some, only the low ones.
ENOUGH_POSITIONS, FEWEST_POSITIONS = 100, 24
# Waves of two orders whose sums over the positions agree to this part leave 2 % of each other's square: they are one.
SAME_WAVE = 0.99
# The window of the positions is looked at so finely, and beyond this finer about its maxima.
WINDOW_STEP, WORTH_A_LOOK = 0.25, 0.9
# So many orders of one joint are looked at in detail.
MOST_PEAKS = 3
# Numbers of waves that are filtered in one piece (8 MB).
NUMBERS_AT_ONCE = 500_000
# Periods that the travel has to show before a line is a gear: one, and three where flexure and refraction bend too
# (of 1.3 periods over the 65 degrees of an elevation axis nobody can say that they repeat).
FEWEST_PERIODS, FEWEST_BESIDE_BENDS = 1.0, 3.0


def gear_variants(scene: ChainScene, selected: Sequence[ChainCandidate], rate: float) -> list[ChainVariant]:
    """Harmonics of rotary joints that stand out of what the selected effects leave, at a false-alarm ``rate``."""
    fit, problem = scene.fit, scene.fit.problem
    chain, positions = problem.context.chain, problem.context.positions
    orders = np.arange(LOWEST, HIGHEST + STEP / 2.0, STEP)
    turning = [index for index, joint in enumerate(chain.joints) if joint.kind == "rotary"]
    ranges = {index: _ranges(positions[:, index], orders) for index in turning}
    tried = {index: counts for index, counts in ranges.items() if counts}
    if not tried:
        return []
    beside = scene.remainders.beside(selected)
    residual = beside.residual
    variance = float(residual @ residual) / max(beside.degrees_of_freedom, 1)
    # Of correlated noise the residual is filtered, and in directions of its own; a wave is not.
    rows = fit.by_rows(residual.reshape(len(problem.runs), -1, 1))[..., 0]
    in_all = [sum(counts[min(part, len(counts) - 1)] for counts in tried.values()) for part in range(2)]
    fewest = FEWEST_BESIDE_BENDS if problem.needs_whole_periods else FEWEST_PERIODS
    variants = []
    for index, counts in tried.items():
        count = counts[-1]
        in_first = np.arange(count) < counts[0]
        limit = -2.0 * np.log(rate / np.where(in_first, *in_all))
        joint = chain.joints[index]
        way = problem.observe(fit.by_error[:, :, index, MOTION, 3 + joint.main]) / problem.sigma
        turn = np.sum(way * rows, axis=1)
        # The two columns are all but orthogonal and of the same length over many positions.
        square = _squares(turn, positions[:, index], count)
        power = 2.0 * square / _lengths(fit, way, positions[:, index], orders[:count]) / variance
        # Too few periods over the travel are a bend, not a gear.
        power = np.where(
            orders[:count] * float(np.ptp(positions[:, index])) < fewest * 2.0 * np.pi, 0.0, power
        )
        peaks = np.flatnonzero((power > limit) & (power >= np.roll(power, 1)) & (power >= np.roll(power, -1)))
        term = f"E{COMPONENTS[3 + joint.main]}{joint.name}"
        for peak in peaks[np.argsort(-power[peaks])][:MOST_PEAKS]:
            text = f"{term}:harmonic{orders[peak]:.6g}"
            variants.append(
                Variant(f"{term}:harmonic", parse_effect(text, chain), counts[0] if in_first[peak] else count)
            )
    return variants


def _ranges(position: Array, orders: Array) -> tuple[int, ...]:
    """How many of the ``orders`` positions (n,) in rad fix by their number, and how many by how they scatter, where
    that is more; empty where these are too few."""
    every = np.unique(np.round(position, 6))
    indexations = every[np.diff(every, prepend=-np.inf) > ONE_TARGET_RAD]
    if len(every) >= ENOUGH_POSITIONS:
        return (len(orders),)
    if len(indexations) < FEWEST_POSITIONS:
        return ()
    # Below the order of two indexations a period every one is seen as itself.
    by_gaps = np.pi / float(np.diff(indexations).max()) - STEP
    by_window = first_repeat(position) / 2.0 - STEP
    counts = sorted({int(np.sum(orders <= highest)) for highest in (by_gaps, max(by_gaps, by_window))})
    return tuple(count for count in counts if count)


def first_repeat(position: Array) -> float:
    """The lowest number of waves a turn that is as good as none at positions (n,) in rad, beyond those that are too
    slow for the travel; infinite where there is none up to twice the highest order."""
    waves = np.arange(0.0, 2.0 * HIGHEST, WINDOW_STEP)
    window = window_of(position, waves)
    beyond = int(np.argmax(window < WORTH_A_LOOK))
    for wave in waves[beyond:][window[beyond:] > WORTH_A_LOOK]:
        near = wave + np.linspace(-WINDOW_STEP, WINDOW_STEP, 11)
        if window_of(position, near).max() > SAME_WAVE:
            return float(wave)
    return np.inf


def window_of(position: Array, waves: Array) -> Array:
    """The length (k,) of the mean of unit vectors that turn by so many ``waves`` (k,) a turn over positions (n,) in
    rad: one where these are all alike to them."""
    indexations, rows = np.unique(np.round(position, 6), return_counts=True)
    window = np.empty(len(waves))
    at_once = max(NUMBERS_AT_ONCE // len(indexations), 1)
    for start in range(0, len(waves), at_once):
        some = slice(start, start + at_once)
        window[some] = np.abs(np.exp(1j * waves[some, None] * indexations) @ rows) / len(position)
    return window


def _lengths(fit: Fit, way: Array, position: Array, orders: Array) -> Array:
    """The squared lengths (count,) of the cosine and the sine of every order together, which move the rows by ``way``
    (n, d) of their standard uncertainty for a unit of the turn: the same for all orders in independent noise."""
    if fit.whitening is None:
        return np.full(len(orders), max(float(np.sum(way * way)), 1e-300))
    moved = fit.problem.padded(way[..., None])[..., 0]
    padded_position = fit.problem.padded(np.broadcast_to(position[:, None, None], (*way.shape, 1)))[..., 0]
    lengths = np.empty(len(orders))
    at_once = max(NUMBERS_AT_ONCE // moved.size, 1)
    for start in range(0, len(orders), at_once):
        some = slice(start, start + at_once)
        # Of calibrated quantities, which stand behind the rows, a turn moves nothing.
        waves = np.zeros((2, len(orders[some]), *fit.solution.last.residual.shape))
        angle = orders[some, None, None] * padded_position
        waves[0, :, :, : moved.shape[1]], waves[1, :, :, : moved.shape[1]] = (
            moved * np.cos(angle),
            moved * np.sin(angle),
        )
        white = fit.whitening(waves)
        lengths[some] = np.einsum("pkrn,pkrn->k", white, white)
    return np.maximum(lengths, 1e-300)


def _squares(numbers: Array, position: Array, count: int) -> Array:
    """The squares (count,) of the lengths of the Fourier sums of numbers (n,) over positions in rad, order by order."""
    # From one order to the next every wave turns by as much: a cosine and a sine of each would take ten times as long.
    wave, turn = numbers * np.exp(1j * LOWEST * position), np.exp(1j * STEP * position)
    sums = np.empty(count, dtype=np.complex128)
    for order in range(count):
        sums[order] = wave.sum()
        wave *= turn
    return np.asarray(np.abs(sums) ** 2)
