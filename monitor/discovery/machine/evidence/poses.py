"""Readings of one pose share what the machine did there: the evidence for an effect counted by poses.

A robot comes back to a pose to some hundredths of a millimetre, and all reflectors on its tool move with it, so that
nine coordinates of a pose are not nine independent readings. What is the same in a pose is allowed for by a test
whose variance is that of the poses' own sums (Liang and Zeger, Biometrika 73 (1986) 13; the clusters are the poses).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.search.projection import orthonormal, without
from monitor.methods.chain.poses import covariance_by_poses, shared_poses
from monitor.records import Array


def poses_of_rows(fit: Fit) -> npt.NDArray[np.int64] | None:
    """The pose (M,) of every whitened number, -1 for calibrated quantities and padding; None where readings do not
    share their poses."""
    return shared_poses(fit.problem, fit.solution)


def p_value_by_poses(
    candidate: ChainCandidate,
    scene: ChainScene,
    others: Sequence[ChainCandidate],
    pose: npt.NDArray[np.int64],
) -> float:
    """Return p-value of an effect beside others with every pose as one observation, what was searched paid for."""
    beside = scene.remainders.beside(others)
    residual = beside.residual
    columns = orthonormal(without(beside.basis, candidate.columns))
    size = columns.shape[1]
    inside = pose >= 0
    poses = len(np.unique(pose[inside]))
    dof = beside.degrees_of_freedom - size
    if size == 0 or dof < 1 or poses <= size:
        return 1.0
    onto = columns.T @ residual
    remainder = residual - columns @ onto
    scores = _sums(columns[inside] * remainder[inside, None], pose[inside])
    # What the fit took out of the residual is missing from the sums.
    meat = scores.T @ scores * (int(inside.sum()) / dof)
    statistic = float(onto @ np.linalg.pinv(meat, hermitian=True) @ onto) / size
    return float(min(1.0, scipy.special.fdtrc(size, poses - size, statistic) * candidate.variant.tries))


def widening(scene: ChainScene, selected: Sequence[ChainCandidate], pose: npt.NDArray[np.int64]) -> Array:
    """Factors (k,), 1 at least, by which what poses share widens the standard uncertainties of the selected effects'
    coefficients over those of independent readings."""
    basis = orthonormal(scene.shared)
    residual = without(basis, scene.residual[:, None])[:, 0]
    columns = without(basis, np.concatenate([candidate.columns for candidate in selected], axis=1))
    of_runs = scene.fit.nuisance.basis
    unknowns = np.concatenate([of_runs.reshape(len(residual), -1), basis], axis=1)
    shared, plain = covariance_by_poses(columns, unknowns, residual, pose)
    rank = int(np.linalg.matrix_rank(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)))
    dof = max(scene.degrees_of_freedom - basis.shape[1] - rank, 1)
    remainder = without(orthonormal(columns), residual[:, None])[:, 0]
    ratio = np.diag(shared) / np.maximum(np.diag(plain) * float(remainder @ remainder) / dof, 1e-300)
    return np.asarray(np.sqrt(np.maximum(ratio, 1.0)))


def _sums(rows: Array, pose: npt.NDArray[np.int64]) -> Array:
    """Sums (P, k) of rows (m, k) over each pose."""
    _, index = np.unique(pose, return_inverse=True)
    return np.column_stack([np.bincount(index, weights=column) for column in rows.T])
