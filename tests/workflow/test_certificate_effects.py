"""A certificate under a model with added effects states their values, in its joint region wherever the fit gives it."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from by_path import load, simulator

from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.reporting.certificate.model_effect import ModelEffect, Outside
from monitor.reporting.certificate.model_effects import printed_effects
from monitor.reporting.certificate.page import _printed
from monitor.reporting.texts import texts_of
from monitor.store import Database, import_campaign, load_campaign, machine_history
from monitor.workflow.certificate.effects import _u_of_mean, effects_of
from monitor.workflow.certificate.results import results_of
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.model.change import add_effect
from monitor.workflow.model.request import AddEffectRequest
from monitor.workflow.models import as_model, resolve
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stating import statement
from monitor.workflow.uncertainty.stored import StatedUncertainty

BACKLASH = "EXX:reversal"
#: µm; the reversal value is twice as much.
AMPLITUDE = 6.0


def _campaign(seed: int, **schedule: int):
    """A campaign of a machine whose X has backlash."""
    virtual = load("virtual_campaigns", Path(__file__).resolve().parents[1] / "discovery" / "virtual.py")
    backlash = simulator().Effect(BACKLASH, coefficients=AMPLITUDE * 1e-3)
    return virtual.virtual(seed, [backlash], **schedule)[0]


@pytest.fixture(scope="module")
def stated(tmp_path_factory):
    """The database, and what each model states of the last run, of a machine whose X has backlash."""
    campaign = _campaign(311, days=2, runs_per_day=3)
    with Database(tmp_path_factory.mktemp("effects") / "monitor.duckdb", threads=1) as db:
        import_campaign(db, campaign)
        name = campaign.name
        add_effect(db, AddEffectRequest(BACKLASH, "samba", "with-backlash", campaign=name))
        answers = {}
        for model in ("samba", "with-backlash"):
            answer = statement(evaluate(db, UncertaintyRequest(name, 6, model=model, method="guf")))
            answers[model] = StatedUncertainty(load_campaign(db, name), resolve(db, model), answer)
        yield db, answers


@pytest.fixture(scope="module")
def outside(stated):
    """What is stated where 14 degrees of freedom bound an ellipsoid of 13 dimensions and none of 14."""
    db, _ = stated
    campaign = replace(_campaign(312, days=2, runs_per_day=8), name="sixteen")
    import_campaign(db, campaign)
    answer = statement(evaluate(db, UncertaintyRequest("sixteen", 16, model="with-backlash", method="guf")))
    evaluated = StatedUncertainty(load_campaign(db, "sixteen"), resolve(db, "with-backlash"), answer)
    before = effects_of(db, evaluated)
    identify(db, IdentifyRequest("sixteen", model="with-backlash"))
    return db, evaluated, before


def test_iso230_2_the_reversal_value_is_stated_beside_the_amplitude(stated) -> None:
    db, answers = stated
    (effect,) = effects_of(db, answers["with-backlash"])
    assert (effect.name, effect.unit, effect.runs, effect.days) == (BACKLASH, "µm", 6, 2)
    assert effect.joint
    assert effect.value == pytest.approx(AMPLITUDE, abs=4.0 * effect.u)
    assert effect.u < 0.5
    assert effect.reversal_value == pytest.approx(2.0 * effect.value)
    assert effect.u_reversal == pytest.approx(2.0 * effect.u)


def test_an_effect_is_in_the_joint_region_and_in_the_covariance(stated) -> None:
    _, answers = stated
    evaluated = answers["with-backlash"]
    assert evaluated.answer.effects == (BACKLASH,)
    assert evaluated.names == (*answers["samba"].names, BACKLASH)
    result = results_of(evaluated, texts_of())
    assert result.names[-1] == BACKLASH
    assert result.covariance.shape == (14, 14)
    assert result.rank == 14
    # The gain of X and a play of X are told apart by where the axis came from, not quite.
    assert 0.001 < abs(result.correlation[-1, result.names.index("EXX")]) < 0.9


def test_the_joint_covariance_is_that_of_one_dense_fit_of_all_runs(stated) -> None:
    """All unknowns of all runs side by side, solved at once with numpy; the bar is one length for all runs."""
    db, _ = stated
    campaign, model = load_campaign(db, "virtual"), as_model(resolve(db, "with-backlash"))
    problem = campaign_method(campaign).problem_of(campaign, model)
    solution = solve_problem(problem)
    at = problem.linearise(solution.local, solution.common)
    runs, numbers, unknowns = at.local.shape
    dense = np.zeros((runs, numbers, runs * unknowns + 1))
    for run in range(runs):
        dense[run, :, run * unknowns : (run + 1) * unknowns] = at.local[run]
    dense[..., -1:] = at.common
    answer = np.linalg.pinv(dense.reshape(runs * numbers, -1))
    # Numbers are whitened; the last of each run is the bar's, which moves all of them by the same part of u.
    of_bar = answer.reshape(-1, runs, numbers)[..., -1].sum(axis=1)
    of_readings = answer.reshape(-1, runs, numbers)[..., :-1].reshape(len(answer), -1)
    result = evaluate(db, UncertaintyRequest("virtual", 6, model="with-backlash", method="guf"))
    lines = {line.source: line.covariance for line in result.framework.budget}
    places = [5 * unknowns + problem.base_names.index(name) for name in result.framework.names[:-1]]
    rows = of_readings[[*places, -1]]
    # What the run scatters by over what the probe states.
    times = result.covariance_source.u_um / (campaign.probe.standard_uncertainty * 1e3)
    together = lines["readings"] + lines["readings of the other runs"]
    expected = times**2 * rows @ rows.T
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(together / np.outer(size, size), expected / np.outer(size, size), atol=2e-3)
    bar = of_bar[[*places, -1]]
    np.testing.assert_allclose(lines["scale bar"], np.outer(bar, bar), rtol=2e-3, atol=2e-3 * np.max(bar**2))


def test_jcgm102_8_monte_carlo_and_framework_agree_of_the_effect(stated) -> None:
    db, _ = stated
    request = UncertaintyRequest("virtual", 6, model="with-backlash", method="both", digits=1)
    result = evaluate(db, replace(request, model_uncertainty=False))
    assert result.monte_carlo.names[-1] == BACKLASH
    assert result.validation.passed


@pytest.mark.parametrize(
    ("language", "title", "reversal"),
    [
        ("en", f"{BACKLASH}: added to the model", "reversal value (ISO 230-2), twice the amplitude"),
        ("de", f"{BACKLASH}: dem Modell hinzugefügt", "Umkehrspanne (ISO 230-2), doppelte Amplitude"),
    ],
)
def test_the_page_has_the_reversal_value_and_what_the_effect_is(
    stated, language: str, title: str, reversal: str
) -> None:
    db, answers = stated
    texts, evaluated = texts_of(language), answers["with-backlash"]
    printed = printed_effects(effects_of(db, evaluated), texts)
    assert printed.explained.startswith(title)
    # The amplitude is among the results.
    (row,) = printed.rows
    assert row[1] == reversal
    assert float(row[2][0].text.replace(",", ".")) == pytest.approx(2.0 * AMPLITUDE, rel=0.1)
    assert not printed.unknown
    # A result of before has none.
    assert _printed(results_of(evaluated, texts), texts).effects is None


def test_effects_that_so_few_runs_bound_no_ellipsoid_of_stay_outside_and_the_paper_says_why(outside) -> None:
    db, evaluated, before = outside
    assert evaluated.answer.effects is None
    assert BACKLASH not in evaluated.names
    assert np.isfinite(evaluated.k_p)
    assert before == (ModelEffect(BACKLASH, outside=Outside.FEW_RUNS),)
    (effect,) = effects_of(db, evaluated)
    history = machine_history(db, "V", model="with-backlash", version=1)
    own = history.part(history.campaign == "sixteen").values[:, history.parameters.index(BACKLASH)]
    assert effect.value == pytest.approx(np.mean(own))
    assert not effect.joint
    for language, words in (("en", "bound no hyper-ellipsoid"), ("de", "kein Hyperellipsoid")):
        printed = printed_effects((effect,), texts_of(language))
        assert words in printed.explained
        assert len(printed.rows) == 2


@pytest.mark.parametrize("reason", list(Outside))
def test_every_reason_has_a_sentence_in_each_language(reason: Outside) -> None:
    effect = ModelEffect(BACKLASH, "µm", 6.0, 0.1, 6, 2, outside=reason)
    sentences = [printed_effects((effect,), texts_of(language)).explained for language in ("en", "de")]
    assert "outside the joint region because" in sentences[0]
    assert "außerhalb des gemeinsamen Bereichs, weil" in sentences[1]


def test_an_effect_without_a_stored_value_is_named_in_words(outside) -> None:
    _, _, before = outside
    printed = printed_effects(before, texts_of())
    assert not printed.rows
    assert str(printed.unknown).endswith(f"of which the campaign has no stored value: {BACKLASH}.")


@pytest.mark.parametrize(
    ("language", "sentence"),
    [
        (
            "en",
            "lies somewhere between {low} mm and {high} mm of X, as far as the readings tell; no uncertainty",
        ),
        ("de", "liegt irgendwo zwischen {low} mm und {high} mm von X, soweit die Messwerte es zeigen; keine"),
    ],
)
def test_the_paper_says_where_a_step_lies_without_a_map_too(stated, language: str, sentence: str) -> None:
    """``step at 20 mm`` with a value and its u was all that stood there."""
    db, answers = stated
    model = replace(answers["with-backlash"].model, added=("EXX:step(20)",), effects=("EXX:step(20)",))
    plain = answers["with-backlash"]
    answer = replace(
        plain.answer,
        effects=("EXX:step(20)",),
        guf=replace(
            plain.answer.guf,
            estimate={**plain.answer.guf.estimate, "EXX:step(20)": 1.0},
            u={**plain.answer.guf.u, "EXX:step(20)": 0.5},
        ),
        units={**plain.answer.units, "EXX:step(20)": "µm"},
    )
    (effect,) = effects_of(db, StatedUncertainty(plain.campaign, model, answer))
    assert effect.lies.axis == "X"
    assert effect.lies.low_mm < 20.0 < effect.lies.high_mm
    texts = texts_of(language)
    low, high = (texts.number(Decimal(f"{end:.1f}")) for end in (effect.lies.low_mm, effect.lies.high_mm))
    assert sentence.format(low=low, high=high) in printed_effects((effect,), texts).explained


def test_the_methods_own_model_has_none(stated) -> None:
    db, answers = stated
    assert effects_of(db, answers["samba"]) is None


def test_an_effect_of_which_the_joint_region_has_one_coefficient_keeps_the_other_on_the_paper(stated) -> None:
    """Beside a tenth harmonic that is determined stand its sine without a number, and all of a first harmonic."""
    db, answers = stated
    evaluated = answers["with-backlash"]
    guf = evaluated.answer.guf
    cosine = "EBB:harmonic10.cos"
    answer = replace(
        evaluated.answer,
        effects=(cosine,),
        units={**evaluated.answer.units, cosine: "µrad"},
        guf=replace(guf, estimate={**guf.estimate, cosine: 3.0}, u={**guf.u, cosine: 0.2}),
    )
    texts = ("EBB:harmonic1", "EBB:harmonic10")
    model = replace(evaluated.model, name="none stored", effects=texts, added=texts)
    effects = effects_of(db, StatedUncertainty(evaluated.campaign, model, answer))
    assert [(effect.name, effect.value) for effect in effects] == [
        (cosine, 3.0),
        ("EBB:harmonic1", None),
        ("EBB:harmonic10.sin", None),
    ]


def test_u_of_the_mean_is_that_of_days_that_differ_more_than_runs() -> None:
    values, days = np.array([1.0, 1.0, 3.0, 3.0]), np.array([0, 0, 1, 1])
    assert _u_of_mean(values, np.full(4, 0.1), days) == pytest.approx(1.0)
    assert _u_of_mean(np.ones(4), np.full(4, 0.1), days) == pytest.approx(0.05)
