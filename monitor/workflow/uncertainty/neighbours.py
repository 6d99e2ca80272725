"""The covariance of readings of one run that resemble their neighbours, where no repeated runs show it.

Of several instruments each resembles itself alone, all by one correlation. What a model lacks makes neighbours alike as
well: then u is too large rather than too small.

A slow drift, a warm spindle, a probe that forgets slowly: such noise moves parameters by more than independent noise of
the same size, and the residuals show less of it. What the search for missing effects takes out before it looks
(``discovery.machine.noise``) is put into the covariance here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.discovery import Fit
from monitor.discovery.machine.noise.correlation import Correlation, Whitening
from monitor.methods.chain.poses import shared_poses
from monitor.records import Array
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.runs.touched_run import TouchedRun


@dataclass(frozen=True)
class Resemblance:
    """How the readings of a run resemble each other: their ``matrix`` (N, N) of correlations and the ``correlation``
    that it is of; ``scale`` is the standard deviation of a reading over the stated one, by generalised least squares.
    """

    matrix: Array
    correlation: Correlation
    scale: float


def resemblance_of(fit: Fit, run: MeasuredRun) -> Resemblance | None:
    """The resemblance of the readings of one ``run`` of a fit; None where its residuals show none.

    None, too, where numbers share their poses (a robot): these are what resembles, and have a yardstick of their own.
    """
    if shared_poses(fit.problem, fit.solution) is not None:
        return None
    correlation = fit.correlation()
    if correlation is None:
        return None
    white = fit.with_correlation(correlation)
    index = int(np.flatnonzero(fit.problem.runs == run.problem.runs[0])[0])
    whitening = white.whitening
    assert whitening is not None
    if isinstance(run, TouchedRun):
        # The linear axes drift alike, each by itself. A touch without weight has no row of its own.
        triangle = whitening.factors[0][index] + np.diag(~whitening.rows.weighted[index] * 1.0)
        touches = np.linalg.inv(triangle)[: run.probings, : run.probings]
        matrix = np.kron(touches @ touches.T, np.eye(len(run.linear)))
    else:
        numbers = _root(white, whitening, index)[run.problem.is_number.ravel()]
        matrix = numbers @ numbers.T
    scale = float(np.sum(white.white**2)) / max(fit.degrees_of_freedom, 1)
    size = np.sqrt(np.diag(matrix))
    size = np.where(size > 0.0, size, 1.0)
    return Resemblance(matrix / np.outer(size, size), correlation, float(np.sqrt(scale)))


def _root(white: Fit, whitening: Whitening, index: int) -> Array:
    """What independent numbers are as those of the run at ``index``: (n d, n d) for its n rows."""
    rows = whitening.rows
    count = int(np.sum(white.problem.context.run == white.problem.runs[index])) * rows.numbers
    shape = white.solution.last.residual.shape
    root = np.empty((count, count))
    for number in range(count):
        unit = np.zeros(shape)
        unit[index, number] = 1.0
        root[:, number] = whitening.undone(unit)[index, :count]
    return root
