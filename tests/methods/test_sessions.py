"""One bar in several runs of a campaign has one length: against a least squares of numpy over all runs at once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.shares import shares
from monitor.readers import read_campaign
from monitor.uncertainty.runs.row_run import measured_run
from monitor.uncertainty.runs.sensitivity import sensitivity_of
from tests.benchmarks.trial_instruments import truth_of
from tests.simulator import four_instruments as shop

GAINS = ("EXX", "EYY", "EZZ")


@pytest.fixture(scope="module", params=[False, True], ids=["one day", "three days"])
def session(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> InstrumentProblem:
    """A run with laser and bar, and two with the same bar alone; on one day, and on a day each."""
    rng = np.random.default_rng(5)
    truths = [truth_of(rng) for _ in range(3)]
    folder = tmp_path_factory.mktemp("shop") / "week"
    return problem_at(shop.session(folder, rng, truths, 20.0, days=request.param))


def problem_at(folder: Path) -> InstrumentProblem:
    campaign = read_campaign(folder)
    problem = campaign_method(campaign).problem_of(campaign)
    assert isinstance(problem, InstrumentProblem)
    return problem


def test_one_length_is_the_least_squares_of_all_runs(session: InstrumentProblem) -> None:
    """Estimates and covariances of every run are those of one dense system whose last column is the length."""
    stays = session.stays
    assert stays is not None
    (length,) = stays.columns
    solution = solve_problem(session)
    at = replace(session, shares_bars=False).linearise(solution.local, solution.common)
    runs, numbers, unknowns = at.local.shape
    prior = numbers - len(session.extra_names) + int(stays.rows[0])
    design, residual = np.zeros((runs * numbers, runs * unknowns + 1)), at.residual.copy()
    for run in range(runs):
        block = at.local[run].copy()
        if run > 0:  # the calibration counts once
            block[prior] = residual[run, prior] = 0.0
        rows = slice(run * numbers, (run + 1) * numbers)
        design[rows, -1] = block[:, length]
        block[:, length] = 0.0
        design[rows, run * unknowns : (run + 1) * unknowns] = block
    scale = np.linalg.norm(design, axis=0)
    scale[scale == 0.0] = 1.0
    inverse = np.linalg.pinv(design / scale, rcond=1e-6) / scale[:, None]
    covariance = inverse @ inverse.T
    u = np.sqrt(np.diag(covariance))
    assert np.all(np.abs(inverse @ residual.ravel())[u > 0.0] < 1e-6 * u[u > 0.0])
    assert len(np.unique(solution.local[:, length])) == 1
    for run in range(runs):
        index = np.arange(run * unknowns, (run + 1) * unknowns)
        index[length] = runs * unknowns
        free = solution.local_free[run]
        ours = solution.local_covariance[run][np.ix_(free, free)]
        size = np.sqrt(np.outer(np.diag(ours), np.diag(ours)))
        assert np.all(np.abs(ours - covariance[np.ix_(index, index)][np.ix_(free, free)]) < 1e-9 * size)


def test_a_laser_in_one_run_calibrates_the_bar_of_the_others(session: InstrumentProblem) -> None:
    """Of runs with the bar alone the gains have a fourth of the u that a length of their own leaves them."""
    joint, single = (solve_problem(problem) for problem in (session, replace(session, shares_bars=False)))
    for gain in GAINS:
        column = session.base_names.index(gain)
        u = [np.sqrt(solution.local_covariance[1:, column, column]) for solution in (joint, single)]
        assert np.all(u[0] < 0.4 * u[1])


@pytest.mark.parametrize("run", [1, 2])
def test_a_run_beside_the_others_has_the_same_numbers_by_itself(session: InstrumentProblem, run: int) -> None:
    """What others say of the bar is its calibration: the uncertainty of one run is that of the joint fit."""
    solution = solve_problem(session)
    alone = session.beside_others(solution, run)
    at = sensitivity_of(measured_run(alone, run, solution.common), start=solution.local[run - 1])
    free = solution.local_free[run - 1]
    u = np.sqrt(np.diag(solution.local_covariance[run - 1]))[free]
    assert np.all(np.abs(at.unknowns - solution.local[run - 1])[free] < 1e-5 * u)
    # The Hessian of the sensitivity has the residuals' curvature, the covariance has not.
    assert np.allclose(np.sqrt(np.diag(at.inverse))[free], u, rtol=5e-3)
    by_instrument, stated = shares(session, solution, run)
    whole = sum(share.variance for share in by_instrument) + stated
    bases = slice(0, len(session.base_names))
    number = np.isfinite(whole)
    assert np.allclose(whole[number], np.diag(solution.local_covariance[run - 1])[bases][number], rtol=1e-6)


def test_a_bar_that_is_set_anew_is_an_instrument_of_its_own(tmp_path: Path) -> None:
    """Setups that name another bar on the second day share nothing with the first: two lengths, each run its own."""
    rng = np.random.default_rng(6)
    folder = shop.session(tmp_path / "days", rng, [truth_of(rng)] * 2, 30.0, days=True)
    one_bar = problem_at(folder)
    toml, csv = folder / "campaign.toml", folder / "probings.csv"
    text = toml.read_text(encoding="utf-8")
    head, *setups = text.split("\n[[setups]]\n")
    bars = [setup for setup in setups if 'instrument = "ball bar"' in setup]
    anew = [
        bar.replace('id = "bar', 'id = "new-bar').replace('"ball bar"', '"ball bar, set anew"')
        for bar in bars
    ]
    toml.write_text("\n[[setups]]\n".join([head, *setups, *anew]), encoding="utf-8")
    lines = csv.read_text(encoding="utf-8").splitlines()
    csv.write_text(
        "\n".join(line.replace(",bar-", ",new-bar-") if line.startswith("2,") else line for line in lines)
        + "\n",
        encoding="utf-8",
    )
    two_bars = problem_at(folder)
    assert one_bar.stays is not None
    assert two_bars.stays is not None
    assert (len(one_bar.stays.columns), len(two_bars.stays.columns)) == (1, 2)
    joint, anew_fit = solve_problem(one_bar), solve_problem(two_bars)
    single = solve_problem(replace(one_bar, shares_bars=False))
    for gain in GAINS:
        column = one_bar.base_names.index(gain)
        u = [np.sqrt(solution.local_covariance[:, column, column]) for solution in (joint, anew_fit, single)]
        assert u[0][1] < 0.5 * u[2][1]
        assert u[1] == pytest.approx(u[2], rel=1e-6)
        assert anew_fit.local[:, column] == pytest.approx(
            single.local[:, column], abs=1e-6 * float(u[2].min())
        )
