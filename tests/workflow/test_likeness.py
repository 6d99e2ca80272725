"""Campaigns like one that was measured: what is identified is what was asked for, whatever the method."""

from __future__ import annotations

import csv
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import DataError, EffectError, InputError
from monitor.methods import campaign_method
from monitor.methods.chain.likeness import Likeness
from monitor.methods.chain.problem import solve_problem
from monitor.readers import read_campaign
from monitor.workflow.likeness import Drift, LikeAnswer, LikeRequest, Step, simulate_like
from monitor.workflow.sight import effect_sight
from monitor.workflow.simulation import SimulateRequest, simulate
from monitor.workflow.true_values import is_truth

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
START = date(2024, 1, 31)


@pytest.mark.parametrize(
    "name",
    [
        "tilting-table",
        "mount-gem-28",
        "r-test",
        *(
            pytest.param(name, marks=pytest.mark.all_seeds)
            for name in (
                "four-instruments",
                "laser",
                "ball-bar",
                "cold-cold",
                "free-form-pins",
                "free-form-pocket",
                "l-shape",
                "tracked-robot",
            )
        ),
    ],
)
def test_identified_errors_scatter_about_the_true_ones_as_their_uncertainty_says(name: str) -> None:
    pattern = read_campaign(EXAMPLES / name)
    method = campaign_method(pattern)
    likeness = Likeness(pattern, method)
    local, count = likeness.solution.local.copy(), len(likeness.problem.base_names)
    free = likeness.solution.local_free[:, :count]
    rng = np.random.default_rng(5)
    local[:, :count] += np.where(free, rng.normal(0.0, 2e-5, count), 0.0)
    fitted = method.identify(likeness.campaign_with(local, rng))
    deviations = np.array([run.estimate for run in fitted.runs]) - local[:, :count]
    covariances = np.array([run.covariance for run in fitted.runs])
    chi_square, degrees = 0.0, 0
    for row, deviation, covariance in zip(free, deviations, covariances, strict=True):
        solved = np.linalg.solve(covariance[np.ix_(row, row)], deviation[row])
        chi_square += float(deviation[row] @ solved)
        degrees += int(row.sum())
    # Five standard deviations of chi-square: its variance is twice its degrees of freedom.
    assert abs(chi_square - degrees) < 5.0 * np.sqrt(2.0 * degrees) + 5.0


def test_months_drift_steps_and_scatter_are_those_asked_for(tmp_path: Path) -> None:
    request = LikeRequest(
        tmp_path / "shop", str(EXAMPLES / "tilting-table"), ("A", "B"), START, months=3,
        drifts=(Drift("EY0A", 0.5),), events=(Step(date(2024, 2, 15), "EB0C", -7.0, "B"),), steady=True, seed=3,
    )  # fmt: skip
    answer = simulate_like(request)
    names = [f"{machine}-2024-0{month}" for machine in "AB" for month in (1, 2, 3)]
    assert [Path(folder).name for folder in answer.folders] == names
    assert sorted(path.name for path in (tmp_path / "shop").iterdir()) == [*names, "truth.csv"]
    assert is_truth(Path(answer.truth))
    with Path(answer.truth).open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    first_runs = {
        (row["campaign"], row["parameter"]): float(row["value"])
        for row in reversed(rows)
        if row["parameter"] in ("EY0A", "EB0C", "EX0A")
    }
    # 31 January, 29 February and 31 March: 0, 29 and 60 days of 30.436875 a month.
    for machine in "AB":
        drift = [first_runs[f"{machine}-2024-0{month}", "EY0A"] for month in (1, 2, 3)]
        assert np.diff(drift) == pytest.approx([0.5 * 29 / 30.436875, 0.5 * 31 / 30.436875], abs=1e-9)
        still = [first_runs[f"{machine}-2024-0{month}", "EX0A"] for month in (1, 2, 3)]
        assert still == pytest.approx([still[0]] * 3, abs=1e-9)
    stepped = [first_runs[name, "EB0C"] for name in names]
    assert np.diff(stepped) == pytest.approx([0, 0, 0, -7, 0], abs=1e-9)
    made = read_campaign(Path(answer.folders[4]))
    pattern = read_campaign(EXAMPLES / "tilting-table")
    assert (made.machine.id, made.runs[0].started_at.date()) == ("B", date(2024, 2, 29))
    assert made.runs[0].started_at.timetz() == pattern.runs[0].started_at.timetz()
    np.testing.assert_array_equal(made.probings.target, pattern.probings.target)
    np.testing.assert_array_equal(made.probings.readings["A"], pattern.probings.readings["A"])
    assert np.abs(made.probings.readings["X"] - pattern.probings.readings["X"]).max() < 0.1
    again = simulate_like(LikeRequest(**{**vars(request), "out": tmp_path / "again"}))
    for ours, theirs in zip(answer.folders, again.folders, strict=True):
        for file in ("campaign.toml", "runs.csv", "probings.csv"):
            assert (Path(ours) / file).read_bytes() == (Path(theirs) / file).read_bytes()


def test_a_hidden_effect_moves_a_row_by_its_peak() -> None:
    likeness = Likeness(*(lambda c: (c, campaign_method(c)))(read_campaign(EXAMPLES / "tilting-table")))
    problem, common = likeness.hidden("EXX:reversal", 4e-3)
    pose = problem.evaluated(likeness.solution.local, common)
    bare = likeness.problem.evaluated(likeness.solution.local, np.zeros(0))
    moved = np.linalg.norm(pose.residual - bare.residual, axis=1)
    assert moved.max() == pytest.approx(4e-3, rel=1e-3)
    with pytest.raises(EffectError, match="there is no shape"):
        likeness.hidden("EXX:nope", 1.0)


@pytest.mark.parametrize(
    ("name", "effect"),
    [
        ("tilting-table", "EXX:reversal"),
        ("free-form-pocket", "EYY:reversal"),
        *(
            pytest.param(name, effect, marks=pytest.mark.all_seeds)
            for name, effect in (
                ("tilting-table", "EYY:reversal"),
                ("tilting-table", "EYY:windup5mm"),
                ("free-form-pocket", "EXX:reversal"),
                ("free-form-pins", "EYY:reversal"),
                ("cold-cold", "EXX:reversal"),
                ("cold-cold", "EBB:reversal"),
                ("r-test", "EYY:reversal"),
                ("laser", "EXX:reversal"),
                ("ball-bar", "EXX:reversal"),
                ("four-instruments", "EXX:reversal"),
                ("mount-gem-28", "ECHA:reversal"),
                ("tracked-robot", "EBJ2:reversal"),
            )
        ),
    ],
)
def test_a_jump_at_reversal_is_hidden_and_estimated_with_its_size(name: str, effect: str) -> None:
    """The way an axis came is the plan's: moves of the sought readings by micrometres do not turn it round."""
    pattern = read_campaign(EXAMPLES / name)
    method = campaign_method(pattern)
    likeness = Likeness(pattern, method)
    hidden, common = likeness.hidden(effect, 8e-3)
    local = likeness.solution.local.copy()
    made = likeness.campaign_with(local, np.random.default_rng(11), (hidden, common))
    read_again = method.problem_of(made, method.own_model).foreseen()
    np.testing.assert_array_equal(read_again.context.travel, likeness.problem.context.travel)
    fitted = solve_problem(replace(read_again, added=hidden.added))
    assert bool(fitted.common_free.all())
    standard_uncertainty = np.sqrt(np.diag(fitted.common_covariance))
    assert np.all(np.abs(fitted.common - common) < 4.5 * standard_uncertainty)
    assert np.all(fitted.common > 0.5 * common)


@pytest.mark.parametrize(
    ("name", "effect"),
    [("tilting-table", "EXX:reversal"), ("r-test", "EXX:reversal"), ("laser", "EBX:reversal")],
)
def test_what_a_plan_shows_of_an_effect_is_its_size_over_its_standard_uncertainty(
    name: str, effect: str
) -> None:
    """Two ways: what is left of its column beside all unknowns, and the covariance of the fit that has it."""
    pattern = read_campaign(EXAMPLES / name)
    likeness = Likeness(pattern, campaign_method(pattern))
    hidden, common = likeness.hidden(effect, 8e-3)
    fitted = solve_problem(hidden)
    assert fitted.common_covariance.shape == (1, 1)
    shown = float(common[0] / np.sqrt(fitted.common_covariance[0, 0]))
    sight = effect_sight(likeness.problem, effect, 8e-3)
    assert sight.standard_deviations == pytest.approx(shown, rel=2e-3)
    assert sight.certain_from_um == pytest.approx(8.0 * 5.0 / shown, rel=2e-3)


@pytest.mark.parametrize(("effect", "axis"), [("EXX:poly2", "X"), ("EYY:poly2", "Y")])
def test_a_bow_is_told_by_what_differs_from_a_straight_line(effect: str, axis: str) -> None:
    """A line through the squares of the positions by least squares, by itself."""
    pattern = read_campaign(EXAMPLES / "r-test")
    sight = effect_sight(Likeness(pattern, campaign_method(pattern)).problem, effect, 5e-3)
    at = pattern.probings.readings[axis]
    bow = at**2
    straight = np.polynomial.Polynomial.fit(at, bow, 1)(at)
    told = 5.0 * np.abs(bow - straight).max() / bow.max()
    assert sight.told_um == pytest.approx(told, rel=1e-3)
    assert (" differ from the straight line " in sight.words(effect, 5.0)) == (
        told < 4.5 and sight.is_certain
    )


def test_a_hidden_effect_that_the_plan_cannot_see_is_called_so(tmp_path: Path) -> None:
    like = str(EXAMPLES / "tilting-table")

    def hidden(out: str, effect: str, peak: float) -> LikeAnswer:
        request = LikeRequest(tmp_path / out, like, ("A",), START, months=1, effect=effect, peak_um=peak)
        return simulate_like(request)

    blind = hidden("blind", "EZZ:reversal", 8.0)
    assert blind.sight is not None
    assert (blind.sight.standard_deviations, blind.sight.certain_from_um) == (0.0, None)
    assert "; this plan cannot see EZZ:reversal: the errors that it identifies take up all" in blind.message
    weak = hidden("weak", "EXX:reversal", 0.1)
    assert weak.message.endswith("from a peak of 0.41 µm on it sees that something is missing")
    seen = hidden("seen", "EXX:reversal", 8.0)
    assert seen.message.endswith("; EXX:reversal with a peak of 8 µm is hidden in all of them")
    rows = list(csv.DictReader((tmp_path / "seen" / "truth.csv").read_text(encoding="utf-8").splitlines()))
    assert {(row["value"], row["unit"]) for row in rows if row["parameter"] == "EXX:reversal"} == {
        ("8.0", "µm (peak)")
    }
    assert seen.sight is not None
    assert seen.sight.is_certain
    demo = simulate(SimulateRequest(tmp_path / "demo", effect="EXX:reversal", peak_um=0.1))
    assert "; this plan shows EXX:reversal by 1.8 standard deviations of its readings" in demo.message
    nothing = simulate(SimulateRequest(tmp_path / "nothing"))
    assert nothing.sight is None


@pytest.mark.parametrize(
    ("on", "where"), [(date(2023, 12, 1), "before"), (START, "before"), (date(2027, 5, 1), "behind")]
)
def test_a_step_that_no_run_is_before_or_behind_is_refused(tmp_path: Path, on: date, where: str) -> None:
    request = LikeRequest(
        tmp_path / "out",
        str(EXAMPLES / "tilting-table"),
        ("A",),
        START,
        months=2,
        events=(Step(on, "EB0C", 8.0),),
    )
    with pytest.raises(InputError, match=f"and none is {where} it"):
        simulate_like(request)
    assert not request.out.exists()


def test_a_mount_may_be_off_by_minutes_of_arc() -> None:
    """Errors that are not small: the readings are found by steps with derivatives of their own."""
    pattern = read_campaign(EXAMPLES / "mount-gem-28")
    likeness = Likeness(pattern, campaign_method(pattern))
    local, count = likeness.solution.local.copy(), len(likeness.problem.base_names)
    free = likeness.solution.local_free[:, :count]
    # 3 mrad are ten minutes of arc.
    local[:, :count] += np.where(free, np.random.default_rng(3).normal(0.0, 3e-3, count), 0.0)
    likeness.campaign_with(local, np.random.default_rng(4))
    local[:, :count] += np.where(free, 0.3, 0.0)
    with pytest.raises(DataError, match="choose a smaller drift, step or peak"):
        likeness.campaign_with(local, np.random.default_rng(4))


def test_what_cannot_be_simulated_is_refused(tmp_path: Path) -> None:
    like = str(EXAMPLES / "tilting-table")
    with pytest.raises(InputError, match="there is no machine 'C' among those asked for; there are A, B"):
        LikeRequest(tmp_path / "x", like, ("A", "B"), START, drifts=(Drift("EY0A", 1.0, "C"),))
    with pytest.raises(InputError, match="has no parameter 'EY0a'; did you mean 'EY0A'"):
        simulate_like(LikeRequest(tmp_path / "x", like, ("A",), START, drifts=(Drift("EY0a", 1.0),)))
    with pytest.raises(InputError, match="is a curve, which has no machine"):
        simulate_like(LikeRequest(tmp_path / "x", str(EXAMPLES / "load-cell"), ("A",), START))
    with pytest.raises(InputError, match="--months 0: 1 or more"):
        LikeRequest(tmp_path / "x", like, ("A",), START, months=0)
    with pytest.raises((DataError, InputError), match=r"--peak 3 needs --effect"):
        LikeRequest(tmp_path / "x", like, ("A",), START, peak_um=3.0)
    assert list(tmp_path.iterdir()) == []
