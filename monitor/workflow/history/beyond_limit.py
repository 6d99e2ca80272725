"""How probable it is that a value lies beyond its limit, and from which probability on that is said (JCGM 106:2012)."""

from __future__ import annotations

import scipy

#: A machine may be out of tolerance where the probability of that is above this one.
RISK = 0.05


def longest_beyond(beyond_um: float, u_um: float, freedom: float | None) -> float:
    """The probability that a length, ``beyond_um`` above its limit, is above it; ``freedom`` None: infinite."""
    if u_um <= 0.0:
        return float(beyond_um > 0.0)
    z = beyond_um / u_um
    return float(scipy.special.ndtr(z) if freedom is None else scipy.special.stdtr(freedom, z))
