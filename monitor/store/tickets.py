"""Tickets of those who wait for a database file: writers write in order, and readers come in between two of them.

Asking again and again lets in whoever happens to ask when the file is free: beside eight importers a reader once waited
227 s. So whoever waits takes a ticket, and

- writers write in the order of their tickets;
- a writer whose turn it is lets in first whoever waits to read at that moment. Whoever comes to read later waits for
  this writer, and for no other: a reader waits for two writers at most.

A ticket is a lock on one byte of the file of turns, behind its content: on the byte behind the last that is locked. It
belongs to the open file (``F_OFD_SETLK`` of Linux), needs no right but to read, and ends with its process, however that
ends. Two who take one at the same instant may have the same, and come in either order. A process that is stopped keeps
others waiting for ``_OVERTAKEN_S`` at each turn. Where the system has no such locks, nobody has a ticket, and chance
decides.
"""

from __future__ import annotations

import struct
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

try:
    import fcntl
except ImportError:  # Windows
    _TICKETS = False
else:
    # The name may be there on other systems too, whose record of a lock is laid out otherwise.
    _TICKETS = sys.platform == "linux" and hasattr(fcntl, "F_OFD_SETLK")

#: First bytes of the tickets of writers and of readers; a range ends at twice its first byte.
_WRITERS, _READERS = 1 << 40, 1 << 41
#: ``struct flock`` of Linux: kind, whence, start and length in bytes, process (none: the lock is of the open file).
_FLOCK = struct.Struct("hhqqi4x")
#: A free file is left to those whose turn it is for so long, in s, and no longer than one is ready to wait. They look
#: twenty times a second; twenty readers who come in one after the other took 1.5 s on two cores at a load of 23.
_OVERTAKEN_S = 3.0


class ReadersTicket:
    """The ticket of one who waits to read, by the open file of turns; None where there is no such file."""

    def __init__(self, file: int | None) -> None:
        self._file = file
        self._number: int | None = None

    def take(self) -> None:
        """Take the ticket, once; it is given back when the file is closed."""
        if self._file is not None and self._number is None:
            self._number = _taken(self._file, _READERS)


class WritersTicket:
    """The ticket of one who waits to write; ``is_next`` says whether it is that writer's turn."""

    def __init__(self, file: int, patience_s: float) -> None:
        self._file = file
        self._number = _taken(file, _WRITERS)
        self._overtakes_after_s = min(_OVERTAKEN_S, patience_s)
        #: Behind the last ticket of those who waited to read when this writer was the next; None: it was not yet.
        self._behind_readers: int | None = None
        self._free_since: float | None = None

    def is_next(self) -> bool:
        """Whether nobody comes before this writer. The file of turns is free, and stays so until one takes it."""
        moment = time.monotonic()
        if self._free_since is None:
            self._free_since = moment
        if self._number is None or moment - self._free_since >= self._overtakes_after_s:
            return True
        if _locked_byte(self._file, _WRITERS, self._number) is not None:
            return False
        if self._behind_readers is None:
            self._behind_readers = _behind_last(self._file, _READERS)
        return _locked_byte(self._file, _READERS, self._behind_readers) is None

    def note_taken(self) -> None:
        """Note that somebody else writes: who comes before this one is asked anew when the file is free again."""
        self._free_since = self._behind_readers = None

    def give_back(self) -> None:
        """Give the ticket back: whoever comes behind is no longer kept waiting by it."""
        if self._number is not None:
            _lock(self._file, fcntl.F_UNLCK, self._number)
            self._number = None


@contextmanager
def writers_ticket(file: int, patience_s: float) -> Iterator[WritersTicket]:
    """Hold a ticket for this block, by the open file of turns, for whoever waits at most so long."""
    ticket = WritersTicket(file, patience_s)
    try:
        yield ticket
    finally:
        ticket.give_back()


def _taken(file: int, first: int) -> int | None:
    """Take the ticket behind the last of a range; None where the file system has none."""
    if not _TICKETS:
        return None
    try:
        number = _behind_last(file, first)
        _lock(file, fcntl.F_RDLCK, number)
    except OSError:
        return None
    return number


def _behind_last(file: int, first: int) -> int:
    """Return the byte behind the last that is locked in a range that begins at ``first``; ``first`` where none is."""
    behind = first
    while True:
        locked = _locked_byte(file, behind, 2 * first)
        if locked is None:
            return behind
        behind = locked + 1


def _locked_byte(file: int, first: int, end: int) -> int | None:
    """Return a byte from ``first`` to before ``end`` that somebody else has locked; None where nobody has."""
    if end <= first:
        return None
    asked = _FLOCK.pack(fcntl.F_WRLCK, 0, first, end - first, 0)
    kind, _, start, _, _ = _FLOCK.unpack(fcntl.fcntl(file, fcntl.F_OFD_GETLK, asked))
    return None if kind == fcntl.F_UNLCK else max(int(start), first)


def _lock(file: int, kind: int, number: int) -> None:
    fcntl.fcntl(file, fcntl.F_OFD_SETLK, _FLOCK.pack(kind, 0, number, 1, 0))
