"""What every registered method must keep: built-in ones and plug-ins come through one door and are asked one way."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import monitor.methods
from monitor.exceptions import DataError, InputError
from monitor.methods import (
    Able,
    AnglePlan,
    ChainMethod,
    CurveMethod,
    Stepwise,
    TouchPlan,
    Unable,
    campaign_method,
    method_named,
    methods,
    registry,
    require,
)
from monitor.methods.chain.problem import solve_problem
from monitor.methods.chain.touch import TouchProblem
from monitor.methods.model import chain_of
from monitor.readers import method_rules, read_campaign
from monitor.records import Campaign, CurveCampaign
from monitor.refusal import Reason, ReasonKind, Refusal
from monitor.reporting.refused import refusal_sentence
from monitor.reporting.texts import languages, texts_of
from monitor.units import Unit

EXAMPLES = Path(__file__).parents[2] / "examples"
PACKAGE = Path(monitor.methods.__file__).parent
OF_MACHINES = [name for name, method in methods().items() if isinstance(method, ChainMethod)]
OF_CURVES = [name for name, method in methods().items() if isinstance(method, CurveMethod)]


@cache
def example(method: str) -> Campaign | CurveCampaign:
    """The first run of the first example campaign that was measured by a method."""
    for folder in sorted(EXAMPLES.iterdir()):
        toml = folder / "campaign.toml"
        if toml.exists() and tomllib.loads(toml.read_text(encoding="utf-8"))["method"] == method:
            campaign = read_campaign(folder)
            if isinstance(campaign, CurveCampaign):
                return campaign
            first = campaign.runs[0]
            rows = campaign.probings.run == first.run
            return replace(campaign, runs=(first,), probings=campaign.probings.rows(rows))
    raise AssertionError(f"no example campaign was measured by {method}")


def test_every_folder_with_a_method_is_registered_under_its_name() -> None:
    folders = sorted(path.parent.name for path in PACKAGE.glob("*/method.py"))
    assert sorted(name.replace("-", "_") for name in methods()) == folders


@pytest.mark.parametrize("name", methods())
def test_a_method_says_what_it_is(name: str) -> None:
    method = methods()[name]
    assert method_named(name) is method
    assert method.name == name == method.own_model.name
    assert all([method.title, method.description, *vars(method.nouns).values()])
    assert not method.own_model.added
    abilities = [value for value in vars(method).values() if isinstance(value, Unable)]
    assert all(ability.why for ability in abilities)


@pytest.mark.parametrize("name", methods())
def test_the_method_of_a_campaign_is_the_one_it_names(name: str) -> None:
    assert campaign_method(example(name)) is methods()[name]


def test_the_rules_of_campaign_folders_are_those_of_the_methods_of_machines() -> None:
    assert sorted(method_rules()) == sorted(OF_MACHINES)


@pytest.mark.parametrize("name", OF_MACHINES)
def test_a_method_of_machines_identifies_its_example_at_the_least_squares_point(name: str) -> None:
    campaign = example(name)
    method = campaign_method(campaign)
    problem = method.problem_of(campaign)
    solution = solve_problem(problem)
    found = method.identify(campaign, solve=lambda _: solution)
    assert (found.method, found.model, found.parameters) == (name, name, problem.base_names)
    assert [run.run for run in found.runs] == [1]
    assert np.isfinite(found.runs[0].estimate).any()
    advice = method.advice(problem, problem.base_names[:1], 1)
    reason = Reason(ReasonKind.NOT_SEPARATED, advice=advice)
    for language in languages():
        assert refusal_sentence(Refusal(problem.base_names[:1], reason), texts_of(language))


@pytest.mark.parametrize("name", OF_MACHINES)
def test_the_derivatives_of_a_problem_are_those_of_its_residuals(name: str) -> None:
    """Two ways must agree: the linearisation and a central difference along a random direction."""
    campaign = example(name)
    problem = campaign_method(campaign).problem_of(campaign)
    rng = np.random.default_rng(7)
    direction = rng.standard_normal(problem.start.shape) * 1e-3
    common = problem.common_start
    at = problem.linearise(problem.start, common)
    high, low = (problem.linearise(problem.start + sign * 1e-3 * direction, common) for sign in (1.0, -1.0))
    slope = (high.residual - low.residual) / 2e-3
    expected = np.einsum("rnp,rp->rn", at.local, direction)
    assert np.abs(slope - expected).max() < 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("name", OF_MACHINES)
def test_base_effects_are_the_terms_that_are_free_in_the_example(name: str) -> None:
    campaign = example(name)
    method = campaign_method(campaign)
    problem = method.problem_of(campaign)
    texts = {text.partition(":")[0] for text in method.base_effects(chain_of(campaign.machine))}
    assert texts == {effect.text.partition(":")[0] for effect in problem.base}


@pytest.mark.parametrize("name", OF_MACHINES)
def test_a_plan_is_weighed_where_the_method_says_so(name: str) -> None:
    campaign = example(name)
    method = campaign_method(campaign)
    assert isinstance(method.problem_of(campaign), TouchProblem) == isinstance(method.plan, TouchPlan)
    if isinstance(method.plan, AnglePlan):
        candidates = method.plan.candidates_of(campaign, method.own_model, (15.0, 20.0))
        present = candidates.expected(candidates.present)
        ranked, best = candidates.next_angles(1)
        assert best == (ranked[0].angles[-1],)
        assert np.nanmean(ranked[0].shape) < np.nanmean(present.shape)
        assert set(present.u) <= set(candidates.units)


@pytest.mark.parametrize("name", OF_MACHINES)
def test_stepwise_coefficients_have_units_and_uncertainties(name: str) -> None:
    campaign = example(name)
    method = campaign_method(campaign)
    if isinstance(method.stepwise, Stepwise):
        problem = method.problem_of(campaign)
        coefficients = method.stepwise.coefficients(problem, solve_problem(problem), 1)
        assert {type(coefficient.unit) for coefficient in coefficients} == {Unit}
        assert all(coefficient.u_stepwise > 0.0 for coefficient in coefficients)


@pytest.mark.parametrize("name", OF_CURVES)
def test_a_method_of_curves_fits_its_example(name: str) -> None:
    curve = example(name)
    method = campaign_method(curve)
    fit = method.fit(method.problem_of(curve))
    assert np.isfinite(fit.estimate).all()


def test_a_campaign_of_an_unknown_method_is_refused_with_those_that_are_known() -> None:
    with pytest.raises(DataError, match="'ballbar' cannot be identified yet; these can: curve, free-form"):
        method_named("ballbar")


def test_a_verb_without_an_answer_is_refused_with_the_reason() -> None:
    campaign = example("samba")
    require(Able(), campaign, "stats")
    with pytest.raises(
        DataError, match=r"stats has no answer for campaign .*, which was measured by samba: one run"
    ):
        require(Unable("one run"), campaign, "stats")


def test_a_machine_cannot_have_been_measured_by_a_method_of_curves() -> None:
    campaign = replace(example("samba"), method="curve")
    with pytest.raises(DataError, match="cannot have been measured by the method curve"):
        campaign_method(campaign)


class Point:
    """An entry point as importlib.metadata gives it."""

    name, value = "mine", "my_package:METHOD"

    def __init__(self, plug_in: object) -> None:
        self.plug_in = plug_in

    def load(self) -> object:
        if isinstance(self.plug_in, Exception):
            raise self.plug_in
        return self.plug_in


@pytest.fixture
def plugged_in(monkeypatch):
    def plug(value: object):
        monkeypatch.setattr(
            registry, "entry_points", lambda group: [Point(value)] if group == "monitor.methods" else []
        )
        registry.methods.cache_clear()
        return registry.methods()

    yield plug
    monkeypatch.undo()
    registry.methods.cache_clear()


def test_a_plug_in_comes_through_the_same_door(plugged_in) -> None:
    own = replace(methods()["samba"], name="my-balls")
    known = plugged_in(own)
    assert known["my-balls"] is own
    assert list(known) == [*OF_CURVES, *OF_MACHINES, "my-balls"]
    assert campaign_method(replace(example("samba"), method="my-balls")) is own


@pytest.mark.parametrize(
    ("plug_in", "words"),
    [
        (ImportError("no such module"), r"the plug-in mine \(my_package:METHOD\) cannot be loaded: no such"),
        ("samba", r"the plug-in mine \(my_package:METHOD\) must give a ChainMethod or a CurveMethod"),
        (methods()["samba"], "two methods are named samba; remove one of the plug-ins"),
    ],
)
def test_a_plug_in_that_is_no_method_is_refused(plugged_in, plug_in: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        plugged_in(plug_in)


@pytest.mark.parametrize("name", OF_MACHINES)
def test_chosen_rows_of_a_problem_leave_the_residuals_that_they_had(name: str) -> None:
    campaign = example(name)
    problem = campaign_method(campaign).problem_of(campaign)
    rows = np.arange(len(problem.context))
    twice = problem.taken(np.tile(rows, 2), np.repeat([1, 2], len(rows)))
    both = twice.vectors(np.tile(problem.start, (2, 1)), problem.common_start)
    once = problem.vectors(problem.start, problem.common_start)
    np.testing.assert_array_equal(both[: len(rows)], once)
    np.testing.assert_allclose(both[len(rows) :], once, atol=1e-9)
