"""Monte Carlo trials and runs on several processes or machines, with the same numbers to the last bit.

``processes`` starts processes on this machine; ``cluster`` uses a Dask scheduler that is there already (extra
``cluster``). Either is an ``Engine``; ``spread`` puts the trials of one Monte Carlo on it, ``monte_carlo_of_runs``
many runs with one task each, ``map_in_order`` anything else. Every block of trials has a random stream of its own
(``BlockSampler``) and results are taken in their order, so the numbers depend neither on how many workers there
are nor on who dies: what a dead worker had in hand is done again by another. Workers use one thread for linear
algebra; on machines whose BLAS differs the numbers agree to about 3e-15 instead (measured between the kernels of
OpenBLAS).
"""

from __future__ import annotations

import hashlib
import itertools
import multiprocessing
import pickle
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from monitor.exceptions import InputError, RefusedResultError
from monitor.records import Array
from monitor.uncertainty.adaptive import MonteCarloResult, adaptive_monte_carlo
from monitor.uncertainty.propagation import Model
from monitor.uncertainty.sampling import BlockSampler

Item = TypeVar("Item")
Result = TypeVar("Result")
#: Makes the model of a worker. It travels by pickle, so it is a function of a module or a ``partial`` of one.
Recipe = Callable[[], Model]

#: Trials of one task: some 20 ms of work for SAMBA, against a millisecond for sending a task.
TRIALS_A_TASK = 10_000
#: Tasks in hand for every worker, so that none waits for the results of others to be taken.
AHEAD = 3
#: A task that so many workers died of kills workers.
MOST_DEATHS = 5
#: Models that a worker keeps: one for each run that is being evaluated at the same time.
_KEPT_MODELS = 8


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


class Processes:
    """Worker processes of this machine; a pool that lost a process is replaced by a new one."""

    def __init__(self, workers: int) -> None:
        if workers < 1:
            raise InputError(f"--workers {workers}: at least one worker is needed")
        self._workers = workers
        self._pool = self._new()

    def _new(self) -> ProcessPoolExecutor:
        # Spawned, not forked: a forked process inherits threads' locks in whatever state they are.
        return ProcessPoolExecutor(self._workers, mp_context=multiprocessing.get_context("spawn"))

    @property
    def size(self) -> int:
        """How many processes there are."""
        return self._workers

    @property
    def process_ids(self) -> tuple[int, ...]:
        """The processes that run now."""
        return tuple(self._pool._processes or ())

    def submit(self, task: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Hand a task out."""
        try:
            return self._pool.submit(task, *arguments)
        except BrokenExecutor:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = self._new()
            return self._pool.submit(task, *arguments)

    def result(self, handle: Future[Any]) -> Any:
        """Wait for a task."""
        try:
            return handle.result()
        except BrokenExecutor as error:
            raise WorkerLostError from error

    def cancel(self, handles: Iterable[Future[Any]]) -> None:
        """Forget tasks."""
        for handle in handles:
            handle.cancel()

    def close(self) -> None:
        """End the processes."""
        self._pool.shutdown(wait=True, cancel_futures=True)


class Cluster:
    """A Dask distributed cluster that somebody started; ``client`` is the connection to its scheduler."""

    def __init__(self, client: Any) -> None:
        self.client = client

    @property
    def size(self) -> int:
        """How many threads of workers the scheduler has now, at least one: workers may come later."""
        return max(1, int(sum(self.client.nthreads().values())))

    def submit(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Hand a task out."""
        return self.client.submit(task, *arguments, pure=False)

    def result(self, handle: Any) -> Any:
        """Wait for a task; the scheduler itself gives it to another worker where one died."""
        from distributed import KilledWorker
        from distributed.client import FutureCancelledError

        try:
            return handle.result()
        except KilledWorker as error:
            raise WorkerLostError from error
        except (FutureCancelledError, OSError) as error:
            raise InputError(
                f"the scheduler of the cluster was lost while it worked ({error}); start it and ask again"
            ) from error

    def cancel(self, handles: Iterable[Any]) -> None:
        """Forget tasks."""
        self.client.cancel(list(handles), reason="the result is not needed any more", msg=False)


@contextmanager
def processes(workers: int) -> Iterator[Processes]:
    """``workers`` processes of this machine, ended at the end. Raises InputError for fewer than one."""
    engine = Processes(workers)
    try:
        yield engine
    finally:
        engine.close()


@contextmanager
def cluster(address: str, patience_s: float = 10.0) -> Iterator[Cluster]:
    """The Dask cluster whose scheduler listens at ``address``, such as ``tcp://host:8786``.

    Raises InputError where the extra is not installed, or no scheduler with a worker answers within ``patience_s``.
    Whoever reaches a scheduler can run anything on its workers: keep it inside, or use ``tls://``.
    """
    try:
        import distributed
    except ImportError as error:
        raise InputError(
            "--cluster needs Dask distributed; install it with: pip install 'machine-health-monitor[cluster]'"
        ) from error
    try:
        connect: Any = distributed.Client
        client = connect(address, timeout=patience_s, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--cluster {address}: no Dask scheduler answers there ({error}); start one with `dask scheduler` and "
            "workers with `dask worker ADDRESS`, and give its address, for example tcp://127.0.0.1:8786"
        ) from error
    try:
        try:
            client.wait_for_workers(1, timeout=patience_s)
        except TimeoutError as error:
            raise InputError(
                f"--cluster {address}: the scheduler has no workers; start some with `dask worker {address}`"
            ) from error
        yield Cluster(client)
    finally:
        client.close()


def in_order(
    engine: Engine, task: Callable[..., Result], arguments: Iterable[tuple[Any, ...]]
) -> Generator[Result, None, None]:
    """The results of ``task`` for each of ``arguments``, in their order, a bounded number ahead.

    Raises RefusedResultError where ``MOST_DEATHS`` workers died of one task.
    """
    left = iter(arguments)
    in_hand: deque[tuple[tuple[Any, ...], Any]] = deque()

    def refill() -> None:
        for one in itertools.islice(left, max(0, AHEAD * engine.size - len(in_hand))):
            in_hand.append((one, engine.submit(task, *one)))

    try:
        refill()
        while in_hand:
            one, handle = in_hand.popleft()
            yield _result(engine, task, one, handle)
            refill()
    finally:
        engine.cancel(handle for _, handle in in_hand)


def _result(engine: Engine, task: Callable[..., Result], one: tuple[Any, ...], handle: Any) -> Result:
    for _ in range(MOST_DEATHS):
        try:
            found: Result = engine.result(handle)
            return found
        except WorkerLostError:
            handle = engine.submit(task, *one)
    engine.cancel([handle])
    raise RefusedResultError(
        f"{MOST_DEATHS} workers died one after the other with the same task in hand: it needs more memory than they "
        "have, or something ends them; nothing was kept"
    )


def map_in_order(engine: Engine, task: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """``task`` of every item, one task an item, such as a run; in the order of the items."""
    return list(in_order(engine, task, ((item,) for item in items)))


@dataclass(frozen=True)
class NumberedBlocks(BlockSampler):
    """Stands for a sampler whose blocks are drawn where the model is: a block holds nothing but its number."""

    def draw(self, block: int) -> Array:
        """The number of the block, ``block_size`` times: (block_size, 1)."""
        return np.full((self.block_size, 1), float(block))


class SpreadModel:
    """A model whose blocks are drawn and evaluated by an engine; call it with ``NumberedBlocks``, in order."""

    def __init__(self, engine: Engine, recipe: Recipe, sampler: BlockSampler) -> None:
        payload = pickle.dumps((recipe, sampler))
        key = hashlib.sha256(payload).hexdigest()
        self._each = max(1, TRIALS_A_TASK // sampler.block_size)
        firsts = itertools.count(0, self._each)
        self._results = in_order(engine, _blocks, ((key, payload, first, self._each) for first in firsts))
        self._ready: deque[tuple[Array, npt.NDArray[np.bool_]]] = deque()
        self._next = 0

    def __call__(self, block: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        """Outputs (block_size, m) and which trials converged (block_size,)."""
        if int(block[0, 0]) != self._next:
            raise InputError(
                f"blocks are taken in order: {self._next} is next, not {int(block[0, 0])}; use one thread"
            )
        if not self._ready:
            self._ready.extend(next(self._results))
        self._next += 1
        return self._ready.popleft()

    def close(self) -> None:
        """Forget what is still in hand."""
        self._results.close()


@contextmanager
def spread(
    engine: Engine, recipe: Recipe, sampler: BlockSampler
) -> Iterator[tuple[SpreadModel, NumberedBlocks]]:
    """A model and a sampler for ``adaptive_monte_carlo`` (with its one thread) whose trials an engine computes.

    ``recipe`` makes the model in every worker; ``sampler`` is the one that a single process would use, and the
    results are the same as there.
    """
    model = SpreadModel(engine, recipe, sampler)
    try:
        yield model, NumberedBlocks(sampler.groups, sampler.seed, sampler.block_size)
    finally:
        model.close()


@dataclass(frozen=True)
class RunTask:
    """The Monte Carlo of one run, for a worker to do as a whole; the fields are those of ``adaptive_monte_carlo``."""

    recipe: Recipe
    sampler: BlockSampler
    names: tuple[str, ...]
    units: tuple[str, ...]
    p: float = 0.95
    digits: int = 2
    tighten: float = 1.0


def monte_carlo_of_runs(engine: Engine, tasks: Iterable[RunTask]) -> list[MonteCarloResult]:
    """The results of many runs, one task a run, in their order: better than ``spread`` where there are many."""
    return map_in_order(engine, _whole_run, tasks)


# In the worker from here on.


def _whole_run(task: RunTask) -> MonteCarloResult:
    threadpool_limits(1, "blas")
    return adaptive_monte_carlo(
        task.recipe(),
        task.sampler,
        task.names,
        task.units,
        p=task.p,
        digits=task.digits,
        tighten=task.tighten,
    )


_models: dict[str, tuple[Model, BlockSampler]] = {}
_making = threading.Lock()


def _model(key: str, payload: bytes) -> tuple[Model, BlockSampler]:
    """The model and sampler of a worker, made once; linear algebra on one thread from then on."""
    with _making:
        if key not in _models:
            threadpool_limits(1, "blas")
            while len(_models) >= _KEPT_MODELS:
                del _models[next(iter(_models))]
            recipe, sampler = pickle.loads(payload)
            _models[key] = recipe(), sampler
        return _models[key]


def _blocks(key: str, payload: bytes, first: int, count: int) -> list[tuple[Array, npt.NDArray[np.bool_]]]:
    model, sampler = _model(key, payload)
    return [model(sampler.draw(block)) for block in range(first, first + count)]
