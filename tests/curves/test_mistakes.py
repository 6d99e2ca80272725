"""What people hand in by mistake, and what hides behind what: refused, told or found, never taken for an answer."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery.curve.compare import compare_curve
from monitor.discovery.curve.explain import explain_curve
from monitor.exceptions import CampaignError
from monitor.methods.curve.fit import fit
from monitor.methods.curve.problem import problem_of
from monitor.readers import read_campaign
from monitor.records import CurveCampaign, Instrument, Verdict
from monitor.workflow.explain.curve_answer import curve_explanation

HOURS = np.arange(240.0)


def curve(
    columns: dict[str, np.ndarray], base: str, time: str | None = None, unit: str = ""
) -> CurveCampaign:
    units = dict.fromkeys(columns, "") | ({} if time is None else {time: unit})
    rows = len(columns["y"])
    return CurveCampaign(
        "made", "curve", Instrument("made"), "y", base, columns, {}, units, time, np.arange(2, rows + 2)
    )


def daily(seed: int, unit: str) -> CurveCampaign:
    """Ten days by the hour: drift 0.0005/h, a daily cycle of 0.02, noise of 0.005."""
    noise = np.random.default_rng(seed).normal(0.0, 0.005, 240)
    y = 20.0 + 0.0005 * HOURS + 0.02 * np.sin(2.0 * np.pi * HOURS / 24.0 + 0.3) + noise
    return curve({"y": y, "stunde": HOURS}, "y ~ 1", "stunde", unit)


@pytest.mark.parametrize("unit", ["h", ""])
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.all_seeds) for seed in (1, 2))])
@pytest.mark.slow
def test_a_drift_and_a_cycle_that_hide_each_other_are_both_found(seed: int, unit: str) -> None:
    campaign = daily(seed, unit)
    found = explain_curve(problem_of(campaign))
    assert {one.fitted.shape for one in found.missing} == {"drift", "sin"}
    for one in found.missing:
        if one.fitted.shape == "drift":
            assert abs(one.amplitude - 0.0005) < 4.0 * one.u
    assert not found.noise.noticed
    assert compare_curve(fit(problem_of(campaign))).verdict == Verdict.SOMETHING_IS_MISSING


def test_rows_at_different_times_that_drift_are_no_repeats() -> None:
    """Two thermometer readings that happen to be equal days apart: their scatter is the drift, not repeatability."""
    rng = np.random.default_rng(8)
    ambient = np.round(20.0 + 0.5 * rng.normal(size=240), 1)
    y = 0.01 * ambient + 0.0005 * HOURS + rng.normal(0.0, 0.002, 240)
    problem = problem_of(
        curve({"y": y, "ambient": ambient, "stunde": HOURS}, "y ~ 1 + ambient", "stunde", "h")
    )
    compared = compare_curve(fit(problem))
    assert compared.lack_of_fit is None
    assert compared.repeatability is None
    assert compared.verdict == Verdict.SOMETHING_IS_MISSING
    assert [one.effect for one in explain_curve(problem).missing] == ["stunde:drift"]
    # Independent repeats at different times stay repeats.
    y = y - 0.0005 * HOURS
    problem = problem_of(
        curve({"y": y, "ambient": ambient, "stunde": HOURS}, "y ~ 1 + ambient", "stunde", "h")
    )
    assert compare_curve(fit(problem)).repeatability == pytest.approx(0.002, rel=0.15)


def test_without_an_input_nothing_was_repeated() -> None:
    y = np.random.default_rng(3).normal(size=40)
    compared = compare_curve(fit(problem_of(curve({"y": y}, "y ~ 1"))))
    assert compared.repeatability is None
    assert compared.verdict == Verdict.EXPLAINED


def test_rounding_is_no_noise() -> None:
    x = np.linspace(0.1, 7.3, 60)
    problem = problem_of(curve({"y": 2.0 + 3.0 * x, "x": x}, "y ~ 1 + x"))
    answer = curve_explanation(explain_curve(problem), "curve")
    assert answer.missing == ()
    assert answer.comparison.verdict is Verdict.EXPLAINED
    assert "fits exactly" in answer.answer
    problem = problem_of(curve({"y": 2.0 + 3.0 * x + 0.5 * x**2, "x": x}, "y ~ 1 + x"))
    answer = curve_explanation(explain_curve(problem), "curve")
    assert [effect.effect for effect in answer.missing] == ["x:poly2"]
    assert answer.suspect_data == ()
    assert "With all of it the model fits exactly" in answer.answer


def test_a_response_that_was_set_is_told() -> None:
    load = np.repeat(np.arange(6.0), 8)
    read = 3.0 * load + np.random.default_rng(4).normal(0.0, 0.1, 48)
    swapped = problem_of(curve({"y": load, "x": read}, "y ~ 1 + x"))
    assert "exchange them" in curve_explanation(explain_curve(swapped), "curve").answer
    right = problem_of(curve({"y": read, "x": load}, "y ~ 1 + x"))
    assert "exchange them" not in curve_explanation(explain_curve(right), "curve").answer


def written(folder: Path, rows: list[str], header: str = "when,y", keys: str = "") -> Path:
    (folder / "campaign.toml").write_text(
        f'format = 1\ncampaign = "made"\nmethod = "curve"\n[curve]\nresponse = "y"\nbase = "y ~ 1"\n{keys}'
    )
    (folder / "data.csv").write_text("\n".join([header, *rows]) + "\n")
    return folder


DATES = [f"2026-03-{day:02d}T08:00,{1.0 + 0.1 * day}" for day in range(1, 11)]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([], "there is only a header; at least one row must follow"),
        ([*DATES, "2026-04-01T08:00,1e200"], "'1e200' is beyond 1e+15"),
        ([*DATES, "2026-04-01T08:00,-1e300"], "'-1e300' is beyond 1e+15"),
        (
            [*DATES, "2026-02-30T08:00,1.5"],
            "data.csv, line 12, column when: '2026-02-30T08:00' is no date of the calendar",
        ),
        ([*DATES, "02.03.2026 08:00,1.5"], "write 2026-03-02 or 2026-03-02T08:00 (year, month, day)"),
        (
            [f"{day:02d}.03.2026,{day}" for day in range(1, 9)],
            "data.csv, line 2, column when: '01.03.2026': countries",
        ),
        ([*DATES, "2026-04-01T08:00Z,1.5"], "some moments have a time zone and some have none"),
        ([*DATES, *DATES], "20 rows hold 10 measurements; remove the copies"),
    ],
)
def test_a_mistake_is_refused_in_words(tmp_path: Path, rows: list[str], message: str) -> None:
    with pytest.raises(CampaignError, match=re.escape(message)):
        read_campaign(written(tmp_path, rows))


def test_what_only_looks_like_a_mistake_is_read(tmp_path: Path) -> None:
    # A coarse instrument three times a day, a batch that begins with a date, and dates that are declared labels.
    coarse = [f"2026-03-{day:02d},{day % 3}" for day in (1, 2, 3, 4) for _ in range(3) for day in (day, day)]
    assert isinstance(read_campaign(written(tmp_path, [*coarse, "2026-03-09,1"])), CurveCampaign)
    batches = [f"2026-03-{day:02d}-A,{day}" for day in range(1, 9)]
    found = read_campaign(written(tmp_path, batches))
    assert isinstance(found, CurveCampaign)
    assert list(found.groups) == ["when"]
    found = read_campaign(written(tmp_path, [*DATES, "2026-02-30T08:00,1.5"], keys='groups = ["when"]\n'))
    assert isinstance(found, CurveCampaign)
    assert list(found.groups) == ["when"]
