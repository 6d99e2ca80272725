"""Curves of rotary joints that have several lines: gears, encoders and bearings, as one effect of each joint.

A strain wave drive errs at many orders at once. Searched one by one they fill a search with single harmonics, each of
which the next one moves. So, before the search, the lines of all joints are pursued together (orthogonal matching
pursuit: Pati, Rezaiifar and Krishnaprasad, Asilomar 1993) on whole orders, with all that weights, play, lag and drifts
could do taken out, every pose counted as one observation, for as long as poses left out in blocks are predicted better.
A joint with several lines becomes one effect; where no joint has several, single lines are left to the search. Where a
table over the travel predicts better than the lines, it is the curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import scipy
from scipy import special

from monitor.discovery.machine.evidence.held_out import of_numbers, pose_blocks, poses_of
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainVariant, scene_of
from monitor.discovery.machine.shapes.gears import ENOUGH_POSITIONS, HIGHEST
from monitor.discovery.machine.shapes.tables import occupied
from monitor.discovery.search.candidate import Variant, side_by_side
from monitor.discovery.search.plausible import nearly_cancelled
from monitor.discovery.search.projection import orthonormal, without
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.drivers import WarmUp
from monitor.effects.drivers.gravity import Gravity
from monitor.effects.shapes import Const, Harmonic, harmonics_text, nodes_text
from monitor.machine import COMPONENTS, MOTION
from monitor.records import Array
from monitor.units import DEGREE

# Fewer poses than this do not hold the lines of six joints beside the geometry.
FEWEST_POSES = 200
# Orders up to this belong to encoders and bearings at the output side; gears are looked for above it.
LOW = (1.0, 2.0, 3.0)
# A sweep takes the lines of at least this part of the power of the strongest one; weaker ones may be its side lobes.
STRONG = 0.3
MOST_SWEEPS = 40
# Lines closer than this, in units of one period over the travel, are one that lies between whole orders.
SAME_LINE = 1.5
# An effect whose displacement is this many times as large as what it takes of the residual is nearly cancelled by
# others: no finding. A load that gives way moves poses at full reach some ten times as much as the usual one.
LARGEST_RATIO = 40.0
# Nodes of tables that are tried; a node needs some poses.
NODES, POSES_A_NODE = (24, 36, 48, 60), 12
# A node with fewer poses about it is the error of each of them.
LEAST_POSES = 3
# A table that is no curve of the lines must stand out so far from them.
TABLE_LEVEL = 1e-4


@dataclass(frozen=True)
class _Joint:
    """A joint that may have a curve: its index, term of its drive, positions (P,) in rad of poses, orders (K,) that are
    looked at, and the way (n, d) that it moves each reading for a radian, whitened."""

    index: int
    term: str
    position: Array
    orders: Array
    way: Array

    @cached_property
    def waves(self) -> tuple[Array, Array]:
        """Cosines and sines (P, K) of all orders."""
        phase = np.outer(self.position, self.orders)
        return np.cos(phase), np.sin(phase)

    @property
    def travel(self) -> float:
        """The range of positions in rad."""
        return float(np.ptp(self.position))

    def clusters(self, orders: Sequence[float]) -> int:
        """The number of lines among orders, neighbours that the travel cannot separate counted once."""
        apart = SAME_LINE * 2.0 * np.pi / self.travel
        high = np.sort([order for order in orders if order > LOW[-1]])
        low = sum(order <= LOW[-1] for order in orders)
        return low + int(len(high) > 0) + int(np.sum(np.diff(high) > apart))


@dataclass(frozen=True)
class _Blocks:
    """Sums over blocks of poses of an orthonormal basis (M, k): products (B, k, k), and (B, k) with the residual."""

    grams: Array
    ontos: Array

    def with_columns(self, basis: Array, columns: Array, whole: Array, rows: Sequence[slice]) -> _Blocks:
        """The sums with further columns (M, c); ``rows`` are the blocks, in the order of the rows."""
        size, more = basis.shape[1], columns.shape[1]
        grams = np.zeros((len(rows), size + more, size + more))
        ontos = np.concatenate([self.ontos, np.zeros((len(rows), more))], axis=1)
        grams[:, :size, :size] = self.grams
        for block, inside in enumerate(rows):
            part = columns[inside]
            grams[block, size:, :size] = part.T @ basis[inside]
            grams[block, :size, size:] = grams[block, size:, :size].T
            grams[block, size:, size:] = part.T @ part
            ontos[block, size:] = part.T @ whole[inside]
        return _Blocks(grams, ontos)

    def held_out(self, square: float) -> float:
        """Sum of squares of blocks that took no part; ``square`` is that of the residual without any column."""
        gram, onto = self.grams.sum(axis=0), self.ontos.sum(axis=0)
        total = square
        for gram_of_block, of_block in zip(self.grams, self.ontos, strict=True):
            sizes = scipy.linalg.solve(gram - gram_of_block, onto - of_block, assume_a="sym")
            total += float(sizes @ gram_of_block @ sizes - 2.0 * sizes @ of_block)
        return total


class Pursuit:
    """The lines selected so far: an orthonormal basis of them and all that protects, and what it leaves.

    Rows stand in the order of their blocks of poses; ``order`` (M,) says which whitened number each is.
    """

    def __init__(self, fit: Fit, protecting: Array, pose: npt.NDArray[np.int64]) -> None:
        self.fit = fit
        self.pose = pose
        blocks = pose_blocks(fit)
        self.order = np.argsort(blocks, kind="stable")[int(np.sum(blocks < 0)) :]
        edges = np.searchsorted(blocks[self.order], np.arange(int(blocks.max()) + 2))
        self.rows = [slice(first, last) for first, last in pairwise(edges)]
        self.numbered = of_numbers(fit, pose)[self.order]
        self.whole = fit.white.reshape(-1)[self.order]
        self.square = float(self.whole @ self.whole)
        self.basis = np.zeros((len(self.whole), 0))
        self.blocks = _Blocks(np.zeros((len(self.rows), 0, 0)), np.zeros((len(self.rows), 0)))
        self.residual = self.whole
        self.take(self.new(protecting[self.order]))

    def new(self, columns: Array) -> Array:
        """An orthonormal basis of what columns (M, c) have beside what is selected."""
        return orthonormal(without(self.basis, columns))

    def columns(self, texts: Sequence[str]) -> Array:
        """Columns (M, c) of effects."""
        return columns_of(self.fit, texts)[self.order]

    def take(self, new: Array) -> None:
        """Go on with new columns."""
        self.blocks = self.blocks.with_columns(self.basis, new, self.whole, self.rows)
        self.basis = np.concatenate([self.basis, new], axis=1)
        self.residual = self.residual - new @ (new.T @ self.residual)

    def held_out(self, new: Array | None = None) -> float:
        """Sum of squares of blocks of poses that took no part, with ``new`` columns beside the selected ones."""
        if new is None:
            return self.blocks.held_out(self.square)
        return self.blocks.with_columns(self.basis, new, self.whole, self.rows).held_out(self.square)

    def turns(self, joint: _Joint) -> Array:
        """What the residual says (P,) of the turn of a joint at every pose."""
        padded = np.zeros(self.fit.solution.last.residual.size)
        padded[self.order] = self.residual
        rows = self.fit.problem.by_rows(padded.reshape(*self.fit.solution.last.residual.shape, 1))[..., 0]
        return np.asarray(np.bincount(self.pose, weights=np.sum(joint.way * rows, axis=1)), dtype=float)

    def cancels(self, candidate: ChainCandidate, new: Array) -> bool:
        """Whether an effect with ``new`` columns is nearly cancelled by what is selected."""
        columns = without(self.basis, candidate.columns[self.order])
        sizes = np.linalg.pinv(columns, rcond=1e-6) @ self.residual
        peak = float(np.linalg.norm(candidate.raw @ sizes, axis=1).max())
        removed = self.fit.sigma**2 * float(np.sum((new.T @ self.residual) ** 2))
        return nearly_cancelled(peak, removed, self.fit.readings, LARGEST_RATIO)

    def p_value(self, new: Array) -> float:
        """The p-value of new columns, every pose counted as one observation; 1 where the model has all of them."""
        size = new.shape[1]
        if size == 0:
            return 1.0
        onto = new.T @ self.residual
        remainder = self.residual - new @ onto
        scores = np.column_stack([np.bincount(self.numbered, weights=column * remainder) for column in new.T])
        statistic = float(onto @ np.linalg.pinv(scores.T @ scores, hermitian=True) @ onto) / size
        return float(special.fdtrc(size, len(scores) - size, statistic))


def columns_of(fit: Fit, texts: Sequence[str]) -> Array:
    """Whitened columns (M, c) of effects, with what is free in every run taken out."""
    chain = fit.problem.context.chain
    variants = [Variant(text, parse_effect(text, chain)) for text in texts]
    return side_by_side(fit.solution.last.residual.size, scene_of(fit, variants).candidates)


def joint_curves(fit: Fit, variants: Sequence[ChainVariant], rate: float) -> tuple[ChainVariant, ...]:
    """The curves of rotary joints, one variant a joint, where some joint has several lines; else empty.

    ``variants`` is the catalogue, ``rate`` the false-alarm probability of a sweep over all orders and joints.
    """
    pose = poses_of(fit)
    joints = _joints(fit, pose) if pose.max() + 1 >= FEWEST_POSES else []
    if not joints:
        return ()
    scene = scene_of(fit, protecting(fit, variants))
    always = scene.columns([candidate for candidate in scene.candidates if candidate.visible])
    low = columns_of(fit, [f"{joint.term}:{harmonics_text(LOW)}" for joint in joints])
    # With the low orders of all joints too, the strongest ones, nothing of them leaks into the others.
    high = Pursuit(fit, np.concatenate([always, low], axis=1), pose)
    lines = _high_lines(high, joints, rate)
    if all(joint.clusters(lines[joint.index]) == 0 for joint in joints):
        return ()
    pursuit = Pursuit(fit, always, pose)
    pursuit.take(pursuit.new(pursuit.columns(_texts(joints, lines))))
    _add_low_lines(pursuit, joints, lines, rate)
    _leave_out_cancelled(pursuit, always, joints, lines)
    curves = {
        joint.index: harmonics_text(lines[joint.index])
        for joint in joints
        if joint.clusters(lines[joint.index]) > 1
    }
    curves = _with_tables(high, always, joints, lines, curves)
    if curves:
        # The search beside curves looks for no lines: those of the other joints come along.
        curves = {index: _text_of(orders) for index, orders in lines.items() if orders} | curves
    chain = fit.problem.context.chain
    return tuple(
        Variant(
            f"{joint.term}:curve",
            parse_effect(f"{joint.term}:{curves[joint.index]}", chain),
            _tries(joints, lines[joint.index]),
        )
        for joint in joints
        if joint.index in curves
    )


def _tries(joints: Sequence[_Joint], lines: Sequence[float]) -> int:
    """How many lines were asked, of all joints, where those of one were found: its low ones among the low ones."""
    if lines and max(lines) <= LOW[-1]:
        return len(LOW) * len(joints)
    return sum(len(joint.orders) for joint in joints)


def _text_of(orders: Sequence[float]) -> str:
    """The shape of the lines of a joint, as one harmonic where there is one."""
    return f"harmonic{orders[0]:g}" if len(orders) == 1 else harmonics_text(orders)


def all_curves_were_searched(fit: Fit) -> bool:
    """Whether every joint of a chain could have shown a curve of several lines or a table."""
    pose = poses_of(fit)
    return bool(pose.max() + 1 >= FEWEST_POSES) and len(_joints(fit, pose)) == len(
        fit.problem.context.chain.joints
    )


def _joints(fit: Fit, pose: npt.NDArray[np.int64]) -> list[_Joint]:
    """The rotary joints that were at many positions."""
    problem = fit.problem
    context = problem.context
    first = np.unique(pose, return_index=True)[1]
    joints = []
    for index, joint in enumerate(context.chain.joints):
        position = context.positions[first, index]
        if joint.kind != "rotary" or len(np.unique(np.round(position, 6))) < ENOUGH_POSITIONS:
            continue
        # Whole orders repeat after a turn; over a travel of two turns half orders do.
        step = 1.0 / np.ceil(float(np.ptp(position)) / (2.0 * np.pi) - 1e-9)
        orders = np.arange(LOW[-1] + 1.0, HIGHEST + step / 2.0, step)
        way = problem.observe(fit.by_error[:, :, index, MOTION, 3 + joint.main]) / problem.sigma
        term = f"E{COMPONENTS[3 + joint.main]}{joint.name}"
        joints.append(_Joint(index, term, position, orders, np.where(fit.has_weight, way, 0.0)))
    return joints


def protecting(fit: Fit, variants: Sequence[ChainVariant]) -> list[ChainVariant]:
    """What is taken out before lines are looked for: the catalogue without what repeats with a turn."""
    session = float(fit.problem.context.day_time.max())
    families: dict[str, ChainVariant] = {}
    for variant in variants:
        effect = variant.effect
        if isinstance(effect, ChainEffect) and (
            isinstance(effect.shape, Harmonic)
            or (isinstance(effect.shape, Const) and isinstance(effect.driver, Gravity))
        ):
            continue
        if isinstance(effect.driver, WarmUp):
            # One time constant, a third of the session, stands for all.
            tau = effect.driver.time_constant_s or session
            previous = families.get(variant.family)
            if previous is not None:
                assert isinstance(previous.effect.driver, WarmUp)
                other = previous.effect.driver.time_constant_s or session
                if abs(np.log(3.0 * tau / session)) > abs(np.log(3.0 * other / session)):
                    continue
        families[variant.family] = variant
    return list(families.values())


def _high_lines(pursuit: Pursuit, joints: Sequence[_Joint], rate: float) -> dict[int, list[float]]:
    """The orders above the low ones that stand out, by joint; ``pursuit`` goes on with them."""
    lines: dict[int, list[float]] = {joint.index: [] for joint in joints}
    limit = -2.0 * np.log(rate / sum(len(joint.orders) for joint in joints))
    error = pursuit.held_out()
    for _ in range(MOST_SWEEPS):
        strongest = []
        for joint in joints:
            turn = pursuit.turns(joint)
            cosine, sine = joint.waves
            # Under no line the two sums have half the squares of the turns as variances, whatever poses share.
            power = 2.0 * ((turn @ cosine) ** 2 + (turn @ sine) ** 2) / max(float(turn @ turn), 1e-300)
            power[np.isin(joint.orders, lines[joint.index])] = 0.0
            best = int(power.argmax())
            strongest.append((float(power[best]), joint, float(joint.orders[best])))
        least = max(limit, STRONG * max(power for power, *_ in strongest))
        selected = [(joint, order) for power, joint, order in strongest if power > least]
        if not selected:
            break
        new = pursuit.new(
            pursuit.columns([f"{joint.term}:harmonics({order:g})" for joint, order in selected])
        )
        after = pursuit.held_out(new)
        if after >= error:
            break
        error = after
        pursuit.take(new)
        for joint, order in selected:
            lines[joint.index].append(order)
    return lines


def _add_low_lines(
    pursuit: Pursuit, joints: Sequence[_Joint], lines: dict[int, list[float]], rate: float
) -> None:
    """Add the low orders that stand out beside the others to ``lines``, the most certain first."""
    keys = [(joint.index, order) for joint in joints for order in LOW]
    columns = pursuit.columns(
        [f"{joint.term}:{harmonics_text([order])}" for joint in joints for order in LOW]
    )
    rest = without(pursuit.basis, columns)
    remaining = {key: slice(2 * number, 2 * number + 2) for number, key in enumerate(keys)}
    while remaining:
        new = {key: orthonormal(rest[:, part]) for key, part in remaining.items()}
        p_values = {key: pursuit.p_value(columns_of_key) for key, columns_of_key in new.items()}
        best = min(p_values, key=lambda key: p_values[key])
        if p_values[best] * len(keys) > rate or pursuit.held_out(new[best]) >= pursuit.held_out():
            break
        pursuit.take(new[best])
        rest = without(new[best], rest)
        del remaining[best]
        lines[best[0]].append(best[1])


def _leave_out_cancelled(
    whole: Pursuit, always: Array, joints: Sequence[_Joint], lines: dict[int, list[float]]
) -> None:
    """Leave out of ``lines`` the lowest orders of joints that turned a part of a turn, as long as these nearly cancel
    each other and the geometry: a step of 240 um was told as orders 1 to 3 of 13 mm."""
    fit = whole.fit
    for joint in joints:
        orders = lines[joint.index]
        if joint.travel >= 2.0 * np.pi or not any(order in LOW for order in orders):
            continue
        beside = Pursuit(
            fit, np.concatenate([always, columns_of(fit, _texts(joints, lines, joint))], axis=1), whole.pose
        )
        while orders and min(orders) <= LOW[-1]:
            text = f"{joint.term}:{harmonics_text(orders)}"
            (curve,) = scene_of(
                fit, [Variant(text, parse_effect(text, fit.problem.context.chain))]
            ).candidates
            if not beside.cancels(curve, beside.new(curve.columns[beside.order])):
                break
            orders.remove(min(orders))


def _texts(
    joints: Sequence[_Joint], lines: dict[int, list[float]], except_for: _Joint | None = None
) -> list[str]:
    """The lines of all joints ``except_for`` one, as effects."""
    return [
        f"{joint.term}:{harmonics_text(lines[joint.index])}"
        for joint in joints
        if joint is not except_for and lines[joint.index]
    ]


def _with_tables(
    whole: Pursuit,
    always: Array,
    joints: Sequence[_Joint],
    lines: dict[int, list[float]],
    curves: dict[int, str],
) -> dict[int, str]:
    """The curves with a table over the travel instead of lines, for joints where blocks left out prefer it; ``whole``
    has the lines and the low orders of all joints."""
    curves, fit = dict(curves), whole.fit
    poses = len(joints[0].position)
    counts = [count for count in NODES if POSES_A_NODE * count <= poses]
    lacking = [joint for joint in joints if _lacks_shape(whole, joint)] if counts else []
    for joint in lacking:
        others = _texts(joints, lines, joint)
        pursuit = Pursuit(fit, np.concatenate([always, columns_of(fit, others)], axis=1), whole.pose)
        refined = pursuit.new(
            pursuit.columns([f"{joint.term}:{harmonics_text({*lines[joint.index], *LOW})}"])
        )
        best = pursuit.held_out(refined)
        reading = fit.problem.context.chain.joints[joint.index].sign * joint.position / DEGREE.factor
        for count in counts:
            even: Array = np.linspace(np.floor(reading.min()), np.ceil(reading.max()), count)
            nodes = occupied(np.round(even, 2), reading, LEAST_POSES)
            # The zero of the joint is a base parameter: the ends are held, so that every other node has a number.
            text = nodes_text(nodes, nodes[[0, -1]])
            error = pursuit.held_out(pursuit.new(pursuit.columns([f"{joint.term}:{text}"])))
            if error < best:
                best, curves[joint.index] = error, text
    return curves


def _lacks_shape(whole: Pursuit, joint: _Joint) -> bool:
    """Whether hats over the travel of a joint stand out from all lines."""
    turn = whole.turns(joint)
    nodes = np.linspace(joint.position.min(), joint.position.max(), NODES[0])
    hats = np.stack([np.interp(joint.position, nodes, hat) for hat in np.eye(NODES[0])], axis=1)
    # What every pose says of the turn weighs as much as the way that it moves the reflectors.
    weight = np.bincount(whole.pose, weights=np.sum(joint.way**2, axis=1))
    scale = np.sqrt(np.where(weight > 0.0, weight, 1.0))
    span = orthonormal(hats * scale[:, None])
    turn = turn / scale
    explained, size = float(np.sum((span.T @ turn) ** 2)), span.shape[1]
    f = explained / size / ((float(turn @ turn) - explained) / (len(turn) - size))
    return float(special.fdtrc(size, len(turn) - size, f)) < TABLE_LEVEL
