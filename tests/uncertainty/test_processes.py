"""Starting a worker is not broken off by Ctrl-C: half a start would leave the worker's traceback on the terminal."""

import multiprocessing
import os
import signal
import threading
import time
from multiprocessing.context import SpawnProcess

import pytest

from monitor.uncertainty.workers.processes import Processes


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="signals cannot be blocked here")
def test_ctrl_c_while_a_worker_starts_is_heard_afterwards(monkeypatch):
    done = threading.Event()
    begun = []
    start = SpawnProcess.start

    def slow(process):
        # Another thread, which does not block the signal, receives it, and Python would raise it in this one.
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.2)
        start(process)
        begun.append(process)

    waiting = threading.Thread(target=done.wait, daemon=True)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    waiting.start()
    monkeypatch.setattr(SpawnProcess, "start", slow)
    try:
        with pytest.raises(KeyboardInterrupt, match=r"^$"):
            Processes(1)
        assert len(begun) == 1
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        done.set()
        signal.signal(signal.SIGINT, before)
        for process in multiprocessing.active_children():
            process.kill()
            process.join()
