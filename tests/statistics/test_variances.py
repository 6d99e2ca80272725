"""Bartlett and Levene against the e-Handbook (GEAR), scipy, and their rates on null data."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.statistics import bartlett, levene

GEAR = Path(__file__).resolve().parents[1] / "references" / "nist-handbook" / "gear.csv"


@pytest.fixture(scope="module")
def gear():
    with GEAR.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return np.array([float(r["diameter"]) for r in rows]), np.array([int(r["batch"]) for r in rows])


def test_handbook_1_3_5_7_bartlett_gear(gear, certified, digits):
    right = certified("nist-handbook/gear_bartlett_levene.json")
    result = bartlett(*gear)
    assert result.dof == 9
    assert digits(result.statistic[0], right["bartlett_T"]) >= 12
    assert round(result.statistic[0], 6) == 20.785873
    assert result.p_value[0] == pytest.approx(right["bartlett_p"], rel=1e-11)


def test_handbook_1_3_5_10_levene_gear(gear, certified, digits):
    right = certified("nist-handbook/gear_bartlett_levene.json")
    about_median, about_mean = levene(*gear), levene(*gear, centre="mean")
    assert digits(about_median.statistic[0], right["levene_median_W"]) >= 11
    assert digits(about_mean.statistic[0], right["levene_mean_W"]) >= 11
    # The handbook prints 1.705910: its last digits are rounding of its own.
    assert about_median.statistic[0] == pytest.approx(1.705910, abs=1e-5)
    assert about_median.p_value[0] == pytest.approx(right["levene_p"], rel=1e-10)


def test_all_columns_at_once_agree_with_scipy_one_by_one():
    rng = np.random.default_rng(1)
    groups = np.repeat([1, 2, 3], [4, 6, 5])
    values = 250.0 + rng.normal(size=(15, 186)) * 1e-3
    together, robust = bartlett(values, groups), levene(values, groups)
    for j in range(values.shape[1]):
        parts = [values[groups == g, j] - 250.0 for g in (1, 2, 3)]
        assert together.statistic[j] == pytest.approx(stats.bartlett(*parts).statistic, rel=1e-9, abs=1e-12)
        assert robust.statistic[j] == pytest.approx(stats.levene(*parts).statistic, rel=1e-8, abs=1e-12)


@pytest.mark.parametrize(
    # Measured with 400 000 other columns: Bartlett 0.0480, Brown-Forsythe 0.0642.
    ("test", "level"),
    [(bartlett, 0.048), (levene, 0.0642)],
)
def test_false_alarm_rate_with_five_days_of_four_runs(test, level, rate_agrees):
    trials = 20_000
    values = np.random.default_rng(6).normal(size=(20, trials))
    alarms = int((test(values, np.repeat(np.arange(5), 4)).p_value < 0.05).sum())
    assert rate_agrees(alarms, trials, level), alarms / trials


def test_a_group_that_never_varies_beside_one_that_does():
    values = np.column_stack([[1.0, 1.0, 1.0, 2.0, 3.0, 4.0], np.full(6, 2.0)])
    result = bartlett(values, np.repeat([1, 2], 3))
    assert result.p_value[0] == 0.0
    assert np.isnan(result.p_value[1])


def test_refusals_say_what_is_needed():
    with pytest.raises(DataError, match="group 2 has 1 run"):
        bartlett(np.arange(4.0), [1, 1, 1, 2])
    with pytest.raises(DataError, match="centre is 'mode'; it is 'median' or 'mean'"):
        levene(np.arange(4.0), [1, 1, 2, 2], centre="mode")
