"""Stops a computation that somebody took back: at its next ``checkpoint``, with nothing left half.

A thread that answers for somebody else begins with ``stoppable``; loops that may be long, and every query of the
database, pass a checkpoint. Everywhere else a checkpoint does nothing. What passes none for long, such as a query of
the user's own, says by ``broken_off_by`` how it is ended.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_THREAD = threading.local()


class StoppedError(BaseException):
    """The computation was taken back. No ``except Exception`` goes on after it, and open transactions are undone."""


class Stop(threading.Event):
    """Is set where work is taken back; set again, it breaks off anew what the work waits for."""

    def __init__(self) -> None:
        super().__init__()
        self.breaks: list[Callable[[], object]] = []

    def set(self) -> None:
        """Let the work end at its next checkpoint, and break off what it waits for."""
        super().set()
        for break_off in tuple(self.breaks):
            break_off()


@contextmanager
def stoppable(stop: Stop) -> Iterator[None]:
    """Let ``stop`` end what this thread does in the block, by StoppedError."""
    outer = getattr(_THREAD, "stop", None)
    _THREAD.stop = stop
    try:
        yield
    finally:
        _THREAD.stop = outer


def is_stoppable() -> bool:
    """Return whether somebody can take back what this thread does."""
    return getattr(_THREAD, "stop", None) is not None


def checkpoint() -> None:
    """Raise StoppedError where the work of this thread was taken back."""
    stop: Stop | None = getattr(_THREAD, "stop", None)
    if stop is not None and stop.is_set():
        raise StoppedError("the work was taken back")


@contextmanager
def broken_off_by(break_off: Callable[[], object]) -> Iterator[None]:
    """Have ``break_off`` called, in another thread, where the work of this one is taken back within the block."""
    stop: Stop | None = getattr(_THREAD, "stop", None)
    if stop is None:
        yield
        return
    stop.breaks.append(break_off)
    try:
        # Taken back before the line above nobody would break it off.
        checkpoint()
        yield
    finally:
        stop.breaks.remove(break_off)
