"""The longest of many vectors: against all of them by numpy, and which points of a grid can be it."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from monitor.statistics import longest, may_be_longest

POSES, POINTS, PARAMETERS = 3, 7, 5
SHAPE = (POSES, POINTS, POINTS, POINTS)


def field(rng: np.random.Generator, bent: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (k, 3, p) and vectors (k, 3) that run straight along three axes at each pose; along ``bent`` the
    first parameter goes with the square of the position, the most in the middle."""
    position = np.array(list(product(np.linspace(-200.0, 350.0, POINTS), repeat=3)))
    columns = []
    for _ in range(POSES):
        start, slopes = rng.normal(size=(3, PARAMETERS + 1)), rng.normal(size=(3, 3, PARAMETERS + 1)) / 200.0
        # Position by position: a product of two positions is straight along both.
        mixed = rng.normal(size=(3, PARAMETERS + 1)) / 4e4
        rows = start + np.tensordot(position, slopes, axes=1)
        rows += (position[:, 0] * position[:, 1])[:, np.newaxis, np.newaxis] * mixed
        if bent is not None:
            rows[:, :, 0] += 10.0 * (1.0 - ((position[:, [bent]] - 75.0) / 275.0) ** 2)
        columns.append(rows)
    every = np.concatenate(columns)
    return every[:, :, :PARAMETERS], every[:, :, PARAMETERS]


def by_numpy(parameters: np.ndarray, sensitivity: np.ndarray, offset: np.ndarray) -> np.ndarray:
    vectors = np.einsum("kcp,mp->mkc", sensitivity, parameters) + offset
    return np.linalg.norm(vectors, axis=2).max(axis=1)


def test_the_longest_is_that_of_all_vectors() -> None:
    rng = np.random.default_rng(1)
    sensitivity, offset = field(rng)
    parameters = rng.normal(size=(237, PARAMETERS)) * 10.0
    right = by_numpy(parameters, sensitivity, offset)
    np.testing.assert_allclose(longest(parameters, sensitivity, offset), right, rtol=1e-13)


def test_where_a_grid_is_straight_its_corners_are_enough() -> None:
    rng = np.random.default_rng(2)
    sensitivity, offset = field(rng)
    kept = may_be_longest(sensitivity, offset, SHAPE, 100.0)
    assert len(kept) == POSES * 8
    for size in (0.01, 1.0, 100.0):
        parameters = rng.normal(size=(300, PARAMETERS)) * size
        right = by_numpy(parameters, sensitivity, offset)
        np.testing.assert_allclose(longest(parameters, sensitivity[kept], offset[kept]), right, rtol=1e-12)


@pytest.mark.parametrize("bent", [0, 1, 2])
def test_along_an_axis_that_bends_all_points_stay(bent: int) -> None:
    rng = np.random.default_rng(3)
    sensitivity, offset = field(rng, bent)
    kept = may_be_longest(sensitivity, offset, SHAPE, 100.0)
    assert len(kept) == POSES * POINTS * 4
    parameters = rng.normal(size=(300, PARAMETERS)) * 5.0
    right = by_numpy(parameters, sensitivity, offset)
    np.testing.assert_allclose(longest(parameters, sensitivity[kept], offset[kept]), right, rtol=1e-12)
    # The bend is what makes some of the longest lie between the corners.
    corners = may_be_longest(*field(rng), SHAPE, 100.0)
    assert (longest(parameters, sensitivity[corners], offset[corners]) < right * (1.0 - 1e-6)).any()


def test_what_is_left_of_rounding_is_no_bend_but_a_tenth_of_a_thousandth_is() -> None:
    rng = np.random.default_rng(4)
    sensitivity, offset = field(rng)
    rounded = 1e-12 * rng.normal(size=offset.shape)
    assert len(may_be_longest(sensitivity, rounded, SHAPE, 100.0)) == POSES * 8
    assert len(
        may_be_longest(sensitivity, offset + 1e-2 * rng.normal(size=offset.shape), SHAPE, 100.0)
    ) == len(offset)
