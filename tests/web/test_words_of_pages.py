"""What pages say of questions and machines reads as sentences do."""

from __future__ import annotations

import re
import threading
from datetime import date
from types import SimpleNamespace
from typing import Any, cast

import pytest

from monitor.web.pages.fleet import _advises
from monitor.web.users import Role, User
from monitor.web.words import how_long_ago, what_breaks
from monitor.workflow.explain.ties import Tie, TieBreak
from monitor.workflow.fleet.answer import FleetAnswer
from monitor.workflow.plan.test_answer import TestAnswer as InstrumentTest
from tests.web.test_pages import looked_at


def test_the_interface_lists_what_each_question_answers_without_marks_of_the_code(local: Any) -> None:
    text = local.client.get("/interface").text
    answers = re.findall(r'<td data-title="Answers">(.*?)</td>', text)
    assert len(answers) > 40
    for answer in answers:
        assert answer
        assert "Raises" not in answer
        assert "`" not in answer


@pytest.mark.parametrize("kind", TieBreak)
def test_the_page_of_a_model_has_words_for_whatever_breaks_a_tie(kind: TieBreak) -> None:
    """A page of a robot was a server error: what an observer sees from outside had none."""
    words = what_breaks(Tie(("EXX:const",), kind, ("ambient_degC",), ("J1", "J2")))
    assert len(words.split()) > 4
    assert kind is not TieBreak.MORE_POSES or "J1 and J2" in words


def test_a_measurement_that_breaks_a_tie_is_named_with_its_axes() -> None:
    bar = InstrumentTest(
        "ball-bar",
        "bar 1",
        "length",
        True,
        25,
        {"x_mm": (-100.0, 100.0), "c_deg": (0.0, 90.0), "z_mm": (5.0, 5.0)},
        {},
    )
    words = what_breaks(Tie(("EXX:const",), TieBreak.INSTRUMENT, measurement=bar))
    assert words == "measure 25 poses with the ball-bar with X −100 to 100 mm, C 0 to 90°"


@pytest.mark.parametrize(
    ("last", "words"),
    [
        ("2026-11-29", ""),
        ("2026-11-28", "today"),
        ("2026-11-27", "yesterday"),
        ("2026-11-15", "13 days ago"),
        ("2026-11-14", "2 weeks ago"),
        ("2026-10-01", "8 weeks ago"),
        ("2026-09-01", "2 months ago"),
        ("2024-11-29", "23 months ago"),
        ("2024-11-27", "2 years ago"),
    ],
)
def test_the_age_of_a_last_run_is_said_in_words(last: str, words: str) -> None:
    assert how_long_ago(last, date(2026, 11, 28)) == words


def test_a_machine_whose_model_does_not_fit_is_not_called_usual(local: Any) -> None:
    """Its numbers ask for nothing, but they are those of a model that the latest comparison refuted."""
    looked_at(local, "/machine?name=HU40-T")
    assert local.ask("compare", {"campaign": "hidden-spindle-growth"})[1]["verdict"] != "explained"
    text = looked_at(local, "/")
    row = next(row for row in re.findall(r"<tr>.*?</tr>", text, re.DOTALL) if "HU40-T" in row)
    assert "as usual" not in row
    assert 'class="state look"' in row
    assert "the model does not explain the latest readings" in row
    assert 'href="/model?campaign=hidden-spindle-growth"' in row
    chosen = looked_at(local, "/?state=the+model+does+not+explain+the+latest+readings")
    assert "HU40-T" in chosen
    assert "HU40-T" not in looked_at(local, "/?state=as+usual")


def test_a_page_that_waits_asks_whether_it_is_worth_to_be_loaded_again(local: Any) -> None:
    end = threading.Event()
    desk = local.client.app._app.state.desk
    ticket = desk.begin(User("ada", Role.APPROVER), "import", {"folders": ["a"]}, lambda tell: end.wait(60.0))
    waits = local.client.get(f"/work/state?number={ticket.number}")
    assert waits.status_code == 202
    assert re.fullmatch(r"\d+ seconds? so far(, about \d+ % done)?", waits.json()["so_far"])
    end.set()
    assert ticket.future.result(60.0)
    assert local.client.get(f"/work/state?number={ticket.number}").status_code == 200
    assert local.client.get("/work/state?number=99999").status_code == 200


def test_the_fleet_says_how_long_ago_a_machine_was_measured(local: Any) -> None:
    looked_at(local, "/machine?name=HU40-T")
    assert re.search(r"last run \d+ \w+ ago, 20\d\d-\d\d-\d\d<", looked_at(local, "/"))


@pytest.mark.parametrize(
    ("rows", "advised"),
    [
        ([("A", 1, None)], (True, True)),
        ([("A", 30, 6.0), ("A", 30, None)], (False, False)),
        ([("A", 30, 6.0), ("B", 3, None)], (True, True)),
        ([], (True, True)),
    ],
)
def test_the_fleet_advises_what_it_lacks(
    rows: list[tuple[str, int, float | None]], advised: tuple[bool, bool]
) -> None:
    """Of thirty campaigns with tolerances it asked for campaigns of earlier months and for tolerances."""
    table = [SimpleNamespace(machine=machine, days=days, limit=limit) for machine, days, limit in rows]
    advises = _advises(cast(FleetAnswer, SimpleNamespace(table=table)))
    assert (advises.earlier_campaigns, advises.tolerances) == advised
