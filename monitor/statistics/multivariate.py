"""Are the vectors of all parameters alike between groups? Box's M (covariances) and MANOVA (means).

Both need more runs than parameters: MANOVA over all groups together (n - k >= p), Box's M in every single
group (n_j > p). Where the runs do not suffice they refuse, in words, with the number that would.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.statistics.sums import GroupedSums, grouped_sums
from monitor.statistics.tails import f_tail


@dataclass(frozen=True)
class VectorTest:
    """A test on the vector of all p parameters: F statistic with ``dof`` and ``dof_denominator``."""

    name: str
    labels: tuple[str, ...]
    statistic: float
    f: float
    dof: float
    dof_denominator: float
    p_value: float


def manova(values: npt.ArrayLike, groups: npt.ArrayLike) -> VectorTest:
    """Wilks' lambda for equal mean vectors of ``values`` (n, p) by ``groups`` (n,), with Rao's F.

    With two groups it is Hotelling's T² (then F is exact; also for three groups). Raises ``DataError``
    where n - k < p, or where the parameters are exactly dependent. Source: C. R. Rao, Bull. Int. Stat.
    Inst. 33 (1951) 177; R. A. Johnson and D. W. Wichern, Applied Multivariate Statistical Analysis, 6.4.
    """
    sums = grouped_sums(values, groups)
    n, k, p = sums.n, sums.k, sums.centred.shape[1]
    if sums.dof_within < p:
        raise DataError(
            f"{n} runs in {k} groups leave {sums.dof_within} degrees of freedom for {p} parameters: "
            f"at least {p + k} runs are needed, or at most {sums.dof_within} parameters."
        )
    scaled = _scaled(sums)
    within = np.linalg.slogdet(scaled.residual.T @ scaled.residual)[1]
    total = scaled.centred - scaled.mean
    wilks = float(np.exp(within - np.linalg.slogdet(total.T @ total)[1]))
    q = k - 1
    squares = p * p + q * q - 5
    s = np.sqrt((p * p * q * q - 4) / squares) if squares > 0 else 1.0
    dof = float(p * q)
    dof2 = float(s * (n - 1 - (p + q + 1) / 2.0) - p * q / 2.0 + 1.0)
    root = wilks ** (1.0 / s)
    f = float((1.0 - root) / root * dof2 / dof)
    name = "Hotelling T²" if k == 2 else "MANOVA (Wilks)"
    return VectorTest(name, sums.labels, wilks, f, dof, dof2, float(f_tail(f, dof, dof2)))


def box_m(values: npt.ArrayLike, groups: npt.ArrayLike) -> VectorTest:
    """Box's M for equal covariance matrices of ``values`` (n, p) by ``groups`` (n,), with Box's F.

    Raises ``DataError`` where a group has p runs or fewer. The approximation wants n_j well above p (Box
    asks for 20); with n_j below 2 p it is liberal. Source: G. E. P. Box, Biometrika 36 (1949) 317.
    """
    sums = grouped_sums(values, groups, least_runs=2)
    k, p = sums.k, sums.centred.shape[1]
    few = int(sums.counts.argmin())
    if sums.counts[few] <= p:
        raise DataError(
            f"group {sums.labels[few]} has {sums.counts[few]} runs for {p} parameters: its covariance matrix is "
            f"singular. At least {p + 1} runs in every group are needed, or at most "
            f"{sums.counts[few] - 1} parameters."
        )
    scaled = _scaled(sums)
    dof = sums.counts - 1.0
    within = sums.dof_within
    m = within * np.linalg.slogdet(scaled.residual.T @ scaled.residual / within)[1]
    for j in range(k):
        rows = scaled.residual[sums.index == j]
        m -= dof[j] * np.linalg.slogdet(rows.T @ rows / dof[j])[1]
    c1 = ((1.0 / dof).sum() - 1.0 / within) * (2 * p * p + 3 * p - 1) / (6.0 * (p + 1) * (k - 1))
    c2 = ((1.0 / dof**2).sum() - 1.0 / within**2) * (p - 1) * (p + 2) / (6.0 * (k - 1))
    dof1 = p * (p + 1) * (k - 1) / 2.0
    dof2 = (dof1 + 2.0) / abs(c2 - c1 * c1)
    if c2 > c1 * c1:
        f = m * (1.0 - c1 - dof1 / dof2) / dof1
    else:
        b = dof2 / (1.0 - c1 + 2.0 / dof2)
        f = dof2 * m / (dof1 * (b - m)) if m < b else np.inf
    return VectorTest("Box's M", sums.labels, float(m), float(f), dof1, dof2, float(f_tail(f, dof1, dof2)))


@dataclass(frozen=True)
class _Scaled:
    residual: npt.NDArray[np.float64]
    centred: npt.NDArray[np.float64]
    mean: npt.NDArray[np.float64]


def _scaled(sums: GroupedSums) -> _Scaled:
    """Columns in units of their own scatter: radians beside millimetres would hide the dependent ones."""
    u = np.sqrt(sums.ms_within)
    scale = np.where(u > 0.0, u, 1.0)
    residual = sums.residual / scale
    singular = np.linalg.svd(residual, compute_uv=False)
    if singular[-1] <= 1e-10 * singular[0]:
        raise DataError(
            "values has columns that are exactly dependent, or one that never varies within the groups; "
            "leave out the column that the others determine."
        )
    return _Scaled(residual, sums.centred / scale, sums.mean / scale)
