"""Which unknowns the readings of a run separate, and which combinations of them stay open."""

from __future__ import annotations

import numpy as np

from monitor.methods.chain.least_squares import eliminate
from monitor.records import Array

# An unknown of which less than this part is separated is open by itself.
ALONE = 1e-6
# Derivatives below this part of the largest, in mm or rad over what a reading is known to, are rounding.
ROUNDING = 1e-12


def projector_on_separated(by_local: Array) -> Array:
    """The projector (R, p, p) on the unknowns that whitened derivatives (R, N, p) separate."""
    scale = np.linalg.norm(by_local, axis=1)
    # A centre across the plane of a bar's swing leaves 1e-14 by rounding, or nothing, as its plane lies.
    is_rounding = scale <= ROUNDING * scale.max(axis=1, keepdims=True, initial=0.0)
    by_local, scale = np.where(is_rounding[:, None, :], 0.0, by_local), np.where(is_rounding, 1.0, scale)
    null_space = eliminate(by_local).null_space
    projector = np.eye(by_local.shape[2]) - np.swapaxes(null_space, 1, 2) @ null_space
    # What is open by itself leaves a column of rounding.
    projector *= np.linalg.norm(projector, axis=1, keepdims=True) > ALONE
    return np.asarray(projector * scale[:, None, :] / scale[:, :, None])
