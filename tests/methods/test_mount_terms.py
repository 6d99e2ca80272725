"""Terms of equatorial mounts, hidden by the published formulas of pointing analysts and found by the search.

The formulas are those of P. T. Wallace's TPOINT (IH, ID, CH, NP, ME, MA, TF, FO, HCES, HCEC, DCES, DCEC; PHH is a scale
of the hour angle), in corrections of hour angle and declination: nothing of the package's chain is in them.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain
from monitor.discovery.machine.missing import ChainMissing
from monitor.discovery.machine.mistakes.mistakes import find_mistakes
from monitor.discovery.machine.separation.alike import moves_alike
from monitor.effects import parse_effect
from monitor.exceptions import EffectError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.model import Model
from monitor.readers import read_campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

ARCSECOND = np.pi / 648000.0
LATITUDE = np.deg2rad(35.0)
#: Every mount has these, arcseconds; the model has them too.
GEOMETRY = {"IH": 100.0, "ID": -60.0, "CH": -80.0, "NP": 30.0, "ME": 90.0, "MA": -70.0}
SKY = """
[[setups]]
id = "sky"
reading = "direction"
standard_uncertainty_urad = 5.0
tool_direction = [1.0, 0.0, 0.0]
"""


def corrections(h: np.ndarray, d: np.ndarray, terms: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """What hour angle and declination as read lie above those of the star, rad."""
    size = {name: value * ARCSECOND for name, value in terms.items()}
    sine, cosine = np.sin(LATITUDE), np.cos(LATITUDE)
    east = size["IH"] + size["CH"] / np.cos(d) + size["NP"] * np.tan(d)
    east = east + (size["ME"] * np.sin(h) - size["MA"] * np.cos(h)) * np.tan(d)
    north = size["ID"] + size["ME"] * np.cos(h) + size["MA"] * np.sin(h)
    sag = size.get("TF", 0.0)
    east = east + sag * cosine * np.sin(h) / np.cos(d)
    north = north + sag * (cosine * np.cos(h) * np.sin(d) - sine * np.cos(d))
    north = north + size.get("FO", 0.0) * np.cos(h)
    east = east + size.get("HCES", 0.0) * np.sin(h) + size.get("HCEC", 0.0) * np.cos(h)
    north = north + size.get("DCES", 0.0) * np.sin(d) + size.get("DCEC", 0.0) * np.cos(d)
    return east + size.get("PHH", 0.0) * h, north


def night(folder: Path, seed: int, stars: int = 80, **hidden: float) -> Path:
    """A night of a fork mount within 85 degrees of the meridian, 15 degrees above the horizon; noise of 1 arcsecond in
    each direction across."""
    rng = np.random.default_rng(seed)
    h, d = np.deg2rad(rng.uniform(-85, 85, 40 * stars)), np.arcsin(rng.uniform(-0.64, 0.98, 40 * stars))
    high = np.sin(LATITUDE) * np.sin(d) + np.cos(LATITUDE) * np.cos(d) * np.cos(h) > np.sin(np.deg2rad(15.0))
    read_h, read_d = h[high][:stars], d[high][:stars]
    h, d = read_h, read_d
    for _ in range(8):
        east, north = corrections(h, d, GEOMETRY | hidden)
        h, d = read_h - east, read_d - north
    star = np.stack([np.cos(d) * np.cos(h), -np.cos(d) * np.sin(h), np.sin(d)], axis=1)
    noise = rng.normal(0.0, ARCSECOND, star.shape)
    star = star + noise - star * np.sum(star * noise, axis=1, keepdims=True)
    star /= np.linalg.norm(star, axis=1, keepdims=True)
    rows = [
        {"setup": "sky", "HA": a, "DEC": b, "direction_x": x, "direction_y": y, "direction_z": z}
        for a, b, (x, y, z) in zip(np.rad2deg(read_h), np.rad2deg(read_d), star, strict=True)
    ]
    axes = (
        SimulatedAxis("HA", "rotary", (0.0, 0.0, 1.0), sign=-1),
        SimulatedAxis("DEC", "rotary", (0.0, 1.0, 0.0), sign=-1),
    )
    chain = SimulatedChain(axes, gravity=(-np.cos(LATITUDE), 0.0, -np.sin(LATITUDE)))
    return chain.write(folder / f"night-{seed}", SKY, rows)


def missing(folder: Path) -> list[ChainMissing]:
    campaign = read_campaign(folder)
    problem = campaign_method(campaign).problem_of(campaign)
    answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    return list(answer.missing)


# FO turns DEC by the component of gravity across both axes, of which the cosine of the latitude is there.
TERMS: dict[str, tuple[dict[str, float], list[float]]] = {
    "fork:DEC@gravity": ({"FO": 30.0}, [-30.0 / np.cos(LATITUDE)]),
    "ECHA:harmonic1": ({"HCES": 25.0, "HCEC": -15.0}, [-15.0, -25.0]),
    "EBDEC:harmonic1": ({"DCES": 25.0, "DCEC": -15.0}, [-15.0, -25.0]),
    "ECHA:poly1": ({"PHH": 20.0}, [-20.0]),
    "flexure:tool@gravity": ({"TF": 60.0}, [-60.0]),
}


@pytest.mark.parametrize(
    "effect",
    [
        "fork:DEC@gravity",
        *(pytest.param(name, marks=pytest.mark.slow) for name in TERMS if "fork" not in name),
    ],
)
def test_a_term_of_an_equatorial_mount_is_found_with_its_size(effect: str, tmp_path: Path) -> None:
    """HA turns through 170 degrees, DEC through 120: parts of a turn, over which no flexure or refraction is a function
    of one axis alone. One of three nights may show one false effect: a scan has a false alarm in a hundred."""
    hidden, sizes = TERMS[effect]
    nights = [missing(night(tmp_path, seed, **hidden)) for seed in (11, 12, 13)]
    assert [findings[0].effect for findings in nights] == [effect] * 3
    assert sum(map(len, nights)) <= 4
    for first, *_ in nights:
        u = np.sqrt(np.diag(first.covariance)) / ARCSECOND
        # Products of the geometry are some 0.1 arcseconds in the formulas, which are of first order.
        assert np.all(np.abs(first.coefficients / ARCSECOND - sizes) < 4.0 * u + 0.3)


def test_a_mount_that_hides_nothing_shows_no_bend_of_an_axis(tmp_path: Path) -> None:
    assert [missing(night(tmp_path, seed)) for seed in range(20, 30)] == [[]] * 10


def test_a_fork_carries_an_axis_that_turns_across_it(tmp_path: Path) -> None:
    campaign = read_campaign(night(tmp_path, 5, stars=20))
    method = campaign_method(campaign)
    with pytest.raises(EffectError, match=r"HA is no turning axis across another .* here these are DEC"):
        method.problem_of(campaign, Model("fork", added=("fork:HA@gravity",)))
    solved = solve_problem(method.problem_of(campaign, Model("fork", added=("fork:DEC@gravity",))))
    assert solved.common.shape == (1,)


def test_a_free_shape_of_a_mount_is_compared_at_any_pose(tmp_path: Path) -> None:
    """`explain` ended with "operands could not be broadcast together"."""
    campaign = read_campaign(night(tmp_path, 1))
    context = campaign_method(campaign).problem_of(campaign).context
    hat, wave = (parse_effect(f"EBDEC:{shape}", context.chain) for shape in ("free(7)", "harmonic1"))
    assert not moves_alike(context, hat, np.array([1e-5]), wave, {})
    assert moves_alike(context, hat, np.array([1e-5]), hat, {})


def with_columns(folder: Path, change: Callable[[dict[str, str]], dict[str, str]]) -> Path:
    """Rewrite the rows of a night."""
    with (folder / "probings.csv").open(encoding="utf-8") as file:
        rows = [change(row) for row in csv.DictReader(file)]
    with (folder / "probings.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return folder


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda row: row | {"ha_deg": repr(float(row["ha_deg"]) / 15.0)},
            "ha_deg was in hours (15 degrees each)",
        ),
        (
            lambda row: row | {"dec_deg": repr(90.0 - float(row["dec_deg"]))},
            "dec_deg was counted from 90 degrees (a zenith or polar distance)",
        ),
        (
            lambda row: row | {"direction_y": repr(-float(row["direction_y"]))},
            "the directions were mirrored (`azimuth_from` of their mapping counts the other way round",
        ),
    ],
)
def test_angles_as_an_observatory_writes_them_are_named(
    change: Callable[[dict[str, str]], dict[str, str]], words: str, tmp_path: Path
) -> None:
    """Was: did not converge, check everything."""
    campaign = read_campaign(with_columns(night(tmp_path, 3, stars=40), change))
    mistakes = find_mistakes(campaign, campaign_method(campaign).problem_of, None)
    assert any(words in mistake.what for mistake in mistakes), mistakes
