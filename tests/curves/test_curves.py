"""Curves from folder to answer: the language, the reader, the noise, the search by rates, and the verbs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import linalg

from monitor.cli import main
from monitor.discovery.curve.explain import explain_curve
from monitor.effects.curve import Inputs, parse_base, parse_curve_effect
from monitor.exceptions import CampaignError, EffectError
from monitor.methods.curve.problem import problem_of
from monitor.readers import read_campaign
from monitor.records import CurveCampaign, Instrument
from monitor.statistics.noise import Noise, assess, p_value_in_noise

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "load-cell"
INPUTS = Inputs(
    {"load": np.arange(9.0), "sequence": np.arange(1.0, 10.0)}, {"probe": np.array(list("aabbccabc"))}, {}, 9
)


def curve(y: np.ndarray, **columns: np.ndarray) -> CurveCampaign:
    return CurveCampaign(
        "made", "curve", Instrument("made"), "y", "y ~ 1" + "".join(f" + {name}" for name in columns),
        {"y": y, **columns}, {}, {}, None, np.arange(2, len(y) + 2),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("typed", "text"),
    [
        ("load", "load:poly1"),
        ("probe", "probe:group"),
        ("load:poly3", "load:poly3"),
        ("load:sin12", "load:sin12"),
        ("load:sin~12.5", "load:sin~12.5"),
        ("load:step~-1e-3", "load:step~-0.001"),
        ("formula( log(load + 1) )", "formula(log(load + 1))"),
    ],
)
def test_an_effect_reads_back(typed: str, text: str) -> None:
    found = parse_curve_effect(typed, INPUTS)
    assert found.text == text
    assert parse_curve_effect(found.text, INPUTS) == found


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ("laod", "laod, which is no input; there are load, probe"),
        ("load:sine", "is no effect of a curve; write for example"),
        ("load:sin-3", "a period is above 0"),
        ("load:exp0", "finite number other than 0"),
        ("load:sin~", "after ~ comes the period"),
        ("probe:poly2", "holds labels: only probe:group"),
        ("load:group", "it is an input, not load:group"),
        ("__import__('os')", "is no effect of a curve"),
        ("formula(open(load))", "not allowed"),
    ],
)
def test_a_wrong_effect_is_told(typed: str, message: str) -> None:
    with pytest.raises(EffectError, match="(?s)" + __import__("re").escape(message)):
        parse_curve_effect(typed, INPUTS)


def test_a_base_model_in_one_line() -> None:
    constant, effects = parse_base("y ~ 0 + load + load:sin~1e+3 + formula(load + 1) + probe", "y", INPUTS)
    assert not constant
    assert [one.text for one in effects] == [
        "load:poly1",
        "load:sin~1000",
        "formula(load + 1)",
        "probe:group",
    ]
    for wrong in ("y = load", "z ~ load", "y ~ load +", "y ~ load + load", "y ~ 0"):
        with pytest.raises(EffectError, match="'"):
            parse_base(wrong, "y", INPUTS)


@pytest.mark.parametrize("noise", [Noise(0.6), Noise(0.95, 0.6), Noise(-0.5)])
def test_whitening_is_the_inverse_of_the_covariance(noise: Noise) -> None:
    """Two ways: the innovations filter, and the Cholesky factor of the Toeplitz covariance."""
    covariance = linalg.toeplitz(noise.correlations(60)) * noise.variance
    filtered, logarithm = noise.whiten(np.eye(60))
    assert filtered @ covariance @ filtered.T == pytest.approx(np.eye(60), abs=1e-6)
    assert logarithm == pytest.approx(np.linalg.slogdet(covariance)[1], abs=1e-6)


def correlated(rng: np.random.Generator, n: int, phi: float) -> np.ndarray:
    e = rng.normal(size=n)
    for row in range(1, n):
        e[row] = phi * e[row - 1] + np.sqrt(1.0 - phi**2) * e[row]
    return e


@pytest.mark.all_seeds
def test_false_alarms_of_a_slope_in_correlated_noise() -> None:
    """At 5 %, correlation 0.6, 100 rows: independent rows would say so in a quarter of the series."""
    slope, one = np.linspace(-1.0, 1.0, 100)[:, None], np.ones((100, 1))
    series = [correlated(np.random.default_rng([seed, 3]), 100, 0.6) for seed in range(60)]
    assert sum(p_value_in_noise(y, one, slope) < 0.05 for y in series) <= 7
    assert sum(p_value_in_noise(y, one, slope, white=True) < 0.05 for y in series) >= 10
    assert sum(assess(y, one).noticed for y in series) >= 55


@pytest.mark.all_seeds
def test_silence_over_independent_noise_and_over_correlated_noise() -> None:
    alarms = [
        bool(explain_curve(problem_of(curve(correlated(np.random.default_rng([seed, 4]), 60, phi)))).missing)
        for seed in range(15)
        for phi in (0.0, 0.7)
    ]
    # 1 % and 5 % (docs/trials-curve.md): more than four of thirty comes once in a thousand times.
    assert sum(alarms) <= 4


def test_two_cycles_a_group_and_an_outlier_are_found() -> None:
    rng = np.random.default_rng(5)
    t = np.arange(160.0)
    y = 2.0 * np.sin(2 * np.pi * t / 23.7) + 1.5 * np.cos(2 * np.pi * t / 9.1) + 0.5 * rng.normal(size=160)
    y[70] += 6.0
    found = explain_curve(problem_of(curve(y)))
    assert [one.fitted.shape for one in found.missing] == ["sin", "sin"]
    for one, period in zip(found.missing, (23.7, 9.1), strict=True):
        assert one.fitted.value is not None
        assert one.searched.u is not None
        assert abs(one.fitted.value - period) < 4.0 * one.searched.u
    assert [one.row for one in found.suspect] == [70]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for file in EXAMPLE.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        (
            "campaign.toml",
            'response = "deflection_mm"',
            'response = "deflexion"',
            "did you mean 'deflection_mm'",
        ),
        ("campaign.toml", "base =", "bass =", "bass: this key is not known; did you mean 'base'?"),
        (
            "campaign.toml",
            "standard_uncertainty = 0.0001",
            "standard_uncertainty = -1",
            "must be greater than 0",
        ),
        ("data.csv", "load_N", "load (N)", "is not a name that a model can use"),
        ("data.csv", "anna,500", "anna,5oo", "'5oo' is not a number"),
        ("data.csv", ",deflection_mm", ",load_N", "names the column 'load_N' twice"),
    ],
)
def test_a_wrong_folder_is_refused(folder: Path, file: str, old: str, new: str, message: str) -> None:
    path = folder / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(CampaignError, match="(?s)" + __import__("re").escape(message)):
        read_campaign(folder)


def test_the_reader_tells_dates_labels_and_numbers_apart(folder: Path) -> None:
    found = read_campaign(folder)
    assert isinstance(found, CurveCampaign)
    assert found.time == "date"
    assert list(found.groups) == ["operator"]
    assert found.units == {"date": "d", "load_N": "N", "ambient_degC": "degC", "deflection_mm": "mm"}
    assert found.columns["date"][0] == 0.0
    assert found.columns["date"][-1] == pytest.approx(3.0694444)


def test_the_verbs(tmp_path: Path, capsys: Any) -> None:
    db = str(tmp_path / "m.duckdb")

    def typed(*words: str, status: int = 0) -> Any:
        assert main(["--db", db, *words]) == status
        told = capsys.readouterr()
        return json.loads(told.out) if "--json" in words else told

    assert typed("import", str(EXAMPLE)).out == "load-cell: imported, 44 rows\n"
    assert "nothing changed" in typed("import", str(EXAMPLE)).out
    compared = typed("compare", "load-cell", "--json")
    assert compared["verdict"] == "something is missing"
    assert compared["rms_um"] == pytest.approx(1e3 * compared["rms"])
    explained = typed("explain", "load-cell", "--json")
    assert compared.keys() <= explained.keys()
    assert [one["effect"] for one in explained["missing"]] == ["load_N:poly2", "operator:group"]
    first = explained["missing"][0]
    assert abs(first["amplitude"] + 3.1e-8) < 3.0 * first["u"]
    assert first["unit"] == "mm/N²"
    assert [one["sequence"] for one in explained["suspect_data"]] == [30]
    added = typed("model", "add", "load_N:poly2", "--to", "curve", "--campaign", "load-cell", "--json")
    assert added["model"] == "curve@2"
    history = typed("model", "history", "curve", "--campaign", "load-cell", "--json")
    assert [one["model"] for one in history] == ["curve", "curve@2"]
    assert history[1]["rms"] < history[0]["rms"] / 5.0
    identified = typed("identify", "load-cell", "--json")
    assert list(identified["runs"][0]["parameters"]) == ["constant", "load_N", "load_N:poly2"]
    assert list(identified["added"]) == ["load_N:poly2"]
    assert "is a curve, not a machine" in typed("uncertainty", "load-cell", status=2).err
    assert "no input" in typed("model", "add", "laod:poly2", "--to", "curve", status=2).err
    assert typed("model", "add", "EXX:reversal", "--to", "samba", status=2).err
    assert typed("verify", "--json")["ok"]
