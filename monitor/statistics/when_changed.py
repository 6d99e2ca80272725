"""Between which runs does a change lie? From the likelihood of all its places."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.records import Array

#: 95 % point of the likelihood ratio for the place of a change, -2 log(1 - sqrt(0.95)): the larger of two
#: independent exponential maxima, one on each side (Siegmund, Ann. Stat. 16 (1988) 1; Eo and Morley 2015).
PLACE = -2.0 * float(np.log(1.0 - np.sqrt(0.95)))


def when(t: Array, places: npt.NDArray[np.int64], deviance: Array, fitted: int) -> tuple[float, float]:
    """Times between which a change lies, from all ``places`` (c,) that explain nearly as much as the best.

    ``deviance`` (c,) is minus twice their log-likelihood, ``fitted`` the number of fitted coefficients.
    """
    freedom = max(len(t) - fitted, 1) / len(t)
    inside = places[freedom * (deviance - deviance.min()) <= PLACE]
    return float(t[max(int(inside.min()) - 1, 0)]), float(t[min(int(inside.max()), len(t) - 1)])
