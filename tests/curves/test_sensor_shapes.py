"""Sensors with a knee and with hysteresis, simulated here with numpy alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery.curve.explain import CurveExplanation, explain_curve
from monitor.discovery.curve.plausible import is_plausible
from monitor.effects.curve import parse_curve_effect
from monitor.effects.curve.shapes.loop import directions
from monitor.exceptions import EffectError
from monitor.methods.curve.fit import fit
from monitor.methods.curve.problem import problem_of
from monitor.methods.model import Model
from monitor.readers import read_campaign
from monitor.records import CurveCampaign, Instrument

TOML = """format = 1
campaign = "{name}"
method = "curve"

[curve]
response = "{response}"
base = "{response} ~ 1 + {column}"
"""


def explained(folder: Path, column: str, x: np.ndarray, response: str, y: np.ndarray) -> CurveExplanation:
    folder.mkdir()
    (folder / "campaign.toml").write_text(
        TOML.format(name=folder.name, response=response, column=column), encoding="utf-8"
    )
    rows = [f"{column},{response}", *(f"{a:.6g},{b:.8g}" for a, b in zip(x, y, strict=True))]
    (folder / "data.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    campaign = read_campaign(folder)
    assert isinstance(campaign, CurveCampaign)
    return explain_curve(problem_of(campaign))


@pytest.mark.parametrize("seed", range(5))
def test_a_second_slope_is_a_knee_at_its_place_and_not_a_cycle_as_long_as_the_range(
    seed: int, tmp_path: Path
) -> None:
    """Was: p_kPa:sin~100, one cycle over the whole range, or a knee of the row's number."""
    rng = np.random.default_rng(seed)
    pressure = np.linspace(0.0, 100.0, 80)
    voltage = 0.05 * pressure + 0.01 * np.maximum(pressure - 60.0, 0.0) + rng.normal(0.0, 0.02, 80)
    (finding,) = explained(tmp_path / "sensor", "p_kPa", pressure, "u_V", voltage).missing
    assert finding.effect.startswith("p_kPa:knee~")
    assert [unit.name for unit in finding.units] == ["V/kPa"]
    assert finding.searched is not None
    assert finding.searched.name == "place"
    assert abs(finding.searched.value - 60.0) < 5.0
    assert abs(finding.coefficients[0] - 0.01) < 0.001


@pytest.mark.parametrize("seed", range(5))
def test_hysteresis_is_a_loop_and_not_a_cycle_of_rows(seed: int, tmp_path: Path) -> None:
    """Was: sequence:sin~20.7, the length of one load cycle in rows."""
    rng = np.random.default_rng(seed)
    one = np.concatenate([np.arange(0.0, 101.0, 10.0), np.arange(90.0, -1.0, -10.0)])
    load = np.tile(one, 3)
    falling = np.tile(np.arange(21) > 10, 3)
    lens = 1.0 - (load / 50.0 - 1.0) ** 2
    signal = 0.2 * load + 0.02 * falling * lens + rng.normal(0.0, 0.003, len(load))
    missing = explained(tmp_path / "cell", "load_N", load, "s_mV", signal).missing
    # Half of the loop goes with the direction; the other half is a bend of the mean curve.
    assert missing[0].effect == "load_N:loop"
    assert abs(missing[0].coefficients[0] + 0.01) < 4.0 * missing[0].u
    assert [effect.effect for effect in missing[1:]] == ["load_N:poly2"]


@pytest.mark.parametrize("seed", range(5))
def test_a_smooth_bend_stays_a_polynomial(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(100 + seed)
    x = rng.uniform(0.0, 10.0, 80)
    y = 2.0 * x + 0.02 * (x - 5.0) ** 2 + rng.normal(0.0, 0.1, 80)
    assert [effect.effect for effect in explained(tmp_path / "gauge", "x_mm", x, "y_um", y).missing] == [
        "x_mm:poly2"
    ]


@pytest.mark.parametrize("seed", [109, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (101, 104))])
def test_cycles_whose_period_nothing_determines_are_no_findings(seed: int, tmp_path: Path) -> None:
    """The law of a thermistor is an exponential, and next to one in what is left; was: cycles such as 100 ± 1432 and
    40 ± 1031 °C beside it, each undetermined beside the other."""
    rng = np.random.default_rng(seed)
    celsius = np.linspace(0.0, 100.0, 40)
    ohm = 1e4 * np.exp(3950.0 * (1.0 / (celsius + 273.15) - 1.0 / 298.15)) * (1.0 + rng.normal(0.0, 1e-3, 40))
    missing = explained(tmp_path / "ntc", "t_degC", celsius, "r_ohm", ohm).missing
    assert missing[0].effect.startswith("t_degC:exp~")
    for effect in missing:
        assert (
            effect.searched is None
            or effect.searched.u is None
            or effect.searched.u < effect.searched.value / 2
        )


@pytest.mark.parametrize(("periods", "plausible"), [(("30", "30.02"), False), (("30", "20"), True)])
def test_two_cycles_that_nearly_cancel_are_no_findings(periods: tuple[str, str], plausible: bool) -> None:
    """Cycles of 30 and 30.02 over 90 are told apart by 1 % of their size: noise gives each a size hundreds of times as
    large as what it takes away."""
    rng = np.random.default_rng(1)
    x = np.linspace(0.0, 90.0, 200)
    # What cycles of 30 and of 20 add up to, and what two neighbours can only do against each other.
    y = np.sin(2 * np.pi * x / 30) + np.sin(2 * np.pi * x / 20) + 0.1 * x * np.cos(2 * np.pi * x / 30)
    curve = CurveCampaign(
        "made", "curve", Instrument("made"), "y", "y ~ 1", {"y": y + rng.normal(0.0, 0.01, 200), "x": x}, {},
        {"x": "mm", "y": "um"}, None, np.arange(2, 202),
    )  # fmt: skip
    fitted = fit(problem_of(curve, Model("both", added=tuple(f"x:sin{period}" for period in periods))))
    assert [is_plausible(fitted, index) for index in (0, 1)] == [plausible] * 2


def test_the_direction_is_that_of_the_last_change() -> None:
    assert directions(np.array([0.0, 0.0, 1.0, 1.0, 0.5, 0.5, 2.0])).tolist() == [1, 1, 1, 1, -1, -1, 1]
    assert directions(np.zeros(3)).tolist() == [0.0, 0.0, 0.0]


def test_a_knee_may_lie_at_zero_and_a_loop_has_no_number() -> None:
    assert parse_curve_effect("load_N:knee~0").text == "load_N:knee~0"
    with pytest.raises(
        EffectError, match=r"'load_N:loop3' is no effect of a curve.*load_N:knee, load_N:loop"
    ):
        parse_curve_effect("load_N:loop3")
