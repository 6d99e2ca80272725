"""Plays that begin a run on another side than that from which the axis is taken to come.

The simulator shares no code with the package.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import fit
from monitor.discovery.machine.scene import ChainScene, scene_of
from monitor.discovery.machine.suspects.unknown_sides import open_places, unknown_sides
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of

SMALLEST = 0.1


def play_of(width: float, start: Callable[[int], float]) -> Callable[..., np.ndarray]:
    """A play of a width in mm that begins each run in the state ``start``, from -1 to 1."""

    def state(q, travel, now):
        ahead = np.zeros(len(q))
        for run in np.unique(now.run):
            rows = np.flatnonzero(now.run == run)
            at = start(int(run))
            for before, row in zip([rows[0], *rows], rows, strict=False):
                at = float(np.clip(at + 2.0 * (q[row] - q[before]) / width, -1.0, 1.0))
                ahead[row] = at
        return ahead

    return state


@pytest.mark.parametrize(
    ("positions", "width", "places"),
    [
        # A play that turns over at once is known from the first move on.
        ([10.0, 10.02, 60.0, 20.0], 0.0, [[0, 1]]),
        # One of 40 mm once the axis went 40 mm in one direction, from whichever side it came.
        ([10.0, 25.0, 25.01, 5.0, 20.0, 55.0, 90.0], 40.0, [[0], [1, 2], [3], [4]]),
        # An axis that stands still says nothing.
        ([5.0, 5.0, 5.0], 0.0, [[0, 1, 2]]),
    ],
)
def test_the_side_is_open_until_the_axis_has_gone_through_the_play(
    positions: list[float], width: float, places: list[list[int]]
) -> None:
    rows = np.arange(len(positions))
    told = open_places(np.array(positions), rows, width, SMALLEST)
    assert [each.tolist() for each in told] == places


def _scene(virtual_campaigns, start: Callable[[int], float], *texts: str) -> ChainScene:
    hidden = simulator().Effect("EXX:curve", peak_um=4.0, curve=play_of(1e-3, start))
    campaign, _ = virtual_campaigns.virtual(5, [hidden], days=1, runs_per_day=3)
    fitted = fit(problem_of(campaign).for_search())
    chain = fitted.problem.context.chain
    return scene_of(fitted, [Variant(text, parse_effect(text, chain)) for text in texts])


def test_a_side_is_unknown_where_the_first_readings_contradict_it(virtual_campaigns) -> None:
    scene = _scene(virtual_campaigns, lambda run: -1.0, "EXX:reversal")
    (side,) = unknown_sides(scene, scene.candidates, 0.01)
    assert side.term.symbol == "EXX"
    columns = side.basis(scene.fit.problem.context).columns
    assert columns.shape[1] == 3
    # The first place of each run, nothing else.
    sequence = scene.fit.problem.context.sequence
    assert sequence[columns.any(axis=1)].max() < 10


def test_a_side_that_is_as_assumed_stays(virtual_campaigns) -> None:
    scene = _scene(virtual_campaigns, lambda run: 1.0, "EXX:reversal")
    assert unknown_sides(scene, scene.candidates, 0.01) == ()


@pytest.mark.slow
def test_a_play_that_begins_on_the_other_side_is_told_as_that(virtual_campaigns, explained) -> None:
    """It was a free shape, of a scale that does not keep its pitch."""
    hidden = simulator().Effect("EXX:curve", peak_um=4.0, curve=play_of(1e-3, lambda run: (-1.0) ** run))
    campaign, _ = virtual_campaigns.virtual(5, [hidden], days=2, runs_per_day=4)
    (found,) = explained(campaign).missing
    assert found.effect == "EXX:reversal"
