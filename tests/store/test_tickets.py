"""Who waits for a database is let in by order, not by chance: writers in theirs, readers between two writers."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from monitor.store import Database, Patience, SharedDatabase, tickets
from monitor.store.opening import connect
from monitor.store.turns import LOCK_ENDING, turn_to_write

pytestmark = pytest.mark.skipif(not tickets._TICKETS, reason="this system has no locks of open files")

#: Longest wait for an event that has to come, in s.
LONGEST_S = 120.0
WAITS_TO_WRITE = """
import sys
from monitor.store import Patience
from monitor.store.opening import connect
from monitor.store.turns import turn_to_write
with turn_to_write(sys.argv[1], Patience(300)):
    pass
"""


class Waiting:
    """Threads that wait for one database, one after the other, and the order in which they came in."""

    def __init__(self, path: Path) -> None:
        self.path = str(path)
        self.came_in: list[str] = []
        self._threads: list[threading.Thread] = []

    def add(self, name: str, first: int, work: Callable[[], None]) -> None:
        """Let one more wait, and return once it has its ticket, in the range that begins at ``first``."""
        before = last_ticket(self.path, first)
        self._threads.append(threading.Thread(target=work, name=name))
        self._threads[-1].start()
        until(lambda: last_ticket(self.path, first) > before)

    def writer(self, name: str) -> None:
        def write() -> None:
            with turn_to_write(self.path, Patience(LONGEST_S)) as holder:
                assert holder is None
                connection = connect(self.path, False, 1, Patience(LONGEST_S))
                self.came_in.append(name)
                connection.close()

        self.add(name, tickets._WRITERS, write)

    def reader(self, name: str) -> None:
        def read() -> None:
            with SharedDatabase(self.path, read_only=True, threads=1, patience=Patience(LONGEST_S)) as db:
                self.came_in.append(name)
                db.rows("SELECT 1")

        self.add(name, tickets._READERS, read)

    def end(self) -> list[str]:
        for thread in self._threads:
            thread.join(LONGEST_S)
            assert not thread.is_alive()
        return self.came_in


def last_ticket(path: str, first: int) -> int:
    with open(path + LOCK_ENDING, "rb") as file:
        return tickets._behind_last(file.fileno(), first)


def until(is_so: Callable[[], bool]) -> None:
    deadline = time.monotonic() + LONGEST_S
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.005)


@contextmanager
def held(path: Path) -> Iterator[Waiting]:
    """Hold the turn to write while the block lets others wait."""
    Database(path).close()
    with turn_to_write(str(path), Patience()):
        yield Waiting(path)


def test_writers_come_in_the_order_in_which_they_came(path: Path) -> None:
    names = [f"writer {number}" for number in range(6)]
    with held(path) as waiting:
        for name in names:
            waiting.writer(name)
    assert waiting.end() == names


def test_readers_who_wait_come_in_before_the_next_writer_and_all_of_them(path: Path) -> None:
    with held(path) as waiting:
        for number in range(3):
            waiting.writer(f"writer {number}")
        for number in range(4):
            waiting.reader(f"reader {number}")
    came_in = waiting.end()
    assert sorted(came_in[:4]) == [f"reader {number}" for number in range(4)]
    assert came_in[4:] == [f"writer {number}" for number in range(3)]


def test_a_reader_who_comes_while_the_next_one_writes_waits_for_that_writer_alone(path: Path) -> None:
    Database(path).close()
    waiting = Waiting(path)
    inside, on = threading.Event(), threading.Event()

    def write_long() -> None:
        with turn_to_write(str(path), Patience(LONGEST_S)):
            inside.set()
            assert on.wait(LONGEST_S)

    with turn_to_write(str(path), Patience()):
        waiting.add("long", tickets._WRITERS, write_long)
        waiting.writer("later")
    assert inside.wait(LONGEST_S)
    waiting.reader("reader")
    on.set()
    assert waiting.end() == ["reader", "later"]


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_who_is_killed_or_stopped_while_waiting_keeps_nobody_out(
    path: Path, end: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tickets, "_OVERTAKEN_S", 0.3 if end == signal.SIGSTOP else 1e9)
    Database(path).close()
    with subprocess.Popen([sys.executable, "-c", WAITS_TO_WRITE, str(path)]) as ended:
        try:
            # The turn is free behind this block: what was stopped holds its ticket and does not go in.
            with turn_to_write(str(path), Patience()):
                until(lambda: last_ticket(str(path), tickets._WRITERS) > tickets._WRITERS)
                os.kill(ended.pid, end)
                if end == signal.SIGKILL:
                    # Until it is gone its ticket counts, and the next one gets the same number.
                    ended.wait()
                waiting = Waiting(path)
                waiting.writer("the next")
            assert waiting.end() == ["the next"]
        finally:
            ended.kill()


def test_nobody_waits_longer_for_one_who_is_stopped_than_he_is_ready_to(path: Path) -> None:
    """A reader who was stopped keeps a ticket and asks no more; each who follows waits for itself, with no event."""
    Database(path).close()
    with turn_to_write(str(path), Patience()):
        pass
    with open(str(path) + LOCK_ENDING, "rb") as file:
        assert tickets._taken(file.fileno(), tickets._READERS) is not None
        for patience_s in (0.0, 0.2, 0.2):
            with turn_to_write(str(path), Patience(patience_s)) as holder:
                assert holder is None


def test_who_is_refused_beside_a_free_file_hears_of_those_whose_turn_it_is(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Database(path).close()
    with turn_to_write(str(path), Patience()):
        pass
    monkeypatch.setattr(tickets.WritersTicket, "is_next", lambda ticket: False)
    with turn_to_write(str(path), Patience()) as holder:
        assert str(holder) == "others who wait for it"


def test_without_such_locks_all_come_in_by_chance(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tickets, "_TICKETS", False)
    Database(path).close()
    with SharedDatabase(path, patience=Patience(LONGEST_S)) as db:
        with db.transaction():
            db.execute("DELETE FROM registered_machine")
        assert db.rows("SELECT count(*) FROM registered_machine") == [(0,)]
    with open(str(path) + LOCK_ENDING, "rb") as file:
        assert tickets._taken(file.fileno(), tickets._WRITERS) is None


def test_macos_has_no_tickets_whatever_names_its_locks_have(tmp_path: Path) -> None:
    """There ``struct flock`` begins with start and length; what is laid out for Linux says something else."""
    path = tmp_path / "shop.duckdb.lock"
    path.touch()
    code = (
        "import sys\nsys.platform = 'darwin'\nfrom monitor.store import tickets\n"
        "with open(sys.argv[1], 'rb') as file:\n    print(tickets._taken(file.fileno(), 1 << 41))"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True
    )
    assert answer.stdout == "None\n"
