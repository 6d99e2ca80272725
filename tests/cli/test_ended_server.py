"""A server ends in time whatever it computes, answers who waits, and leaves a database that the next command opens."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")

from monitor.cli import main
from monitor.store import Database
from tests.web.test_interface import zipped

#: Each starts a server or two.
pytestmark = pytest.mark.slow
CAMPAIGN, MACHINE = "cold-cold", "HU40-T"
ENDLESS = "SELECT count(*) FROM range(1000000000000) a, range(1000000) b WHERE a.range % 7 = b.range % 5"
#: A server with a function that never returns in the place of another, which says when it is reached. It has so many
#: seconds to end.
DEAF = """
import importlib, sys, threading
from monitor.cli import main
from monitor.web import ending

def deaf(*arguments, **options):
    print("reached", flush=True)
    threading.Event().wait()

module, name = sys.argv[1].split(":")
setattr(importlib.import_module(module), name, deaf)
ending.ENDING_S = float(sys.argv[2])
sys.exit(main(sys.argv[3:]))
"""
#: In the midst of the transaction of an import, with all readings written.
STORING = "monitor.store.campaigns:keep_notes"
QUERYING = "monitor.workflow.query:run_query"


class Serving:
    """A server of its own, what it prints, and what it answered to whom it let wait."""

    def __init__(self, process: subprocess.Popen[str], database: Path) -> None:
        self.process, self.database = process, database
        assert process.stdout is not None
        self.address = process.stdout.readline().partition("served at ")[2].partition("/ ;")[0]
        self.answers: list[tuple[int, Any]] = []
        self._asking: list[threading.Thread] = []

    def ask(self, question: str, body: bytes, kind: str = "application/json") -> None:
        """Ask without waiting for the answer."""

        def wait() -> None:
            request = urllib.request.Request(
                f"{self.address}/api/v1/{question}", body, {"Content-Type": kind}
            )
            try:
                with urllib.request.urlopen(request, timeout=120) as answer:
                    self.answers.append((answer.status, json.load(answer)))
            except urllib.error.HTTPError as refused:
                self.answers.append((refused.code, json.load(refused)))
            except OSError as cut:
                self.answers.append((0, str(cut)))

        self._asking.append(threading.Thread(target=wait))
        self._asking[-1].start()

    def await_word(self, word: str) -> None:
        """Wait until the server prints a line."""
        assert self.process.stdout is not None
        assert self.process.stdout.readline().strip() == word

    def await_work(self, question: str) -> None:
        """Wait until the server lists a question as being computed."""
        while True:
            with urllib.request.urlopen(f"{self.address}/work", timeout=60) as page:
                if question in page.read().decode():
                    return

    def ended(self, *signals: signal.Signals) -> str:
        """What it printed after the signals, of which each further one follows what it says of the one before."""
        said = ""
        assert self.process.stdout is not None
        for number, sent in enumerate(signals):
            if number:
                said += self.process.stdout.readline()
            self.process.send_signal(sent)
        rest, faults = self.process.communicate(timeout=120)
        for asking in self._asking:
            asking.join()
        assert "Traceback" not in faults
        return said + rest + faults


@contextmanager
def serving(folder: Path, environment: dict[str, str], *deaf: str) -> Iterator[Serving]:
    """A server of a new database with one campaign; ``deaf`` is what never returns, and how long it has to end."""
    database = folder / "shop.duckdb"
    temporary = folder / "temporary"
    temporary.mkdir()
    examples = Path(__file__).resolve().parents[2] / "examples"
    assert main(["--db", str(database), "import", str(examples / CAMPAIGN)]) == 0
    command = [sys.executable, *(("-c", DEAF, *deaf) if deaf else ("-m", "monitor"))]
    process = subprocess.Popen(
        [*command, "--db", str(database), "serve", "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env={**os.environ, **environment, "TMPDIR": str(temporary)},
    )  # fmt: skip
    try:
        yield Serving(process, database)
        assert list(temporary.iterdir()) == []
        assert not Path(f"{database}.server").exists()
    finally:
        process.kill()
        process.communicate()


def test_a_question_without_end_is_broken_off_and_whoever_waits_is_answered(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    with serving(tmp_path, environment) as server:
        server.ask("sql", json.dumps({"query": ENDLESS}).encode())
        server.await_work("sql query SELECT count(*)")
        said = server.ended(signal.SIGTERM)
    assert server.process.returncode == 0
    words = "the server ends within 10 s, at once with Ctrl-C once more; taken back: sql query SELECT count(*) FROM"
    assert words in said
    ((status, answer),) = server.answers
    assert status == 503
    assert answer["error"].startswith("this was taken back by the end of the server before it was answered")
    assert sorted(path.name for path in tmp_path.glob("shop*")) == ["shop.duckdb", "shop.duckdb.lock"]


@pytest.mark.parametrize(
    ("patience", "signals", "status"),
    [
        ("2.3", [signal.SIGTERM], 0),
        ("600", [signal.SIGINT, signal.SIGINT], 130),
        ("2.3", [signal.SIGINT], 130),
    ],
)
def test_what_hears_nothing_is_cut_off(
    tmp_path: Path, environment: dict[str, str], patience: str, signals: list[signal.Signals], status: int
) -> None:
    with serving(tmp_path, environment, QUERYING, patience) as server:
        server.ask("sql", b'{"query": "SELECT 1"}')
        server.await_word("reached")
        said = server.ended(*signals)
    assert server.process.returncode == status
    assert "cut off: sql query SELECT 1; what was not finished is not stored" in said
    assert server.answers[0][0] == 0
    with Database(server.database) as db:
        assert db.rows("SELECT count(*) FROM campaign") == [(1,)]


NEXT: dict[str, list[str]] = {
    "identify": ["identify", CAMPAIGN],
    "campaigns": ["campaigns"],
    "verify": ["verify"],
    "import": ["import", "examples/nothing-hidden"],
    "event": ["event", MACHINE, "x", "--at", "2026-03-05T07:00:00Z"],
    "serve": ["serve", "--port", "0"],
}


@pytest.mark.parametrize(
    "verb",
    [
        pytest.param(verb, marks=() if verb in ("campaigns", "import", "serve") else pytest.mark.all_seeds)
        for verb in NEXT
    ],
)
def test_an_import_that_is_cut_off_is_undone_and_the_next_command_works(
    tmp_path: Path, environment: dict[str, str], verb: str
) -> None:
    """Cut off within the transaction, with all readings of the campaign written."""
    root = Path(__file__).resolve().parents[2]
    body = (
        b'--x\r\nContent-Disposition: form-data; name="file"; filename="c.zip"\r\n\r\n'
        + zipped(root / "examples" / "nothing-hidden")
        + b"\r\n--x--\r\n"
    )
    with serving(tmp_path, environment, STORING, "2.3") as server:
        server.ask("import", body, "multipart/form-data; boundary=x")
        server.await_word("reached")
        assert "cut off: import of 1 folder: nothing-hidden" in server.ended(signal.SIGTERM)
    command = [sys.executable, "-m", "monitor", "--db", str(server.database), *NEXT[verb]]
    following = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=root,
        env={**os.environ, **environment},
    )  # fmt: skip
    if verb == "serve":
        assert following.stdout is not None
        assert "is served at" in following.stdout.readline()
        following.send_signal(signal.SIGTERM)
    said, faults = following.communicate(timeout=300)
    assert (following.returncode, faults) == (0, "")
    assert verb != "import" or "nothing-hidden: imported" in said
    with Database(server.database) as db:
        names = {name for (name,) in db.rows("SELECT campaign FROM campaign")}
    assert names == {CAMPAIGN} | ({"nothing-hidden"} if verb == "import" else set())
