"""An error that drifts through one run of several is named with its run: at rates over seeds, in the independent
simulator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery.machine.explain import variants_of_campaign
from monitor.discovery.machine.fit import fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.drifts_of_runs import drifts_of_runs
from monitor.discovery.machine.surroundings import surroundings_of
from monitor.methods.samba.method import problem_of
from monitor.records import Campaign


def tilting(run: int) -> Callable[[np.ndarray, np.ndarray, Any], np.ndarray]:
    """A tilt of Z that grows evenly through one run: a shift in proportion to Z and to the time."""
    return lambda position, travel, now: position / 100.0 * now.run_fraction * (now.run == run)


def proposed(campaign: Campaign) -> set[str]:
    """The drifts of one run that stand out under the plain model."""
    problem = problem_of(campaign).for_search()
    drivers = surroundings_of(campaign, problem).drivers
    variants = variants_of_campaign(campaign, problem, drivers)
    drifts = [variant for variant in variants if variant.family.endswith("@run_time")]
    return {variant.effect.text for variant in drifts_of_runs(scene_of(fit(problem), drifts), (), 0.01)}


@pytest.mark.parametrize(("error", "name"), [("EXZ", "EB0Z"), ("EYZ", "EYZ:poly1")])
def test_a_tilt_that_grows_in_one_run_stands_out(virtual_campaigns, seeds, error, name):
    """8 µm at the end of run 2 of four, 1 µm noise."""
    sim = simulator()
    campaigns = seeds(20, 2)
    found = 0
    for seed in campaigns:
        hidden = sim.Effect(f"{error}:curve", peak_um=8.0, curve=tilting(2))
        found += f"{name}@run_time(2)" in proposed(
            virtual_campaigns.virtual(64500 + seed, [hidden], days=1)[0]
        )
    assert found >= 0.9 * len(campaigns)


def test_nothing_stands_out_where_nothing_drifts_or_every_run_walks(virtual_campaigns, seeds):
    def walk(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
        noise = 0.7 * rng.standard_normal((len(run), 3))
        steps = 0.25 * rng.standard_normal((len(run), 3))
        for number in np.unique(run):
            noise[run == number] += np.cumsum(steps[run == number], axis=0)
        return noise

    campaigns = seeds(100, 3)
    alarms = sum(
        bool(proposed(virtual_campaigns.virtual(64600 + seed, days=1, **options)[0]))
        for seed in campaigns
        for options in ({}, {"noise": walk})
    )
    assert alarms <= max(len(campaigns) // 15, 1)


@pytest.mark.slow
def test_a_tilt_of_one_run_is_named_or_tied_and_no_ball_moved(virtual_campaigns, explained, seeds):
    """Before: nothing, or two balls that moved; a temperature that happens to change in that run alone ties."""
    sim = simulator()
    for seed in seeds(10, 1):
        hidden = sim.Effect("EYZ:curve", peak_um=20.0, curve=tilting(3))
        told = explained(virtual_campaigns.virtual(64700 + seed, [hidden], days=1)[0])
        named = {
            name for effect in told.missing for name in (effect.effect, *(r.effect for r in effect.rivals))
        }
        assert "EYZ:poly1@run_time(3)" in named
        assert told.moves == ()
