"""Columns projected onto, and out of, the span of others."""

from __future__ import annotations

import numpy as np

from monitor.records import Array

# Eigenvalues of a candidate's scaled normal matrix below this belong to directions without data.
RELATIVE_RANK = 1e-9


def orthonormal(columns: Array) -> Array:
    """An orthonormal basis (M, rank) of what columns (M, k) span."""
    return orthonormal_by(columns)[0]


def orthonormal_by(columns: Array) -> tuple[Array, Array]:
    """That basis, and the combinations (k, rank) of the columns that it consists of."""
    if columns.shape[1] == 0:
        return columns, np.zeros((0, 0))
    gram = columns.T @ columns
    scale = np.sqrt(np.diagonal(gram))
    if len(scale) == 1 and scale[0] > 0.0:
        return columns / scale, 1.0 / scale[:, None]
    scale = np.where(scale == 0, 1.0, scale)
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    keep = values > RELATIVE_RANK * max(float(values.max()), 1.0)
    combinations = vectors[:, keep] / np.sqrt(values[keep]) / scale[:, None]
    return columns @ combinations, combinations


def orthonormal_to_full_precision(columns: Array) -> Array:
    """An orthonormal basis (m, r) of columns, to full precision: calendar years to the third power."""
    scale = np.linalg.norm(columns, axis=0)
    u, values, _ = np.linalg.svd(columns / np.where(scale == 0, 1.0, scale), full_matrices=False)
    return np.asarray(u[:, values > 1e-12 * max(values.max(initial=0.0), 1e-300)])


def without(basis: Array, columns: Array) -> Array:
    """Columns with the span of an orthonormal basis taken out."""
    if basis.shape[1] == 0:
        return columns
    remainder: Array = columns - basis @ (basis.T @ columns)
    return remainder


def eigen(grams: Array) -> tuple[Array, Array]:
    """The rising eigenvalues (..., k) and the eigenvectors (..., k, k) of symmetric matrices: of two rows in closed
    form, since LAPACK takes them one by one."""
    if grams.shape[-1] == 1:
        # Of one coefficient the product is its own eigenvalue.
        return grams[..., 0], np.ones_like(grams)
    if grams.shape[-1] > 2:
        values, vectors = np.linalg.eigh(grams)
        return values, vectors
    first, between, second = grams[..., 0, 0], grams[..., 0, 1], grams[..., 1, 1]
    mean, half = (first + second) / 2.0, (first - second) / 2.0
    radius, angle = np.hypot(half, between), np.arctan2(between, half) / 2.0
    cosine, sine = np.cos(angle), np.sin(angle)
    vectors = np.stack([-sine, cosine, cosine, sine], axis=-1).reshape(*grams.shape)
    return np.stack([mean - radius, mean + radius], axis=-1), np.swapaxes(vectors, -1, -2)


def inverse_above(grams: Array, least: float) -> Array:
    """The inverses (..., k, k) of products of columns, symmetric; directions with at most ``least`` are left out.

    The limit is one for all: of a single column that is hardly there `pinv` would keep everything, since it compares
    with the largest of the same matrix.
    """
    values, vectors = np.linalg.eigh(grams)
    keep = values > least
    inverse = np.where(keep, 1.0 / np.where(keep, values, 1.0), 0.0)
    return np.asarray((vectors * inverse[..., None, :]) @ np.swapaxes(vectors, -1, -2))
