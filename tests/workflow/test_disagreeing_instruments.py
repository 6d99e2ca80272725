"""Instruments that disagree by more than chance are a ground against a certificate: one of them was read wrongly."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import scipy

from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting.certificate.grounds import GroundKind, ground_sentence
from monitor.reporting.texts import texts_of
from monitor.store import Database
from monitor.workflow.certificate.grounds import grounds_against
from monitor.workflow.instruments.instruments import K, limit_of
from monitor.workflow.models import resolve
from tests.simulator import four_instruments as shop


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
    """The grounds against a certificate of run 1, by their kind."""
    with Database(":memory:") as db:
        model = resolve(db, None, campaign.method)
    return {ground.kind: ground for ground in grounds_against(campaign, model, {1: None})}


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


def test_instruments_that_agree_are_no_ground(tmp_path: Path) -> None:
    for seed in range(31, 36):
        assert grounds(week(tmp_path / str(seed), seed)) == {}


def test_the_limit_is_that_of_the_largest_of_independent_comparisons() -> None:
    """Bonferroni's bound: the largest of 11 normal differences in units of 2 u, against its own distribution."""
    limit = limit_of(11, 1e-3)
    beyond = 1.0 - (1.0 - 2.0 * scipy.stats.norm.sf(K * limit)) ** 11
    assert beyond == pytest.approx(1e-3, rel=1e-3)
