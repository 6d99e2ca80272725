"""A slight error of unknown shape: one part of a flexible basis that stands out of what an empty catalogue leaves.

Lack of fit asks all poses at once whether anything is missing, and a shape of a few standard deviations is lost among
them. Here every part of the flexible basis of every error is asked for itself, some 1 700 in all, and the largest one
has to stand against that number twice: in the whitened residual, and, where runs are many enough, under sign flips of
whole runs, which holds whatever the noise within a run depends on (A. M. Winkler et al., NeuroImage 92 (2014) 381).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.scene import ChainScene, ChainVariant, scene_of
from monitor.discovery.search.projection import without
from monitor.discovery.search.sign_flips import signs
from monitor.records import Array

# The search may be wrong in one empty campaign of a hundred; this is its part of that, and that of the flips.
LEVEL, FLIP_LEVEL = 5e-4, 5e-2
# With fewer runs than this no flip is rare enough: two runs to the power of six are 1 in 64 and more.
FEWEST_RUNS = 8
# Fewer runs than this have no other run to speak of, and a correlation of neighbours is an estimate: what stands
# there has to stand beyond any doubt of its noise.
FEWEST, LEVEL_OF_FEW = 3, 1e-6
# A part of which less than this is left beside the runs' own unknowns shows nothing.
SMALLEST_SHARE = 1e-2


def slight_shape(scene: ChainScene, wholes: Sequence[ChainVariant]) -> tuple[str, int] | None:
    """The error, and the part from 0 of its flexible basis, that stands out alone; None where none does.

    ``wholes`` are the errors in any shape, their symbols as families.
    """
    runs = len(scene.fit.problem.runs)
    if poses_of_rows(scene.fit) is not None:
        return None
    beside = scene.remainders.beside([])
    parts: list[tuple[str, int]] = []
    columns: list[Array] = []
    for whole in scene_of(scene.fit, wholes).candidates:
        before = whole.raw_lengths / scene.fit.sigma
        remainder = without(beside.basis, whole.columns)
        length = np.linalg.norm(remainder, axis=0)
        able = np.flatnonzero(length > SMALLEST_SHARE * np.maximum(before, 1e-300))
        parts += [(whole.family, int(part)) for part in able]
        columns.append((remainder[:, able] / length[able]).astype(np.float32))
    if not parts:
        return None
    every = np.concatenate(columns, axis=1)
    sizes = every.T @ beside.residual
    best = int(np.abs(sizes).argmax())
    squares, dof = float(sizes[best]) ** 2, beside.degrees_of_freedom - 1
    rest = float(beside.residual @ beside.residual) - squares
    if dof < 1 or rest <= 0.0:
        return None
    p_value = float(scipy.special.fdtrc(1, dof, squares / (rest / dof)))
    is_white = runs >= FEWEST and scene.fit.whitening is None
    if p_value * len(parts) > (LEVEL if is_white else LEVEL_OF_FEW):
        return None
    if runs >= FEWEST_RUNS and _share_of_flips(scene, every, beside.residual, abs(sizes[best])) > FLIP_LEVEL:
        return None
    return parts[best]


def _share_of_flips(scene: ChainScene, columns: Array, residual: Array, largest: float) -> float:
    """The share of sign flips of whole runs under which the largest of all parts (M, C) is as large."""
    count = len(scene.fit.problem.runs)
    shares = (columns * residual[:, None].astype(np.float32)).reshape(count, -1, columns.shape[1]).sum(axis=1)
    flipped = np.abs(shares.T @ signs(count)).max(axis=0)
    return float((1 + np.sum(flipped >= largest)) / (1 + len(flipped)))
