"""The whole way: what is hidden leads, groups are named, campaigns of other kinds. The full trial is in
tests/benchmarks/trial_discovery.py; here a few seeds of each."""

from __future__ import annotations

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import Verdict, explain
from monitor.effects.catalogue import catalogue, drivers_of
from monitor.effects.words import describe
from monitor.methods.model import Model
from monitor.methods.samba.method import problem_of


def names(found):
    return {found.effect, *(rival.effect for rival in found.rivals)}


@pytest.mark.parametrize(
    ("effect", "options"),
    [
        pytest.param("EYY:cyclic16mm", {"direction": (1.0, -0.4)}, marks=pytest.mark.slow),
        pytest.param("EB0C@run_time", {}, marks=pytest.mark.slow),
        ("stem:gravity", {"targets": ("3",)}),
        # Of their kinds the labelled campaigns and other tests have one each.
        pytest.param("artefact:expansion@run_time", {}, marks=pytest.mark.all_seeds),
        pytest.param("EZC:const@gravity", {"direction": (1.0, 0.5, 0.2)}, marks=pytest.mark.slow),
        pytest.param("EXX:poly2", {}, marks=pytest.mark.all_seeds),
        pytest.param("EBZ:poly3", {}, marks=pytest.mark.all_seeds),
        pytest.param("EXC:harmonic3", {"direction": (0.3, 1.0)}, marks=pytest.mark.all_seeds),
        pytest.param("EZC1:const@warmup", {"tau_s": 6000.0}, marks=pytest.mark.slow),
        pytest.param("EZC1:const@x_axis_degC", {}, marks=pytest.mark.slow),
        pytest.param("EAY:poly2", {}, marks=pytest.mark.all_seeds),
    ],
)
def test_a_hidden_effect_leads_or_stands_in_the_leading_group(virtual_campaigns, explained, effect, options):
    sim = simulator()
    campaign, _ = virtual_campaigns.virtual(21, [sim.Effect(effect, peak_um=8.0, **options)])
    answer = explained(campaign)
    assert len(answer.missing) == 1
    (found,) = answer.missing
    assert effect in names(found)
    # A group that names everything would be no answer.
    assert len(found.rivals) <= 6
    assert found.held_out_after == pytest.approx(1e-3, rel=0.03)
    assert effect not in answer.blind


@pytest.mark.slow
def test_three_effects_are_found_one_after_the_other_and_the_error_falls(virtual_campaigns, explained):
    sim = simulator()
    hidden = [
        sim.Effect("EXX:reversal", peak_um=5.0),
        sim.Effect("EBB:harmonic2", peak_um=5.0, direction=(1.0, 1.0)),
        sim.Effect("EZC1:const@warmup", peak_um=8.0, tau_s=2400.0),
    ]
    answer = explained(virtual_campaigns.virtual(2, hidden)[0])
    assert {one.effect for one in answer.missing} == {one.name for one in hidden}
    assert [one.rank for one in answer.missing] == [1, 2, 3]
    for before, after in zip(answer.missing, answer.missing[1:], strict=False):
        assert after.rms_before == pytest.approx(before.rms_after)
        assert after.held_out_before == pytest.approx(before.held_out_after)
    for one in answer.missing:
        assert one.rms_after < one.rms_before
        assert one.held_out_after < one.held_out_before
    assert answer.missing[-1].held_out_after == pytest.approx(1e-3, rel=0.03)


@pytest.mark.all_seeds
def test_growth_of_the_artefact_is_not_told_as_that_of_two_axes(virtual_campaigns, explained):
    sim = simulator()
    hidden = [
        sim.Effect("artefact:expansion@run_time", peak_um=6.0),
        sim.Effect("EXX:poly1@run_time", peak_um=6.0),
    ]
    answer = explained(virtual_campaigns.virtual(5009, hidden)[0])
    assert {one.effect for one in answer.missing} == {one.name for one in hidden}


@pytest.mark.slow
def test_the_plain_effect_leads_where_a_driver_hardly_varies(virtual_campaigns, explained, seeds):
    """Ambient less 20 °C varies by a tenth of itself: on few runs the two are the same, and both are told."""
    sim = simulator()
    plain = sim.Effect("EAX:poly1", peak_um=3.0)
    both = 0
    campaigns = seeds(6, 2)
    for seed in campaigns:
        campaign, _ = virtual_campaigns.virtual(700 + seed, [plain], days=2, runs_per_day=2)
        found = explained(campaign).missing[0]
        assert found.effect == "EAX:poly1"
        both += "EAX:poly1@ambient_degC" in names(found)
    assert both >= len(campaigns) / 2


@pytest.mark.slow
def test_a_pitch_that_nobody_knows_is_found_with_its_uncertainty(virtual_campaigns, explained):
    sim = simulator()
    hidden = sim.Effect("EYY:cyclic13.7mm", peak_um=5.0, direction=(1.0, 2.0))
    answer = explained(virtual_campaigns.virtual(2, [hidden], days=2)[0])
    (found,) = answer.missing
    assert found.searched.name == "pitch"
    assert abs(found.searched.value - 13.7) < 4 * found.searched.u
    assert found.searched.u < 0.01
    assert found.effect.startswith("EYY:cyclic13.")


@pytest.mark.parametrize(
    "options",
    [
        {"days": 1, "runs_per_day": 1},
        {"noise_um": 0.5, "stated_um": 1.0, "days": 2},
        {"with_channels": False, "days": 2},
        {"keep": lambda told: (told["run"] % 2 == 1) | (told["sequence"] < 50), "days": 2},
        pytest.param({"cold": True, "noise_um": 0.7}, marks=pytest.mark.all_seeds),
        pytest.param({"days": 1, "runs_per_day": 2}, marks=pytest.mark.all_seeds),
        pytest.param({"days": 3, "runs_per_day": 1}, marks=pytest.mark.all_seeds),
        pytest.param({"noise_um": 0.5, "stated_um": 1.0}, marks=pytest.mark.all_seeds),
        pytest.param({"stated_um": 1 / 1.2}, marks=pytest.mark.all_seeds),
        pytest.param({"with_channels": False}, marks=pytest.mark.all_seeds),
        pytest.param(
            {"keep": lambda told: (told["run"] % 2 == 1) | (told["sequence"] < 50)},
            marks=pytest.mark.all_seeds,
        ),
    ],
)
@pytest.mark.slow
def test_campaigns_of_other_kinds_with_and_without_an_effect(virtual_campaigns, explained, options):
    sim = simulator()
    assert explained(virtual_campaigns.virtual(41, **options)[0]).missing == ()
    (found,) = explained(
        virtual_campaigns.virtual(41, [sim.Effect("EXX:reversal", peak_um=6.0)], **options)[0]
    ).missing
    assert found.effect == "EXX:reversal"
    assert abs(found.amplitude) == pytest.approx(6e-3, abs=4 * found.u)


@pytest.mark.slow
def test_a_channel_with_empty_cells_is_refused_aloud(virtual_campaigns, explained):
    sim = simulator()
    campaign, _ = virtual_campaigns.virtual(1, [sim.Effect("EXX:reversal", peak_um=5.0)], days=2)
    campaign.probings.channels["x_axis_degC"][5] = np.nan
    answer = explained(campaign)
    assert [one.effect for one in answer.missing] == ["EXX:reversal"]
    refused = dict(answer.refused)
    assert "empty at 1 of 496 probings" in refused["EZC1:const@x_axis_degC"]


@pytest.mark.slow
def test_an_error_of_a_tenth_of_a_millimetre_is_still_one_effect(virtual_campaigns, explained):
    """Far beyond what is likely, and where curvature matters: a scale that shrinks everything is no answer."""
    sim = simulator()
    (found,) = explained(virtual_campaigns.virtual(1, [sim.Effect("EXX:reversal", peak_um=100.0)])[0]).missing
    assert found.effect == "EXX:reversal"
    assert abs(found.amplitude) == pytest.approx(0.1, rel=3e-3)


@pytest.mark.parametrize(
    "chosen", [(2,), *(pytest.param(runs, marks=pytest.mark.slow) for runs in ((3, 5, 9, 12), (4, 5)))]
)
@pytest.mark.slow
def test_runs_that_were_left_out_or_never_probed_do_not_matter(virtual_campaigns, explained, chosen):
    sim = simulator()
    campaign, _ = virtual_campaigns.virtual(
        1, [sim.Effect("EXX:reversal", peak_um=5.0)], keep=lambda told: np.isin(told["run"], chosen)
    )
    (found,) = explained(campaign).missing
    assert found.effect == "EXX:reversal"


def test_an_added_effect_is_missing_no_more_and_a_removed_one_is_again(virtual_campaigns):
    sim = simulator()
    campaign, _ = virtual_campaigns.virtual(2, [sim.Effect("EXX:reversal", peak_um=5.0)], days=2)
    rng = np.random.default_rng(1)
    grown = problem_of(campaign, Model("grown", added=("EXX:reversal",)))
    answer = explain(campaign, grown, "grown", rng=rng)
    assert answer.missing == ()
    assert answer.comparison.verdict is Verdict.EXPLAINED
    again = explain(campaign, problem_of(campaign), "samba", rng=rng)
    assert [one.effect for one in again.missing] == ["EXX:reversal"]


@pytest.mark.parametrize(
    "effect",
    [
        "EZC1:const@warmup",
        "EZC:const@gravity",
        pytest.param("EB0C@run_time", marks=pytest.mark.slow),
        pytest.param("artefact:expansion@run_time", marks=pytest.mark.slow),
    ],
)
def test_an_added_effect_that_follows_a_driver_is_missing_no_more(virtual_campaigns, effect):
    sim = virtual_campaigns.simulator()
    width = 3 if effect.endswith("gravity") else 1
    hidden = sim.Effect(effect, peak_um=8.0, direction=(1.0, 0.5, 0.2)[:width])
    campaign, _ = virtual_campaigns.virtual(3, [hidden], days=2)
    grown = problem_of(campaign, Model("grown", added=(effect,)))
    answer = explain(campaign, grown, "grown", rng=np.random.default_rng(1))
    assert answer.missing == ()
    assert answer.comparison.verdict is Verdict.EXPLAINED


@pytest.mark.all_seeds
def test_rates_over_forty_small_campaigns(virtual_campaigns, explained):
    """Nothing hidden, four runs: at 2 % a campaign, five or more alarms in 40, three in ten are a chance of 1e-3."""
    alarms = sum(
        bool(explained(virtual_campaigns.virtual(900 + seed, days=2, runs_per_day=2)[0]).missing)
        for seed in range(40)
    )
    assert alarms <= 4


@pytest.mark.all_seeds
def test_the_amplitude_lies_in_its_interval_as_often_as_stated(virtual_campaigns, explained):
    """40 campaigns of four runs: fewer than 33 inside their 95 % interval are a chance of 1e-3."""
    sim = simulator()
    inside = 0
    for seed in range(40):
        hidden = sim.Effect("EAX:poly1", peak_um=6.0)
        campaign, told = virtual_campaigns.virtual(700 + seed, [hidden], days=2, runs_per_day=2)
        found = explained(campaign).missing[0]
        assert found.effect == "EAX:poly1"
        inside += (
            abs(found.amplitude - float(np.atleast_1d(told["effects"][-1].coefficients)[0])) < 1.96 * found.u
        )
    assert inside >= 33


def test_every_effect_of_the_catalogue_has_words(virtual_campaigns):
    problem = problem_of(virtual_campaigns.virtual(1)[0])
    base = [effect.text for effect in problem.base]
    effects = catalogue(problem.context.chain, base, drivers_of(problem.context))
    assert len(effects) >= 120
    assert len({effect.text for effect in effects}) == len(effects)
    meanings = set()
    for effect in effects:
        words = describe(effect)
        for text in (words.meaning, words.cause, words.remedy):
            assert len(text.split()) >= 3, effect.text
        assert words.described_in.startswith(("ISO ", "docs/")), effect.text
        assert effect.unit.name, effect.text
        meanings.add(words.meaning)
    # Two effects with the same words could not be told apart by a reader.
    assert len(meanings) == len(effects)
