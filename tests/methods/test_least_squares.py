"""The solver alone, on problems whose answer numpy gives in one line: blocks, common unknowns, rank, curvature."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.methods.chain.least_squares import (
    RANK_TOLERANCE,
    Linearisation,
    eliminate,
    project_out,
    solve,
    space_of_run,
)
from monitor.records import Array


def linear(local: Array, common: Array, readings: Array) -> Callable[[Array, Array], Linearisation]:
    """Residuals A x + B y - d of R runs: (R, N, p), (R, N, c) and (R, N)."""

    def at(x: Array, y: Array) -> Linearisation:
        return Linearisation(np.einsum("rnp,rp->rn", local, x) + common @ y - readings, local, common)

    return at


def in_one(local: Array, common: Array) -> Array:
    """The same problem as a single matrix: the runs' blocks, then the common columns."""
    runs, rows, width = local.shape
    whole = np.zeros((runs * rows, runs * width + common.shape[-1]))
    for run in range(runs):
        whole[run * rows : (run + 1) * rows, run * width : (run + 1) * width] = local[run]
    whole[:, runs * width :] = common.reshape(runs * rows, -1)
    return whole


def drawn(common: int) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(5)
    # Columns of sizes from 1e-4 to 1e4, as µm and rad beside one another have.
    local = rng.normal(size=(3, 20, 4)) * np.array([1e-4, 1.0, 30.0, 1e4])
    return local, rng.normal(size=(3, 20, common)) * 7.0, rng.normal(size=(3, 20))


@pytest.mark.parametrize("common", [0, 1, 3])
def test_blocks_and_common_unknowns_equal_one_large_problem(common: int) -> None:
    a, b, d = drawn(common)
    found = solve(linear(a, b, d), np.zeros((3, 4)), np.zeros(common))
    whole = in_one(a, b)
    size = np.linalg.norm(whole, axis=0)
    expected = np.linalg.lstsq(whole / size, d.reshape(-1), rcond=None)[0] / size
    np.testing.assert_allclose(found.local.reshape(-1), expected[:12], rtol=1e-9)
    np.testing.assert_allclose(found.common, expected[12:], rtol=1e-9)
    scaled = whole / size
    covariance = np.linalg.inv(scaled.T @ scaled) / np.outer(size, size)
    for run in range(3):
        own = covariance[4 * run : 4 * run + 4, 4 * run : 4 * run + 4]
        np.testing.assert_allclose(found.local_covariance[run], own, rtol=1e-8, atol=0)
    np.testing.assert_allclose(found.common_covariance, covariance[12:, 12:], rtol=1e-8)
    assert found.local_free.all()
    assert found.common_free.all()
    assert found.rank.tolist() == [4, 4, 4]


def test_padding_with_zero_rows_changes_nothing() -> None:
    a, b, d = drawn(2)
    plain = solve(linear(a, b, d), np.zeros((3, 4)), np.zeros(2))
    wide = [np.concatenate([m, np.zeros_like(m[:, :7])], axis=1) for m in (a, b, d)]
    padded = solve(linear(*wide), np.zeros((3, 4)), np.zeros(2))
    np.testing.assert_allclose(padded.local, plain.local, rtol=1e-9)
    np.testing.assert_allclose(padded.common_covariance, plain.common_covariance, rtol=1e-9)


def test_equal_columns_are_refused_and_the_rest_keeps_its_number() -> None:
    a, b, d = drawn(1)
    a[1, :, 2] = -2.0 * a[1, :, 0]
    found = solve(linear(a, b, d), np.zeros((3, 4)), np.zeros(1))
    assert found.rank.tolist() == [4, 3, 4]
    assert found.local_free.tolist() == [[True] * 4, [False, True, False, True], [True] * 4]
    assert found.common_free.all()
    merged = a.copy()
    merged[1, :, 2] = 0.0
    whole = in_one(merged, b)
    expected = np.linalg.lstsq(whole, d.reshape(-1), rcond=None)[0]
    np.testing.assert_allclose(found.local[1, [1, 3]], expected[[5, 7]], rtol=1e-8)
    np.testing.assert_allclose(found.common, expected[12:], rtol=1e-8)


def test_a_column_of_zeros_is_refused() -> None:
    a, b, d = drawn(2)
    a[0, :, 3] = 0.0
    b[:, :, 1] = 0.0
    found = solve(linear(a, b, d), np.zeros((3, 4)), np.zeros(2))
    assert found.local_free[0].tolist() == [True, True, True, False]
    assert found.common_free.tolist() == [True, False]
    assert found.local[0, 3] == 0.0


def test_a_common_unknown_inside_the_runs_own_span_is_refused() -> None:
    a, b, d = drawn(2)
    b[:, :, 0] = np.einsum("rnp,p->rn", a, [1e3, 2.0, 0.1, 1e-4])
    found = solve(linear(a, b, d), np.zeros((3, 4)), np.zeros(2))
    assert found.common_free.tolist() == [False, True]
    assert found.local_free.all()


def test_two_common_unknowns_that_do_the_same_are_both_refused() -> None:
    a, b, d = drawn(3)
    b[:, :, 2] = 5.0 * b[:, :, 0]
    found = solve(linear(a, b, d), np.zeros((3, 4)), np.zeros(3))
    assert found.common_free.tolist() == [False, True, False]


@pytest.mark.parametrize(("off", "rank"), [(30 * RANK_TOLERANCE, 2), (0.1 * RANK_TOLERANCE, 1)])
def test_rank_is_counted_at_its_tolerance(off: float, rank: int) -> None:
    first = np.array([1.0, 0.0, 0.0])
    second = np.array([1.0, off, 0.0])
    assert eliminate(np.column_stack([first, second])[None]).rank.tolist() == [rank]


def test_what_is_projected_out_is_gone() -> None:
    a, b, _ = drawn(3)
    left = project_out(eliminate(a).basis, b)
    assert np.abs(np.einsum("rnp,rnk->rpk", a / np.linalg.norm(a, axis=1)[:, None], left)).max() < 1e-11


def test_a_curved_problem_reaches_the_point_where_the_gradient_vanishes() -> None:
    t = np.linspace(0.0, 2.0, 25)
    data = 3.0 * np.exp(-1.3 * t) + 0.05 * np.sin(17.0 * t)

    def at(x: Array, y: Array) -> Linearisation:
        decay = np.exp(-x[:, 1:] * t)
        slopes = np.stack([decay, -x[:, :1] * t * decay], axis=-1)
        return Linearisation(x[:, :1] * decay - data, slopes, np.zeros((1, 25, 0)))

    found = solve(at, np.array([[1.0, 0.1]]), np.zeros(0))
    gradient = np.einsum("rnp,rn->rp", found.last.local, found.last.residual)
    assert np.abs(gradient).max() < 1e-7
    np.testing.assert_allclose(found.local, [[3.0, 1.3]], atol=0.05)


def test_readings_that_no_step_brings_nearer_do_not_converge() -> None:
    # Every step leads the wrong way, as with an axis that moves against its sign.
    def at(x: Array, y: Array) -> Linearisation:
        return Linearisation(x - 1e3, -np.ones((1, 1, 1)), np.zeros((1, 1, 0)))

    with pytest.raises(
        DataError, match=r"did not converge in 50 steps: .* check the axis signs, the topology"
    ):
        solve(at, np.zeros((1, 1)), np.zeros(0))


def test_fewer_rows_than_unknowns_span_what_they_can() -> None:
    """A plan of few touches: the basis reproduces every column, and the null vectors change no residual."""
    rng = np.random.default_rng(20261123)
    local = rng.standard_normal((2, 5, 8))
    space = eliminate(local)
    assert space.rank.tolist() == [5, 5]
    assert project_out(space.basis, local) == pytest.approx(np.zeros(local.shape), abs=1e-12)
    scale = np.linalg.norm(local, axis=1)
    # Null vectors are those of the scaled columns; there are 8 - 5 of them.
    nulls = space.null_space / scale[:, None, :]
    assert np.einsum("rnp,rkp->rnk", local, nulls) == pytest.approx(np.zeros((2, 5, 8)), abs=1e-12)
    assert [np.linalg.matrix_rank(vectors) for vectors in nulls] == [3, 3]


@pytest.mark.parametrize("alike", [1.0, 1e-2, 1e-4, 1e-7, 0.0])
@pytest.mark.parametrize("rows", [40, 4])
def test_the_space_of_one_run_is_that_of_the_elimination(alike: float, rows: int) -> None:
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((rows, 6)) * 10.0 ** np.arange(-3, 3)
    columns[:, 5] = columns[:, 0] + alike * columns[:, 5] / 10.0**5
    fast, slow = space_of_run(columns), eliminate(columns[None])
    assert fast.rank == int(slow.rank[0])
    # The projection, and the shortest unknowns behind it, do not depend on how the basis is turned.
    np.testing.assert_allclose(fast.basis @ fast.basis.T, slow.basis[0] @ slow.basis[0].T, rtol=0, atol=1e-9)
    scale = np.linalg.norm(columns, axis=0)[:, None]
    np.testing.assert_allclose(
        scale * (fast.inverse @ fast.basis.T),
        scale * (slow.inverse[0] @ slow.basis[0].T),
        rtol=1e-6,
        atol=1e-6,
    )


def test_a_model_that_bends_under_a_large_residual_converges_where_whole_steps_run_away() -> None:
    """Fletcher's example (Practical Methods of Optimization, 1987, 6.1): (x + 1)^2 + (b x^2 + x - 1)^2 has its minimum
    at 0, and each whole step of Gauss and Newton multiplies x by b: -1.4 leads away."""

    def at(x: Array, y: Array) -> Linearisation:
        (value,) = x[0]
        residual = np.array([[value + 1.0, -1.4 * value**2 + value - 1.0]])
        by_x = np.array([[[1.0], [-2.8 * value + 1.0]]])
        return Linearisation(residual, by_x, np.zeros((1, 2, 0)))

    solution = solve(at, np.array([[0.1]]), np.zeros(0))
    assert abs(solution.local[0, 0]) < 1e-7
