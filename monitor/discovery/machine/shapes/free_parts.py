"""The free shape of an error: its whole flexible basis, and the parts of it that are worth their price.

A few parts are selected, one after the other, at the price of each and of the choice (Schwarz's criterion extended for
many candidates: Chen and Chen, Biometrika 95 (2008) 759).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, scene_of
from monitor.discovery.machine.shapes.bends import score_beside
from monitor.discovery.machine.shapes.curves import follows
from monitor.discovery.machine.shapes.waves import worth_keeping
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside, weigh_in
from monitor.discovery.search.products import Products
from monitor.discovery.search.projection import without
from monitor.discovery.search.rivals import UNDECIDED
from monitor.discovery.search.scan import except_for
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.shape import DescribedShape
from monitor.effects.shapes.free import HARMONICS, Follows, Free
from monitor.records import Array

# More parts than this of one shape are beyond what a plan can separate.
MOST_PARTS = 8
# The price of the choice of a part: the logarithm of the size of a basis, 30 to 50 parts.
PRICE = float(np.log(45.0))
# A part of which others leave less than this is one of them.
SMALLEST_LENGTH = 1e-2


def is_free(candidate: ChainCandidate) -> bool:
    """Return whether an effect is of free shape."""
    effect = candidate.effect
    return isinstance(effect, ChainEffect) and isinstance(effect.shape, Free)


def price_of_parts(candidate: ChainCandidate) -> float:
    """What the choice of its parts takes from the score of a free shape; nothing from other effects."""
    return 2.0 * candidate.columns.shape[1] * PRICE if is_free(candidate) else 0.0


def price_of_choices(candidate: ChainCandidate) -> float:
    """What the choice of its parts takes at least: a wave, cosine and sine, is one entry of the catalogue."""
    if not is_free(candidate):
        return 0.0
    effect = candidate.effect
    assert isinstance(effect, ChainEffect)
    assert isinstance(effect.shape, Free)
    parts = set(effect.shape.parts)
    pairs = sum({part, part + 1} <= parts for part in range(1, 2 * HARMONICS, 2)) if effect.joint.turns else 0
    return price_of_parts(candidate) - 2.0 * PRICE * pairs


def price_of_powers(scene: ChainScene, effects: Sequence[ChainCandidate]) -> float:
    """What the choice of powers takes where they stand beside a step: with two of them it follows a bump."""
    return 2.0 * PRICE * sum(any(effect is power for power in scene.powers) for effect in effects)


def priced(
    scene: ChainScene, selected: Sequence[ChainCandidate], others: Sequence[ChainCandidate] = ()
) -> float:
    """The score of effects together beside others, free shapes at the price of the choice of their parts."""
    return score_beside(scene, selected, others) - sum(map(price_of_parts, selected))


def whole_basis(scene: ChainScene, symbol: str, shape: ChainCandidate) -> ChainCandidate:
    """The whole flexible basis of the error of which a candidate is a shape."""
    return scene_of(scene.fit, [in_any_shape(symbol, shape)]).candidates[0]


def in_any_shape(symbol: str, shape: ChainCandidate) -> ChainVariant:
    """The error of which a candidate is a shape, in any shape, under its symbol."""
    effect = shape.effect
    assert isinstance(effect, ChainEffect)
    return Variant(symbol, replace(effect, shape=Free(), shape_text="free"))


def of_parts(
    scene: ChainScene,
    symbol: str,
    parts: Sequence[int],
    shapes: Sequence[ChainCandidate],
    others: Sequence[ChainCandidate],
) -> ChainCandidate:
    """The effect of some parts, from 0, of a flexible basis; nearest to it is the best of ``shapes``."""
    return with_nearest(scene, of_parts_alone(scene, symbol, parts), shapes, others)


def of_parts_alone(scene: ChainScene, symbol: str, parts: Sequence[int]) -> ChainCandidate:
    """The effect of some parts, from 0, of a flexible basis, without what comes nearest to it."""
    name = f"{symbol}:free({','.join(str(part + 1) for part in sorted(parts))})"
    effect = parse_effect(name, scene.fit.problem.context.chain)
    return scene_of(scene.fit, [Variant(f"{symbol}:free", effect)]).candidates[0]


def parts_anew(scene: ChainScene, selected: Sequence[ChainCandidate]) -> list[list[int]]:
    """The parts that are worth keeping of the error of each free shape among selected effects, beside the others."""
    return [
        sorted(
            parts_worth_keeping(
                scene, whole_basis(scene, free.effect.term.symbol, free), except_for(selected, index)
            )
        )
        for index, free in enumerate(selected)
        if is_free(free) and isinstance(free.effect, ChainEffect)
    ]


def with_nearest(
    scene: ChainScene,
    free: ChainCandidate,
    shapes: Sequence[ChainCandidate],
    others: Sequence[ChainCandidate],
) -> ChainCandidate:
    """A free shape and the best of ``shapes`` beside others, which is nearest to it; none that follows moves comes near
    one without direction, unless there are no others."""
    alike = (
        [] if _has_direction(scene, free, others) else [shape for shape in shapes if not _is_of_moves(shape)]
    )
    weighed = weigh_beside(scene, alike or shapes, others)
    nearest = max(weighed, key=lambda evidence: evidence.explained).candidate
    return replace(free, variant=replace(free.variant, nearest=nearest.family))


def _has_direction(scene: ChainScene, free: ChainCandidate, others: Sequence[ChainCandidate]) -> bool:
    """Whether a free shape beside others follows the direction of its axis, as its description says."""
    effect, context = free.effect, scene.fit.problem.context
    assert isinstance(effect, ChainEffect)
    assert isinstance(effect.shape, Free)
    if Follows.DIRECTION not in effect.shape.following(context, effect.term.joint):
        return False
    beside = scene.remainders.beside(others)
    columns = without(beside.basis, free.columns)
    inverse: Array = np.asarray(np.linalg.pinv(columns.T @ columns, hermitian=True), dtype=np.float64)
    coefficients = inverse @ (columns.T @ beside.residual)
    remaining = beside.residual - columns @ coefficients
    variance = float(remaining @ remaining) / max(beside.degrees_of_freedom - len(coefficients), 1)
    return Follows.DIRECTION in follows(context, effect, coefficients, variance * inverse)


def _is_of_moves(candidate: ChainCandidate) -> bool:
    """Whether the shape of an effect follows how its axis came to a position."""
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect) and isinstance(effect.shape, DescribedShape) and effect.shape.of_moves
    )


def most_together(
    scene: ChainScene,
    new: ChainCandidate,
    leading: Sequence[ChainCandidate],
    may_stay: Sequence[ChainCandidate],
) -> float:
    """A bound that the score of leading effects, a new one and whichever of others stay is not above: the columns of
    the new one cost nothing here, and its parts and what stays their price."""
    before = scene.remainders.beside(leading)
    columns = without(before.basis, np.concatenate([each.columns for each in (new, *may_stay)], axis=1))
    total = float(before.residual @ before.residual)
    products = Products(columns.T @ columns, columns.T @ before.residual, total, total)
    first = np.cumsum([each.columns.shape[1] for each in (new, *may_stay)])
    least = np.log(max(before.degrees_of_freedom - int(first[-1]), 1))
    ranks = {id(each.candidate): each.rank for each in weigh_in(before, may_stay)}
    prices = [
        ranks[id(each)] * least + 2.0 * np.log(each.variant.tries * each.variant.odds) + price_of_parts(each)
        for each in may_stay
    ]
    most = -np.inf
    for stay in product((False, True), repeat=len(may_stay)):
        numbers = np.flatnonzero(np.repeat((True, *stay), np.diff(first, prepend=0)))
        gain = before.degrees_of_freedom * np.log(total / max(products.left_by(numbers.tolist()), 1e-300))
        most = max(most, float(gain - np.dot(prices, stay)))
    return float(priced(scene, leading) + most - price_of_parts(new))


def parts_worth_keeping(
    scene: ChainScene,
    whole: ChainCandidate,
    others: Sequence[ChainCandidate],
    *,
    most: int = MOST_PARTS,
    choice: float = PRICE,
) -> list[int]:
    """The parts of a flexible basis, from 0, that are worth their price beside others, selected one after the other:
    so many at ``most``, ``choice`` the price of the choice of each.

    The selection begins once with the best part and once with the best pair: a drive that is wound up is the direction
    less what decays after a reversal, and neither of the two says much alone. The pair has to say more beyond doubt.
    """
    beside = scene.remainders.beside(others)
    overlap = beside.basis.T @ whole.columns
    total = float(beside.residual @ beside.residual)
    products = Products(whole.gram - overlap.T @ overlap, whole.columns.T @ beside.residual, total, total)
    least = SMALLEST_LENGTH * np.maximum(np.sqrt(np.diagonal(whole.gram)), 1e-300)
    dof = scene.degrees_of_freedom - beside.basis.shape[1]
    price = float(np.log(dof)) + 2.0 * choice

    def cost(parts: Sequence[int]) -> float:
        return float(dof * np.log(products.left_by(parts)) + price * len(parts))

    selections = []
    for begin in ([], _best_pair(products, least))[:most]:
        parts = _selected(products, least, (dof, price), begin, most)
        selections.append(worth_keeping(products, parts, dof, price))
    one_by_one, from_pair = selections[0], selections[-1]
    return from_pair if cost(from_pair) < cost(one_by_one) - UNDECIDED else one_by_one


def _selected(
    products: Products, least: Array, prices: tuple[float, float], begin: Sequence[int], most: int
) -> list[int]:
    """The parts to ``begin`` with and those that are worth their price beside them, one after the other, so many at
    ``most``; ``prices`` are the degrees of freedom and the price of a part, ``least`` (k,) lengths below which a part
    is one of those before."""
    (dof, price), parts = prices, list(begin)
    for part in parts:
        products = products.without(part)
    while len(parts) < most:
        length, total = products.lengths, products.total
        explained = np.where(length > least, products.onto / np.where(length > least, length, 1.0), 0.0) ** 2
        best = int(np.argmax(explained))
        if dof * np.log(total / max(total - float(explained[best]), 1e-300)) < price:
            break
        parts.append(best)
        products = products.without(best)
    return parts


def _best_pair(products: Products, least: Array) -> list[int]:
    """The two parts that explain most of a residual together; none where no two differ."""
    length = products.lengths
    able = np.flatnonzero(length > least)
    if len(able) < 2:
        return []
    along = products.gram[np.ix_(able, able)] / np.outer(length[able], length[able])
    onto = products.onto[able] / length[able]
    apart = 1.0 - along**2
    differ = length[able] ** 2 * apart > least[able] ** 2
    squares = onto[:, None] ** 2 + onto**2 - 2.0 * along * np.outer(onto, onto)
    explained = np.where(differ & differ.T, squares / np.where(differ, apart, 1.0), 0.0)
    first, second = np.unravel_index(int(np.argmax(explained)), explained.shape)
    return [] if first == second else [int(able[first]), int(able[second])]
