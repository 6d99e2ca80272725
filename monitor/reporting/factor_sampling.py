"""How well sampled coverage factors are known: stored with what they belong to, and decisive for the digits printed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FactorSampling:
    """Seed and number of the trials behind k_p and k_q and their standard errors; zero for a closed form."""

    seed: int
    trials: int
    k_p_standard_error: float
    k_q_standard_error: float
