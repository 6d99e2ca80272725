"""A step that all parameters share at one time, which none of them may show alone."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.changes import Change, when
from monitor.statistics.checks import as_matrix, as_vector
from monitor.statistics.scan_candidates import EDGE


def joint_change(
    values: npt.ArrayLike, times: npt.ArrayLike, *, rng: np.random.Generator, trials: int = 1999
) -> Change:
    """The best common step of all columns of ``values`` (n, p), in any units, and its p-value.

    The statistic is the largest Hotelling T² over all places; its null distribution does not depend on the
    covariance and is simulated. ``size`` is the Mahalanobis length of the step in units of the scatter.
    Raises ``DataError`` unless n > p + 4, or for columns that are exactly dependent. Neglected: serial
    correlation; take day means where runs of a day resemble each other.
    """
    y = as_matrix(values, "values", least=2 * EDGE + 2)
    n, p = y.shape
    t = as_vector(times, "times", length=n)
    if n <= p + 4:
        raise DataError(f"{n} runs for {p} parameters; more than {p + 4} runs are needed.")
    places = np.arange(EDGE, n - EDGE + 1)
    steps = (np.arange(n)[:, np.newaxis] >= places).astype(np.float64)
    steps -= steps.mean(axis=0)
    steps /= np.sqrt((steps**2).sum(axis=0))
    centred = y - y.mean(axis=0)
    norm = np.sqrt((centred**2).sum(axis=0))
    if (norm == 0.0).any() or np.linalg.svd(centred / norm, compute_uv=False)[-1] < 1e-9:
        raise DataError("values has columns that never vary or are exactly dependent; leave one out.")
    share = ((np.linalg.qr(centred / norm)[0].T @ steps) ** 2).sum(axis=0)
    null = np.concatenate(
        [_largest_share(rng, min(100, trials - i), n, p, steps) for i in range(0, trials, 100)]
    )
    best = int(share.argmax())
    p_value = (1 + int((null >= share[best]).sum())) / (trials + 1)
    ratio = share[best] / max(1.0 - share[best], 1e-300)
    runs = places[best] * (n - places[best]) / n
    length = float(np.sqrt(ratio * (n - 2) / runs))
    at = int(places[best])
    between = when(t, places, n * np.log(np.maximum(1.0 - share, 1e-15)), p + 2)
    return Change("all", "step", at, float(t[at]), between, length, float(np.sqrt(1.0 / runs)), p_value)


def _largest_share(rng: np.random.Generator, trials: int, n: int, p: int, steps: Array) -> Array:
    """Largest share over all places for normal noise, (trials,)."""
    draws = rng.standard_normal((trials, n, p))
    draws -= draws.mean(axis=1, keepdims=True)
    q = np.linalg.qr(draws)[0].transpose(0, 2, 1)
    return np.asarray(((q @ steps) ** 2).sum(axis=1).max(axis=1))
