"""Setups that only seem to contradict each other: noise that follows itself moves whole setups.

Simulated without a line of the package: a laser on three axes, a ball bar in three planes and an R-test.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from monitor.discovery import Fit, fit
from monitor.discovery.machine.noise.by_setup import whitening_by_setup
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.workflow.instruments.against_others import against_others, contradiction_in
from tests.simulator import four_instruments as shop

#: A reading's noise in µm, and its correlation with the reading before it of the same setup.
NOISE_UM, RHO = 0.4, 0.8
#: From one place of the bar to the next.
STEP_DEG = 15.0
#: A seed of which readings that were independent would contradict each other.
SEEMING = 4
READ = ("reading_um", "dx_um", "dy_um", "dz_um")


class _Still:
    """Draws nothing: what is written is exact."""

    def normal(self, mean: float, _: float, size: int | None = None) -> float | np.ndarray:
        return mean if size is None else np.full(size, mean)


@pytest.fixture(scope="module")
def exact(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    chain, still = shop.machine(0.0), _Still()
    parts = [shop.laser(chain, still, 1), shop.ball_bar(chain, still, STEP_DEG), shop.r_test(chain, still)]
    text = "".join(text for text, _ in parts)
    for stated in (shop.LASER, shop.LENGTH, shop.NEST):
        text = text.replace(
            f"standard_uncertainty_um = {1e3 * stated:g}\n", f"standard_uncertainty_um = {NOISE_UM}\n"
        )
    rows = [row for _, of in parts for row in of]
    campaign = read_campaign(chain.write(tmp_path_factory.mktemp("exact") / "week", text, rows))
    assert isinstance(campaign, Campaign)
    return campaign


def _noisy(campaign: Campaign, seed: int, rho: float = RHO, off_um: float = 0.0) -> Campaign:
    """The campaign with noise that follows itself within every setup; one plane of the bar reads ``off_um`` times the
    cosine of twice the angle of the arm more, as where its readings are of another plane."""
    rng, probings = np.random.default_rng(seed), campaign.probings
    channels = {name: np.array(values) for name, values in probings.channels.items()}
    for setup in dict.fromkeys(probings.target.tolist()):
        rows = np.flatnonzero(probings.target == setup)
        for name in READ:
            if not np.isfinite(channels[name][rows]).all():
                continue
            drawn = rng.normal(size=len(rows))
            for number in range(1, len(rows)):
                drawn[number] = rho * drawn[number - 1] + np.sqrt(1.0 - rho**2) * drawn[number]
            channels[name][rows] += NOISE_UM * drawn
        if setup == "bar-zx":
            there = np.arange(0.0, 361.0, STEP_DEG)
            channels["reading_um"][rows] += off_um * np.cos(2.0 * np.deg2rad([*there, *there[::-1]]))
    return replace(campaign, probings=replace(probings, channels=channels))


def _fitted(campaign: Campaign) -> Fit:
    return fit(campaign_method(campaign).problem_of(campaign))


def _told(campaign: Campaign) -> tuple[bool, bool]:
    """Whether setups contradict each other: of readings taken for independent, with noise of neighbours allowed for."""
    found, ability = _fitted(campaign), campaign_method(campaign).instruments
    white = against_others(found.problem, found.solution, ability)
    return white is not None, contradiction_in(found, ability) is not None


@pytest.mark.slow
def test_noise_that_follows_itself_is_no_contradiction(exact: Campaign, seeds) -> None:
    """Of healthy machines, read with a correlation of 0.8, 1 % may be told by chance: 1 of 100; taken for independent
    readings it is 44."""
    told = np.array([_told(_noisy(exact, seed)) for seed in seeds(100, 20)])
    as_if_white, allowed_for = told.mean(axis=0)
    assert as_if_white > 0.2
    assert allowed_for <= 0.05


def test_a_healthy_machine_read_with_such_noise_does_not_contradict_itself(exact: Campaign) -> None:
    assert _told(_noisy(exact, SEEMING)) == (True, False)


@pytest.mark.parametrize("rho", [0.0, RHO])
def test_a_setup_that_reads_something_else_contradicts_still(exact: Campaign, seeds, rho: float) -> None:
    told = [_told(_noisy(exact, seed, rho, 4.0))[1] for seed in seeds(20, 1)]
    assert all(told)


def test_what_setups_leave_by_themselves_is_noise_whatever_they_contradict(exact: Campaign) -> None:
    for off in (0.0, 20.0):
        whitening = whitening_by_setup(_fitted(_noisy(exact, 5, off_um=off)))
        assert whitening is not None
        assert 0.6 <= whitening.correlation.rho <= 0.9
        assert whitening_by_setup(_fitted(_noisy(exact, 6, 0.0, off))) is None
