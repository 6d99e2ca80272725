"""What is sent twice is done once; what two windows change does not undo each other; a database that was replaced."""

from __future__ import annotations

import html
import re
import shutil
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from monitor.exceptions import NotFoundError
from monitor.web.presses import MOST, Presses

CURVE = "load-cell"


@pytest.fixture
def own(imported: Path, serve: Any, tmp_path: Path) -> Any:
    """A server of a copy of the database that the test may write to."""
    copy = tmp_path / "own.duckdb"
    shutil.copyfile(imported, copy)
    return serve(copy, False)


def _form(page: str, action: str, effect: str = "") -> dict[str, str]:
    """The fields of a form of a page as a browser sends them untouched."""
    forms = re.findall(rf'<form method="post" action="{action}".*?</form>', page, re.S)
    form = next(form for form in forms if f'value="{effect}"' in form)
    return {
        name: html.unescape(value)
        for name, value in re.findall(r'<input[^>]* name="(\w+)" value="([^"]*)"', form)
    }


def _settled(served: Any, address: str) -> str:
    """A page after what it waits for is computed."""
    for _ in range(600):
        page: str = served.client.get(address).text
        if 'class="waiting"' not in page:
            return page
        threading.Event().wait(0.05)
    raise AssertionError("the page is still not complete")


def _effects(served: Any) -> list[list[str]]:
    """The effects of each version of the curve's model."""
    models = served.ask("models")[1]["models"]
    return [model["effects"] for model in models if model["name"] == "curve"]


def test_a_form_sent_twice_adds_one_effect_and_says_so_both_times(own: Any) -> None:
    page = _settled(own, f"/model?campaign={CURVE}")
    effect = re.search(r'data-effect="([^"]+)"', page)
    assert effect is not None
    fields = _form(page, "/model/add", effect[1])
    answers = [own.client.post("/model/add", data=fields) for _ in range(2)]
    assert {answer.status_code for answer in answers} == {303}
    assert len({answer.headers["location"] for answer in answers}) == 1
    assert "model=curve%402" in answers[0].headers["location"]
    assert _effects(own) == [[], [effect[1]]]
    # A second window that still shows the first version: nothing is undone or doubled, and it shows what there is.
    other = own.client.post("/model/add", data={**fields, "once": "another page", "effect": "load_N:sin1"})
    assert other.status_code == 303
    shown = _settled(own, other.headers["location"])
    assert "somebody or another window has made curve@2" in shown
    assert _effects(own) == [[], [effect[1]]]
    # From there it is added to what the other window made.
    fields = _form(shown, "/model/undo", effect[1])
    assert (fields["model"], fields["latest"]) == ("curve@2", "curve@2")
    assert own.client.post("/model/undo", data=fields).status_code == 303
    assert own.client.post("/model/undo", data={**fields, "once": "x"}).headers["location"].count("overtaken")
    assert _effects(own) == [[], [effect[1]], []]
    # The first version is chosen by its number: its name alone is the latest.
    assert '<option value="curve@1">curve<' in shown


def test_an_event_sent_twice_is_recorded_once_and_another_beside_it(own: Any) -> None:
    fields = {
        "machine": "HU40-T",
        "text": "belt",
        "kind": "repair",
        "at": "2026-03-01T07:00:00Z",
        "once": "a",
    }
    fields["proof"] = own.proof()
    for once, text in (("a", "belt"), ("a", "belt"), ("b", "belt"), ("a", "motor")):
        answer = own.client.post("/machine/event", data={**fields, "once": once, "text": text})
        assert answer.status_code == 303
    assert own.db.rows("SELECT description FROM event ORDER BY ALL") == [("belt",), ("motor",)]


def test_what_was_refused_can_be_sent_again(own: Any) -> None:
    fields = {"machine": "HU40-T", "text": "belt", "at": "yesterday", "once": "a", "proof": own.proof()}
    assert own.sent("/machine/event", data=fields).status_code == 400
    assert own.sent("/machine/event", data=fields).status_code == 400
    assert own.sent("/machine/event", data={**fields, "at": "2026-03-01T07:00:00Z"}).status_code == 200


def test_a_press_waits_for_the_same_press() -> None:
    presses, begun, go = Presses(), threading.Event(), threading.Event()
    done: list[str] = []

    def work() -> int:
        begun.set()
        go.wait(60)
        done.append("work")
        return len(done)

    answers: list[int] = []
    threads = [threading.Thread(target=lambda: answers.append(presses.once("a", work))) for _ in range(2)]
    threads[0].start()
    begun.wait(60)
    assert presses.is_known("a")
    threads[1].start()
    go.set()
    for thread in threads:
        thread.join()
    assert (answers, done) == ([1, 1], ["work"])


def test_presses_forget_what_failed_and_what_is_old() -> None:
    presses = Presses()

    def fails() -> int:
        raise NotFoundError("there is no machine")

    for _ in range(2):
        with pytest.raises(NotFoundError, match="there is no machine"):
            presses.once("a", fails)
    assert presses.once("a", lambda: 1, lambda answer: answer > 1) == 1
    assert presses.once("a", lambda: 2) == 2
    assert presses.once("a", lambda: 3) == 2
    for number in range(MOST):
        presses.once(str(number), lambda: 0)
    assert presses.once("a", lambda: 4) == 4
    assert presses.once("", lambda: 5) == 5
    assert presses.once("", lambda: 6) == 6


def _replaced(path: Path) -> None:
    shutil.copyfile(path, path.with_suffix(".new"))
    path.with_suffix(".new").rename(path)


@pytest.mark.parametrize("change", [_replaced, Path.unlink])
def test_a_database_that_was_replaced_is_neither_shown_nor_written(
    own: Any, change: Callable[[Path], None]
) -> None:
    assert own.client.get("/").status_code == 200
    before = own.db.rows("SELECT count(*) FROM event")
    proof = own.proof()
    change(Path(own.db.path))
    answers = [own.client.get("/"), own.client.get("/campaigns")]
    fields = {"machine": "HU40-T", "text": "x", "at": "2026-03-01T07:00:00Z", "proof": proof}
    answers.append(own.client.post("/machine/event", data=fields))
    for answer in answers:
        assert answer.status_code == 503
        assert "was replaced or removed while it is served" in answer.text
    assert own.ask("campaigns")[0] == 503
    assert own.db.rows("SELECT count(*) FROM event") == before
