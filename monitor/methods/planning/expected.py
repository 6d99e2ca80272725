"""Expected uncertainties of a plan before anyone measures: what every touch that it could make is worth.

A candidate touch is a target at an indexation. Its three residuals depend on the parameters, the stylus tip and
the target's own place, which no other target shares; with the places eliminated, the information on parameters
and tip is a sum over the targets (a block elimination of the normal equations). So thousands of plans are
weighed in a second, from one walk through the chain. First order, at a machine without errors: errors of 100 µrad
change the Jacobian, and with it an uncertainty, by some 1e-4 of itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.methods.chain.least_squares import MEMBER_SHARE, RANK_TOLERANCE
from monitor.methods.planning.touches import Bar, Mask, Touches
from monitor.records import Array


@dataclass(frozen=True)
class Expected:
    """What a plan promises: standard uncertainties ``u`` (k,) in internal units, NaN where it gives no number.

    ``alone`` (k,) is what would be left if everything else were known. ``separation`` compares the two.
    ``covariance`` (k, k) is that of the parameters ``names``.
    """

    names: tuple[str, ...]
    u: Array
    alone: Array
    covariance: Array

    @property
    def separation(self) -> Array:
        """From 0 (the plan cannot separate the parameter from others) to 1 (nothing is lost to them), (k,)."""
        return np.asarray(
            np.where(np.isfinite(self.u), self.alone / np.where(np.isfinite(self.u), self.u, 1.0), 0.0)
        )

    @property
    def determined(self) -> Mask:
        """Which parameters get a number (k,)."""
        return np.isfinite(self.u)


@dataclass(frozen=True)
class Sums:
    """What plans add up to: ``squares`` (..., q, q) of all rows, ``rows`` (..., T, 3, q) of each target and how many
    ``touches`` (..., T) it has. The sums of two plans without a common touch add."""

    squares: Array
    rows: Array
    touches: Array

    def __add__(self, other: Sums) -> Sums:
        return Sums(self.squares + other.squares, self.rows + other.rows, self.touches + other.touches)


def sums_of(touches: Touches, touched: Mask) -> Sums:
    """The sums of plans ``touched`` (..., P, T)."""
    weight = touched.astype(float)
    return Sums(
        np.einsum("...pt,ptij->...ij", weight, touches.squares),
        np.einsum("...pt,ptai->...tai", weight, touches.rows),
        weight.sum(axis=-2),
    )


def sums_by_pose(touches: Touches, touched: Mask) -> Sums:
    """The sums (P, ...) of each pose of the plan ``touched`` (P, T) by itself."""
    weight = touched.astype(float)
    return Sums(
        np.einsum("pt,ptij->pij", weight, touches.squares), weight[:, :, None, None] * touches.rows, weight
    )


def information(touches: Touches, sums: Sums) -> Array:
    """Information (..., q, q) of plans on parameters and tip, the targets' places free."""
    paired = [index for bar in touches.bars for index in (bar.first, bar.second)]
    single = [index for index in range(len(touches.targets)) if index not in paired]
    rows = sums.rows[..., single, :, :]
    weight = 1.0 / np.sqrt(np.maximum(sums.touches[..., single], 1.0))
    rows = (rows * weight[..., None, None]).reshape(*rows.shape[:-3], -1, rows.shape[-1])
    lost = np.swapaxes(rows, -1, -2) @ rows
    for bar in touches.bars:
        lost = lost + _lost_to_bar(touches, bar, sums.rows, sums.touches)
    return np.asarray(sums.squares - lost)


def _lost_to_bar(touches: Touches, bar: Bar, sums: Array, counts: Array) -> Array:
    """What the six coordinates of the bar's ends take of the information, the calibrated length known."""
    ends = [bar.first, bar.second]
    cross = np.concatenate(
        [sums[..., end, :, :] for end in ends], axis=-2
    )  # (..., 6, q), sign of -1/sigma left out
    inner = np.zeros((*counts.shape[:-1], 6, 6))
    for number, end in enumerate(ends):
        block = slice(3 * number, 3 * number + 3)
        inner[..., block, block] = np.eye(3) * np.maximum(counts[..., end, None, None], 1e-12)
    # In units of sigma, as the rows: the length row has the weight (sigma / u)².
    row = np.concatenate([bar.direction, -bar.direction]) * touches.sigma / bar.standard_uncertainty
    inner = inner + np.outer(row, row)
    return np.asarray(np.swapaxes(cross, -1, -2) @ np.linalg.solve(inner, cross))


def expected(touches: Touches, touched: Mask) -> Expected:
    """Expected uncertainties of the plan ``touched`` (P, T)."""
    matrix = information(touches, sums_of(touches, touched))
    raw = np.sqrt(np.diag(np.einsum("pt,ptij->ij", touched.astype(float), touches.squares)))
    scale = np.where(raw > 0.0, raw, 1.0)
    values, vectors = np.linalg.eigh(matrix / scale[:, None] / scale)
    # Of singular values the limit is RANK_TOLERANCE, of eigenvalues its square.
    keep = values > RANK_TOLERANCE**2 * max(float(values[-1]), np.finfo(float).tiny)
    lost = np.max(np.abs(vectors[:, ~keep]), axis=1, initial=0.0) >= MEMBER_SHARE
    half = vectors[:, keep] / np.sqrt(values[keep]) / scale[:, None]
    covariance = half @ half.T
    covariance[lost, :] = covariance[:, lost] = np.nan
    reported = slice(0, touches.reported)
    diagonal = np.diag(matrix)[reported]
    return Expected(
        names=touches.names[reported],
        u=np.sqrt(np.diag(covariance)[reported]),
        alone=np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), np.inf),
        covariance=covariance[reported, reported],
    )
