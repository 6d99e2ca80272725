"""An effect of one run that is no ``each_run`` is said of that run, and not on the paper of another."""

from __future__ import annotations

from pathlib import Path

import pytest
from by_path import load

from monitor.reporting.certificate.model_effects import printed_effects
from monitor.reporting.texts import texts_of
from monitor.store import Database, import_campaign, load_campaign
from monitor.workflow.certificate.effects import effects_of
from monitor.workflow.model.change import add_effect
from monitor.workflow.model.request import AddEffectRequest
from monitor.workflow.models import resolve
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stating import statement
from monitor.workflow.uncertainty.stored import StatedUncertainty

DRIFT, MOVED = "EXX:reversal@run_time(2)", "ball:4:moved(run 2, sequence 30)"
#: What the noise of one run leaves of them.
NAMES = {DRIFT, *(f"{MOVED}.{axis}" for axis in "xyz")}


@pytest.fixture(scope="module")
def of_run(tmp_path_factory):
    """What is stated of runs 2 and 3 under a model with both, and the database."""
    virtual = load("virtual_campaigns", Path(__file__).resolve().parents[1] / "discovery" / "virtual.py")
    campaign = virtual.virtual(311, [], days=2, runs_per_day=2)[0]
    with Database(tmp_path_factory.mktemp("effects") / "monitor.duckdb", threads=1) as db:
        import_campaign(db, campaign)
        name = campaign.name
        add_effect(db, AddEffectRequest(DRIFT, "samba", "of-run-2", campaign=name))
        add_effect(db, AddEffectRequest(MOVED, "of-run-2", campaign=name))
        yield (
            db,
            {
                run: StatedUncertainty(
                    load_campaign(db, name),
                    resolve(db, "of-run-2"),
                    statement(evaluate(db, UncertaintyRequest(name, run, model="of-run-2", method="guf"))),
                )
                for run in (2, 3)
            },
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("language", "said"), [("en", "of this run alone"), ("de", "von diesem Lauf allein")]
)
def test_the_paper_of_its_run_states_it_as_of_this_run(of_run, language: str, said: str) -> None:
    db, stated = of_run
    effects = effects_of(db, stated[2])
    assert {effect.name for effect in effects} == NAMES
    assert all(effect.value is not None and effect.runs == 1 for effect in effects)
    printed = printed_effects(effects, texts_of(language))
    assert said in printed.explained
    assert not printed.unknown


@pytest.mark.slow
def test_the_paper_of_another_run_is_silent(of_run) -> None:
    """Was: the campaign has no stored value of them."""
    db, stated = of_run
    assert not effects_of(db, stated[3])
    assert not NAMES.intersection(stated[3].names)
