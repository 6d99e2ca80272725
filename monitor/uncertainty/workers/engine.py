"""Where tasks are done: an ``Engine`` has workers, and what a dead worker had in hand is done again by another.

Results are taken in the order of the tasks, so they depend neither on how many workers there are nor on who dies.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Generator, Iterable
from functools import partial
from typing import Any, Protocol, TypeVar

from monitor.exceptions import RefusedResultError

Item = TypeVar("Item")
Result = TypeVar("Result")
#: Tasks in hand for every worker, so that none waits for the results of others to be taken.
AHEAD = 3
#: A task that so many workers died of kills workers.
MOST_DEATHS = 5


class WorkerLostError(Exception):
    """The worker that had a task in hand died; the task can be given to another."""


class Engine(Protocol):
    """Where tasks are done, ``size`` of them at once."""

    @property
    def size(self) -> int:
        """How many workers there are."""
        ...

    def submit(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Hand a task out; the answer is a handle for ``result``."""
        ...

    def result(self, handle: Any) -> Any:
        """Wait for a task. Raises WorkerLostError where its worker died, and whatever the task raised."""
        ...

    def cancel(self, handles: Iterable[Any]) -> None:
        """Forget tasks whose results nobody wants."""
        ...


class Here:
    """This process: a task is done when its result is asked for."""

    size = 1

    def submit(self, task: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
        """Remember a task."""
        return partial(task, *arguments)

    def result(self, handle: Callable[[], Any]) -> Any:
        """Do it."""
        return handle()

    def cancel(self, handles: Iterable[Any]) -> None:
        """Nothing was begun."""


def in_order(
    engine: Engine, task: Callable[..., Result], arguments: Iterable[tuple[Any, ...]]
) -> Generator[Result, None, None]:
    """The results of ``task`` for each of ``arguments``, in their order, a bounded number ahead.

    Raises RefusedResultError where ``MOST_DEATHS`` workers died of one task.
    """
    waiting = iter(arguments)
    in_hand: deque[tuple[tuple[Any, ...], Any]] = deque()

    def refill() -> None:
        for task_arguments in itertools.islice(waiting, max(0, AHEAD * engine.size - len(in_hand))):
            in_hand.append((task_arguments, engine.submit(task, *task_arguments)))

    try:
        refill()
        while in_hand:
            arguments, handle = in_hand.popleft()
            yield _result(engine, task, arguments, handle)
            refill()
    finally:
        engine.cancel(handle for _, handle in in_hand)


def _result(
    engine: Engine, task: Callable[..., Result], task_arguments: tuple[Any, ...], handle: Any
) -> Result:
    for _ in range(MOST_DEATHS):
        try:
            result: Result = engine.result(handle)
            return result
        except WorkerLostError:
            handle = engine.submit(task, *task_arguments)
    engine.cancel([handle])
    raise RefusedResultError(
        f"{MOST_DEATHS} workers died one after the other with the same task in hand: it needs more memory than they "
        "have, or something ends them; nothing was kept"
    )
