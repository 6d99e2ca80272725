"""The rivals of an effect: those that the data do not rule out instead of it."""

from __future__ import annotations

import numpy as np

from monitor.discovery.search.candidate import Candidate
from monitor.discovery.search.evidence import Evidence
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scene import CandidateT
from monitor.records import Array

# Rivals whose evidence comes this close are not ruled out. Where two effects are s standard deviations apart,
# the wrong one leads by more than z^2 with a probability of at most Phi(-z); z = 3.5 here.
UNDECIDED = 12.0
# An effect coincides with another where so much of it is explained by the other at any size.
COINCIDES = 0.999


def least_likelihood(evidence: Evidence[CandidateT]) -> float:
    """The likelihood from which a rival of an effect is not ruled out; what explains less than its own price is no
    rival, however weak the effect."""
    return max(evidence.likelihood - UNDECIDED, 0.0)


def coincides(basis: Array, rival: Candidate[object], effect: Array) -> bool:
    """Whether a rival explains what an effect does, columns (M, k) with the ``basis`` (M, r) of all others taken
    out."""
    columns = orthonormal(without(basis, rival.columns))
    total = float(np.sum(effect**2))
    return float(np.sum((columns.T @ effect) ** 2)) / max(total, 1e-300) > COINCIDES
