"""A certificate under a model with added effects states their values: its results hold beside them alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from by_path import load, simulator

from monitor.reporting.certificate.model_effect import ModelEffect
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
from monitor.workflow.models import resolve
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stating import statement
from monitor.workflow.uncertainty.stored import StatedUncertainty

BACKLASH = "EXX:reversal"
#: µm; the reversal value is twice as much.
AMPLITUDE = 6.0


@pytest.fixture(scope="module")
def stated(tmp_path_factory):
    """The database, and what each model states of the last run, of a machine whose X has backlash."""
    virtual = load("virtual_campaigns", Path(__file__).resolve().parents[1] / "discovery" / "virtual.py")
    backlash = simulator().Effect(BACKLASH, coefficients=AMPLITUDE * 1e-3)
    campaign, _ = virtual.virtual(311, [backlash], days=2, runs_per_day=3, runs=6)
    with Database(tmp_path_factory.mktemp("effects") / "monitor.duckdb", threads=1) as db:
        import_campaign(db, campaign)
        name = campaign.name
        add_effect(db, AddEffectRequest(BACKLASH, "samba", "with-backlash", campaign=name))
        answers = {}
        for model in ("samba", "with-backlash"):
            answer = statement(evaluate(db, UncertaintyRequest(name, 6, model=model, method="guf")))
            answers[model] = StatedUncertainty(load_campaign(db, name), resolve(db, model), answer)
        unknown = effects_of(db, answers["with-backlash"])
        identify(db, IdentifyRequest(name, model="with-backlash"))
        yield db, answers, unknown


def test_iso230_2_the_reversal_value_is_stated_beside_the_amplitude(stated) -> None:
    db, answers, _ = stated
    (effect,) = effects_of(db, answers["with-backlash"])
    assert (effect.name, effect.unit, effect.runs, effect.days) == (BACKLASH, "µm", 6, 2)
    assert effect.value == pytest.approx(AMPLITUDE, abs=4.0 * effect.u)
    assert effect.u < 0.5
    assert effect.reversal_value == pytest.approx(2.0 * effect.value)
    assert effect.u_reversal == pytest.approx(2.0 * effect.u)
    history = machine_history(db, "V", model="with-backlash", version=1)
    own = history.values[:, history.parameters.index(BACKLASH)]
    assert effect.value == pytest.approx(np.mean(own))


@pytest.mark.parametrize(
    ("language", "title", "reversal"),
    [
        (
            "en",
            "The results above hold beside these effects",
            "reversal value (ISO 230-2), twice the amplitude",
        ),
        (
            "de",
            "Die Ergebnisse oben gelten neben diesen Effekten",
            "Umkehrspanne (ISO 230-2), doppelte Amplitude",
        ),
    ],
)
def test_the_page_has_amplitude_and_reversal_value(stated, language: str, title: str, reversal: str) -> None:
    db, answers, _ = stated
    texts, evaluated = texts_of(language), answers["with-backlash"]
    printed = printed_effects(effects_of(db, evaluated), texts)
    assert printed.explained.startswith(title)
    assert [row[1] for row in printed.rows][1] == reversal
    values = [float(row[2][0].text.replace(",", ".")) for row in printed.rows]
    assert values == pytest.approx([AMPLITUDE, 2.0 * AMPLITUDE], rel=0.1)
    assert not printed.unknown
    # A result of before has none.
    assert _printed(results_of(evaluated, texts), texts).effects is None


def test_an_effect_without_a_stored_value_is_named_in_words(stated) -> None:
    _, _, unknown = stated
    assert unknown == (ModelEffect(BACKLASH),)
    printed = printed_effects(unknown, texts_of())
    assert not printed.rows
    assert str(printed.unknown).endswith(f"of which the campaign has no stored value: {BACKLASH}.")


def test_the_methods_own_model_has_none(stated) -> None:
    db, answers, _ = stated
    assert effects_of(db, answers["samba"]) is None


def test_u_of_the_mean_is_that_of_days_that_differ_more_than_runs() -> None:
    values, days = np.array([1.0, 1.0, 3.0, 3.0]), np.array([0, 0, 1, 1])
    assert _u_of_mean(values, np.full(4, 0.1), days) == pytest.approx(1.0)
    assert _u_of_mean(np.ones(4), np.full(4, 0.1), days) == pytest.approx(0.05)
