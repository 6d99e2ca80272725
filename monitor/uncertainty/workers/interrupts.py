"""Keeps Ctrl-C until a block is over that would lose it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def interrupts_kept() -> Iterator[None]:
    """Let Ctrl-C take effect at the end of this block.

    The compiler calls back into Python from C (llvmlite), where an exception is printed and forgotten: the program
    would go on as if nobody had asked it to stop. Compiling takes up to half a minute on a fresh installation; what was
    asked meanwhile is done then. Outside the main thread, which alone receives signals, nothing is changed.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    asked = False

    def note(*_: object) -> None:
        nonlocal asked
        asked = True

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if asked:
        before(signal.SIGINT, None)
