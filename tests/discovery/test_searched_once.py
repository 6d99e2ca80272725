"""What is not searched twice: what stands under conditions that hardly differ or under other noise, and edges that
cannot be worth it."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from monitor.discovery import explain, fit
from monitor.discovery.machine.found_again import Found, found_in_other_noise, is_steady, still_found
from monitor.discovery.machine.noise.correlation import Correlation, is_next
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.search import first_found, search_chain
from monitor.discovery.machine.shapes import edges
from monitor.discovery.machine.shapes.free_parts import most_together, priced
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of

TEXTS = ("EXX:poly2", "EYX:poly2", "ECC:harmonic2", "EXC:harmonic2", "EXX:reversal", "EZZ:poly3")


@pytest.fixture(scope="module")
def searched(virtual_campaigns):
    """A scene of white noise with two hidden effects, its variants, and what a search finds."""
    simulator = virtual_campaigns.simulator()
    hidden = [simulator.Effect("EYX:poly2", peak_um=6.0), simulator.Effect("EXC:harmonic2", peak_um=6.0)]
    campaign, _ = virtual_campaigns.virtual(5, hidden, days=1, runs_per_day=4)
    fitted = fit(problem_of(campaign).for_search())
    chain = fitted.problem.context.chain
    variants = [variant for text in TEXTS for variant in variants_of(parse_effect(text, chain))]
    return (fitted, variants, *search_chain(scene_of(fitted, variants), (), 0.01))


@pytest.mark.parametrize(
    "noise", [Correlation(0.1, 0.1), Correlation(0.1, 0.2)], ids=["hardly correlated", "a little more"]
)
def test_what_a_scan_neither_adds_to_nor_takes_from_is_found_again(searched, noise):
    fitted, variants, scene, result = searched
    under = scene_of(fitted.with_correlation(noise), variants)
    again = still_found(under, Found(scene, result), (), 0.01)
    assert again is not None
    names = [each.effect.text for each in again.candidates]
    assert sorted(names) == sorted(each.effect.text for each in result.candidates)
    _, anew = search_chain(under, (), 0.01)
    assert names == [each.effect.text for each in anew.candidates]


@pytest.mark.parametrize("change", ["one less", "one more"])
def test_what_a_scan_adds_to_or_takes_from_is_searched_anew(searched, change):
    _, _, scene, result = searched
    findings = result.findings[:1]
    if change == "one more":
        candidate = next(each for each in scene.candidates if each.effect.text == "EZZ:poly3")
        evidence = result.findings[0].evidence._replace(candidate=candidate)
        findings = (*result.findings, replace(result.findings[0], evidence=evidence))
    assert still_found(scene, Found(scene, replace(result, findings=findings)), (), 0.01) is None


def named_as(result, *texts):
    """A result of which the findings, the same evidence for all, are those of other candidates of its scene."""
    scene, found = result
    candidates = [next(each for each in scene.candidates if each.effect.text == text) for text in texts]
    like = found.findings[0]
    findings = tuple(
        replace(like, evidence=like.evidence._replace(candidate=candidate)) for candidate in candidates
    )
    return Found(scene, replace(found, findings=findings))


MUCH = Correlation(0.6, 0.5)


@pytest.mark.parametrize("besides", [False, True], ids=["the same", "with a drift of noise"])
def test_steady_effects_stand_under_other_noise_and_drifts_that_are_noise_fall(searched, besides):
    fitted, variants, _, result = searched
    chain = fitted.problem.context.chain
    drift = variants_of(parse_effect("EXX:poly2@run_time", chain))
    with_drifts = scene_of(fitted, [*variants, *drift])
    names = sorted(each.effect.text for each in result.candidates)
    drifting = [each.effect.text for each in with_drifts.candidates if "@" in each.effect.text][:1]
    earlier = named_as((with_drifts, result), *names, *(drifting if besides else []))
    under = scene_of(fitted.with_correlation(MUCH), [*variants, *drift])
    again = found_in_other_noise(under, lambda: first_found(under, (), 0.01), earlier, (), 0.01)
    assert again is not None
    assert sorted(each.effect.text for each in again.result.candidates) == names
    _, anew = search_chain(under, (), 0.01)
    assert [each.effect.text for each in again.result.candidates] == [
        each.effect.text for each in anew.candidates
    ]


@pytest.mark.parametrize(
    "texts",
    [("EYX:poly2",), ("EYX:poly2", "EXC:harmonic2", "EZZ:poly3"), ("EZZ:poly3",)],
    ids=["one less", "a steady one more", "another one"],
)
def test_what_a_scan_adds_or_a_steady_effect_that_falls_is_searched_anew_under_other_noise(searched, texts):
    fitted, variants, scene, result = searched
    under = scene_of(fitted.with_correlation(MUCH), variants)
    first = first_found(under, (), 0.01)
    assert found_in_other_noise(under, lambda: first, named_as((scene, result), *texts), (), 0.01) is None


def test_a_drift_stands_under_other_noise_where_the_first_scan_names_it_too(virtual_campaigns):
    simulator = virtual_campaigns.simulator()
    hidden = [
        simulator.Effect("EYX:poly2", peak_um=8.0),
        simulator.Effect("EXX:poly2@run_time", peak_um=12.0),
    ]
    campaign, _ = virtual_campaigns.virtual(5, hidden, days=1, runs_per_day=4)
    fitted = fit(problem_of(campaign).for_search())
    chain = fitted.problem.context.chain
    texts = (*TEXTS, "EXX:poly2@run_time")
    variants = [variant for text in texts for variant in variants_of(parse_effect(text, chain))]
    earlier = search_chain(scene_of(fitted, variants), ("run_time",), 0.01)
    under = scene_of(fitted.with_correlation(Correlation(0.3, 0.5)), variants)
    first = first_found(under, ("run_time",), 0.01)
    again = found_in_other_noise(under, lambda: first, earlier, ("run_time",), 0.01)
    assert again is not None
    assert {each.effect.text for each in again.result.candidates} == {"EYX:poly2", "EXX:poly2@run_time"}
    steady = replace(first, findings=tuple(each for each in first.findings if is_steady(each.candidate)))
    assert found_in_other_noise(under, lambda: steady, earlier, ("run_time",), 0.01) is None


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ((0.6, 0.8), (0.7, 0.8), True),
        ((0.7, 0.89), (0.6, 0.8), True),
        ((0.6, 0.8), (0.8, 0.8), False),
        ((0.6, 1.0), (0.6, 0.97), False),
        ((0.6, 0.8), (0.6, 0.8), False),
    ],
)
def test_noise_hardly_differs_one_step_of_the_grid_apart(first, second, expected):
    assert is_next(Correlation(*first), Correlation(*second)) is expected
    assert not is_next(None, Correlation(*second))
    assert not is_next(Correlation(*first, frame=1), Correlation(*second))


def test_no_new_effect_and_others_that_stay_are_worth_more_than_their_bound(searched):
    _, _, scene, _ = searched
    leading, *others = scene.candidates[:5]
    for new in scene.candidates[5:]:
        bound = most_together(scene, new, [leading], others[:3])
        for count in range(4):
            for staying in combinations(others[:3], count):
                assert priced(scene, [leading, new, *staying]) <= bound + 1e-6


@pytest.mark.slow
def test_edges_that_cannot_be_worth_it_change_no_answer(virtual_campaigns, monkeypatch):
    """A step in a scale beside an effect of the catalogue, with and without the bound."""
    simulator = virtual_campaigns.simulator()
    step = simulator.Effect("EXX:curve", peak_um=5.0, curve=lambda q, travel, now: np.tanh((q - 12.0) / 4.0))
    hidden = [step, simulator.Effect("EZZ:poly3", peak_um=6.0)]
    campaign, _ = virtual_campaigns.virtual(11, hidden, days=1, runs_per_day=4)
    answers = []
    for leeways in ((edges.LEEWAY_OF_STEPS, edges.LEEWAY_OF_TEETH), (np.inf, np.inf)):
        monkeypatch.setattr(edges, "LEEWAY_OF_STEPS", leeways[0])
        monkeypatch.setattr(edges, "LEEWAY_OF_TEETH", leeways[1])
        answer = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))
        answers.append([(each.effect, each.amplitude) for each in answer.missing])
    assert answers[0] == answers[1]
    assert {effect.partition(":")[0] for effect, _ in answers[0]} == {"EXX", "EZZ"}
