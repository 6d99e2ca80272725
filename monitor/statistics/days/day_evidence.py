"""Do the days of a machine differ by much more than its runs? What one parameter cannot say of itself, others can.

In few days a step between two of them looks like days that differ: a series by itself may not refute either. But all
parameters of a machine come from the same runs, and where the others show wide day components, the one in question
may have one too. How wide they are among the parameters is estimated from the others (empirical Bayes; Efron,
Large-Scale Inference, 2010, chapter 1), and what the series itself says is added.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.statistics.scan import DAY_GRID, WIDE_DAYS

#: A wide day component is allowed for from this probability on.
LIKELY = 0.05
#: Steps until the shares of the day components among the parameters stand still.
STEPS = 50


def shows_wide_days(support: Array) -> npt.NDArray[np.bool_]:
    """Whether each of p parameters may have a day component beyond ``DAY_GRID``, (p,).

    ``support`` (p, 1 + len(DAY_GRID) + len(WIDE_DAYS)) are the log-likelihoods of its components, none first. One
    parameter alone may not: a component counts as usual until others show that it is wide.
    """
    usual = 1 + len(DAY_GRID)
    assert support.shape[1] == usual + len(WIDE_DAYS)
    # As if one parameter more had shown a usual component.
    before = np.concatenate([np.full(usual, 1.0 / usual), np.zeros(len(WIDE_DAYS))])
    p = len(support)
    # Row i: the others of parameter i. All shares are followed at once: p loops of arrays so small would take p times as
    # long.
    others = support[np.arange(p - 1) + (np.arange(p - 1) >= np.arange(p)[:, np.newaxis])]
    share = np.full(support.shape, 1.0 / support.shape[1])
    for _ in range(STEPS):
        share = (before + _parts(others + np.log(share)[:, np.newaxis, :]).sum(axis=1)) / p
        share = np.maximum(share, 1e-300)
    return np.asarray(_parts(support + np.log(share))[:, usual:].sum(axis=1) >= LIKELY)


def _parts(logarithms: Array) -> Array:
    """Return what each exponential is of the sum along the last axis."""
    above = np.exp(logarithms - logarithms.max(axis=-1, keepdims=True))
    return np.asarray(above / above.sum(axis=-1, keepdims=True))
