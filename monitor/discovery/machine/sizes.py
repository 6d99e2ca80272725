"""How large an effect is that was found: one number with its standard uncertainty.

A coefficient is its own size (of teeth it is their step), and a cosine and a sine, or the components of gravity, have a
length. Where coefficients nearly cancel or there are as many as one likes (lines over a part of a turn, weights of
links, nodes of a table, parts of a free shape) the size is the largest value of the error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.discovery.machine.joints.curve_findings import is_curve
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, MachineEffect, scene_of
from monitor.discovery.machine.scene_columns import raw_columns
from monitor.discovery.machine.shapes.curves import Curve, beyond_base, curve_of, without_powers
from monitor.discovery.search.amplitudes import length_of
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.plausible import nearly_cancelled
from monitor.effects import ChainEffect, Context, parse_effect
from monitor.effects.drivers import Always, EachRun
from monitor.effects.effect import ChainBasis
from monitor.effects.shapes import Harmonics, Nodes, Poly, Sawtooth, Step
from monitor.effects.weight import LinkWeights
from monitor.machine import MOTION
from monitor.records import Array
from monitor.units import Unit

#: Lengths of which an effect moves none by this part of its standard uncertainty (0.1 µm of a laser, of which so many
#: digits are said), and all together by less than this part of what it moves angles, in squares: it is told as a turn.
SEEN, OF_ANGLES = 0.5, 0.01


@dataclass(frozen=True)
class Size:
    """The ``amplitude`` of an effect with its standard uncertainty ``u``, in ``unit`` (None: that of its coefficients),
    and the displacements ``raw`` (n, d, k) in mm of a unit of each coefficient. ``curve`` is that of a free shape,
    ``largest`` the node of a table that is its size."""

    amplitude: float
    u: float
    raw: Array
    unit: Unit | None = None
    curve: Curve | None = None
    largest: str | None = None


def size_of(candidate: ChainCandidate, coefficients: Array, covariance: Array) -> Size:
    """The size of an effect with coefficients (k,) and their covariance (k, k)."""
    effect, raw, context = candidate.effect, candidate.raw, candidate.fit.problem.context
    if candidate.variant.nearest is not None and not is_curve(candidate):
        curve = curve_of(context, effect, coefficients, covariance)
        if curve is not None:
            if isinstance(effect, ChainEffect) and isinstance(effect.shape, Sawtooth):
                # One coefficient, the step of the teeth: that of the fitted model, of maps and of tables.
                step, u = spread_or_length(effect, coefficients, covariance)
                return Size(abs(step), u, _of_shape(candidate, beyond_base), curve=curve)
            # Parts of a free shape that nearly cancel are as large as they like: its size is what its curve shows.
            largest = int(np.abs(curve.size).argmax())
            amplitude, u = abs(float(curve.size[largest])), float(curve.u[largest])
            return Size(amplitude, u, _of_shape(candidate, beyond_base), curve=curve)
    if isinstance(effect, ChainEffect):
        several_steps = isinstance(effect.shape, Step) and len(coefficients) > 1
        if (several_steps or isinstance(effect.shape, Nodes)) and not isinstance(effect.driver, EachRun):
            # The length of all nodes grows with their number: what the axis errs by is the largest of them.
            node = int(np.abs(coefficients).argmax())
            u = float(np.sqrt(covariance[node, node]))
            return Size(abs(float(coefficients[node])), u, raw, largest=effect.parameters(context)[node])
        by_weights, by_lines = isinstance(effect.driver, LinkWeights), isinstance(effect.shape, Harmonics)
        if by_weights or by_lines:
            # Over a part of a turn low orders nearly cancel: what the joint does there is their sum.
            size = largest_deviation(effect.basis(context).columns, coefficients, covariance)
            unit = effect.term.unit if by_weights else None
            return Size(*size, raw - raw.mean(axis=0) if by_lines else raw, unit)
    return Size(*spread_or_length(effect, coefficients, covariance), raw)


def spread_or_length(effect: MachineEffect, coefficients: Array, covariance: Array) -> tuple[float, float]:
    """The length of the coefficients, or the spread of sizes of the runs, with its standard uncertainty."""
    if len(coefficients) == 1 or not isinstance(effect.driver, EachRun):
        return length_of(coefficients, covariance)
    # The spread of the sizes less what noise adds to it, and the uncertainty of a variance from R sizes.
    noise = float(np.mean(np.diag(covariance)))
    total = float(np.var(coefficients, ddof=1))
    spread = float(np.sqrt(max(total - noise, 0.0)))
    u_of_variance = total * float(np.sqrt(2.0 / (len(coefficients) - 1)))
    return spread, u_of_variance / (2.0 * max(spread, float(np.sqrt(noise))))


def largest_deviation(columns: Array, coefficients: Array, covariance: Array) -> tuple[float, float]:
    """The largest deviation from its mean of an error with columns (n, k), and its standard uncertainty; in absolute
    value, for the coefficients of several weights have no sign in common."""
    apart = columns - columns.mean(axis=0)
    row = apart[int(np.abs(apart @ coefficients).argmax())]
    return abs(float(row @ coefficients)), float(np.sqrt(max(row @ covariance @ row, 0.0)))


def peak_of(scene: ChainScene, candidate: ChainCandidate, raw: Array, coefficients: Array) -> float:
    """The largest displacement in mm where lengths were measured, of displacements ``raw`` (n, d, k); no more than what
    a power of the position of an axis makes beyond the constant and the slope that the base takes up. Where those rows
    show nothing it is that of the rows of angles.

    Powers of a position are counted from the zero of the axis, which may lie far from where it stood.
    """
    return min(_largest(scene, each @ coefficients) for each in (raw, _beyond_powers(scene, candidate, raw)))


def all_but_cancels(
    scene: ChainScene, candidate: ChainCandidate, coefficients: Array, explained: float
) -> bool:
    """Whether an effect with coefficients (k,) is many times as large as what it takes of the error, ``explained`` in
    squares of sigma: others nearly cancel it. Of a power of a position what the base takes up is not counted."""
    removed = scene.fit.sigma**2 * explained
    whole = float(np.linalg.norm(candidate.raw @ coefficients, axis=1).max())
    if not nearly_cancelled(whole, removed, scene.fit.readings):
        return False
    beyond = _beyond_powers(scene, candidate, candidate.raw) @ coefficients
    peak = float(np.linalg.norm(beyond, axis=1).max())
    return nearly_cancelled(peak, removed, scene.fit.readings)


def peaks_of_errors(
    scene: ChainScene, candidates: Sequence[ChainCandidate], sizes: Sequence[tuple[Array, Array]]
) -> dict[int, float]:
    """The largest displacement in mm of every error of the chain that has several effects, of all of them together as
    ``peak_of`` of one, by the index of its first candidate; ``sizes`` are the coefficients and their covariances.

    Effects of one error that cancel in part are each larger than what the axis does.
    """
    of_error: dict[str, list[int]] = {}
    for index, candidate in enumerate(candidates):
        if isinstance(candidate.effect, ChainEffect):
            of_error.setdefault(candidate.effect.term.symbol, []).append(index)
    peaks = {}
    for several in (indices for indices in of_error.values() if len(indices) > 1):
        raws = [size_of(candidates[index], *sizes[index]).raw for index in several]
        whole = sum(raw @ sizes[index][0] for index, raw in zip(several, raws, strict=True))
        beyond = sum(
            _beyond_powers(scene, candidates[index], raw) @ sizes[index][0]
            for index, raw in zip(several, raws, strict=True)
        )
        peaks[several[0]] = min(_largest(scene, np.asarray(each)) for each in (whole, beyond))
    return peaks


def seen_as_turn(scene: ChainScene, displacement: Array) -> bool:
    """Whether displacements (n, d) in mm show in rows of angles and hardly in lengths: every laser has an Abbe arm of
    some mm. Those of an angle are on a lever of a metre."""
    problem = scene.fit.problem
    lengths = problem.is_length
    moved = np.where(np.isfinite(problem.sigma), np.abs(displacement) / problem.sigma, 0.0)
    of_lengths, of_angles = (float(np.sum(moved[rows] ** 2)) for rows in (lengths, ~lengths))
    return not (moved[lengths] > SEEN).any() and of_lengths < OF_ANGLES * of_angles


def _largest(scene: ChainScene, displacement: Array) -> float:
    """The largest of displacements (n, d) in mm where lengths were measured; where those show nothing, of angles."""
    rows = scene.fit.problem.is_length
    if not rows.any() or seen_as_turn(scene, displacement):
        rows = ~rows
    return float(np.linalg.norm(displacement[rows], axis=1).max())


def _beyond_powers(scene: ChainScene, candidate: ChainCandidate, raw: Array) -> Array:
    """The displacements ``raw`` (n, d, k) of an effect; of a power of the position of an axis what the base leaves."""
    effect = candidate.effect
    if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Poly):
        return raw
    if not isinstance(effect.driver, Always) or effect.term.stage != MOTION:
        return raw
    powers = _powers_of_base(scene, effect)
    return _of_shape(candidate, lambda context, of: without_powers(context, of, powers))


def _powers_of_base(scene: ChainScene, effect: ChainEffect) -> list[int]:
    """The powers of the position of an axis which the base takes up of one of its errors: its place and its gain."""
    chain = scene.fit.problem.context.chain
    texts = (f"{effect.term.symbol}:const", f"{effect.term.symbol}:poly1")
    variants = [Variant(text, parse_effect(text, chain)) for text in texts]
    visible = {each.family: each.visible for each in scene_of(scene.fit, variants).candidates}
    return [power for power, text in enumerate(texts) if not visible.get(text, True)]


def _of_shape(candidate: ChainCandidate, columns_of: Callable[[Context, ChainEffect], Array]) -> Array:
    """The displacement (n, d, k) in mm of an error of an axis with other columns of its shape."""
    effect, basis, fit = candidate.effect, candidate.basis, candidate.fit
    if not isinstance(effect, ChainEffect) or not isinstance(basis, ChainBasis):
        return candidate.raw
    columns = columns_of(fit.problem.context, effect)
    return np.moveaxis(raw_columns(fit, replace(basis, columns=columns)), 0, 2)
