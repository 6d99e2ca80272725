"""An import under way: how far it is, stopped, seen again after a reload, and nobody else's."""

from __future__ import annotations

import io
import re
import threading
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from monitor.stopping import checkpoint
from monitor.web.users import Role, User
from monitor.workflow.intake import importing

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
ENGINEER = User("engineer-1", Role.ENGINEER)


@pytest.fixture
def served(imported: Path, serve: Any, tmp_path: Path) -> Any:
    copy = tmp_path / "copy.duckdb"
    copy.write_bytes(imported.read_bytes())
    guarded = serve(copy, True)
    _as(guarded, "engineer")
    return guarded


def _as(served: Any, role: str) -> None:
    served.client.cookies.clear()
    served.client.post("/login", data={"token": served.tokens[role]})


def _text(page: Any) -> str:
    return re.sub(r"<[^>]+>|\s+", " ", page.text).replace("  ", " ")


def _packed(*names: str) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for name in names:
            for path in (EXAMPLES / name).iterdir():
                archive.writestr(f"{name}/{path.name}", path.read_bytes())
    return content.getvalue()


def test_an_import_that_takes_long_is_seen_to_its_end_and_again(served: Any) -> None:
    state = served.client.app._app.state
    state.import_patience_s = 0.0
    files = [("file", ("two.zip", _packed("nothing-hidden", "tilting-table")))]
    sent = served.client.post("/import", data={"proof": served.proof()}, files=files)
    assert sent.status_code == 303
    address = sent.headers["location"]
    for _ in range(600):
        page = served.client.get(address)
        assert page.status_code == 200
        if "waiting" not in page.text:
            break
        assert 'http-equiv="refresh"' in page.text
        time.sleep(0.1)
    again = served.client.get(address)
    for shown in (page, again):
        text = re.sub(" +", " ", _text(shown))
        assert "nothing-hidden: imported, 20 runs" in text
        assert "tilting-table: imported" in text
    _as(served, "viewer")
    assert served.client.get(address).status_code == 404
    assert not list(Path(state.working_folder).glob("tmp*"))


def test_a_refused_folder_has_its_faults_on_the_page_of_its_progress(served: Any) -> None:
    served.client.app._app.state.import_patience_s = 0.0
    torn = [("file", ("campaign.toml", (EXAMPLES / "five-days/campaign.toml").read_bytes()))]
    sent = served.client.post("/import", data={"proof": served.proof()}, files=torn)
    assert sent.status_code == 303
    for _ in range(600):
        page = served.client.get(sent.headers["location"])
        if page.status_code != 200:
            break
        time.sleep(0.1)
    assert page.status_code == 422
    assert "the upload was refused" in page.text


def _until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_the_page_counts_folders_and_stops_the_import(served: Any) -> None:
    desk = served.client.app._app.state.desk
    told = threading.Event()

    def work(tell: Callable[[str], None]) -> None:
        for name in ("a", "b"):
            tell(name)
        told.set()
        while True:
            checkpoint()
            time.sleep(0.01)

    ticket = desk.begin(ENGINEER, "import", {"folders": ["a", "b", "c"]}, work)
    assert told.wait(60.0)
    address = f"/import/under-way?number={ticket.number}"
    page = served.client.get(address)
    assert "Importing b, 2 of 3 folders" in re.sub(" +", " ", _text(page))
    assert '<progress max="3" value="1"' in page.text
    assert f'<a href="{address}">import of 3 folders: a, b, c</a>' in served.client.get("/work").text
    # From the menu it is seen again, and a page that waits is told how far it is without being made anew.
    assert (
        f'Under way: <a href="{address}">import of 3 folders: a, b, c</a>'
        in served.client.get("/import").text
    )
    state = served.client.get(f"/work/state?number={ticket.number}")
    assert (state.status_code, state.json()["at"], state.json()["done"]) == (
        202,
        "Importing b, 2 of 3 folders",
        1,
    )
    stopped = served.client.post("/work/cancel", data={"proof": served.proof(), "number": ticket.number})
    assert (stopped.status_code, stopped.headers["location"]) == (303, address)
    _until(lambda: bool(ticket.is_taken_back))
    text = re.sub(" +", " ", _text(served.client.get(address)))
    assert "This import was taken back by engineer-1." in text
    assert (
        f'<a href="{address}">import of 3 folders: a, b, c</a>, by engineer-1, stopped'
        in served.client.get("/import").text
    )


def test_an_import_that_is_stopped_names_what_went_in_and_what_did_not(
    served: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = served.client.app._app.state
    state.import_patience_s = 0.0
    stored, free = threading.Event(), threading.Event()
    store = importing.import_campaign

    def stored_then_held(*arguments: Any) -> Any:
        imported = store(*arguments)
        if not stored.is_set():
            stored.set()
            assert free.wait(60.0)
        return imported

    monkeypatch.setattr(importing, "import_campaign", stored_then_held)
    files = [("file", ("three.zip", _packed("nothing-hidden", "five-days", "tilting-table")))]
    sent = served.client.post("/import", data={"proof": served.proof(), "button": ""}, files=files)
    address = sent.headers["location"]
    assert stored.wait(60.0)
    ticket = state.desk.begun(ENGINEER, int(address.partition("=")[2]))
    # Taken back when the first folder is in the database and its notes are not read yet.
    served.client.post("/work/cancel", data={"proof": served.proof(), "number": ticket.number})
    free.set()
    _until(lambda: bool(ticket.is_taken_back))
    text = re.sub(" +", " ", _text(served.client.get(address)))
    first = ticket.document["folders"][0]
    rest = ticket.document["folders"][1:]
    assert f"In the database, and staying there (1): {first}." in text
    assert f"Not imported (2): {rest[0]}, {rest[1]}." in text
    names = {row["campaign"] for row in served.ask("campaigns", role="viewer")[1]["campaigns"]}
    assert first in names
    assert not names & set(rest)


def test_the_number_of_an_earlier_server_shows_no_other_import(served: Any) -> None:
    page = served.client.get("/import/under-way?number=1")
    assert page.status_code == 404
    assert "the server was started anew since" in page.text
    desk = served.client.app._app.state.desk
    number = desk.begin(ENGINEER, "import", {"folders": []}, lambda tell: None).number
    assert number > 1_700_000_000_000
    beyond = served.client.get(f"/import/under-way?number={number + 1}")
    assert "this is not known any more, or was begun by somebody else" in beyond.text
