"""A run that is unlike the others is named with how it is unlike: at rates over seeds, in the independent simulator."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from monitor.discovery.machine.explain import variants_of_campaign
from monitor.discovery.machine.fit import fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.surroundings import surroundings_of
from monitor.discovery.machine.suspects.runs_apart import RunApart, runs_apart
from monitor.methods.samba.method import problem_of
from monitor.records import Campaign
from monitor.reporting.machine_finding import MachineFinding, machine_sentences
from monitor.workflow.explain.explain_answer import UnlikeRun


def apart(campaign: Campaign) -> tuple[RunApart, ...]:
    """The runs apart under the plain model, every drift of the catalogue asked."""
    problem = problem_of(campaign)
    surroundings = surroundings_of(campaign, problem)
    variants = variants_of_campaign(campaign, problem, surroundings.drivers)
    drifts = [variant for variant in variants if variant.family.endswith("@run_time")]
    return runs_apart(scene_of(fit(problem), drifts))


def spoil(campaign: Campaign, told: dict[str, Any], run: int, added: np.ndarray) -> None:
    """Add errors (n, 3) in µm to the readings of one run."""
    rows = told["run"] == run
    for index, axis in enumerate("XYZ"):
        campaign.probings.readings[axis][rows] += 1e-3 * added[: int(rows.sum()), index]


def test_a_run_whose_readings_scatter_is_named(virtual_campaigns, seeds):
    """Run 3 of eight has 4 µm beside 1 µm, so it leaves 4.1 times as much, and neighbours do not go together."""
    for seed in seeds(20, 2):
        campaign, told = virtual_campaigns.virtual(62000 + seed, days=2)
        spoil(campaign, told, 3, 4.0 * np.random.default_rng(seed).standard_normal((62, 3)))
        (found,) = apart(campaign)
        assert found.run == 3
        assert found.times == pytest.approx(4.1, rel=0.25)
        assert found.neighbours < 0.25


def test_a_slow_wave_of_one_run_is_named_as_wandering(virtual_campaigns, seeds):
    for seed in seeds(20, 2):
        campaign, told = virtual_campaigns.virtual(62100 + seed, days=2)
        phase = 2.0 * np.pi * 1.3 * np.linspace(0.0, 1.0, 62) + seed
        spoil(campaign, told, 2, 6.0 * np.sin(phase)[:, None] * np.array([0.0, 1.0, 0.0]))
        (found,) = apart(campaign)
        assert found.run == 2
        assert found.neighbours > 0.25


def test_runs_alike_are_not_named(virtual_campaigns, seeds):
    """White noise, heavy tails, and neighbours alike by 0.6 in every run."""

    def tails(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
        return rng.standard_t(3, (len(run), 3)) / np.sqrt(3.0)

    def alike(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
        noise = rng.standard_normal((len(run), 3))
        for row in range(1, len(run)):
            if run[row] == run[row - 1]:
                noise[row] = 0.6 * noise[row - 1] + 0.8 * noise[row]
        return noise

    for seed in seeds(100, 1):
        for options in ({}, {"noise": tails}, {"noise": alike}):
            campaign, _ = virtual_campaigns.virtual(62200 + seed, days=1, **options)
            assert apart(campaign) == ()


@pytest.mark.parametrize(
    ("neighbours", "as_if", "says"),
    [
        (0.0, None, "see whether probe, tip and targets sat firmly"),
        (0.6, None, "wandering slowly: look for what warmed"),
        (0.6, "EB0Z", "as if EB0Z drifted while it was measured"),
    ],
)
def test_a_run_apart_is_told_in_a_sentence(neighbours: float, as_if: str | None, says: str) -> None:
    finding = MachineFinding(
        explained=True,
        missing=[],
        bad_points=0,
        moves=[],
        limits=[],
        most_bad_points=40,
        unfitted=[],
        hopeless=False,
        mistakes=[],
        unlike_runs=[UnlikeRun(2, 2.3, 2.2, neighbours, 1e-9, as_if)],
    )
    text = machine_sentences(finding)
    assert "Run 2 leaves 2.3 times as much as the others (2.2 µm in a reading)" in text
    assert says in text
