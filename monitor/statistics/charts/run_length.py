"""Average run length of EWMA and CUSUM charts by Markov chain, the size of the reference period included.

A chart whose centre and scatter come from m runs does not have the run length of the textbook: its standardised
points have neither mean 0 nor scatter 1. Limits here make the expected rate of false alarms over everything
that the reference period may have been equal to 1 / ARL.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.charts.chart_limits import tabulated_limit

#: States of the chain: with 101 the run length of the tables of Lucas and Saccucci (1990) comes to 4 digits.
STATES = 101
#: Longer mean times than this drown in the rounding of double precision (1e-16 times the number of states).
LONGEST = 1e12
#: Nodes for the centre (Gauss-Hermite) and the scatter (Gauss-Legendre in probability) of the reference.
NODES = 9

RunLength = Callable[[float, Array, Array], Array]


def _solve(inside: Array, start: int) -> Array:
    """Mean time to absorption from state ``start`` for transition matrices (..., s, s)."""
    size = inside.shape[-1]
    system = np.eye(size) - inside
    absorption_time = np.linalg.solve(system, np.ones((*inside.shape[:-2], size, 1)))[..., start, 0]
    # Where hardly anything is absorbed the system is singular to rounding and the sign of its solution is chance.
    return np.where((absorption_time > 0.0) & (absorption_time < LONGEST), absorption_time, LONGEST)


def ewma_run_length(width: float, shift: Array, scatter: Array, lam: float) -> Array:
    """ARL of a two-sided EWMA with constant limits ``width`` sqrt(lam / (2 - lam)), for points with mean
    ``shift`` (m,) and standard deviation ``scatter`` (m,), both in standardised units.

    Source: J. M. Lucas and M. S. Saccucci, Technometrics 32 (1990) 1; chain of Brook and Evans (1972).
    """
    limit = width * np.sqrt(lam / (2.0 - lam))
    edges = np.linspace(-limit, limit, STATES + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    reach = (edges[np.newaxis, :] - (1.0 - lam) * middle[:, np.newaxis]) / lam
    below = scipy.special.ndtr(
        (reach - shift[:, np.newaxis, np.newaxis]) / scatter[:, np.newaxis, np.newaxis]
    )
    return _solve(np.diff(below, axis=2), STATES // 2)


def cusum_run_length(h: float, shift: Array, scatter: Array, k: float) -> Array:
    """ARL of a two-sided tabular CUSUM with reference value ``k`` and limit ``h``, both in standard deviations.

    The two sides combine as rates (D. M. Hawkins and D. H. Olwell, Cumulative Sum Charts, 1998, 2.2).
    Chain of Brook and Evans, Biometrika 59 (1972) 539.
    """
    step = 2.0 * h / (2 * STATES - 1)
    middle = step * np.arange(STATES)
    edges = np.concatenate([[-np.inf], middle + step / 2.0])
    rate = np.zeros_like(shift)
    for side in (1.0, -1.0):
        reach = edges[np.newaxis, :] - middle[:, np.newaxis] + k
        below = scipy.special.ndtr(
            (reach - side * shift[:, np.newaxis, np.newaxis]) / scatter[:, np.newaxis, np.newaxis]
        )
        rate += 1.0 / _solve(np.diff(below, axis=2), 0)
    return 1.0 / rate


def reference_nodes(n: float, dof: float) -> tuple[Array, Array, Array]:
    """Means, scatters and weights of the standardised points over what the reference may have been."""
    if np.isinf(n):
        return np.zeros(1), np.ones(1), np.ones(1)
    z, wz = np.polynomial.hermite_e.hermegauss(NODES)
    x, wx = np.polynomial.legendre.leggauss(NODES)
    ratio = np.sqrt(2.0 * scipy.special.gammaincinv(0.5 * dof, 0.5 * (x + 1.0)) / dof)
    shift = (-(z[:, np.newaxis] / np.sqrt(n)) / ratio).ravel()
    scatter = np.repeat((1.0 / ratio)[np.newaxis, :], NODES, axis=0).ravel()
    weight = np.outer(wz / wz.sum(), wx / wx.sum()).ravel()
    return shift, scatter, weight


def run_length(chart: RunLength, limit: float, n: float, dof: float) -> float:
    """Return 1 / (expected rate of false alarms) of a chart whose reference had ``n`` runs and ``dof``."""
    shift, scatter, weight = reference_nodes(n, dof)
    return float(1.0 / (weight / chart(limit, shift, scatter)).sum())


def limit_for(chart: partial[Array], arl: float, n: float, dof: float, top: float) -> float:
    """The limit with the wanted run length, from the table where it holds it; ``DataError`` where even ``top`` does not
    reach it."""
    name = "ewma" if chart.func is ewma_run_length else "cusum"
    (constant,) = chart.keywords.values()
    tabulated = tabulated_limit(name, constant, arl, n, dof)
    return solved_limit(chart, arl, n, dof, top) if tabulated is None else tabulated


def solved_limit(chart: partial[Array], arl: float, n: float, dof: float, top: float) -> float:
    """As ``limit_for``, computed."""
    return _limit(chart.func, tuple(sorted(chart.keywords.items())), arl, n, dof, top)


# A limit takes a quarter of a second and depends on the size of the reference alone: parameters share it.
@lru_cache(maxsize=256)
def _limit(
    function: RunLength, keywords: tuple[tuple[str, float], ...], arl: float, n: float, dof: float, top: float
) -> float:
    chart = partial(function, **dict(keywords))
    if run_length(chart, top, n, dof) < arl:
        raise DataError(
            f"a reference period of {n:g} runs cannot promise a run length of {arl:g}; take a longer one."
        )

    def excess(limit: float) -> float:
        return float(np.log(run_length(chart, limit, n, dof) / arl))

    return float(scipy.optimize.brentq(excess, 0.2, top, xtol=1e-4))
