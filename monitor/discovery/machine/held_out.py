"""The readings of a chain that are left out in turn: whole runs or days, or blocks of poses of one run.

The base parameters are free in every run, so a run that was left out still finds its own; only the effects
that all runs share are predicted from the others. A single run with many poses is cut into blocks of
neighbouring poses, which are dealt out at random to ten parts; each part is predicted, base parameters included,
from the other nine.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit

PARTS = 10
# Neighbours in time share drifts and lags, so that blocks of them are left out; five blocks to a part.
BLOCKS = 50
# A tenth left out must not cost the base parameters anything to speak of.
READINGS_AN_UNKNOWN = 10
# Deals the blocks out; the held-out error moves by about a hundredth with another deal.
SEED = 20260302


def pose_parts(fit: Fit) -> npt.NDArray[np.int64] | None:
    """The part (M,) of every whitened number of a single run, -1 for calibrated quantities and padding.

    None where there are several runs or too few poses.
    """
    problem = fit.problem
    unknowns = int(fit.solution.rank.sum()) + len(fit.problem.added_names)
    if len(problem.runs) != 1 or fit.readings < READINGS_AN_UNKNOWN * unknowns:
        return None
    positions = problem.context.positions
    pose = np.concatenate([[0], np.cumsum(np.any(np.diff(positions, axis=0) != 0.0, axis=1))])
    poses = int(pose[-1]) + 1
    blocks = min(BLOCKS, poses)
    if blocks < 2 * PARTS:
        return None
    part = np.random.default_rng(SEED).permutation(np.arange(blocks) % PARTS)
    numbers = np.repeat(part[pose * blocks // poses], problem.sigma.shape[1])
    parts = np.full(fit.solution.last.residual.size, -1, dtype=np.int64)
    parts[: len(numbers)] = numbers
    return parts
