"""A hole that is off alike in every part, however the parts lie under the machine that measures them: by numpy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Explanation, Verdict, explain, fit
from monitor.discovery.machine.suspects.anomalies import BadPoint
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.workflow.explain.machine_answer import machine_explanation
from tests.simulator.parts_on_a_cmm import CHAIN, SETUP

HOLES = [(x, y) for y in np.linspace(0.0, 420.0, 8) for x in np.linspace(0.0, 630.0, 10)]
WRONG = 37


def explained(
    folder: Path, seed: int, turns: list[float], off: tuple[float, float], *, is_gross: bool = False
) -> Explanation:
    """The explanation of 80 holes of parts that lie turned so in rad, hole 38 ``off`` by so many mm in each, and left
    out from the beginning if it ``is_gross``."""
    rng = np.random.default_rng(seed)
    rows: list[dict[str, object]] = []
    for run, turn in enumerate(turns, start=1):
        c, s = np.cos(turn), np.sin(turn)
        shift = rng.normal(0.0, 200.0, 2)
        for hole, (x, y) in enumerate(HOLES):
            u, v = np.array([x, y]) + (np.array(off) if hole == WRONG else 0.0)
            at = np.array([c * u - s * v, s * u + c * v]) + shift + rng.normal(0.0, 1.5e-3, 2)
            rows.append(
                {"run": run, "setup": "cmm", "X": x, "Y": y, "Z": -20.0}
                | {"point_x_mm": round(at[0], 4), "point_y_mm": round(at[1], 4), "point_z_mm": None}
            )
    started = [f"2026-03-{day:02d}T20:00:00+00:00" for day in range(2, 2 + len(turns))]
    campaign = read_campaign(CHAIN.write(folder, SETUP, rows, started=started))
    problem = campaign_method(campaign).problem_of(campaign)
    gross = [
        BadPoint(80 * (run - 1) + WRONG, run, 80 * (run - 1) + WRONG + 1, "", "x", off[0], 1e-9)
        for run in range(1, len(turns) + 1)
        if is_gross
    ]
    first = fit(problem.for_search(), np.isin(np.arange(80 * len(turns)), [point.row for point in gross]))
    return explain(campaign, problem, "instruments", rng=np.random.default_rng(1), first=first, gross=gross)


@pytest.mark.parametrize(
    ("turns", "is_gross"),
    [([0.001, -0.002, 0.0, 0.001], False), ([-2.1, 0.4, 1.3, 2.6], False), ([-2.1, 0.4, 1.3, 2.6], True)],
)
def test_a_hole_that_is_off_alike_in_all_parts_recurs(
    tmp_path: Path, turns: list[float], is_gross: bool
) -> None:
    """Nothing was named of parallel parts, and of turned ones four bad points beside which all is explained."""
    found = explained(tmp_path / "parts", 5, turns, (30e-3, -20e-3), is_gross=is_gross)
    assert found.comparison.verdict is Verdict.SOMETHING_IS_MISSING
    assert found.missing == found.suspect == ()
    for axis, size in (("x", 30e-3), ("y", -20e-3)):
        points = [point for point in found.recurring if point.axis == axis]
        assert [point.run for point in points] == [1, 2, 3, 4]
        assert [point.size for point in points] == pytest.approx([size] * 4, abs=6e-3)
        assert {(point.sequence - 1) % len(HOLES) for point in points} == {WRONG}
    answer = machine_explanation(found)
    assert len(answer.recurring_data) == 8
    assert "4 readings are off alike in most runs" in answer.answer


@pytest.mark.slow
def test_no_hole_of_sound_parts_recurs(tmp_path: Path, seeds: Callable[[int, int], range]) -> None:
    """Of 60 sets of parts without a hole that is off none has any."""
    for seed in seeds(60, 15):
        turns = np.random.default_rng(seed).uniform(-3.0, 3.0, 2 + seed % 3).tolist()
        assert explained(tmp_path / f"{seed}", 100 + seed, turns, (0.0, 0.0)).recurring == ()
