"""Effective degrees of freedom of an output covariance that several sources make up."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from monitor.records import Array
from monitor.uncertainty.roots import covariance_root


def effective_dof(contributions: Sequence[Array], dof: Sequence[float]) -> float:
    """Effective degrees of freedom of a sum of independent covariances ``contributions``, each (m, m).

    Satterthwaite's idea for matrices: the sum is matched to a Wishart matrix with the same total variance of
    all elements after whitening, nu = (r + r²) / sum_i [tr(V_i)² + tr(V_i²)] / nu_i with V_i the whitened
    contributions and r the rank (Krishnamoorthy and Yu 2004). It does not change under a linear
    transformation of the outputs, and for m = 1 it is Welch-Satterthwaite, GUM G.2b. Infinite where no
    contribution is estimated.
    """
    total = np.sum([np.atleast_2d(part) for part in contributions], axis=0)
    whitener = covariance_root(total).whitener
    rank = len(whitener)
    if rank == 0:
        return math.inf
    spread = 0.0
    for part, nu in zip(contributions, dof, strict=True):
        white = whitener @ np.atleast_2d(part) @ whitener.T
        spread += (float(np.trace(white)) ** 2 + float(np.sum(white * white.T))) / nu
    return math.inf if spread == 0.0 else (rank + rank**2) / spread
