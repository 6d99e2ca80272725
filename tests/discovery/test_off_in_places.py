"""A hole of a plate that is off in all places of the plate belongs to it: by numpy, errors are of the readings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Explanation, Verdict, explain, fit
from monitor.discovery.machine.suspects.off_in_places import off_in_all_places
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.workflow.explain.machine_answer import machine_explanation
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, X, Y, Z

NOISE = 1e-3
SETUP = """
[[setups]]
id = "{id}"
reading = "point"
instrument = "plate"
standard_uncertainty_um = 1.0
known = ["targets"]
"""
HOLES = [(80.0 * i, 80.0 * j) for j in range(4) for i in range(4)]
#: Turn about Z in rad, and where the plate's first hole stands in mm.
PLACES = [(0.01, (60.0, 80.0, -420.0)), (1.58, (560.0, 400.0, -300.0)), (0.3, (160.0, 450.0, -200.0))]
WRONG = 6
Error = Callable[[np.ndarray], np.ndarray]


def problem_of(
    folder: Path,
    seed: int,
    off: tuple[float, float, float],
    *,
    runs: int = 2,
    places: list[tuple[float, tuple[float, float, float]]] = PLACES,
    only: int | None = None,
    error: Error | None = None,
) -> tuple[Campaign, ChainProblem]:
    """A plate of 16 holes, hole 7 ``off`` in its own frame by so many mm, in each place or ``only`` in one; an
    ``error`` (3,) of the machine at its axes (3,)."""
    rng = np.random.default_rng(seed)
    chain = SimulatedChain(
        tuple(SimulatedAxis(name, "linear", along) for name, along in (("Y", Y), ("X", X), ("Z", Z)))
    )
    rows: list[dict[str, object]] = []
    for run in range(1, runs + 1):
        for place, (turn, corner) in enumerate(places):
            c, s = np.cos(turn), np.sin(turn)
            for hole in (*range(16), *range(15, -1, -1)):
                stated = np.array([*HOLES[hole], 0.0])
                is_off = hole == WRONG and only in (None, place)
                x, y, z = stated + (np.array(off) if is_off else 0.0)
                at = np.array([c * x - s * y, s * x + c * y, z]) + corner
                at = at - (0.0 if error is None else error(at)) + rng.normal(0.0, NOISE, 3)
                rows.append(
                    {"run": run, "setup": f"place{place + 1}", "target": f"H{hole + 1}"}
                    | dict(zip("XYZ", np.round(at, 5), strict=True))
                    | dict(zip(("point_x_mm", "point_y_mm", "point_z_mm"), stated, strict=True))
                )
    setups = "".join(SETUP.format(id=f"place{place + 1}") for place in range(len(places)))
    started = [f"2026-03-{day:02d}T20:00:00+00:00" for day in range(2, 2 + runs)]
    campaign = read_campaign(chain.write(folder, setups, rows, started=started))
    return campaign, campaign_method(campaign).problem_of(campaign)


def explained(campaign: Campaign, problem: ChainProblem) -> Explanation:
    """The explanation of such a plate."""
    return explain(campaign, problem, "instruments", rng=np.random.default_rng(1))


@pytest.mark.parametrize("runs", [1, 3])
def test_a_hole_that_is_off_in_all_places_is_named_and_no_axis(tmp_path: Path, runs: int) -> None:
    """It was "6 bad points" of one run, and of three runs a step of an axis beside the place that was not left out."""
    found = explained(*problem_of(tmp_path / "plate", 4, (0.0, 20e-3, 0.0), runs=runs))
    assert found.missing == found.suspect == found.recurring == ()
    assert found.comparison.verdict is Verdict.EXPLAINED
    (off,) = found.off_targets
    assert (off.target, off.places, off.runs, len(off.point.rows)) == ("H7", 3, runs, 6 * runs)
    assert off.off == pytest.approx((0.0, 20e-3, 0.0), abs=2e-3)
    answer = machine_explanation(found)
    assert "Target H7 is off by " in answer.answer
    assert "in all 3 places of its piece" in answer.answer
    assert [(each.target, each.readings) for each in answer.off_targets] == [("H7", 6 * runs)]
    assert answer.off_targets[0].y_um == pytest.approx(20.0, abs=2.0)


def bend(at: np.ndarray) -> np.ndarray:
    """X goes astray along Y."""
    return np.array([15e-3 * np.sin(at[1] / 150.0), 0.0, 0.0])


@pytest.mark.parametrize(
    ("off", "places", "only", "error"),
    [
        pytest.param(0.0, PLACES, None, None, id="none"),
        pytest.param(0.0, PLACES, None, bend, id="machine"),
        pytest.param(20e-3, PLACES, 1, None, id="one-place"),
        pytest.param(20e-3, PLACES[:1], None, None, id="single"),
        pytest.param(20e-3, [PLACES[0], (0.01, (60.0, 80.0, -100.0))], None, None, id="same-axes"),
    ],
)
def test_no_hole_is_named_where_the_plate_does_not_say_so(tmp_path: Path, off, places, only, error) -> None:
    """Where an axis stood alike in both places, what it does there is the same in both, too."""
    _, problem = problem_of(tmp_path / "plate", 4, (0.0, off, 0.0), places=places, only=only, error=error)
    assert off_in_all_places(fit(problem.for_search())) == ()


def test_a_hole_is_named_beside_an_error_of_the_machine(tmp_path: Path) -> None:
    _, problem = problem_of(tmp_path / "plate", 4, (0.0, 60e-3, 0.0), error=bend)
    (off,) = off_in_all_places(fit(problem.for_search()))
    assert off.target == "H7"


@pytest.mark.slow
def test_no_hole_of_sound_plates_is_named(tmp_path: Path, seeds: Callable[[int, int], range]) -> None:
    """Of 60 plates without a hole that is off none has any, whether the machine bends or not."""
    for seed in seeds(60, 15):
        _, problem = problem_of(
            tmp_path / f"{seed}",
            100 + seed,
            (0.0, 0.0, 0.0),
            runs=1 + seed % 3,
            error=bend if seed % 2 else None,
        )
        assert off_in_all_places(fit(problem.for_search())) == ()
