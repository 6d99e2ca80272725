"""Cycles that are one at even positions: `explain` asks for uneven ones, and a run made so tells them apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Explanation, explain
from monitor.methods.chain.problem import ChainProblem
from monitor.workflow.explain.alias_ties import ties_at_uneven_positions, with_uneven_positions
from monitor.workflow.explain.machine_answer import machine_explanation
from monitor.workflow.explain.ties import Tie, TieBreak
from tests.discovery.laser_along_x import laser_along_x, wave

#: Eleven positions over 760 mm, at which 5, 95 and 380 mm are one.
EVEN = [76.0 * step for step in range(11)]


def explained(
    folder: Path, runs: list[list[float]], pitch: float, seed: int
) -> tuple[Explanation, ChainProblem]:
    """What is missing in runs that read a wave of a pitch, and their problem."""
    campaign, problem = laser_along_x(folder, runs, wave(pitch), seed)
    return explain(campaign, problem, "instruments", rng=np.random.default_rng(1)), problem


def test_cycles_that_are_one_on_the_grid_are_told_by_uneven_positions(tmp_path: Path) -> None:
    """Was: no pose tells 95 mm from 5 mm, and another instrument 380 from 5 mm."""
    _, problem = laser_along_x(tmp_path / "laser", [EVEN], wave(380.0), 1)
    tie = Tie(
        ("EXX:cyclic95mm", "EXX:cyclic16mm", "EXX:poly2", "EXX:cyclic380mm"), TieBreak.MORE_POSES, axes=("X",)
    )
    assert list(ties_at_uneven_positions("EXX:cyclic5mm", tie, problem.context)) == [
        Tie(("EXX:cyclic95mm", "EXX:cyclic380mm"), TieBreak.UNEVEN_POSITIONS, axes=("X",), step_mm=76.0),
        Tie(("EXX:cyclic16mm", "EXX:poly2"), TieBreak.MORE_POSES, axes=("X",)),
    ]


def test_at_uneven_positions_no_cycles_are_one(tmp_path: Path) -> None:
    uneven = np.cumsum(np.random.default_rng(1).uniform(30.0, 110.0, 11)).round(1).tolist()
    _, problem = laser_along_x(tmp_path / "laser", [uneven], wave(380.0), 1)
    tie = Tie(("EXX:cyclic95mm",), TieBreak.MORE_POSES, axes=("X",))
    assert list(ties_at_uneven_positions("EXX:cyclic5mm", tie, problem.context)) == [tie]


@pytest.mark.slow
@pytest.mark.parametrize("pitch", [5.0, 95.0, 390.0])
def test_a_run_made_as_told_breaks_the_tie(tmp_path: Path, pitch: float) -> None:
    """Each off its place by up to half of the interval, as the words say."""
    first, problem = explained(tmp_path / "even", [EVEN] * 3, pitch, 2)
    (effect,) = with_uneven_positions(machine_explanation(first), problem.context).missing
    assert [tie.broken_by for tie in effect.ties] == [TieBreak.UNEVEN_POSITIONS]
    off = np.random.default_rng(79).uniform(-38.0, 38.0, 11)
    off[[0, -1]] = abs(off[0]), -abs(off[-1])
    uneven = (np.array(EVEN) + off).round(2).tolist()
    after, _ = explained(tmp_path / "uneven", [*[EVEN] * 3, uneven], pitch, 502)
    (missing,) = after.missing
    assert float(missing.effect.removeprefix("EXX:cyclic").removesuffix("mm")) == pytest.approx(
        pitch, rel=0.02
    )
    assert not any("cyclic" in rival.effect for rival in missing.rivals)
