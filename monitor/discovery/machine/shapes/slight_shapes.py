"""A slight error of unknown shape: what alone stands out of what an empty catalogue leaves.

Lack of fit asks all poses at once whether anything is missing, and a shape of a few standard deviations is lost among
them. Here every part of the flexible basis of every error is asked for itself, some 1 700 in all, and every wave of
more periods a turn than the catalogue has, cosine and sine together, some 80. The most certain one has to stand
against that number twice: in the whitened residual, and, where runs are many enough, under sign flips of whole runs,
which holds whatever the noise within a run depends on (A. M. Winkler et al., NeuroImage 92 (2014) 381).

One run or two show no lack of fit. There a bend to and fro about the middle of the travel, which no single part comes
near, is asked for as all parts of an error that follow its position alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, scene_of
from monitor.discovery.search.evidence import Evidence, weigh_beside
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.sign_flips import signs
from monitor.effects import ChainEffect
from monitor.effects.shapes.free import parts_of_position
from monitor.records import Array

# The search may be wrong in one empty campaign of a hundred; these are its parts of that, and that of the flips. Waves
# are few, and bearings and gears make them: they have as large a part as so many families of the catalogue.
LEVEL, LEVEL_OF_WAVES, FLIP_LEVEL = 5e-4, 2.5e-3, 5e-2
# With fewer runs than this no flip is rare enough: two runs to the power of six are 1 in 64 and more.
FEWEST_RUNS = 8
# Fewer runs than this have no other run to speak of, and a correlation of neighbours is an estimate: what stands
# there has to stand beyond any doubt of its noise.
FEWEST, LEVEL_OF_FEW = 3, 1e-6
# A part of which less than this is left beside the runs' own unknowns shows nothing.
SMALLEST_SHARE = 1e-2


@dataclass(frozen=True)
class SlightShape:
    """What stands out alone: the ``number``-th part from 0 of an error in any shape, of this ``family``, or the
    ``number``-th wave. ``p_value`` counts all that were tried."""

    family: str
    number: int
    p_value: float


def slight_shape(scene: ChainScene, wholes: Sequence[ChainVariant]) -> SlightShape | None:
    """The part of the flexible basis of an error that stands out alone; None where none does.

    ``wholes`` are the errors in any shape, their symbols as families.
    """
    if poses_of_rows(scene.fit) is not None:
        return None
    beside = scene.remainders.beside([])
    parts: list[tuple[str, int]] = []
    columns: list[Array] = []
    behind: list[float] = []
    for whole in scene_of(scene.fit, wholes).candidates:
        before = whole.raw_lengths / scene.fit.sigma
        remainder = without(beside.basis, whole.columns)
        length = np.linalg.norm(remainder, axis=0)
        able = np.flatnonzero(length > SMALLEST_SHARE * np.maximum(before, 1e-300))
        parts += [(whole.family, int(part)) for part in able]
        behind += [whole.behind] * len(able)
        columns.append((remainder[:, able] / length[able]).astype(np.float32))
    if not parts:
        return None
    best = _most_certain(scene, np.concatenate(columns, axis=1)[:, :, None], behind, LEVEL)
    return None if best is None else SlightShape(*parts[best[0]], best[1])


def slight_wave(scene: ChainScene, waves: Sequence[ChainCandidate]) -> SlightShape | None:
    """The wave that stands out alone; None where none does. Those of which the data see cosine or sine alone are none:
    at such angles a wave is as well one of fewer periods."""
    if poses_of_rows(scene.fit) is not None:
        return None
    beside = scene.remainders.beside([])
    able: list[int] = []
    columns: list[Array] = []
    for number, wave in enumerate(waves):
        remainder = without(beside.basis, wave.columns)
        if _is_whole(scene, wave, remainder):
            able.append(number)
            columns.append(orthonormal(remainder).astype(np.float32))
    if not able:
        return None
    behind = [waves[number].behind for number in able]
    best = _most_certain(scene, np.stack(columns, axis=1), behind, LEVEL_OF_WAVES)
    return None if best is None else SlightShape(waves[able[best[0]]].family, able[best[0]], best[1])


def best_wave(
    scene: ChainScene, waves: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
) -> Evidence[ChainCandidate] | None:
    """The wave that says most beside others, of those of which the data see cosine and sine; None where there is
    none."""
    basis = scene.remainders.beside(others).basis
    able = [wave for wave in waves if _is_whole(scene, wave, without(basis, wave.columns))]
    return next(iter(weigh_beside(scene, able, others)), None)


def _is_whole(scene: ChainScene, wave: ChainCandidate, remainder: Array) -> bool:
    """Whether the data see cosine and sine of a wave, of which they leave a remainder (M, 2)."""
    before = wave.raw_lengths / scene.fit.sigma
    shares = np.linalg.svd(remainder / np.maximum(before, 1e-300), compute_uv=False)
    return bool(shares.min() > SMALLEST_SHARE)


def slight_error(scene: ChainScene, wholes: Sequence[ChainVariant]) -> str | None:
    """The family of the error that stands out of one run or two in whatever shape of its position; None where none
    does. ``wholes`` are the errors in any shape."""
    if poses_of_rows(scene.fit) is not None or len(scene.fit.problem.runs) >= FEWEST:
        return None
    p_values = {
        whole.family: _p_value_of_position(scene, whole) * float(np.exp(whole.behind))
        for whole in scene_of(scene.fit, wholes).candidates
    }
    family = min(p_values, key=lambda name: p_values[name], default=None)
    return None if family is None or p_values[family] * len(p_values) > LEVEL_OF_FEW else family


def _p_value_of_position(scene: ChainScene, whole: ChainCandidate) -> float:
    """The p-value of all parts of an error in any shape that follow its position alone; 1 where nothing is left of
    them."""
    effect = whole.effect
    assert isinstance(effect, ChainEffect)
    return p_value_of_all(scene, whole.columns[:, : parts_of_position(effect.joint.turns)], [])


def p_value_of_all(scene: ChainScene, columns: Array, others: Sequence[ChainCandidate]) -> float:
    """The p-value of all columns (M, k) together beside others; 1 where nothing is left of them."""
    beside = scene.remainders.beside(others)
    columns = orthonormal(without(beside.basis, columns))
    explained, size = float(np.sum((columns.T @ beside.residual) ** 2)), columns.shape[1]
    dof = beside.degrees_of_freedom - size
    rest = float(beside.residual @ beside.residual) - explained
    if size == 0 or dof < 1 or rest <= 0.0:
        return 1.0
    return float(scipy.special.fdtrc(size, dof, explained / size / (rest / dof)))


def _most_certain(
    scene: ChainScene, columns: Array, behind: Sequence[float], level: float
) -> tuple[int, float] | None:
    """Index and p-value, times their number, of the most certain of G shapes with orthonormal ``columns`` (M, G, k),
    of two that explain alike of that which is less far ``behind``; None where it does not stand out at a level,
    beyond any doubt of the noise where that is an estimate."""
    beside = scene.remainders.beside([])
    count, size = columns.shape[1:]
    runs = len(scene.fit.problem.runs)
    explained = np.sum(np.tensordot(columns, beside.residual, (0, 0)) ** 2, axis=1)
    best = int((explained * (1.0 - np.array(behind))).argmax())
    dof = beside.degrees_of_freedom - size
    rest = float(beside.residual @ beside.residual) - float(explained[best])
    if dof < 1 or rest <= 0.0:
        return None
    p_value = count * float(scipy.special.fdtrc(size, dof, float(explained[best]) / size / (rest / dof)))
    is_white = runs >= FEWEST and scene.fit.whitening is None
    if p_value > (level if is_white else LEVEL_OF_FEW):
        return None
    if runs >= FEWEST_RUNS and _share_of_flips(runs, columns, beside.residual, explained[best]) > FLIP_LEVEL:
        return None
    return best, p_value


def _share_of_flips(runs: int, columns: Array, residual: Array, largest: float) -> float:
    """The share of sign flips of whole runs under which the most certain of all shapes (M, G, k) explains as much."""
    products = (columns * residual[:, None, None].astype(np.float32)).reshape(runs, -1, *columns.shape[1:])
    shares = products.sum(axis=1)
    flipped = np.sum(np.tensordot(shares, signs(runs), (0, 0)) ** 2, axis=1).max(axis=0)
    return float((1 + np.sum(flipped >= largest)) / (1 + len(flipped)))
