"""Gears of unknown ratio: the orders at which a rotary joint's own error repeats, found by a periodogram.

The turn of a joint that a gear causes shows in each row as one number, the part of the residual along the way that
the joint moves the tool. So the whole range of orders is looked at for the price of one, and only what stands out
becomes a candidate of the scan, where it pays for the search. The rows of few indexations repeat at several orders:
there only those are looked at that have more than two indexations a period.
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
# So many orders of one joint are looked at in detail.
MOST_PEAKS = 3
# Periods that the travel has to show before a line is a gear: one, and three where flexure and refraction bend too
# (of 1.3 periods over the 65 degrees of an elevation axis nobody can say that they repeat).
FEWEST_PERIODS, FEWEST_BESIDE_BENDS = 1.0, 3.0


def in_rows(fit: Fit, padded: Array) -> Array:
    """Rows (n, d) of numbers that stand run by run (M,)."""
    problem = fit.problem
    count, numbers = problem.sigma.shape
    targets = problem.padded(np.arange(1.0, count * numbers + 1.0).reshape(count, numbers))
    runs = padded.reshape(len(problem.runs), -1)[:, : targets.shape[1]]
    rows = np.zeros(count * numbers)
    filled = targets > 0
    rows[targets[filled].astype(np.int64) - 1] = runs[filled]
    return rows.reshape(count, numbers)


def gear_variants(scene: ChainScene, selected: Sequence[ChainCandidate], rate: float) -> list[ChainVariant]:
    """Harmonics of rotary joints that stand out of what the selected effects leave, at a false-alarm ``rate``."""
    fit, problem = scene.fit, scene.fit.problem
    chain, positions = problem.context.chain, problem.context.positions
    orders = np.arange(LOWEST, HIGHEST + STEP / 2.0, STEP)
    highest = {
        index: _highest_order(positions[:, index])
        for index, joint in enumerate(chain.joints)
        if joint.kind == "rotary"
    }
    tried = {index: int(np.sum(orders <= order)) for index, order in highest.items() if order >= LOWEST}
    if not tried:
        return []
    beside = scene.remainders.beside(selected)
    residual = beside.residual
    variance = float(residual @ residual) / max(beside.degrees_of_freedom, 1)
    rows = in_rows(fit, residual)
    limit = -2.0 * np.log(rate / sum(tried.values()))
    fewest = FEWEST_BESIDE_BENDS if problem.needs_whole_periods else FEWEST_PERIODS
    variants = []
    for index, count in tried.items():
        joint = chain.joints[index]
        way = problem.observe(fit.by_error[:, :, index, MOTION, 3 + joint.main]) / problem.sigma
        turn = np.sum(way * rows, axis=1)
        weight = np.sum(way * way, axis=1)
        # The two columns are all but orthogonal and of the same length over many positions.
        square = _squares(turn, positions[:, index], count)
        power = 2.0 * square / max(float(weight.sum()), 1e-300) / variance
        # Too few periods over the travel are a bend, not a gear.
        power = np.where(
            orders[:count] * float(np.ptp(positions[:, index])) < fewest * 2.0 * np.pi, 0.0, power
        )
        peaks = np.flatnonzero((power > limit) & (power >= np.roll(power, 1)) & (power >= np.roll(power, -1)))
        term = f"E{COMPONENTS[3 + joint.main]}{joint.name}"
        for peak in peaks[np.argsort(-power[peaks])][:MOST_PEAKS]:
            text = f"{term}:harmonic{orders[peak]:.6g}"
            variants.append(Variant(f"{term}:harmonic", parse_effect(text, chain), count))
    return variants


def _highest_order(position: Array) -> float:
    """The highest order that positions (n,) in rad fix, 0 where these are too few: below that of two indexations a
    period every order is seen as itself."""
    if len(np.unique(np.round(position, 6))) >= ENOUGH_POSITIONS:
        return HIGHEST
    indexations = np.sort(position)[
        np.flatnonzero(np.diff(np.sort(position), prepend=-np.inf) > ONE_TARGET_RAD)
    ]
    if len(indexations) < FEWEST_POSITIONS:
        return 0.0
    return min(HIGHEST, np.pi / float(np.diff(indexations).max()) - STEP)


def _squares(numbers: Array, position: Array, count: int) -> Array:
    """The squares (count,) of the lengths of the Fourier sums of numbers (n,) over positions in rad, order by order."""
    # From one order to the next every wave turns by as much: a cosine and a sine of each would take ten times as long.
    wave, turn = numbers * np.exp(1j * LOWEST * position), np.exp(1j * STEP * position)
    sums = np.empty(count, dtype=np.complex128)
    for order in range(count):
        sums[order] = wave.sum()
        wave *= turn
    return np.asarray(np.abs(sums) ** 2)
