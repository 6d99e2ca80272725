"""Angles on the screen are in the unit that the configuration names; what leaves the screen is in µrad."""

from __future__ import annotations

import dataclasses
import math
import re
import typing
from pathlib import Path
from typing import Any

import pytest

from monitor.cli.screen import IN_UNIT, in_angle
from monitor.workflow.contract import QUESTIONS
from monitor.workflow.identify.answer import Estimate

#: 1 µrad in arc seconds: a turn has 1 296 000 of them.
ARCSEC = 1e-6 * 1_296_000 / (2 * math.pi)
#: Numbers beside a unit that are in none or in another: probabilities, counts, factors, times, µm by name.
OTHER = frozenset(
    {
        *(
            "autocorrelation",
            "neighbours",
            "further",
            "time_constant_days",
            # Always in µrad, beside peaks in µm.
            "peak_urad",
            # Of a condition, in its unit.
            "least",
            "greatest",
            "axes",
            "bartlett",
            "by_chance",
            "anova_f",
            "e_n",
            "k",
            "lack_of_fit_f",
            "q_value",
            "share_inside",
            "level",
            "times",
            "work_point_mm",
            *("pitch_mm", "spacing_mm", "step_mm", "width_mm", "middle_mm", "low_mm", "high_mm"),
            "axes_by_pose",
        ),
        *("p", "f", "bic", "bic_before", "bic_after", "degrees_of_freedom", "pure_error_degrees_of_freedom"),
        "latest_degrees_of_freedom",
        *(
            "p_value",
            "bartlett_p",
            "bartlett_q",
            "anova_p",
            "anova_q",
            "drift_p",
            "drift_q",
            "levene_p",
            "welch_p",
        ),
        *(
            "brown_forsythe_p",
            "kruskal_p",
            "normality_p",
            "monotone_p",
            "season_p",
            "noise_alone_p",
            "excess_over_statement_p",
        ),
        *(
            "lack_of_fit_p",
            "in_tolerance_at_next_check",
            "probability",
            "probability_out",
            "slope_widening",
            "scatter_over_stated",
            "neighbours",
        ),
        *("correlation", "allowed_for", "widening", "weight", "high", "low", "present", "proposed", "sums"),
        *(
            "k_p",
            "k_q",
            "lambda_max",
            "k_p_standard_error",
            "k_q_standard_error",
            "joint_coverage_of_k_2_each",
        ),
        *("fewest_degrees_of_freedom", "k_p_with_degrees_of_freedom", "k_q_with_degrees_of_freedom"),
        *("degrees_of_freedom_by_parameter", "budget_degrees_of_freedom", "figure_of_merit", "separation"),
        *("travelled_periods", "frequency", "at_least", "at", "from_", "to", "tell_apart_by"),
        *(
            "tau_h",
            "tau_interval_h",
            "stable_after_h",
            "stable_interval_h",
            "recorded_h",
            "period_days",
            "span_days",
            "seconds",
        ),
        *(
            "recommended_interval_days",
            "years_to_limit",
            "temperature",
            "latest_temperature",
            "reference",
            "expansion",
            "temperature_offset",
        ),
        *("expansion_coefficient", "node_spacing", "budget", "lag_one", "slow", "independent_share"),
        *("effective_rows", "k_p_of_all", "k_q_of_all", "needed", "position"),
        *("k_p_of_all_with_degrees_of_freedom", "k_q_of_all_with_degrees_of_freedom"),
        # the errors of linear axes that a request or a source states: asked for, not answered
        *("proportional", "positioning", "straightness", "squareness"),
    }
)


@pytest.fixture(autouse=True)
def arcseconds(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "no configuration"))
    file = tmp_path / "arcsec.toml"
    file.write_text('angle_unit = "arcsec"\n', encoding="utf-8")
    monkeypatch.setenv("MONITOR_CONFIG", str(file))


def rows(text: str) -> dict[str, list[str]]:
    """The rows of a table of parameters by name, cells apart."""
    return {line.split()[0]: line.split() for line in text.splitlines() if " arcsec " in line}


def same_to_its_digits(cell: str, value: float) -> bool:
    """Whether a printed number is the value, rounded to the digits it has."""
    places = len(cell.partition(".")[2])
    return abs(float(cell) - value) <= 0.5001 * 10.0**-places


def test_identify_prints_arc_seconds_and_its_document_keeps_microradians(typed: Any, db: Path) -> None:
    document = typed("identify", "cold-cold", "--json", db=db).document
    parameters = document["runs"][-1]["parameters"]
    printed = rows(typed("identify", "cold-cold", db=db).out)
    assert set(printed) == {name for name, value in parameters.items() if value["unit"] == "µrad"}
    for name, cells in printed.items():
        assert same_to_its_digits(cells[-1], parameters[name]["u"] * ARCSEC)
        assert same_to_its_digits(cells[-2], parameters[name]["value"] * ARCSEC)


def test_stats_prints_arc_seconds(typed: Any, db: Path) -> None:
    parameters = typed("stats", "cold-cold", "--json", db=db).document["parameters"]
    printed = rows(typed("stats", "cold-cold", db=db).out)
    assert printed
    for name, cells in printed.items():
        mean, _, u_pooled, *_ = (cell for cell in cells if re.fullmatch(r"-?[\d.]+", cell))
        assert same_to_its_digits(mean, parameters[name]["mean"] * ARCSEC)
        assert same_to_its_digits(u_pooled, parameters[name]["u_pooled"] * ARCSEC)


def test_uncertainty_prints_arc_seconds(typed: Any, db: Path) -> None:
    asked = ("uncertainty", "cold-cold", "--run", 3, "--method", "guf")
    guf = typed(*asked, "--json", db=db).document["guf"]
    table, _, _ = typed(*asked, db=db).out.partition("in the machine frame")
    printed = rows(table)
    assert printed
    for name, cells in printed.items():
        assert same_to_its_digits(cells[-1], guf["expanded"][name] * ARCSEC)
        assert same_to_its_digits(cells[-2], guf["u"][name] * ARCSEC)


def test_no_verb_for_people_says_microradian(typed: Any, db: Path) -> None:
    typed("identify", "cold-cold", db=db)
    for words in (
        ("identify", "cold-cold"), ("stats", "cold-cold"), ("fleet",), ("plan", "cold-cold"),
        ("effects", "--campaign", "cold-cold", "tilt"), ("uncertainty", "cold-cold", "--run", 3, "--method", "guf"),
    ):  # fmt: skip
        answer = typed(*words, db=db)
        assert (answer.status, "µrad" in answer.out) == (0, False), words
        assert "arcsec" in answer.out, words


def test_compound_units_and_lengths() -> None:
    per_hour = in_angle(Estimate(10.0, 1.0, "µrad/h"), "arcsec")
    assert (per_hour.value, per_hour.u) == pytest.approx((10 * ARCSEC, ARCSEC), rel=1e-14)
    assert per_hour.unit == "arcsec/h"
    assert in_angle(Estimate(10.0, 1.0, "µrad"), "µm/m") == Estimate(10.0, 1.0, "µm/m")
    for unit in ("µm", "µm/m", "µm/°C", "s"):
        assert in_angle(Estimate(10.0, 1.0, unit), "arcsec") == Estimate(10.0, 1.0, unit)


def test_an_unknown_unit_is_refused(typed: Any, db: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("grad.toml").write_text('angle_unit = "gon"\n', encoding="utf-8")
    monkeypatch.setenv("MONITOR_CONFIG", "grad.toml")
    answer = typed("stats", "cold-cold", db=db)
    assert answer.status == 2
    assert "angle_unit = 'gon': write µrad, arcsec or µm/m" in answer.err


def test_every_number_beside_a_unit_is_known_to_be_in_it_or_not() -> None:
    forgotten = {
        f"{record.__name__}.{field.name}"
        for record in records_beside_a_unit()
        for field in dataclasses.fields(record)
        if is_number(typing.get_type_hints(record)[field.name])
        and field.name not in IN_UNIT | OTHER
        and not field.name.endswith("_um")
    }
    assert not forgotten
    assert not IN_UNIT & OTHER


def records_beside_a_unit() -> set[Any]:
    """The parts of answers that have a unit or lie inside one that has."""
    parts: set[Any] = set()
    for question in QUESTIONS.values():
        collect(question.answer, parts)
    inside: set[Any] = set()
    for record in parts:
        if {"unit", "units"} & {field.name for field in dataclasses.fields(record)}:
            collect(record, inside)
    return inside


def collect(hint: Any, records: set[Any]) -> None:
    for argument in typing.get_args(hint):
        collect(argument, records)
    if dataclasses.is_dataclass(hint) and hint not in records:
        records.add(hint)
        for field in typing.get_type_hints(hint).values():
            collect(field, records)


def is_number(hint: Any) -> bool:
    return hint is float or any(is_number(argument) for argument in typing.get_args(hint))
