"""What is computed from products of columns, or without derivatives, against least squares and the whole way."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.discovery.machine.scene import ChainScene, scene_of
from monitor.discovery.machine.shapes.free_parts import most_together, of_parts_alone, priced
from monitor.discovery.machine.shapes.gears import HIGHEST, LOWEST, STEP, _squares
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.products import Products
from monitor.effects import parse_effect
from monitor.methods.tracker.method import METHOD
from monitor.methods.tracker.problem import TrackingProblem
from monitor.readers import read_campaign

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "tracked-robot"


@pytest.fixture(scope="module")
def problem() -> TrackingProblem:
    return METHOD.problem_of(read_campaign(EXAMPLE))


@pytest.fixture(scope="module")
def scene(problem: TrackingProblem) -> ChainScene:
    texts = ["EBJ2:compliance@gravity", "EBJ3:harmonic2", "ECJ1:harmonic1"]
    chain = problem.context.chain
    return scene_of(fit(problem), [Variant(text, parse_effect(text, chain)) for text in texts])


def left_by(columns: np.ndarray, residual: np.ndarray) -> float:
    sizes = np.linalg.lstsq(columns, residual, rcond=None)[0]
    return float(np.sum((residual - columns @ sizes) ** 2))


def test_what_columns_leave_of_a_residual_against_least_squares():
    rng = np.random.default_rng(1)
    columns = rng.normal(size=(200, 6)) * 10.0 ** np.arange(-3, 3)
    columns[:, 5] = columns[:, 0] + 1e-2 * columns[:, 1]
    residual = columns[:, 2] + rng.normal(size=200)
    total = float(residual @ residual)
    products = Products(columns.T @ columns, columns.T @ residual, total, total)
    assert products.left_by([]) == total
    for parts in ([3], [0, 2], [0, 1, 5], [0, 1, 2, 3, 4]):
        assert products.left_by(parts) == pytest.approx(left_by(columns[:, parts], residual), rel=1e-9)
    beside = products.without(2).without(4)
    assert beside.total == pytest.approx(left_by(columns[:, [2, 4]], residual), rel=1e-9)
    assert beside.left_by([0, 3]) == pytest.approx(left_by(columns[:, [0, 2, 3, 4]], residual), rel=1e-9)
    assert beside.lengths[2] == pytest.approx(0.0, abs=1e-6)


def test_what_is_explained_whole_leaves_no_less_than_rounding():
    column = np.linspace(1.0, 2.0, 50)
    products = Products(
        np.array([[column @ column]]), np.array([column @ column]), 1.0, float(column @ column)
    )
    assert 0.0 < products.left_by([0]) < 1e-10


def test_fourier_sums_order_by_order_against_cosines_and_sines():
    rng = np.random.default_rng(2)
    numbers, position = rng.normal(size=300), rng.uniform(-3.0, 3.0, 300)
    orders = np.arange(LOWEST, HIGHEST + STEP / 2.0, STEP)
    phase = np.outer(orders, position)
    expected = (np.cos(phase) @ numbers) ** 2 + (np.sin(phase) @ numbers) ** 2
    assert _squares(numbers, position, len(orders)) == pytest.approx(expected, rel=1e-9, abs=1e-8)


def test_the_sum_of_squares_without_derivatives_is_that_of_the_linearisation(problem):
    rng = np.random.default_rng(3)
    local = problem.start + 1e-4 * rng.normal(size=problem.start.shape)
    expected = np.sum(problem.linearise(local, problem.common_start).residual ** 2)
    assert problem.squares(local, problem.common_start) == pytest.approx(expected, rel=1e-12)


def test_no_effects_that_stay_beside_a_free_shape_are_worth_more_than_the_bound(scene):
    leading, *others = scene.candidates
    for symbol, parts in (("EBJ5", [0, 3]), ("EAJ4", [1]), ("EBJ3", [2, 3, 7])):
        free = of_parts_alone(scene, symbol, parts)
        bound = most_together(scene, free, [leading], others)
        for count in range(len(others) + 1):
            for staying in combinations(others, count):
                assert priced(scene, [leading, free, *staying]) <= bound
