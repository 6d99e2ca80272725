"""Plays of axes that go from ball to ball of a plate by less than 0.1 mm: by numpy, errors are of the readings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery.machine.explain import Explanation, explain
from monitor.discovery.machine.suspects.small_moves import follows_moves, without_small_moves
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting.machine_finding import SMALL_MOVES
from monitor.workflow.explain.machine_answer import machine_explanation
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, X, Y, Z

SETUP = """
[[setups]]
id = "{id}"
reading = "point"
instrument = "plate"
standard_uncertainty_um = 1.0
known = ["targets"]
"""
#: How the plate lies, as the axes along which its own go, and where its first ball stands in mm.
PLACES = [
    (np.eye(3), (60.0, 80.0, -420.0)),
    (np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), (560.0, 400.0, -300.0)),
    (np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), (100.0, 350.0, -480.0)),
    (np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]]), (300.0, 150.0, -480.0)),
]
BALLS = [np.array([100.0 * column, 100.0 * row, 0.0]) for row in range(5) for column in range(5)]
LOOP_UM = 3.0


def plate(folder: Path, seed: int, turned_by_mm: float, tilt: float = 1e-4) -> tuple[Campaign, ChainProblem]:
    """A plate of 25 balls in four places that lies askew by a ``tilt`` in rad, each ball touched there and back, by a
    machine whose Y errs in a loop: largest in the middle of its travel, in the direction of its last move of more than
    ``turned_by_mm``."""
    rng = np.random.default_rng(seed)
    chain = SimulatedChain(
        tuple(SimulatedAxis(name, "linear", along) for name, along in (("Y", Y), ("X", X), ("Z", Z)))
    )
    touches: list[tuple[int, int, np.ndarray]] = []
    for place, (turn, corner) in enumerate(PLACES):
        askew = rng.normal(0.0, tilt, 3)
        for ball in (*range(25), *range(24, -1, -1)):
            at = turn @ BALLS[ball]
            touches.append((place, ball, at + np.cross(askew, at) + corner))
    ys = np.array([at[1] for _, _, at in touches])
    middle, half = (ys.max() + ys.min()) / 2.0, np.ptp(ys) / 2.0
    rows: list[dict[str, object]] = []
    side, ended = 1.0, ys[0]
    for place, ball, at in touches:
        if abs(at[1] - ended) > turned_by_mm:
            side, ended = np.sign(at[1] - ended), at[1]
        loop = 1e-3 * LOOP_UM * side * (1.0 - ((at[1] - middle) / half) ** 2)
        read = at - np.array([0.0, loop, 0.0]) + rng.normal(0.0, 1e-3, 3)
        rows.append(
            {"run": 1, "setup": f"place{place + 1}", "target": f"H{ball + 1}"}
            | dict(zip("XYZ", np.round(read, 5), strict=True))
            | dict(zip(("point_x_mm", "point_y_mm", "point_z_mm"), BALLS[ball], strict=True))
        )
    setups = "".join(SETUP.format(id=f"place{number}") for number in range(1, len(PLACES) + 1))
    campaign = read_campaign(
        chain.write(folder / "plate", setups, rows, started=["2026-03-02T20:00:00+00:00"])
    )
    return campaign, campaign_method(campaign).problem_of(campaign)


def explained(campaign: Campaign, problem: ChainProblem) -> Explanation:
    """The explanation of such a plate."""
    return explain(campaign, problem, "instruments", rng=np.random.default_rng(1))


def test_small_moves_between_balls_are_asked_where_they_turn_something_over(tmp_path: Path) -> None:
    _, problem = plate(tmp_path, 4, 0.1)
    assert without_small_moves(problem) is None
    searched = problem.for_search()
    other = without_small_moves(searched)
    assert other is not None
    assert not np.array_equal(other.context.travel, searched.context.travel)
    assert without_small_moves(other) is None


@pytest.mark.parametrize(
    ("text", "follows"),
    [
        ("EYY:reversal", True),
        ("EYY:windup40mm", True),
        ("EYY:lag", True),
        ("EYY:free(13,15)", True),
        ("EYY:free(3,28)", False),
        ("EYY:poly2", False),
    ],
)
def test_which_effects_follow_moves(tmp_path: Path, text: str, follows: bool) -> None:
    context = plate(tmp_path, 4, 0.1)[1].context
    assert follows_moves(parse_effect(text, context.chain), context) is follows


@pytest.mark.slow
@pytest.mark.parametrize("turned_by_mm", [0.0, pytest.param(0.1, marks=pytest.mark.all_seeds)])
def test_a_loop_has_its_size_whether_or_not_small_moves_turn_it_over(
    tmp_path: Path, turned_by_mm: float
) -> None:
    """A loop of 2.5 um was told as 5.3 (0.8) um, in four parts that nearly cancel."""
    found = explained(*plate(tmp_path, 4, turned_by_mm, tilt=2e-4))
    (loop,) = found.missing
    assert loop.effect.startswith("EYY:free(")
    assert 1e3 * loop.amplitude == pytest.approx(LOOP_UM, abs=4.0 * 1e3 * loop.u)
    assert 1e3 * loop.u < 0.2
    assert found.small_moves_turn_nothing is (turned_by_mm > 0.0)
    assert (SMALL_MOVES in machine_explanation(found).undecided) is (turned_by_mm > 0.0)
