"""Mistakes of the file are told by name where undoing one lets the residual fall to the noise; effects are not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Verdict, find_mistakes, fit, is_gross
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.shapes.variants import cycles_of_unknown_pitch, resolvable
from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.readers.doubts.doubts import column_doubts
from monitor.records import Campaign, Probings
from monitor.store import Database, StoredModel, import_campaign
from monitor.workflow.campaign_parts import only_run
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.explain_answer import MachineExplanation
from monitor.workflow.explain.request import CompareRequest, ExplainRequest
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.models import as_model, resolve

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@cache
def one_run(example: str) -> Campaign:
    found = read_campaign(EXAMPLES / example)
    assert isinstance(found, Campaign)
    return only_run(found, found.runs[0].run)


@cache
def plain_model(method: str) -> StoredModel:
    """The model that a method has of itself; every database has it."""
    with Database(":memory:") as db:
        return resolve(db, None, method)


def maker(campaign: Campaign) -> Callable[[Campaign], ChainProblem]:
    model = as_model(plain_model(campaign.method))
    return lambda one: campaign_method(campaign).problem_of(one, model)


def recorded(example: str, change: Callable[[Probings], Probings]) -> Campaign:
    campaign = one_run(example)
    return replace(campaign, probings=change(campaign.probings))


def told(campaign: Campaign) -> list[str]:
    problem_of = maker(campaign)
    found: Fit | None
    try:
        found = fit(problem_of(campaign))
    except DataError:
        found = None
    assert found is None or is_gross(campaign, found)
    mistakes = find_mistakes(campaign, problem_of, found)
    for one in mistakes:
        assert one.rms_undone < 0.5 * one.rms_as_recorded
    return [one.what for one in mistakes]


def readings(**changed: str) -> Callable[[Probings], Probings]:
    """Columns by the axis whose readings they hold."""
    return lambda p: replace(p, readings={axis: p.readings[changed.get(axis, axis)] for axis in p.readings})


def channels(**changed: str) -> Callable[[Probings], Probings]:
    return lambda p: replace(p, channels={name: p.channels[changed.get(name, name)] for name in p.channels})


def turned(axis: str) -> Callable[[Probings], Probings]:
    return lambda p: replace(p, readings={**p.readings, axis: -p.readings[axis]})


def exchanged(one: str, other: str, rows: slice) -> Callable[[Probings], Probings]:
    def change(p: Probings) -> Probings:
        target = p.target.copy()
        part = target[rows].copy()
        target[rows] = np.where(part == one, other, np.where(part == other, one, part))
        return replace(p, target=target)

    return change


@pytest.mark.parametrize("example", ["five-days", "tracked-robot", "hidden-reversal-x", "tilting-table"])
def test_no_example_is_gross(example: str) -> None:
    campaign = one_run(example)
    assert not is_gross(campaign, fit(maker(campaign)(campaign)))


@pytest.mark.slow
def test_exchanged_linear_columns_of_balls() -> None:
    assert told(recorded("five-days", readings(X="Y", Y="X"))) == ["the columns x_mm and y_mm were exchanged"]


def test_the_sign_of_a_rotary_axis() -> None:
    assert "the sign of C were the other way round (`sign` of C in campaign.toml)" in told(
        recorded("five-days", turned("C"))
    )


def test_balls_exchanged_at_one_indexation() -> None:
    (what,) = told(recorded("five-days", exchanged("1", "3", slice(0, 6))))
    assert what.startswith(
        "balls 1 and 3 were exchanged in 3 probings (run 1, sequence 1; run 1, sequence 3;"
    )


def test_one_ball_under_the_name_of_another() -> None:
    (what,) = told(recorded("five-days", exchanged("1", "3", slice(0, 1))))
    assert what == "ball 1 was recorded as 3 in 1 probing (run 1, sequence 1)"


def test_exchanged_reflectors_at_one_pose() -> None:
    (what,) = told(recorded("tracked-robot", exchanged("F1", "F2", slice(0, 2))))
    assert what == "reflectors F1 and F2 were exchanged in 2 probings (run 1, sequence 1; run 1, sequence 2)"


def test_exchanged_columns_of_the_angle_sensor() -> None:
    (what,) = told(recorded("l-shape", channels(plane_u_um="plane_v_um", plane_v_um="plane_u_um")))
    assert what == "the columns plane_u_um and plane_v_um were exchanged"


def test_explain_says_it_first_and_tells_nothing_else(tmp_path: Path) -> None:
    campaign = recorded("tracked-robot", exchanged("F1", "F2", slice(0, 2)))
    with Database(tmp_path / "mistaken.duckdb") as db:
        import_campaign(db, campaign)
        answer = explain(db, ExplainRequest(campaign.name)).explanation
    assert isinstance(answer, MachineExplanation)
    assert answer.answer.startswith("It looks as if reflectors F1 and F2 were exchanged in 2 probings")
    assert "mm as recorded" in answer.answer
    assert answer.missing == answer.suspect_data == answer.changes == ()
    assert answer.comparison.verdict is Verdict.SOMETHING_IS_MISSING
    (mistake,) = answer.likely_mistakes
    assert mistake.rms_undone_um < 100.0 < 2000.0 < mistake.rms_as_recorded_um


@pytest.mark.parametrize("name", ["five-days", "tilting-table"])
def test_every_question_says_again_what_the_import_saw_exchanged(tmp_path: Path, name: str) -> None:
    campaign = recorded(name, readings(X="Y", Y="X"))
    questions = (
        lambda db: identify(db, IdentifyRequest(campaign.name)),
        lambda db: compare(db, CompareRequest(campaign.name)),
        lambda db: explain(db, ExplainRequest(campaign.name)),
    )
    with Database(tmp_path / "mistaken.duckdb") as db:
        import_campaign(db, campaign)
        for question in questions:
            with pytest.raises(DataError, match=r"contradict the machine file.*with x_mm and y_mm exchanged"):
                question(db)


@pytest.mark.slow
def test_a_mistake_that_no_import_sees_is_searched_where_no_machine_fits(tmp_path: Path) -> None:
    """Without a pose at zero nothing is seen without a fit."""
    campaign = recorded("five-days", readings(X="Z", Z="X"))
    turned = campaign.probings.readings["B"] + 0.01
    campaign = replace(
        campaign, probings=replace(campaign.probings, readings=campaign.probings.readings | {"B": turned})
    )
    assert column_doubts(campaign) == ()
    with Database(tmp_path / "mistaken.duckdb") as db:
        import_campaign(db, campaign)
        with pytest.raises(DataError, match="It looks as if the columns x_mm and z_mm were exchanged"):
            identify(db, IdentifyRequest(campaign.name))


def test_a_pitch_that_a_grid_of_places_cannot_tell_is_no_candidate() -> None:
    """Nyquist: places on a grid of 5 mm take every pitch below 10 mm for a longer one; balls lie anyhow."""
    on_grid = maker(one_run("l-shape"))(one_run("l-shape")).context
    kept = resolvable(cycles_of_unknown_pitch(on_grid), on_grid)
    assert all(one.effect.shape.pitch >= 10.0 for one in kept)
    anyhow = maker(one_run("five-days"))(one_run("five-days")).context
    every = cycles_of_unknown_pitch(anyhow)
    assert len(resolvable(every, anyhow)) == len(every)
