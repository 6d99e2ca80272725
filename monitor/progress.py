"""Tells whoever waits for a computation how far it is: a share from 0 to 1, or in words what is being done.

A face that shows progress begins with ``listening``; a loop that can say how much is left tells it. Where nobody
listens nothing is told, and nothing should be computed to be told: ``is_awaited`` says so.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_THREAD = threading.local()


@contextmanager
def listening(tell: Callable[[float], None], say: Callable[[str], None] | None = None) -> Iterator[None]:
    """Let ``tell`` hear how far what this thread does in the block is, and ``say`` what it does where nobody knows how
    far that is (None: whoever listens already hears that)."""
    outer, outer_say = getattr(_THREAD, "tell", None), getattr(_THREAD, "say", None)
    _THREAD.tell, _THREAD.say = tell, outer_say if say is None else say
    try:
        yield
    finally:
        _THREAD.tell, _THREAD.say = outer, outer_say


@contextmanager
def saying(activity: str) -> Iterator[None]:
    """Say what the block does, once and of unknown length; an empty text says that it is over."""
    say: Callable[[str], None] | None = getattr(_THREAD, "say", None)
    if say is None:
        yield
        return
    say(activity)
    try:
        yield
    finally:
        say("")


@contextmanager
def within(low: float, high: float) -> Iterator[None]:
    """Let what the block tells, from 0 to 1, count from ``low`` to ``high`` of the whole."""
    tell: Callable[[float], None] | None = getattr(_THREAD, "tell", None)
    if tell is None:
        yield
        return
    outer = tell
    with listening(lambda share: outer(low + (high - low) * share)):
        yield


def is_awaited() -> bool:
    """Return whether anybody listens to what this thread does."""
    return getattr(_THREAD, "tell", None) is not None


def told(share: float) -> None:
    """Tell that a ``share`` of the work is done, 0 to 1."""
    tell: Callable[[float], None] | None = getattr(_THREAD, "tell", None)
    if tell is not None:
        tell(min(max(share, 0.0), 1.0))
