"""Worker processes of this machine, each on a connection of its own.

``concurrent.futures.ProcessPoolExecutor`` is not used: its workers share one pipe for results, and one that is
killed while it writes leaves half a message in it, on which the parent waits for ever (seen once in a full run of
the tests). Here a worker that dies closes its own connection, and the parent knows at once.
"""

from __future__ import annotations

import multiprocessing
import pickle
import queue
import signal
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from typing import Any

from monitor.exceptions import InputError
from monitor.uncertainty.workers.engine import WorkerLostError


class _Worker:
    """A process and the parent's end of its connection. Spawned, not forked: a forked process inherits the locks of
    threads in whatever state they are, and the ends of other workers' connections."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs,), daemon=True)
        with _deaf_to_ctrl_c():
            self.process.start()
        # Only the worker holds its end from now on: when it dies, the parent reads the end of the file.
        theirs.close()

    def do(self, task: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        """The result of a task, or what it raised. Raises WorkerLostError where the process is gone."""
        try:
            self.connection.send((task, arguments))
            succeeded, result = self.connection.recv()
        except (EOFError, OSError) as error:
            raise WorkerLostError from error
        if not succeeded:
            raise result
        return result

    def end(self) -> None:
        self.process.kill()
        self.process.join()
        self.connection.close()


class Processes:
    """Worker processes of this machine; one that died is replaced. A thread for each waits for its answers."""

    def __init__(self, workers: int) -> None:
        if workers < 1:
            raise InputError(f"--workers {workers}: at least one worker is needed")
        self._workers = {number: _Worker() for number in range(workers)}
        self._idle: queue.SimpleQueue[int] = queue.SimpleQueue()
        for number in self._workers:
            self._idle.put(number)
        self._closing = threading.Event()
        self._threads = ThreadPoolExecutor(workers)

    @property
    def size(self) -> int:
        """How many processes there are."""
        return len(self._workers)

    @property
    def process_ids(self) -> tuple[int, ...]:
        """The processes that run now."""
        return tuple(worker.process.pid or 0 for worker in self._workers.values())

    def _do(self, task: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        number = self._idle.get()
        try:
            return self._workers[number].do(task, arguments)
        except WorkerLostError:
            if not self._closing.is_set():
                self._workers[number].end()
                self._workers[number] = _Worker()
            raise
        finally:
            self._idle.put(number)

    def submit(self, task: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Hand a task out."""
        return self._threads.submit(self._do, task, arguments)

    def result(self, handle: Future[Any]) -> Any:
        """Wait for a task."""
        return handle.result()

    def cancel(self, handles: Iterable[Future[Any]]) -> None:
        """Forget tasks."""
        for handle in handles:
            handle.cancel()

    def close(self) -> None:
        """End the processes, whatever they have in hand."""
        self._closing.set()
        self._threads.shutdown(wait=False, cancel_futures=True)
        for worker in self._workers.values():
            worker.process.kill()
        self._threads.shutdown(wait=True)
        for worker in self._workers.values():
            worker.end()


@contextmanager
def processes(workers: int) -> Iterator[Processes]:
    """``workers`` processes of this machine, ended at the end. Raises InputError for fewer than one."""
    engine = Processes(workers)
    try:
        yield engine
    finally:
        engine.close()


@contextmanager
def _deaf_to_ctrl_c() -> Iterator[None]:
    """A process started meanwhile is born with SIGINT blocked, and its start is not broken off: Ctrl-C while it imports
    leaves no traceback of it. It is heard afterwards."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # else the start begins it, which unblocks the signal
    # What is blocked here another thread may receive, and Python would raise it here.
    heard: list[int] = []
    in_main_thread = threading.current_thread() is threading.main_thread()
    handler = signal.signal(signal.SIGINT, lambda number, _: heard.append(number)) if in_main_thread else None
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        if in_main_thread:
            signal.signal(signal.SIGINT, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if heard:
            signal.raise_signal(signal.SIGINT)


def _serve(connection: Connection) -> None:
    """In the worker: do tasks until the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the parent decides
    try:
        while True:
            task, arguments = connection.recv()
            answer: tuple[bool, Any]
            try:
                answer = True, task(*arguments)
            except Exception as error:
                error.add_note("In the worker:\n" + traceback.format_exc())
                answer = False, error
            try:
                connection.send(answer)
            except (pickle.PicklingError, TypeError, AttributeError) as error:
                connection.send((False, RuntimeError(f"the answer of a worker cannot be sent: {error}")))
    except (EOFError, OSError):
        return
