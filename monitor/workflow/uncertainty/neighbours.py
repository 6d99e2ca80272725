"""The covariance of readings of one run that resemble their neighbours, where no repeated runs show it.

Of several instruments each resembles itself alone, all by one correlation. What a model lacks makes neighbours alike as
well: then u is too large rather than too small.

A slow drift, a warm spindle, a probe that forgets slowly: such noise moves parameters by more than independent noise of
the same size, and the residuals show less of it. What the search for missing effects takes out before it looks
(``discovery.machine.noise``) is put into the covariance here.

Readings of one pose of a robot share how its joints came to rest there: one part of their variance is common to all of
them, and follows that of the pose before by the correlation (docs/trials-robots.md has the rates).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.discovery import Fit
from monitor.discovery.machine.noise.correlation import Correlation
from monitor.discovery.machine.noise.rows import Rows
from monitor.methods.chain.poses import shared_poses
from monitor.records import Array
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.runs.touched_run import TouchedRun


@dataclass(frozen=True)
class Resemblance:
    """How the readings of a run resemble each other: their ``matrix`` (N, N) of correlations and the ``correlation``
    that it is of, from reading to reading or ``of_poses``; ``scale`` is the standard deviation of a reading over the
    stated one, by generalised least squares.
    """

    matrix: Array
    correlation: Correlation
    scale: float
    of_poses: bool

    @property
    def neighbours(self) -> float:
        """The correlation of a reading with the one before it, with ``of_poses`` with the others of its pose."""
        return self.correlation.share * (1.0 if self.of_poses else self.correlation.rho)


def resemblance_of(fit: Fit, run: MeasuredRun) -> Resemblance | None:
    """The resemblance of the readings of one ``run`` of a fit; None where its residuals show none."""
    correlation = fit.correlation()
    if correlation is None:
        return None
    rows, of_poses = fit.rows, shared_poses(fit.problem, fit.solution) is not None
    white = fit.with_correlation(correlation).white
    scale = float(np.sum(white**2)) / max(fit.degrees_of_freedom, 1)
    index = int(np.flatnonzero(fit.problem.runs == run.problem.runs[0])[0])
    touches = rows.correlated(index, correlation.rho, correlation.share)
    if isinstance(run, TouchedRun):
        # The linear axes drift alike, each by itself.
        matrix = _each_alike(touches[: run.probings, : run.probings], len(run.linear))
    else:
        is_number = run.problem.is_number
        matrix = _of_numbers(touches[: len(is_number), : len(is_number)], rows, index)
        matrix = matrix[np.ix_(is_number.ravel(), is_number.ravel())]
    size = np.sqrt(np.diag(matrix))
    size = np.where(size > 0.0, size, 1.0)
    matrix /= size
    matrix /= size[:, None]
    return Resemblance(matrix, correlation, float(np.sqrt(scale)), of_poses)


def _of_numbers(touches: Array, rows: Rows, index: int) -> Array:
    """The correlations (n d, n d) of the numbers of n rows from those (n, n) of drifts in one direction."""
    count, numbers = len(touches), rows.numbers
    if rows.turned is None:
        return _each_alike(touches, numbers)
    turned = rows.turned[index, :count]
    matrix = np.einsum("iba,ij,jbc->iajc", turned, touches, turned, optimize=True)
    return np.asarray(matrix.reshape(count * numbers, -1))


def _each_alike(touches: Array, numbers: int) -> Array:
    """The correlations of so many numbers of every touch, each of which follows the same of the touch before."""
    return np.asarray(np.kron(touches, np.eye(numbers)), dtype=np.float64)
