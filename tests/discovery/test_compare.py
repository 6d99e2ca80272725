"""Comparison of model and measurement, against formulas written out here."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from by_path import simulator
from scipy import stats

from monitor.discovery import Verdict, compare, fit
from monitor.discovery.machine.compare import lack_of_fit
from monitor.discovery.machine.noise.correlation import Correlation
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.search.comparison import split
from monitor.methods import campaign_method
from monitor.methods.samba.method import problem_of
from monitor.readers import read_campaign
from tests.simulator import four_instruments as shop

STRD = Path(__file__).resolve().parents[1] / "references" / "nist-strd" / "linear"


def test_nist_load_cell_lack_of_fit_of_the_straight_line():
    """NIST/SEMATECH e-Handbook 4.6.1, load cell calibration (data Pontius): 20 loads, each twice.

    Replication standard deviation 0.0002147264895 on 20 degrees of freedom, F of lack of fit 214.7464 on 18 and 20
    (printed by Dataplot in single precision: six digits).
    """
    lines = (STRD / "Pontius.dat").read_text(encoding="ascii").splitlines()[60:]
    y, x = np.array([[float(cell) for cell in line.split()] for line in lines]).T
    design = np.column_stack([np.ones_like(x), x])
    residual = y - design @ np.linalg.lstsq(design, y, rcond=None)[0]
    error, lack, repeats = split(residual[:, None], np.unique(x, return_inverse=True)[1])
    assert repeats == 20
    assert np.sqrt(error / repeats) == pytest.approx(0.0002147264895, rel=1e-6)
    assert (lack / 18) / (error / repeats) == pytest.approx(214.7464, rel=1e-5)
    assert error + lack == pytest.approx(residual @ residual, rel=1e-12)


@pytest.fixture(scope="module")
def compared(virtual_campaigns):
    sim = simulator()
    campaign, told = virtual_campaigns.virtual(5, [sim.Effect("EXX:reversal", peak_um=4.0)])
    found = fit(problem_of(campaign))
    return found, compare(found, "virtual", "samba"), told


def test_numbers_are_those_of_the_residual_vectors(compared):
    found, answer, _ = compared
    vectors = answer.vectors
    assert vectors.shape == (1240, 3)
    assert answer.rms == pytest.approx(np.sqrt(np.mean(vectors**2)), rel=1e-12)
    # 34 unknowns a run from 62 probings and a bar.
    assert found.degrees_of_freedom == 20 * (3 * 62 + 1 - 34)
    assert answer.expected_rms == pytest.approx(1e-3 * np.sqrt(20 * 153 / 3720), rel=1e-12)
    bar = found.solution.last.residual[:, -1]
    chi_square = np.sum((vectors / 1e-3) ** 2) + np.sum(bar**2)
    assert found.sum_of_squares == pytest.approx(chi_square, rel=1e-9)
    assert answer.residual_deviation == pytest.approx(1e-3 * np.sqrt(chi_square / 3060), rel=1e-9)
    assert answer.excess_p_value == pytest.approx(stats.chi2.sf(chi_square, 3060), rel=1e-6)


@pytest.mark.parametrize("correlation", [None, Correlation(0.7, 0.5)])
def test_the_rms_of_explain_is_that_of_compare_for_readings_of_mixed_uncertainty(
    virtual_campaigns, correlation
):
    """One definition: root mean square in mm of every coordinate, whatever its uncertainty and its neighbours."""
    campaign, _ = virtual_campaigns.virtual(6, [simulator().Effect("EXX:reversal", peak_um=30.0)], runs=4)
    problem = problem_of(campaign)
    mixed = np.where(np.arange(len(problem.sigma))[:, None] % 3 == 0, 5.0, 1.0) * problem.sigma
    mixed[7] = np.inf
    fitted = fit(replace(problem, sigma=mixed))
    weighted = fitted.sigma * np.sqrt(fitted.sum_of_squares / fitted.readings)
    scene = scene_of(fitted.with_correlation(correlation), [])
    left = scene.fit.rms_of(scene.residual)
    # Correlated neighbours move the unknowns of a run a little.
    assert left == pytest.approx(fitted.rms, rel=1e-9 if correlation is None else 0.15)
    assert abs(weighted / fitted.rms - 1.0) > 0.2
    if correlation is not None:
        has_weight = scene.fit.problem.padded(np.isfinite(mixed).astype(float)) > 0.5
        whole = np.array(fitted.solution.last.residual)
        whole[:, : has_weight.shape[1]] *= has_weight
        np.testing.assert_allclose(
            scene.fit.whitening.undone(scene.fit.whitening(whole)), whole, atol=1e-3 * np.abs(whole).max()
        )


def test_repeatability_and_lack_of_fit_from_the_means_over_runs(compared):
    _, answer, _ = compared
    # The same plan in every run, so the place of a probing is its sequence.
    runs = answer.vectors.reshape(20, 62, 3) / 1e-3
    mean = runs.mean(axis=0)
    scatter, lack = np.sum((runs - mean) ** 2), 20 * np.sum(mean**2)
    pure = 19 / 20 * 3060
    test = answer.lack_of_fit
    assert test.pure_error_degrees_of_freedom == pytest.approx(pure)
    assert test.degrees_of_freedom == pytest.approx(3060 - pure)
    assert test.f == pytest.approx((lack / 153) / (scatter / pure), rel=1e-9)
    assert test.p_value == pytest.approx(stats.f.sf(test.f, 153, pure), rel=1e-6)
    assert answer.repeatability == pytest.approx(1e-3 * np.sqrt(scatter / pure), rel=1e-9)
    # The effect is the same in every run: it does not spoil repeatability, and the fit lacks it.
    assert answer.repeatability == pytest.approx(1e-3, rel=0.05)
    assert test.p_value < 1e-9
    assert answer.verdict is Verdict.SOMETHING_IS_MISSING


def test_breakdown_tells_where(compared):
    _, answer, told = compared
    by = answer.by
    assert set(by) >= {"target", "axis", "run", "time_in_run", "indexation"}
    assert by["axis"]["x"].rms == pytest.approx(np.sqrt(np.mean(answer.vectors[:, 0] ** 2)), rel=1e-12)
    second = answer.vectors[told["target"] == "2"]
    assert by["target"]["2"].rms == pytest.approx(np.sqrt(np.mean(second**2)), rel=1e-12)
    assert by["target"]["2"].largest == pytest.approx(np.abs(second).max(), rel=1e-12)
    assert by["target"]["2"].count == 300
    assert len(by["run"]) == 20
    chosen = answer.vectors[(told["readings"]["B"] == 30) & (told["readings"]["C"] == 175)]
    assert by["indexation"]["B=30 C=175 C1=0"].rms == pytest.approx(np.sqrt(np.mean(chosen**2)), rel=1e-12)


@pytest.mark.parametrize(
    "options",
    [
        {"days": 3, "runs_per_day": 1},
        {"days": 1, "runs_per_day": 2},
        {"days": 2, "runs_per_day": 2, "keep": lambda told: (told["run"] % 2 == 1) | (told["sequence"] < 48)},
    ],
)
def test_lack_of_fit_has_the_stated_level_where_nothing_is_hidden(virtual_campaigns, options, seeds):
    """p-values of 60 (a sample: 20) empty campaigns are uniform: Kolmogorov and Smirnov at one in a thousand."""
    p_values = []
    for seed in seeds(60, 20):
        campaign, _ = virtual_campaigns.virtual(seed, **options)
        test, repeatability = lack_of_fit(fit(problem_of(campaign)))
        assert repeatability == pytest.approx(1e-3, rel=0.25)
        p_values.append(test.p_value)
    assert stats.kstest(p_values, "uniform").pvalue > 1e-3


def _with_r_test(folder: Path, seed: int, runs: int = 1):
    """Lasers there and back twice beside an R-test, one and three numbers a row; nothing is hidden."""
    rng, chain = np.random.default_rng(seed), shop.machine(0.0)
    rows = []
    for run in range(1, runs + 1):
        parts = [shop.laser(chain, rng, 2), shop.r_test(chain, rng)]
        rows += [{"run": run, **row} for _, of in parts for row in of]
    started = [f"2026-03-{day:02d}T08:00:00+00:00" for day in range(1, runs + 1)]
    campaign = read_campaign(
        chain.write(folder / f"{seed}", "".join(text for text, _ in parts), rows, started=started)
    )
    return fit(campaign_method(campaign).problem_of(campaign))


def test_repeats_of_one_number_beside_rows_of_three_count_once(tmp_path):
    """A laser's reading is one number, also where an R-test of the same campaign reads three."""
    test, _ = lack_of_fit(_with_r_test(tmp_path, 3))
    # Of each axis nine stops inside come back three times, both ends twice: what is read again where the axis turns
    # round is no return. The R-test does not come back.
    assert test.pure_error_degrees_of_freedom == 3 * (9 * 3 + 2 * 2)


def test_p_values_of_lasers_beside_an_r_test_are_uniform(tmp_path, seeds):
    """Of 40 campaigns of one run (a sample: 12); F is about 1, and repeats scatter as stated."""
    tests = [lack_of_fit(_with_r_test(tmp_path, seed)) for seed in seeds(40, 12)]
    assert stats.kstest([test.p_value for test, _ in tests], "uniform").pvalue > 1e-3
    assert np.mean([test.f for test, _ in tests]) == pytest.approx(1.0, abs=0.25)


def test_one_run_has_no_repeatability(virtual_campaigns):
    campaign, _ = virtual_campaigns.virtual(3, days=1, runs_per_day=1)
    answer = compare(fit(problem_of(campaign)), "virtual", "samba")
    assert answer.repeatability is None
    assert answer.lack_of_fit is None
    assert answer.verdict is Verdict.EXPLAINED


def test_what_varies_from_run_to_run_is_seen_against_the_stated_uncertainty(virtual_campaigns):
    """It hides in repeatability: the second yardstick says so."""
    sim = simulator()
    sizes = 3e-6 * np.random.default_rng(1).standard_normal(20) * 60
    campaign, _ = virtual_campaigns.virtual(3, [sim.Effect("EAX:poly1", coefficients=sizes / 400)])
    answer = compare(fit(problem_of(campaign)), "virtual", "samba")
    assert answer.repeatability > 1.25e-3
    assert answer.excess_p_value < 1e-9
    assert answer.verdict is Verdict.SOMETHING_IS_MISSING


def test_a_statement_twenty_per_cent_too_low_is_no_finding(virtual_campaigns):
    campaign, _ = virtual_campaigns.virtual(3, stated_um=1 / 1.2)
    answer = compare(fit(problem_of(campaign)), "virtual", "samba")
    assert answer.excess_p_value < 1e-9
    assert answer.verdict is Verdict.EXPLAINED
