"""The file of one run is wrong: another sign, another unit or exchanged columns are said, and no effect and no run that
is right is named. Simulated without a line of the package; runs differ by what a table moves between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Explanation, find_reading_mistakes, find_run_mistakes, fit
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.store import Database, StoredModel
from monitor.workflow.explain.explain import explanation_of, first_fit
from monitor.workflow.models import as_model, resolve
from tests.discovery.laser_along_x import laser_along_x
from tests.simulator import four_instruments as shop, free_form as sim

DEVIATIONS = ("dx_um", "dy_um", "dz_um")
RUNS = 4
Row = dict[str, object]


def _scaled(names: tuple[str, ...], factor: float) -> Callable[[Row], Row]:
    return lambda row: {**row, **{name: factor * float(str(row[name])) for name in names}}


def _exchanged(row: Row) -> Row:
    return {**row, "dx_um": row["dy_um"], "dy_um": row["dx_um"]}


#: What is done to the rows of a run, and what must be said of it.
MISTAKES = {
    "mm": (_scaled(DEVIATIONS, 1e-3), "dx_um, dy_um, dz_um were in mm"),
    "nm": (_scaled(DEVIATIONS, 1e3), "dx_um, dy_um, dz_um were in nm"),
    "inches": (_scaled(DEVIATIONS, 1.0 / 25.4), "dx_um, dy_um, dz_um were in thousandths of an inch"),
    "sign": (_scaled(("dx_um",), -1.0), "the sign of dx_um were the other way round"),
    "columns": (_exchanged, "the columns dx_um and dy_um were exchanged"),
    "axis": (_scaled(("C",), -1.0), "the sign of C were the other way round"),
}


def campaign(
    folder: Path,
    seed: int,
    change: Callable[[Row], Row] | None = None,
    *,
    of: tuple[int, ...] = (2,),
    hidden: float = 0.0,
) -> Campaign:
    """Four runs of an R-test, a ball some 20 µm beside its place in each; C has an error of ``hidden`` mm at the ball,
    one to three times a turn, in a direction or about an axis of its own."""
    rng = np.random.default_rng(seed)
    rows: list[Row] = []
    order, part, phase = 1 + seed % 3, int(rng.integers(6)), rng.uniform(0.0, 2.0 * np.pi)
    amplitude = hidden / (1.0 if part < 3 else float(np.linalg.norm(shop.BALL)))

    def error(q: float) -> tuple[float, ...]:
        size = amplitude * np.cos(order * np.deg2rad(q) + phase)
        return tuple(float(size) if index == part else 0.0 for index in range(6))

    for run in range(1, RUNS + 1):
        moved = {
            name: value + rng.normal(0.0, 5e-4 if value > 1e-4 else 1e-6)
            for name, value in shop.TRUTH.items()
        }
        chain = shop.machine(0.0, moved)
        chain = replace(chain, work=(chain.work[0], replace(chain.work[1], motion=error)))
        text, readings = shop.r_test(chain, rng)
        right = shop.rounded([{"run": run, **row} for row in readings])
        rows += [change(row) if change is not None and run in of else row for row in right]
    started = [f"2026-03-02T{8 + run:02d}:00:00+00:00" for run in range(RUNS)]
    found = read_campaign(chain.write(folder / "r-test", text, rows, started=started, days=[1] * RUNS))
    assert isinstance(found, Campaign)
    return found


def model_of(found: Campaign) -> StoredModel:
    with Database(":memory:") as db:
        return resolve(db, None, found.method)


def maker(found: Campaign) -> Callable[[Campaign], ChainProblem]:
    model = as_model(model_of(found))
    return lambda changed: campaign_method(changed).problem_of(changed, model)


def explained(found: Campaign) -> Explanation:
    model = model_of(found)
    return explanation_of(found, model, first_fit(found, model))


@pytest.mark.parametrize(
    "name", [name if name == "mm" else pytest.param(name, marks=pytest.mark.slow) for name in MISTAKES]
)
def test_the_mistake_of_one_run_is_said_before_effects_are_searched(tmp_path: Path, name: str) -> None:
    change, words = MISTAKES[name]
    explanation = explained(campaign(tmp_path, 7, change))
    assert f"{words} in run 2" in [mistake.what for mistake in explanation.mistakes]
    assert not explanation.missing
    assert not explanation.apart


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sign", "columns"])
def test_the_same_in_all_runs_is_said_of_all(tmp_path: Path, name: str) -> None:
    change, words = MISTAKES[name]
    explanation = explained(campaign(tmp_path, 8, change, of=(1, 2, 3, 4)))
    # As of all runs, or of the setup that has them all.
    assert any(mistake.what.startswith(words) for mistake in explanation.mistakes)


@pytest.mark.slow
def test_two_runs_with_mistakes_of_their_own_are_both_named(tmp_path: Path) -> None:
    def of_two(row: Row) -> Row:
        return MISTAKES["sign" if row["run"] == 1 else "mm"][0](row)

    (mistake,) = explained(campaign(tmp_path, 9, of_two, of=(1, 3))).mistakes
    assert "the sign of dx_um were the other way round in run 1" in mistake.what
    assert ", and dx_um, dy_um, dz_um were in mm in run 3" in mistake.what


def stated(found: Campaign, times: float, runs: tuple[int, ...]) -> Campaign:
    """Some runs, of which the owner states so many times the standard uncertainty."""
    setups = tuple(
        replace(setup, standard_uncertainty=times * setup.standard_uncertainty)
        for setup in found.artefact.setups
    )
    rows = np.isin(found.probings.run, runs)
    return replace(
        found,
        artefact=replace(found.artefact, setups=setups),
        probings=found.probings.rows(rows),
        runs=tuple(run for run in found.runs if run.run in runs),
    )


def told(found: Campaign) -> list[str]:
    problem_of = maker(found)
    return [
        mistake.what
        for mistake in find_run_mistakes(found, problem_of, first_fit(found, model_of(found)).fit)
    ]


@pytest.mark.parametrize(
    ("times", "runs"),
    [
        (10.0, (1, 2)),
        pytest.param(20.0, (1, 2, 3, 4), marks=pytest.mark.slow),
        *(
            pytest.param(times, runs, marks=pytest.mark.all_seeds)
            for times, runs in ((3.0, (1, 2)), (3.0, (1, 2, 3, 4)), (20.0, (1, 2)))
        ),
    ],
)
def test_a_generous_statement_accuses_no_run_that_is_right(
    tmp_path: Path, times: float, runs: tuple[int, ...]
) -> None:
    found = stated(campaign(tmp_path, 5, MISTAKES["sign"][0]), times, runs)
    what = told(found)
    assert "the sign of dx_um were the other way round in run 2" in what
    assert all(each.endswith("in run 2") for each in what)


@pytest.mark.parametrize(
    "times", [20.0, pytest.param(1.0, marks=pytest.mark.slow), pytest.param(5.0, marks=pytest.mark.slow)]
)
def test_a_wave_of_one_run_of_two_is_no_mistake_of_either(tmp_path: Path, times: float) -> None:
    """Of 40 µm twice a turn: the other run would be brought to its statement by thousandths of an inch."""

    def with_wave(row: Row) -> Row:
        return {
            **row,
            "dx_um": float(str(row["dx_um"])) + 40.0 * np.cos(2.0 * np.deg2rad(float(str(row["C"])))),
        }

    assert told(stated(campaign(tmp_path, 5, with_wave), times, (1, 2))) == []


def test_a_run_in_mm_of_two_is_said_where_undone_it_is_as_stated(tmp_path: Path) -> None:
    assert told(stated(campaign(tmp_path, 5, MISTAKES["mm"][0]), 1.0, (1, 2))) == [
        "dx_um, dy_um, dz_um were in mm in run 2"
    ]


def test_a_gross_reading_hides_no_mistake_of_its_run(tmp_path: Path) -> None:
    found = campaign(tmp_path, 7, MISTAKES["sign"][0])
    dx = np.array(found.probings.channels["dx_um"])
    dx[np.flatnonzero(found.probings.run == 2)[7]] += 2000.0
    channels = {**found.probings.channels, "dx_um": dx}
    found = replace(found, probings=replace(found.probings, channels=channels))
    assert first_fit(found, model_of(found)).fit.left_out.sum() == 1
    assert "the sign of dx_um were the other way round in run 2" in told(found)


@pytest.mark.parametrize("hidden", [0.0, pytest.param(8e-3, marks=pytest.mark.slow)])
def test_nothing_is_said_of_files_that_are_right(
    tmp_path: Path, seeds: Callable[[int, int], range], hidden: float
) -> None:
    """No file of 100 without an effect, and of 100 with one of 16 times the noise."""
    for seed in seeds(100, 1):
        (folder := tmp_path / str(seed)).mkdir()
        found = campaign(folder, 1000 + seed, hidden=hidden)
        problem_of = maker(found)
        first = fit(problem_of(found))
        assert not find_run_mistakes(found, problem_of, first)
        assert not find_reading_mistakes(found, problem_of, first)


def test_an_axis_with_the_other_sign_in_one_run_is_said_where_nothing_but_positions_is_read(
    tmp_path: Path,
) -> None:
    """Free form reads where the axes stand as they touch, and nothing in a unit of its own."""
    rng = np.random.default_rng(3)
    layout = sim.cross_pocket()
    truth = sim.draw_truth(layout, sim.CASE_1_ANGLES, rng)
    runs = [sim.probe(layout, sim.CASE_1_ANGLES, truth, rng) for _ in range(3)]
    runs[1]["y"] = -runs[1]["y"]
    found = read_campaign(sim.write_folder(tmp_path / "pocket", "pocket", layout, runs))
    assert isinstance(found, Campaign)
    assert "the sign of Y were the other way round in run 2" in told(found)


def test_two_readings_at_one_place_are_no_run_in_another_unit(tmp_path: Path) -> None:
    """Of one degree of freedom it is chance that they are 25 times nearer to each other than what the others leave."""
    positions = [25.0 * number for number in range(9)]
    found, _ = laser_along_x(tmp_path / "laser", [positions] * 4, lambda x: 5.0 if x > 110.0 else 0.0, 1)
    probings = found.probings
    kept = np.flatnonzero(probings.run < 4).tolist() + np.flatnonzero(probings.run == 4)[[0, -1]].tolist()
    probings = probings.rows(np.array(kept))
    readings = np.array(probings.channels["reading_um"])
    readings[-2:] = 0.02, 0.08
    channels = {**probings.channels, "reading_um": readings}
    assert not told(replace(found, probings=replace(probings, channels=channels)))
