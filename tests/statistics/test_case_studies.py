"""Check standards and other series of the NIST/SEMATECH e-Handbook: what the handbook prints, and silence on noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.statistics import (
    cusum_chart,
    ewma_chart,
    find_changes,
    individuals_chart,
    mann_kendall,
    reference_period,
    welch_anova,
)
from monitor.statistics.charts.control import Reference
from monitor.statistics.trend import trend

LINEWIDTHS = Path(__file__).resolve().parents[1] / "references" / "nist-cases" / "nist_LINEWID.DAT"


def test_linewidth_check_standards_of_handbook_2_3_7_1_leave_their_limits_on_day_4(certified):
    printed = certified("nist-handbook/linewidth_2_3_7_1.json")
    w = np.array([value for _, _, value in printed["W"]])
    calibration = printed["calibration"]
    # The centre is known to be zero; the scatter is the residual scatter of the calibration, in units of the line.
    reference = Reference(0.0, calibration["rsd"] / calibration["slope"], np.inf, calibration["df"])
    # Three independent check standards a day share a false-alarm probability of 5 %.
    chart = individuals_chart(w, reference, arl=1.0 / (1.0 - 0.95 ** (1.0 / 3.0)))
    assert chart.limit == pytest.approx(printed["t_star"], abs=5e-5)
    assert (chart.lower[0], chart.upper[0]) == pytest.approx(tuple(printed["limits"]), abs=5e-6)
    out = {(day, position) for day, position, _ in printed["out_of_control"]}
    assert {tuple(printed["W"][i][:2]) for i in chart.alarms} == out


def test_linewidth_values_follow_from_the_measured_ones(table, certified):
    printed = certified("nist-handbook/linewidth_2_3_7_1.json")
    rows = []
    for line in LINEWIDTHS.read_text(encoding="latin-1").splitlines():
        words = line.split()
        if len(words) == 4 and words[1] in ("L", "M", "U"):
            rows.append((float(words[2]), float(words[3])))
    x, y = np.array(rows).T
    calibration = printed["calibration"]
    w = (y - calibration["intercept"]) / calibration["slope"] - x
    assert w == pytest.approx([value for _, _, value in printed["W"]], abs=1.01e-4)


def test_mass_check_standard_of_handbook_2_3_5_2_leaves_its_baseline_in_1986(table):
    rows = table("nist-cases/nist_MASS.DAT", 6)
    t, y = rows[:, 0], rows[:, 2]
    base = t < 85.0
    # Recomputed by the reference set; the handbook draws the charts and prints no numbers.
    assert y.mean() == pytest.approx(-19.46452, abs=5e-6)
    assert y.std(ddof=1) == pytest.approx(0.035851, abs=5e-7)
    assert np.sqrt(np.mean(rows[:, 4] ** 2)) == pytest.approx(0.034277, abs=5e-7)
    line = trend(y, t, independent=True)
    assert line.slope == pytest.approx(0.00325, abs=5e-6)
    assert line.slope / line.u_slope == pytest.approx(4.664, abs=5e-4)
    welch = welch_anova(y[:, np.newaxis], base.astype(int))
    assert np.sqrt(welch.statistic[0]) == pytest.approx(5.704, abs=5e-4)
    reference = reference_period(y[base])
    assert (reference.n, reference.centre) == pytest.approx((99, -19.47851), abs=5e-6)
    ewma, cusum = ewma_chart(y[~base], reference), cusum_chart(y[~base], reference)
    for chart in (ewma, cusum):
        assert t[~base][chart.alarms[0]] == pytest.approx(86.513)
    # The single values see only two of them: small lasting shifts are for the charts with a memory.
    assert len(individuals_chart(y[~base], reference).alarms) == 2
    # Measurements of one day are told apart by their order in the file.
    found = find_changes({"y": y}, t + 1e-9 * np.arange(len(t)), rng=np.random.default_rng(1), trials=499)
    assert [(one.kind, one.interval[0] < 86.513 < one.interval[1]) for one in found.changes] == [
        ("step", True)
    ]
    assert found.changes[0].size == pytest.approx(0.038, abs=2 * found.changes[0].u)
    assert not found.trends


# Published in the e-Handbook 1.4.2 (ZARR13, SOULEN) and by Dataplot (RANDN): mean, standard deviation, t of the slope.
@pytest.mark.parametrize(
    ("name", "columns", "mean", "sd", "slope_t"),
    [
        ("RANDN", 10, -0.00294, 1.021041, -0.1251),
        ("ZARR13", 1, 9.26146, 0.022789, -1.960),
        ("SOULEN", 5, 2898.562, 1.305, 4.445),
    ],
)
def test_location_of_handbook_series(table, name, columns, mean, sd, slope_t):
    y = table(f"nist-cases/nist_{name}.DAT", columns).ravel()
    line = trend(y, np.arange(float(len(y))), independent=True)
    assert y.mean() == pytest.approx(mean, rel=1e-6, abs=1e-5)
    assert y.std(ddof=1) == pytest.approx(sd, rel=4e-5)
    assert line.slope / line.u_slope == pytest.approx(slope_t, abs=5e-4)


def test_autocorrelation_of_handbook_zarr13_and_soulen(table):
    for name, columns, printed, half in (("ZARR13", 1, 0.280579, 1e-6), ("SOULEN", 5, 0.315, 5e-4)):
        y = table(f"nist-cases/nist_{name}.DAT", columns).ravel()
        centred = y - y.mean()
        plain = (centred[1:] @ centred[:-1]) / (centred @ centred)
        assert plain == pytest.approx(printed, abs=half)
        # Ours is the same less the bias that a fitted mean and slope bring.
        corrected = mann_kendall(y, np.arange(float(len(y)))).autocorrelation
        assert corrected == pytest.approx(printed, abs=0.025)


@pytest.mark.parametrize(("name", "columns"), [("RANDN", 10), ("RANDU", 5), ("ZARR13", 1)])
def test_nothing_is_found_where_nothing_is_hidden(table, name, columns):
    y = table(f"nist-cases/nist_{name}.DAT", columns).ravel()
    t = np.arange(float(len(y)))
    found = find_changes({name: y}, t, rng=np.random.default_rng(1), trials=499)
    assert (found.changes, found.trends) == ((), ())
    assert mann_kendall(y, t).p_value > 0.05
