"""Jumps at reversal of balls that are touched in one fixed order at every angle of a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.separation.orders import runs_in_reversed_order
from monitor.effects import parse_effect
from monitor.readers import read_campaign
from tests.discovery.ordered_balls import touched


@pytest.fixture(scope="module")
def ordered(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """Four runs in one order."""
    return touched(tmp_path_factory.mktemp("ordered"))


@pytest.mark.parametrize(
    ("effect", "rival", "runs"),
    [
        ("EZZ:reversal", "EXX:reversal", True),
        ("EXX:reversal", "EXZ:windup20mm", True),
        # A tilt and a shift of one axis jump at the same readings in every order.
        ("EXX:reversal", "EBX:reversal", False),
        ("EXX:reversal", "EXX:poly1", False),
    ],
)
def test_which_jumps_the_reversed_order_tells_apart(
    ordered: Fit, effect: str, rival: str, runs: bool
) -> None:
    first, second = (parse_effect(text, ordered.problem.context.chain) for text in (effect, rival))
    more = runs_in_reversed_order(ordered, first, np.array([9e-3]), second)
    assert (more is not None) == runs
    assert more is None or 1 <= more <= 4


@pytest.mark.slow
def test_the_runs_that_are_said_tell_them_apart(tmp_path: Path) -> None:
    """Was: more poses between the present ones, which left the rivals of a play of X as they were."""
    told: list[set[str]] = []
    for back in (0, 1):
        folder = tmp_path / str(back)
        folder.mkdir()
        problem = touched(folder, back=back, reversal=4e-3).problem
        answer = explain(read_campaign(folder), problem, "rotary-probing", rng=np.random.default_rng(1))
        (missing,) = answer.missing
        told.append({missing.effect, *(rival.effect for rival in missing.rivals)})
        if back == 0:
            assert {runs for rival, runs in missing.separation.by_order if rival != "EBX:reversal"} == {1}
    assert all("EXX:reversal" in each for each in told)
    of_other_axes = [{text for text in each if ":reversal" in text and text[2] != "X"} for each in told]
    assert of_other_axes[0]
    assert not of_other_axes[1]
