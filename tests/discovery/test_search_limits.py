"""What a search remembers, where it ends, and what it says that the data do not determine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import explain, fit
from monitor.discovery.machine.noise.correlation import Correlation, caution
from monitor.discovery.machine.rounds import Limit, most_cautious
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.refine import refine_all
from monitor.discovery.machine.shapes.variants import part_of_bend, part_of_period, variants_of
from monitor.discovery.search.candidate import Candidate, Variant
from monitor.discovery.search.evidence import weigh
from monitor.discovery.search.remainder import Remainders
from monitor.discovery.search.rounds import Turns, in_rounds
from monitor.discovery.search.sign_flips import effective_number
from monitor.effects import parse_effect
from monitor.methods.chain.least_squares import COMMON_RANK_TOLERANCE, _common_step
from monitor.methods.samba.method import problem_of
from monitor.reporting.machine_finding import LIMITS


@pytest.fixture(scope="module")
def drifting(virtual_campaigns):
    """A spindle that grows all day at nearly the same rate: a time constant of ten hours."""
    hidden = simulator().Effect(
        "EZC1:curve", peak_um=5.0, curve=lambda q, t, now: 1.0 - np.exp(-now.since_first_run_s / 36000.0)
    )
    campaign, _ = virtual_campaigns.virtual(3, [hidden], days=1, runs_per_day=2)
    return fit(problem_of(campaign))


def test_what_sets_of_effects_leave_agrees_with_least_squares(drifting):
    chain = drifting.problem.context.chain
    texts = ("EXX:poly2", "EYX:poly2", "ECC:harmonic2")
    scene = scene_of(drifting, [v for text in texts for v in variants_of(parse_effect(text, chain))])
    first, second, third = scene.candidates
    for selected in ([first], [first, third], [third, first], [second, third, first]):
        columns = np.concatenate([candidate.columns for candidate in selected], axis=1)
        expected = scene.residual - columns @ np.linalg.lstsq(columns, scene.residual, rcond=1e-9)[0]
        beside = scene.remainders.beside(selected)
        np.testing.assert_allclose(beside.residual, expected, atol=1e-7 * np.abs(scene.residual).max())
        rank = np.linalg.matrix_rank(columns / np.linalg.norm(columns, axis=0))
        assert beside.degrees_of_freedom == scene.degrees_of_freedom - rank
    assert scene.remainders.beside([first, third]) is scene.remainders.beside([third, first])


def test_only_so_much_is_remembered(monkeypatch, drifting):
    chain = drifting.problem.context.chain
    (variant,) = variants_of(parse_effect("EXX:poly2", chain))
    candidates = [scene_of(drifting, [replace(variant)]).candidates[0] for _ in range(4)]
    scene = scene_of(drifting, [variant])
    monkeypatch.setattr("monitor.discovery.search.remainder.MOST_NUMBERS", 2 * len(scene.residual))
    remainders = Remainders(scene.residual, scene.degrees_of_freedom, scene.columns)
    answers = [remainders.beside([candidate]) for candidate in candidates]
    assert remainders.beside([candidates[3]]) is answers[3]
    assert remainders.beside([candidates[0]]) is not answers[0]


def test_a_time_constant_longer_than_the_day_has_a_lower_limit_only(drifting):
    """The limit is where the sum of squares of numpy's least squares has risen by 3.84 variances."""
    chain = drifting.problem.context.chain
    variants = variants_of(parse_effect("EZC1:const@warmup", chain))
    scene = scene_of(drifting, variants)
    (refined,) = refine_all(scene, [scene.candidates[-1]])
    searched = refined.searched
    assert searched.u is None
    assert 5.0 < searched.at_least < 600.0

    def rest(minutes: float) -> float:
        text = f"EZC1:const@warmup{minutes:.6g}min"
        columns = scene_of(drifting, variants_of(parse_effect(text, chain))).candidates[0].columns
        size = np.linalg.lstsq(columns, scene.residual, rcond=None)[0]
        return float(np.sum((scene.residual - columns @ size) ** 2))

    best = min(rest(minutes) for minutes in np.geomspace(searched.at_least, searched.value, 9))
    freedom = scene.degrees_of_freedom
    assert freedom * np.log(rest(searched.at_least) / best) > 3.84
    assert freedom * np.log(rest(searched.at_least * 2.0**0.25) / best) <= 3.84 + 0.1


def test_a_determined_time_constant_keeps_its_uncertainty(virtual_campaigns):
    hidden = simulator().Effect(
        "EZC1:curve", peak_um=20.0, curve=lambda q, t, now: 1.0 - np.exp(-now.since_first_run_s / 2400.0)
    )
    campaign, _ = virtual_campaigns.virtual(3, [hidden], days=2, runs_per_day=2)
    now = fit(problem_of(campaign))
    variants = variants_of(parse_effect("EZC1:const@warmup", now.problem.context.chain))
    (refined,) = refine_all(scene_of(now, variants), [scene_of(now, variants).candidates[2]])
    assert refined.searched.at_least is None
    assert refined.searched.value == pytest.approx(40.0, abs=4.0 * refined.searched.u)


def test_a_harmonic_over_a_part_of_a_turn_says_so(drifting):
    context = drifting.problem.context
    joint = next(index for index, part in enumerate(context.chain.joints) if part.name == "B")
    turned = float(np.ptp(context.positions[:, joint])) / (2.0 * np.pi)
    part = part_of_period(parse_effect("EBB:harmonic1", context.chain), context)
    assert part == (pytest.approx(turned) if turned < 0.95 else None)
    positions = context.positions.copy()
    positions[:, joint] = np.radians(np.linspace(0.0, 68.0, len(positions)))
    less = replace(context, positions=positions)
    assert part_of_period(parse_effect("EBB:harmonic3", context.chain), less) == pytest.approx(3 * 68 / 360)
    assert part_of_period(parse_effect("EBB:harmonic6", context.chain), less) is None
    assert part_of_period(parse_effect("EXX:poly2", context.chain), less) is None


def test_an_effect_of_few_runs_counts_as_so_many():
    unit = np.repeat(np.arange(8), 10)
    equal, few = np.ones((80, 1)), np.where(unit < 2, 1.0, 1e-3)[:, None]
    assert effective_number(equal / np.linalg.norm(equal), unit) == pytest.approx(8.0)
    assert effective_number(few / np.linalg.norm(few), unit) == pytest.approx(2.0, abs=1e-4)


def test_correlations_that_go_round_in_a_circle_end_at_the_most_cautious():
    """White, then 0.9, whose effects leave 0.6, whose effects leave 0.9 again."""
    turns = Turns()
    slow, fast = Correlation(0.9, 1.0), Correlation(0.6, 1.0)
    assert turns.circle(None, "white", slow) == []
    assert turns.circle(slow, "slow", fast) == []
    circle = turns.circle(fast, "fast", slow)
    assert circle == [(slow, "slow"), (fast, "fast")]
    assert most_cautious(circle) == (slow, "slow")
    assert caution(None) < caution(fast) < caution(slow)
    assert Turns().circle(None, "white", None) == [(None, "white")]


class Halved:
    """A search whose rounds halve a number until it is odd."""

    def __init__(self, number):
        self.number = number

    def round(self):
        return self.number

    def judged(self, current):
        self.number = current // 2
        return current if current % 2 else None


def test_rounds_end_where_one_stands_or_after_the_most():
    assert in_rounds(Halved(12), 4) == (3, True)
    assert in_rounds(Halved(12), 2) == (6, False)


def test_every_end_of_a_search_is_said():
    assert set(LIMITS) == set(Limit)


def test_a_part_of_a_turn_names_a_slope_as_rival(virtual_campaigns):
    hidden = simulator().Effect("EBB:harmonic1", peak_um=4.0)
    campaign, _ = virtual_campaigns.virtual(
        3,
        [hidden],
        days=2,
        runs_per_day=4,
        keep=lambda told: (told["readings"]["B"] >= -60.0) & (told["readings"]["B"] <= 30.0),
    )
    answer = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(3))
    leader = answer.missing[0]
    assert (leader.effect, leader.travelled_periods) == ("EBB:harmonic1", pytest.approx(0.25))
    # Over 90 degrees harmonic5 has 1.25 periods, and harmonic6 no fewer than 1.5.
    names = {rival.effect for rival in leader.rivals}
    assert {"EBB:poly1", "EBB:harmonic2"} <= names
    assert not {"EBB:harmonic6", "EBB:harmonic7"} & names
    assert leader.description.cause.startswith(
        "over this part of a turn no more than a smooth bend of B: flexure"
    )


@pytest.mark.parametrize(
    ("order", "degrees", "bend"),
    [
        (6, 58.2, 0.97),
        (6, 88.0, 1.4667),
        (6, 92.0, None),
        (2, 200.0, 1.1111),
        (1, 350.0, None),
        (3, 240.0, None),
    ],
)
def test_fewer_than_one_and_a_half_periods_over_a_part_of_a_turn_are_a_bend(drifting, order, degrees, bend):
    """harmonic6 of an elevation over 58.2 degrees was told as a gear of six errors a turn, with no other cause."""
    context = drifting.problem.context
    effect = parse_effect(f"EBB:harmonic{order}", context.chain)
    positions = context.positions.copy()
    positions[:, effect.term.joint] = np.deg2rad(np.linspace(0.0, degrees, len(positions)))
    part = part_of_bend(effect, replace(context, positions=positions))
    assert part == (None if bend is None else pytest.approx(bend, abs=1e-4))


def test_a_combination_that_only_products_of_errors_determine_is_held():
    """A candidate of which another effect and the runs' own unknowns leave less than the fit's limit is no finding,
    however much of the residual lies there; a little more is one."""
    rng = np.random.default_rng(5)
    directions, _ = np.linalg.qr(rng.standard_normal((60, 3)))
    whole, selected, apart = 1.0, directions[:, [0]], directions[:, 1]
    residual = 5.0 * apart + 0.1 * directions[:, 2] + 0.01 * rng.standard_normal(60)
    # Of the whole effect (length 1) the runs' own unknowns leave a hundredth, the selected effect this much of it.
    for left, determined in ((0.5 * COMMON_RANK_TOLERANCE, False), (2.0 * COMMON_RANK_TOLERANCE, True)):
        column = 0.01 * whole * directions[:, 0] + left * apart
        candidate = Candidate(Variant("EXX:poly2", None), column[:, None], 0.01, np.inf)
        (evidence,) = weigh([candidate], residual, selected, 59)
        assert (evidence.rank == 1) == determined
        assert (evidence.p_value < 1e-6) == determined
        # The fit decides likewise.
        remainder = np.column_stack([selected, column])[None]
        before = np.column_stack([selected, column + np.sqrt(whole - column @ column) * directions[:, 2]])[
            None
        ]
        assert np.all(_common_step(remainder, before, residual[None]).free) == determined
