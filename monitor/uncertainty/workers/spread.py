"""Monte Carlo trials on several processes or machines, with the same numbers to the last bit.

``processes`` starts processes on this machine, ``cluster`` uses a Dask scheduler; either is an ``Engine``. ``spread``
puts the trials of one Monte Carlo on it. Every block of trials has a random stream of its own (``BlockSampler``) and
results are taken in their order, so the numbers depend neither on how many workers there are nor on who dies. Workers
use one thread for linear algebra; on machines whose BLAS differs the numbers agree to about 3e-15 instead (measured
between the kernels of OpenBLAS).
"""

from __future__ import annotations

import hashlib
import itertools
import pickle
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from monitor.exceptions import InputError
from monitor.records import Array
from monitor.uncertainty.monte_carlo.propagation import Model
from monitor.uncertainty.monte_carlo.sampling import BlockSampler
from monitor.uncertainty.workers.engine import Engine, in_order

#: Makes the model of a worker. It travels by pickle, so it is a function of a module or a ``partial`` of one.
Recipe = Callable[[], Model]

#: Trials of one task: some 20 ms of work for SAMBA, against a millisecond for sending a task.
TRIALS_A_TASK = 10_000
#: Models that a worker keeps: one for each run that is being evaluated at the same time.
_KEPT_MODELS = 8


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


# In the worker from here on.


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
