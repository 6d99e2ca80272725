"""Whether one error that several quantities have in common explains how far each of them jumped.

The jumps are fitted to independent points beside a line of each quantity, and their covariance is estimated from what
is left: of few points it is known badly, and Student's law has that. What the error cannot do, the differences between
the jumps beyond it, is asked of each quantity at the Bonferroni share (valid whatever their correlations); how large
the error would have to be is asked besides, with what is stated of it (JCGM 100:2008, F.1.2.3).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array

#: Directions that are shorter than this part of the longest are rounding, and so are differences of that part of the
#: largest jump: of jumps without any scatter these would be many times their u.
NOTHING = 1e-9


class Jumps(NamedTuple):
    """How far p quantities jump: ``sizes`` (p,), their ``covariance`` (p, p), with so many degrees of freedom."""

    sizes: Array
    covariance: Array
    dof: int


def jumps(values: Array, t: Array, after: npt.NDArray[np.bool_], *, line: bool) -> Jumps | None:
    """Return the jumps of the columns of ``values`` (m, p) from the points before to those ``after`` (m,), beside a
    line in ``t`` (m,) common to both sides where ``line`` says so; None where no degree of freedom is left."""
    columns = [np.ones(len(t)), after.astype(np.float64), *([t - t.mean()] if line else [])]
    design = np.column_stack(columns)
    dof = len(t) - design.shape[1]
    if dof < 1 or np.linalg.matrix_rank(design / np.linalg.norm(design, axis=0)) < design.shape[1]:
        return None
    origin = values[0]
    inverse = np.linalg.pinv(design)
    fitted = inverse @ (values - origin)
    rest = values - origin - design @ fitted
    return Jumps(fitted[1], rest.T @ rest / dof * float(inverse[1] @ inverse[1]), dof)


def p_of_common_error(steps: Jumps, apart: Array, scale: Array) -> float:
    """Return the probability of jumps as unlike one error as these where there is nothing else.

    ``apart`` (p, q) are what the quantities change by for one standard uncertainty of each error, ``scale`` (p,) by
    what they are compared: their stated uncertainties, which need not be right.
    """
    sizes, parts = steps.sizes / scale, apart / scale[:, np.newaxis]
    covariance = steps.covariance / np.outer(scale, scale)
    directions, lengths, _ = np.linalg.svd(parts, full_matrices=False)
    along = directions[:, lengths > NOTHING * lengths.max()]
    p_error = _p_of_size(along.T @ sizes, along.T @ covariance @ along, along.T @ parts, steps.dof)
    beyond = np.eye(len(sizes)) - along @ along.T
    free = len(sizes) - along.shape[1]
    if free == 0:
        return p_error
    beyond = beyond[np.linalg.norm(beyond, axis=1) > NOTHING]
    u = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", beyond, covariance, beyond), np.finfo(np.float64).tiny))
    # Of one contrast the rows are one question.
    questions = 1 if free == 1 else len(beyond)
    differences = np.abs(beyond @ sizes)
    differences[differences <= NOTHING * np.abs(sizes).max()] = 0.0
    p_beyond = questions * 2.0 * float(scipy.special.stdtr(steps.dof, -np.max(differences / u)))
    return min(1.0, 2.0 * min(p_error, p_beyond))


def _p_of_size(sizes: Array, scatter: Array, parts: Array, dof: int) -> float:
    """The probability of an error of these ``sizes`` (r,), with the estimated covariance ``scatter`` (r, r) and what is
    stated of it, ``parts`` (r, q); degrees of freedom by Welch and Satterthwaite."""
    whole = scatter + parts @ parts.T
    share = float(np.trace(scatter) / np.trace(whole))
    squares = float(sizes @ np.linalg.solve(whole, sizes)) / len(sizes)
    return float(scipy.special.fdtrc(len(sizes), dof / max(share, 1e-6) ** 2, squares))
