"""The sizes of effects that were found, fitted together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.discovery.search.candidate import Candidate
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scene import Scene
from monitor.records import Array


@dataclass(frozen=True)
class Amplitudes:
    """Coefficients (k,) of the selected effects together, and their covariance (k, k), in internal units."""

    estimate: Array
    covariance: Array


def amplitudes(
    scene: Scene[Candidate[object]], selected: Sequence[Candidate[object]], extra: Array | None = None
) -> Amplitudes:
    """Estimate the coefficients of the selected effects, fitted together with those the model has already.

    ``extra`` (M, e) are columns whose coefficients are not wanted but widen the covariance (how the residual
    changes with a time constant that was searched).
    """
    wanted = np.concatenate([candidate.columns for candidate in selected], axis=1)
    shared = scene.columns([])
    basis = orthonormal(shared if extra is None else np.concatenate([shared, extra], axis=1))
    columns, residual = without(basis, wanted), without(basis, scene.residual[:, None])[:, 0]
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0] = 1.0
    inverse = np.linalg.pinv((columns / scale).T @ (columns / scale), rcond=1e-10, hermitian=True)
    estimate = -inverse @ ((columns / scale).T @ residual)
    remainder = residual + (columns / scale) @ estimate
    dof = scene.degrees_of_freedom - basis.shape[1] - int(np.linalg.matrix_rank(inverse, hermitian=True))
    variance = float(remainder @ remainder) / max(dof, 1)
    return Amplitudes(estimate / scale, variance * inverse / np.outer(scale, scale))


def length_of(coefficients: Array, covariance: Array) -> tuple[float, float]:
    """One coefficient, or the length of several (cosine and sine), with its standard uncertainty."""
    if len(coefficients) == 1:
        return float(coefficients[0]), float(np.sqrt(covariance[0, 0]))
    length = float(np.linalg.norm(coefficients))
    if length == 0.0:
        return 0.0, float(np.sqrt(np.trace(covariance)))
    direction = coefficients / length
    return length, float(np.sqrt(direction @ covariance @ direction))
