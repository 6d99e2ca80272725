"""Places that are one because each lies near the next: the groups, and what many touches of one ball take."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from monitor.discovery.machine.noise.plan_cells import _linked
from monitor.records import Array


def groups_by_spreading(places: Array) -> list[frozenset[int]]:
    """The groups of rows (n, k), by going from every row to all that are near."""
    left, groups = set(range(len(places))), []
    while left:
        group, edge = set[int](), [min(left)]
        while edge:
            row = edge.pop()
            group.add(row)
            near = np.flatnonzero(np.abs(places - places[row]).max(axis=1) <= 1.0)
            edge += [other for other in near.tolist() if other not in group and other not in edge]
        groups.append(frozenset(group))
        left -= group
    return groups


@pytest.mark.parametrize("step", [0.0, 0.5, 1.0])
def test_rows_are_one_where_each_lies_near_the_next(step: float) -> None:
    """Of ties, numbers on a grid of ``step``, too."""
    rng = np.random.default_rng(4)
    for numbers in (1, 2, 4):
        for spread in (0.1, 1.0, 4.0):
            places = rng.normal(0.0, spread, (60, numbers))
            places = np.round(places / step) * step if step else places
            group = _linked(places)
            found = {frozenset(np.flatnonzero(group == each).tolist()) for each in np.unique(group)}
            assert found == set(groups_by_spreading(places))


def memory_of(touches: int) -> int:
    """The most bytes at once of the groups of so many touches of one ball that scatter by 0.5 µm."""
    rng = np.random.default_rng(5)
    places = 0.3 + rng.normal(0.0, 0.005, (touches, 3))
    tracemalloc.start()
    _linked(places)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most


def test_memory_grows_as_the_touches_of_a_ball_do() -> None:
    """Was: with their square, 1.8 GB for 40 000 touches of 25 balls."""
    memory_of(10)
    assert memory_of(3000) < 3.0 * memory_of(1500)
