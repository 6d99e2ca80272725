"""Stops a computation that somebody took back: at its next ``checkpoint``, with nothing left half.

A thread that answers for somebody else begins with ``stoppable``; loops that may be long, and every query of the
database, pass a checkpoint. Everywhere else a checkpoint does nothing.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

_THREAD = threading.local()


class StoppedError(BaseException):
    """The computation was taken back. No ``except Exception`` goes on after it, and open transactions are undone."""


@contextmanager
def stoppable(stop: threading.Event) -> Iterator[None]:
    """Let ``stop`` end what this thread does in the block, by StoppedError."""
    outer = getattr(_THREAD, "stop", None)
    _THREAD.stop = stop
    try:
        yield
    finally:
        _THREAD.stop = outer


def checkpoint() -> None:
    """Raise StoppedError where the work of this thread was taken back."""
    stop: threading.Event | None = getattr(_THREAD, "stop", None)
    if stop is not None and stop.is_set():
        raise StoppedError("the work was taken back")
