"""A plate that is laid anew in every run: what recurs at the same balls is the machine, single rows are bad points, and
its turn makes no cycle.

Simulated with numpy; errors are of the readings themselves, so that no effect of the catalogue has them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Explanation, Verdict, explain, fit
from monitor.discovery.machine.suspects.anomalies import BadPoint
from monitor.discovery.machine.suspects.recurring import are_unchecked, recurring
from monitor.discovery.machine.suspects.varying import most_varying
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.workflow.explain.machine_answer import machine_explanation
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
NOISE = 0.5e-3
OFF = 8e-3
RUNS = 4
SETUP = """
[[setups]]
id = "plate"
reading = "point"
instrument = "plate"
standard_uncertainty_um = 0.5
known = ["targets"]
"""
# Not on a grid, and read in serpentines.
BALLS = [
    (60.0 * i + 7.0 * np.sin(5.0 * i + j), 60.0 * j + 7.0 * np.sin(3.0 * i + 2.0 * j))
    for j in range(6)
    for i in (range(6) if j % 2 == 0 else range(5, -1, -1))
]


def problem_of(
    folder: Path, seed: int, off: list[tuple[int, int]], balls: Sequence[tuple[float, float]] = BALLS
) -> tuple[Campaign, ChainProblem]:
    """A plate of 36 balls; Y reads 8 um too much at ball and run of ``off``."""
    rng = np.random.default_rng(seed)
    chain = SimulatedChain((SimulatedAxis("Y", "linear", Y), SimulatedAxis("X", "linear", X)))
    rows: list[dict[str, object]] = []
    for run in range(1, RUNS + 1):
        turn, shift = rng.normal(0.0, 1e-3), 60.0 + rng.normal(0.0, 0.5, 2)
        c, s = np.cos(turn), np.sin(turn)
        for ball, (x, y) in enumerate(balls):
            at = np.array([x * c - y * s, x * s + y * c]) + shift + rng.normal(0.0, NOISE, 2)
            at[1] += OFF * ((ball, run) in off)
            rows.append(
                {"run": run, "setup": "plate", "X": round(at[0], 5), "Y": round(at[1], 5)}
                | {"point_x_mm": x, "point_y_mm": y, "point_z_mm": None}
            )
    started = [f"2026-03-{day:02d}T20:00:00+00:00" for day in range(2, 2 + RUNS)]
    campaign = read_campaign(chain.write(folder, SETUP, rows, started=started))
    return campaign, campaign_method(campaign).problem_of(campaign)


def explained(folder: Path, seed: int, off: list[tuple[int, int]]) -> Explanation:
    """The explanation of such a plate."""
    campaign, problem = problem_of(folder, seed, off)
    return explain(campaign, problem, "instruments", rng=np.random.default_rng(1))


def test_points_off_alike_in_half_of_the_runs_at_nearly_the_same_place_recur(tmp_path: Path) -> None:
    _, problem = problem_of(tmp_path / "plate", 3, [])
    found = fit(problem)

    def point(ball: int, run: int, size: float, axis: str = "y") -> BadPoint:
        return BadPoint(36 * (run - 1) + ball, run, 36 * (run - 1) + ball + 1, "plate", axis, size, 1e-9)

    twice = [point(14, 1, 8e-3), point(14, 4, 7e-3)]
    unlike = [point(20, 1, 8e-3), point(20, 2, -8e-3), point(5, 1, 8e-3), point(5, 2, 8e-3, "x")]
    single = [point(8, 3, 8e-3)]
    assert recurring(found, [*twice, *unlike, *single]) == {14, 3 * 36 + 14}
    assert not are_unchecked(found, [*twice, *unlike, *single])


def test_the_turn_of_a_plate_nearly_cancels_a_cycle_of_its_spacing(tmp_path: Path) -> None:
    """`EXX:cyclic12mm@each_run` of 1 mm was told of noise in 6 of 6 such campaigns, seeds 3 to 8: balls 60 mm apart,
    off the grid by the turn of the plate alone."""
    grid = [(60.0 * i, 60.0 * j) for j in range(6) for i in range(6)]
    _, problem = problem_of(tmp_path / "plate", 3, [], grid)
    chain = problem.context.chain
    cycles = [Variant(text, parse_effect(text, chain)) for text in ("EXX:cyclic12mm", "EYY:cyclic5mm")]
    assert most_varying(fit(problem), cycles) is None


@pytest.mark.slow
def test_readings_that_recur_at_the_same_balls_are_no_bad_points(tmp_path: Path) -> None:
    """All were bad points, and the model was said to be complete."""
    again = [(14, run) for run in (1, 2, 3, 4)] + [(27, run) for run in (1, 2, 4)]
    found = explained(tmp_path / "plate", 1, [*again, (8, 3)])
    assert [(point.run, point.sequence % 36) for point in found.suspect] == [(3, 9)]
    assert sorted((point.sequence - 1) % 36 for point in found.recurring) == [14] * 4 + [27] * 3
    assert found.missing == ()
    assert found.comparison.verdict is Verdict.SOMETHING_IS_MISSING
    answer = machine_explanation(found)
    assert len(answer.recurring_data) == 7
    assert "7 readings are off alike in most runs at nearly the same places" in answer.answer


@pytest.mark.slow
def test_a_single_row_is_a_bad_point_and_nothing_is_missing(tmp_path: Path) -> None:
    found = explained(tmp_path / "plate", 2, [(8, 3), (20, 1)])
    assert sorted((point.run, (point.sequence - 1) % 36) for point in found.suspect) == [(1, 20), (3, 8)]
    assert found.recurring == found.missing == ()
    assert found.comparison.verdict is Verdict.EXPLAINED
    assert (
        "`monitor compare`, which counts it, says that something is missing"
        in machine_explanation(found).answer
    )


@pytest.mark.slow
def test_rates_of_bad_points_and_of_readings_that_recur(
    tmp_path: Path, seeds: Callable[[int, int], range]
) -> None:
    """Of 40 plates each: two single rows of 8 um named, and nothing in noise alone."""
    named = alarms = 0
    plates = seeds(40, 5)
    for seed in plates:
        rng = np.random.default_rng(1000 + seed)
        off = [(int(ball), run) for ball, run in zip(rng.choice(36, 2, replace=False), (1, 3), strict=True)]
        found = explained(tmp_path / f"single-{seed}", seed, off)
        rows = sorted((point.run, (point.sequence - 1) % 36) for point in found.suspect)
        named += rows == sorted((run, ball) for ball, run in off) and not found.recurring
        empty = explained(tmp_path / f"empty-{seed}", 500 + seed, [])
        alarms += bool(empty.missing or empty.suspect or empty.recurring)
    assert named >= 0.9 * len(plates)
    assert alarms <= len(plates) / 20
