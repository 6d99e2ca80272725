"""A model with an effect of an instrument holds for campaigns that this instrument took no part in."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import monitor as mm
from monitor.exceptions import EffectError, InputError

EXAMPLES = Path(__file__).parents[2] / "examples"
LENGTH = "instrument:ball bar:length"


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[mm.Database]:
    """A model whose effect is the ball bar's, and a campaign that has none beside one that has."""
    with mm.open(tmp_path_factory.mktemp("absent") / "shop.duckdb", new=True) as db:
        db.add(EXAMPLES / "r-test", EXAMPLES / "four-instruments")
        db.ask("add effect", effect=LENGTH, to="instruments", new_name="longer", campaign="four-instruments")
        yield db


def test_identify_says_what_it_left_out(db: mm.Database) -> None:
    """The numbers are those of the method's own model, and the effect stands among what such readings do not see."""
    plain, longer = (
        db.ask("identify", campaign="r-test", model=model).to_dict() for model in ("instruments", "longer")
    )
    assert longer["runs"] == plain["runs"]
    assert longer["added"] == {}
    assert [taken for taken in longer["taken_up"] if taken not in plain["taken_up"]] == [
        {
            "parameter": LENGTH,
            "by": [],
            "why": f"'{LENGTH}': no setup or instrument 'ball bar'; this campaign has r-test, R-test",
        }
    ]


@pytest.mark.parametrize(
    ("question", "options"),
    [
        ("uncertainty", {"method": "guf"}),
        ("uncertainty", {"method": "both", "digits": 1}),
        ("map", {}),
        ("compare", {}),
        ("explain", {}),
        ("contributions", {}),
    ],
)
def test_a_question_has_the_answer_of_the_model_without_it(
    db: mm.Database, question: str, options: dict[str, object]
) -> None:
    """Every document is the same but for the model's name, and how long it took."""
    plain, longer = (
        re.sub(r'"seconds": [0-9.]+', "", json.dumps(answer.to_dict()))
        for answer in (
            db.ask(question, campaign="r-test", model=model, **options) for model in ("instruments", "longer")
        )
    )
    assert longer.replace('"longer"', '"instruments"') == plain


def test_a_plan_weighs_the_effect_where_a_test_brings_its_instrument(db: mm.Database) -> None:
    """A usual ball bar is among the tests; one of another name is asked for in vain, in words."""
    answer = db.ask("plan", campaign="r-test", model="longer", parameters=("EXX",))
    assert answer.present["EXX"] is None
    assert any(test.u["EXX"] is not None for test in answer.tests)
    with pytest.raises(InputError, match="no parameter 'instrument:ballbar:length'; did you mean"):
        db.ask("plan", campaign="r-test", model="longer", parameters=("instrument:ballbar:length",))


def test_an_effect_is_added_only_where_it_has_a_column(db: mm.Database) -> None:
    for campaign, effect in (("r-test", LENGTH), ("four-instruments", "instrument:bal bar:length")):
        with pytest.raises(EffectError, match=rf"no setup or instrument '.*'; .*campaign {campaign} has"):
            db.ask("add effect", effect=effect, to="instruments", new_name="wrong", campaign=campaign)


@pytest.mark.parametrize("question", ["add effect", "affected by effect"])
def test_an_effect_of_no_setup_is_refused_without_a_campaign_too(db: mm.Database, question: str) -> None:
    """A rehearsal of the addition refuses what the addition refuses; both name what there is."""
    with pytest.raises(
        EffectError, match=r"no setup or instrument 'r-tset'; did you mean '[rR]-test'\? the campaigns of"
    ):
        db.ask(question, effect="instrument:r-tset:lobing3", to="instruments", new_name="wrong")
    with pytest.raises(EffectError, match="'instrument:bar-xy:lobing3' is a change of "):
        db.ask(question, effect="instrument:bar-xy:lobing3", to="instruments", new_name="wrong")


def test_a_machine_followed_by_such_a_model_has_one_history(db: mm.Database, tmp_path: Path) -> None:
    """Both campaigns are identified, and stand in one trend, in the fleet's table and in the report of the week."""
    followed = db.ask("use model", model="longer", machine="CENTRE-4", reason="the bar was dropped")
    assert not followed.failed
    trend = db.trend("CENTRE-4").to_dict()
    assert {"EX0C", "EXX"} <= set(trend["parameters"])
    assert "CENTRE-4" in json.dumps(db.fleet().to_dict())
    assert "CENTRE-4" in json.dumps(db.report("2026-W10", out=tmp_path / "report").to_dict())
