"""A curve that no single shape of the catalogue follows: one error table instead of several shapes of one error.

A bump of a guideway is found as a cube, then a square, then cycles that mend what is left. Where a search has found
several effects, tables of the errors among them are tried instead; a table leads if it says more, given
what else stands beside it, than all of them at the price of their coefficients.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, scene_of
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.scan import WORTH_EXCHANGING, ScanResult, findings_of
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.drivers import Always
from monitor.effects.shapes import nodes_text
from monitor.machine import MOTION
from monitor.records import Array
from monitor.units import DEGREE

# Nodes of the tables that are tried.
NODES = (5, 7, 9, 13)
# A curve needs more positions than nodes, or it follows the noise of each.
POSITIONS_A_NODE = 2
# Positions closer than this, in mm or degrees, are the same.
SAME_POSITION = 0.5
# So many tables of one campaign at most, and so many tried for each.
MOST_TABLES, MOST_TRIED = 2, 3

ChainScan: TypeAlias = ScanResult[ChainCandidate]
#: Scans a scene, beginning with candidates, beside some that are taken for granted.
Scan: TypeAlias = Callable[[ChainScene, Sequence[ChainCandidate], Sequence[ChainCandidate]], ChainScan]


def _error(candidate: ChainCandidate) -> str | None:
    """The error motion that a candidate is a shape of; None for others, and for what follows a driver."""
    effect = candidate.effect
    if not isinstance(effect, ChainEffect) or not isinstance(effect.driver, Always):
        return None
    return effect.term.symbol if effect.term.stage == MOTION and effect.joint.kind != "spindle" else None


def table_variants(scene: ChainScene, selected: Sequence[ChainCandidate]) -> list[ChainVariant]:
    """Tables of the errors of which ``selected`` has shapes; their ends are held at zero where the base or the plan
    leaves nothing of a constant and a slope."""
    context = scene.fit.problem.context
    sloping = {candidate.family for candidate in scene.candidates if candidate.visible}
    variants: list[ChainVariant] = []
    for symbol in dict.fromkeys(name for shape in selected if (name := _error(shape)) is not None):
        effect = next(shape.effect for shape in selected if _error(shape) == symbol)
        assert isinstance(effect, ChainEffect)
        joint = effect.joint
        reading = joint.sign * context.places[:, effect.term.joint] / (DEGREE.factor if joint.turns else 1.0)
        positions = len(np.unique(np.round(reading / SAME_POSITION)))
        low, high = np.floor(reading.min()), np.ceil(reading.max())
        for count in NODES:
            if positions < POSITIONS_A_NODE * count:
                break
            even: Array = np.linspace(low, high, count)
            nodes = occupied(np.round(even, 1), reading)
            held = nodes[:1] if f"{symbol}:poly1" in sloping else nodes[[0, -1]]
            text = f"{symbol}:{nodes_text(nodes, held)}"
            variants.append(Variant(f"{symbol}:table", parse_effect(text, context.chain), len(NODES)))
    return variants


def occupied(nodes: Array, reading: Array, least: int = 1) -> Array:
    """The nodes (k,) without inner ones that fewer than ``least`` different readings (n,) are nearest to, the loneliest
    left out first: where nothing was measured no node has a number, and a wider interval says so."""
    places = np.unique(np.round(reading, 6))
    while len(nodes) > 2:
        near = np.bincount(np.digitize(places, (nodes[1:] + nodes[:-1]) / 2.0), minlength=len(nodes))[1:-1]
        if near.min() >= least:
            break
        nodes = np.delete(nodes, 1 + int(near.argmin()))
    return nodes


def _score(scene: ChainScene, selected: Sequence[ChainCandidate]) -> float:
    """The score of effects together, one after the other."""
    return sum(
        weigh_beside(scene, [candidate], selected[:index])[0].score
        for index, candidate in enumerate(selected)
    )


def _promising(
    scene: ChainScene, tables: Sequence[ChainCandidate], selected: Sequence[ChainCandidate]
) -> list[ChainCandidate]:
    """Of every error the table that says most more than its selected shapes, as if there were nothing else."""
    best: dict[str | None, tuple[float, ChainCandidate]] = {}
    for table in tables:
        shapes = [shape for shape in selected if _error(shape) == _error(table)]
        gain = _score(scene, [table]) - _score(scene, shapes)
        if gain > max(best.get(_error(table), (0.0, table))[0], 0.0):
            best[_error(table)] = gain, table
    return [table for _, table in sorted(best.values(), key=lambda pair: -pair[0])][:MOST_TRIED]


def with_tables(scene: ChainScene, result: ChainScan, scan: Scan) -> tuple[ChainScene, ChainScan]:
    """The result with tables instead of several effects, where they say more."""
    for _ in range(MOST_TABLES):
        selected = result.candidates
        variants = table_variants(scene, selected) if len(selected) > 1 else []
        tables = scene_of(scene.fit, variants).candidates if variants else ()
        # What one error does looks like others' at the positions where they are alike: each is tried to its end.
        best, worth = None, _score(scene, selected) + WORTH_EXCHANGING
        for table in _promising(scene, tables, selected):
            others = [shape for shape in selected if _error(shape) != _error(table)]
            beside = scan(replace(scene, shared=scene.columns([table])), others, [table])
            more = [table, *beside.candidates]
            if len(more) < len(selected) and _score(scene, more) > worth:
                best, worth = more, _score(scene, more)
        if best is None:
            break
        scene = replace(scene, candidates=(*scene.candidates, *tables))
        result = ScanResult(findings_of(scene, best))
    return scene, result
