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
    assert "import folders" in re.sub(" +", " ", _text(served.client.get("/work")))
    stopped = served.client.post("/work/cancel", data={"proof": served.proof(), "number": ticket.number})
    assert stopped.status_code == 303
    _until(lambda: bool(ticket.is_taken_back))
    text = re.sub(" +", " ", _text(served.client.get(address)))
    assert "This import was taken back by engineer-1 at b." in text
    assert served.client.get("/import/under-way?number=99999").status_code == 404
