"""Taking turns at a database file: who writes next, and whom one waits for.

DuckDB lets one process write or several read. It refuses at once, so whoever comes meanwhile asks again until it is let
in. Asking alone would keep a writer out for as long as readers follow on each other. So whoever writes takes the turn
first, a lock (``flock``) on a file beside the database, and whoever comes to read waits where the turn is taken: the
readers who are in leave, and none comes in. Who waits has a ticket (``tickets``), so that nobody is passed over. A turn
ends with its process, however that ends. Where the file beside cannot be made or read, as in a folder that is not
writable, the lock of DuckDB decides alone.
"""

from __future__ import annotations

import contextlib
import os
import random
import re
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from monitor.store.tickets import ReadersTicket, writers_ticket

try:
    import fcntl
except ImportError:  # Windows has no such locks: that of DuckDB decides alone
    _LOCKS = False
else:
    _LOCKS = True

#: The file beside the database that a turn is a lock on; it holds the number of the last process that wrote.
LOCK_ENDING = ".lock"

#: First and longest pause between two questions whether the file is free, in s. Each is drawn between a third and the
#: whole of its length, so that those who wait do not ask in step.
_FIRST_PAUSE_S, _LONGEST_PAUSE_S, _PAUSE_GROWS = 0.004, 0.05, 1.3
#: A wait that lasts so long is reported, in s.
_REPORTED_S = 2.0

#: Letters of the number in the file, which is written over and never shorter.
_PID_WIDTH = 20

_HOLDER = re.compile(r"Conflicting lock is held in (.*?) ?\(PID (\d+)\)")


@dataclass(frozen=True)
class Holder:
    """The process that one waits for: its number where it is known, and what it does."""

    pid: int | None
    what: str

    def __str__(self) -> str:
        return (self.what or "unknown") + ("" if self.pid is None else f" (PID {self.pid})")


@dataclass
class Patience:
    """How long to wait for a file, and what is done when it takes long.

    ``report`` is called once a wait, with the holder and the seconds that one goes on waiting. ``longest_s`` is the
    longest wait so far.
    """

    seconds: float = 0.0
    report: Callable[[Holder, float], None] = lambda holder, seconds: None
    longest_s: float = field(default=0.0, init=False)

    def tries(self, holder: Callable[[], Holder | None]) -> Iterator[float]:
        """Yield the seconds waited so far before each try, until the patience is at its end; pauses in between."""
        begin, pause, reported = time.monotonic(), _FIRST_PAUSE_S, False
        while True:
            waited = time.monotonic() - begin
            self.longest_s = max(self.longest_s, waited)
            yield waited
            waited = time.monotonic() - begin
            if waited >= self.seconds:
                return
            if not reported and waited >= _REPORTED_S:
                reported = True
                who = holder()
                if who is not None:
                    self.report(who, self.seconds - waited)
            # No randomness of a result: only whether two processes ask at the same moment.
            time.sleep(min(random.uniform(pause / 3, pause), max(self.seconds - waited, 0.0)))
            pause = min(pause * _PAUSE_GROWS, _LONGEST_PAUSE_S)


def holder_in(message: str) -> Holder | None:
    """Return who holds the file by DuckDB's own words; None where the message is about something else."""
    named = _HOLDER.search(message)
    if named is not None:
        return Holder(int(named[2]), activity(int(named[2])) or named[1])
    return Holder(None, "") if "Could not set lock" in message else None


@contextmanager
def turn_to_write(path: str, patience: Patience) -> Iterator[Holder | None]:
    """Take the turn for this block and yield None; yield the holder where the patience ended before."""
    with _lock_file(path, make=True) as file:
        if file is None:
            yield None
            return
        if _taken_in_order(file, patience):
            with contextlib.suppress(OSError):
                os.pwrite(file, f"{os.getpid():<{_PID_WIDTH}}\n".encode(), 0)
            yield None
        else:
            yield _awaited(file)


def _awaited(file: int) -> Holder:
    """Who has the turn; where nobody has it, those whose turn it is."""
    return Holder(None, "others who wait for it") if _is_free(file) else _last_writer(file)


def _taken_in_order(file: int, patience: Patience) -> bool:
    """Take the turn when it is this process's; False where the patience ended before."""
    with writers_ticket(file, patience.seconds) as ticket:
        for _ in patience.tries(lambda: _awaited(file)):
            if not _is_free(file):
                ticket.note_taken()
            elif ticket.is_next() and _locked(file, fcntl.LOCK_EX):
                return True
    return False


@contextmanager
def ticket_to_read(path: str) -> Iterator[ReadersTicket]:
    """Yield the ticket of one who comes to read; who has to wait takes it, and has it until this block ends."""
    with _lock_file(path, make=False) as file:
        yield ReadersTicket(file)


def writer_at_work(path: str) -> Holder | None:
    """Return who has the turn to write, or waits with it for those who read to leave; None where nobody does."""
    with _lock_file(path, make=False) as file:
        return None if file is None or _is_free(file) else _last_writer(file)


@contextmanager
def _lock_file(path: str, *, make: bool) -> Iterator[int | None]:
    file = _opened(path, make)
    try:
        yield file
    finally:
        if file is not None:
            os.close(file)


def _opened(path: str, make: bool) -> int | None:
    if not _LOCKS:
        return None
    name = path + LOCK_ENDING
    # A link that somebody planted is not followed, and nothing is written into a file that has another name.
    ways = (os.O_RDWR | os.O_CREAT, os.O_RDWR, os.O_RDONLY) if make else (os.O_RDONLY,)
    for way in ways:
        try:
            file = os.open(name, way | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK, 0o600)
        except (OSError, ValueError):
            continue
        status = os.fstat(file)
        if not stat.S_ISREG(status.st_mode) or status.st_nlink > 1:
            os.close(file)
            return None
        if make:
            _readable_as(path, file, status)
        return file
    return None


def _readable_as(path: str, file: int, status: os.stat_result) -> None:
    """Let all take turns who may open the database."""
    with contextlib.suppress(OSError):
        wanted = stat.S_IMODE(os.stat(path).st_mode) & 0o666
        if status.st_uid == os.geteuid() and stat.S_IMODE(status.st_mode) != wanted | 0o600:
            os.fchmod(file, wanted | 0o600)


def _is_free(file: int) -> bool:
    """Whether nobody has the turn."""
    if not _locked(file, fcntl.LOCK_SH):
        return False
    # Held for a moment: only those who write keep the turn.
    with contextlib.suppress(OSError):
        fcntl.flock(file, fcntl.LOCK_UN)
    return True


def _locked(file: int, way: int) -> bool:
    try:
        fcntl.flock(file, way | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        # A file system without such locks: DuckDB's own decides.
        return True
    return True


def _last_writer(file: int) -> Holder:
    with contextlib.suppress(OSError, ValueError):
        pid = int(os.pread(file, _PID_WIDTH, 0))
        return Holder(pid, activity(pid))
    return Holder(None, "")


def activity(pid: int) -> str:
    """Return what a process does, as `monitor import`, or its program; empty where the system does not say."""
    try:
        arguments = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")[:-1]
    except OSError:
        return ""
    starts = [
        index
        for index, word in enumerate(arguments[:4])
        if Path(word).name == "monitor" or word == "monitor.cli" or word.endswith("monitor/cli/__main__.py")
    ]
    if not starts:
        return Path(arguments[0]).name if arguments else ""
    # Only the verb is named: file names of others are none of the reader's business.
    following = arguments[starts[-1] + 1 :]
    while following and following[0].startswith("-"):
        following = following[1 if "=" in following[0] else 2 :]
    return f"monitor {following[0]}" if following else "monitor"
