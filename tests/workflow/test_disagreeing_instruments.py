"""Instruments that disagree by more than chance are a ground against a certificate: one of them was read wrongly."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import scipy

from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting.certificate.grounds import GroundKind, ground_sentence
from monitor.reporting.texts import texts_of
from monitor.store import Database
from monitor.workflow.certificate.grounds import grounds_against
from monitor.workflow.instruments.instruments import K, disagreement, limit_of
from monitor.workflow.models import resolve
from tests.simulator import four_instruments as shop, horizontal_centre as centre

#: A horizontal centre whose readings of three times the stated scatter were refused by what the instruments state.
REFUSED = 0


def week(folder: Path, seed: int, sign: float = 1.0, which: str = "both") -> Campaign:
    """A laser and a ball bar on a machine without a pitch; the readings of the bar times ``sign``."""
    rng = np.random.default_rng(seed)
    chain = shop.machine(0.0)
    laser, bar = shop.laser(chain, rng, 1), shop.ball_bar(chain, rng, 10.0)
    for row in bar[1]:
        row["reading_um"] = sign * float(row["reading_um"])  # type: ignore[arg-type]
    parts = {"both": (laser, bar), "laser": (laser,), "bar": (bar,)}[which]
    text = "".join(setups for setups, _ in parts)
    campaign = read_campaign(chain.write(folder / which, text, [row for _, of in parts for row in of]))
    assert isinstance(campaign, Campaign)
    return campaign


def grounds(campaign: Campaign) -> dict:
    """The grounds against a certificate of run 1, by their kind, but that these lasers state nothing of their scale."""
    with Database(":memory:") as db:
        model = resolve(db, None, campaign.method)
    every = grounds_against(campaign, model, {1: None})
    return {ground.kind: ground for ground in every if ground.kind is not GroundKind.SCALE}


def gain(campaign: Campaign, name: str) -> tuple[float, float]:
    """A gain and its standard uncertainty by the readings of a campaign alone."""
    result = campaign_method(campaign).identify(campaign)
    (run,), at = result.runs, result.parameters.index(name)
    return float(run.estimate[at]), float(np.sqrt(run.covariance[at, at]))


def test_a_bar_read_with_the_other_sign_is_refused_beside_a_laser(tmp_path: Path) -> None:
    """E_n is that of two campaigns of their own (ISO/IEC 17043:2010, B.3.1.3 e), fitted apart."""
    ground = grounds(week(tmp_path / "wrong", 31, -1.0))[GroundKind.INSTRUMENTS]
    parameter, _, names = ground.subject.partition(": ")
    assert names == "laser interferometer, ball bar"
    values = [gain(week(tmp_path / "apart", 31, -1.0, which), parameter) for which in ("laser", "bar")]
    (first, u_first), (second, u_second) = values
    e_n = abs(first - second) / (2.0 * math.hypot(u_first, u_second))
    assert ground.size == pytest.approx(e_n, rel=0.02)
    assert ground.size > 3.0 > ground.limit > 1.5
    assert f"disagree in {ground.subject}, E_n = " in ground_sentence(ground, texts_of("en"))
    assert "widersprechen sich in" in ground_sentence(ground, texts_of("de"))


def runs_with_a_bar(folder: Path, off: float, runs: int) -> Campaign:
    """A laser and a ball bar, ``off`` its stated length by so much, once in each of so many runs."""
    chain, rows, text = shop.machine(0.0), [], ""
    for run in range(1, runs + 1):
        rng = np.random.default_rng(run)
        instruments = (shop.laser(chain, rng, 1), shop.ball_bar(chain, rng, 10.0, off))
        text = "".join(setups for setups, _ in instruments)
        rows += [{**row, "run": run} for _, of in instruments for row in of]
    started = [f"2026-03-{run:02d}T20:00:00+00:00" for run in range(2, runs + 2)]
    campaign = read_campaign(chain.write(folder / f"runs-{runs}", text, rows, started=started))
    assert isinstance(campaign, Campaign)
    return campaign


def test_runs_do_not_vouch_for_the_same_wrong_bar_in_each_other(tmp_path: Path) -> None:
    """The laser of one run calibrates the bar of another, and would make it right by what it is wrong."""
    off = 15.0 * shop.BAR_U
    for runs in (1, 2):
        ground = grounds(runs_with_a_bar(tmp_path / "wrong", off, runs))[GroundKind.INSTRUMENTS]
        assert ground.size > 2.0 > ground.limit
    assert GroundKind.INSTRUMENTS not in grounds(runs_with_a_bar(tmp_path / "right", shop.BAR_U, 2))


def test_instruments_that_agree_are_no_ground(tmp_path: Path) -> None:
    for seed in range(31, 36):
        assert grounds(week(tmp_path / str(seed), seed)) == {}


def test_the_limit_is_that_of_the_largest_of_independent_comparisons() -> None:
    """Bonferroni's bound: the largest of 11 normal differences in units of 2 u, against its own distribution."""
    limit = limit_of(11, 1e-3)
    beyond = 1.0 - (1.0 - 2.0 * scipy.stats.norm.sf(K * limit)) ** 11
    assert beyond == pytest.approx(1e-3, rel=1e-3)


def scattering(folder: Path, only: str = "", otherwise: tuple[str, float] | None = None) -> Campaign:
    """Laser, ball bar and R-test on a horizontal centre, each scattering three times as much as it states."""
    rng, noise = np.random.default_rng(REFUSED), centre.scaled(REFUSED, 3.0)
    path = centre.campaign(folder / "shop", rng, noise=noise, only=only, otherwise=otherwise)
    campaign = read_campaign(path)
    assert isinstance(campaign, Campaign)
    return campaign


def scatter_of(campaign: Campaign) -> tuple[float, int]:
    """What the readings of one instrument scatter over what it states, and the degrees of freedom, by its own fit."""
    solution = solve_problem(campaign_method(campaign).problem_of(campaign))
    residual, read = solution.last.residual[0], np.any(solution.last.local[0] != 0.0, axis=1)
    freedom = int(np.count_nonzero(read)) - int(solution.rank[0])
    return float(np.sqrt(residual @ residual / freedom)), freedom


def test_right_instruments_that_scatter_three_times_as_stated_are_no_ground(tmp_path: Path) -> None:
    """By what they state alone this was refused; E_n is by their own scatter, and Student's t judges it."""
    campaign = scattering(tmp_path)
    assert GroundKind.INSTRUMENTS not in grounds(campaign)
    problem, ability = campaign_method(campaign).problem_of(campaign), campaign_method(campaign).instruments
    apart = disagreement(problem, solve_problem(problem), ability, doubtful=1.0)
    assert apart is not None
    assert apart.degrees_of_freedom is not None
    names = {"laser interferometer": "laser", "ball bar": "bar", "R-test": "r-test"}
    values = []
    for name in (apart.first, apart.second):
        alone = scattering(tmp_path / names[name], names[name])
        scatter, freedom = scatter_of(alone)
        value, u = gain(alone, apart.parameter)
        values.append((value, scatter * u, freedom))
    (first, u_first, nu_first), (second, u_second, nu_second) = values
    u = math.hypot(u_first, u_second)
    assert apart.e_n == pytest.approx(abs(first - second) / (2.0 * u), rel=0.03)
    # JCGM 100:2008, G.2b.
    freedom = u**4 / (u_first**4 / nu_first + u_second**4 / nu_second)
    assert apart.degrees_of_freedom == pytest.approx(freedom, rel=0.05)
    by_t = apart.comparisons * 2.0 * scipy.stats.t.sf(K * apart.e_n, apart.degrees_of_freedom)
    assert apart.by_chance == pytest.approx(min(1.0, by_t), rel=1e-6)
    by_statement = 2.0 * apart.comparisons * scipy.stats.norm.sf(K * apart.e_n * 3.0)
    assert by_statement < 1e-3


def test_the_other_sign_is_refused_where_the_readings_scatter_three_times_as_stated(tmp_path: Path) -> None:
    for setups, factor in (("r-test", -1.0), ("r-test", 1e-3), ("bar", -1.0)):
        campaign = scattering(tmp_path / f"{setups}{factor}", otherwise=(setups, factor))
        assert GroundKind.INSTRUMENTS in grounds(campaign), setups


def test_the_limit_of_a_scatter_with_few_degrees_of_freedom_is_that_of_student() -> None:
    assert limit_of(11, 1e-3, 8.0) == pytest.approx(scipy.stats.t.isf(1e-3 / 22.0, 8.0) / K)
