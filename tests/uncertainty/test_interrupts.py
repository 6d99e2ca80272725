"""Ctrl-C that comes while C calls back into Python is not lost."""

from __future__ import annotations

import ctypes
import signal
import threading

import pytest

from monitor.uncertainty.runs import kernel
from monitor.uncertainty.workers.interrupts import interrupts_kept

#: A function of C that calls Python, as the compiler does: an exception in it is printed and forgotten.
asked_in_a_callback = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))
#: What a KeyboardInterrupt says that a signal raised, and none of a test: nothing.
BY_A_SIGNAL = r"^$"


def test_ctrl_c_in_a_callback_of_c_ends_the_program_after_the_block() -> None:
    behind = []
    handler = signal.getsignal(signal.SIGINT)

    def block() -> None:
        with interrupts_kept():
            asked_in_a_callback()
            behind.append("the block goes on")

    with pytest.raises(KeyboardInterrupt, match=BY_A_SIGNAL):
        block()
    assert behind == ["the block goes on"]
    assert signal.getsignal(signal.SIGINT) is handler
    # A fault of the block is told first.
    with pytest.raises(ValueError, match="of the block"), interrupts_kept():
        raise ValueError("of the block")
    assert signal.getsignal(signal.SIGINT) is handler


def test_another_thread_leaves_the_signals_alone() -> None:
    seen = []

    def work() -> None:
        with interrupts_kept():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.getsignal(signal.SIGINT)]


def test_the_kernel_is_compiled_with_interrupts_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    class Uncompiled:
        signatures: tuple[object, ...] = ()

        def __call__(self, *_: object) -> None:
            asked_in_a_callback()

    monkeypatch.setattr(kernel, "_block", Uncompiled())
    with pytest.raises(KeyboardInterrupt, match=BY_A_SIGNAL):
        kernel.call_block()
