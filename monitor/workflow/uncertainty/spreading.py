"""Where the trials of a Monte Carlo are computed: threads of this process, other processes, or a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

from threadpoolctl import threadpool_limits

from monitor.exceptions import InputError
from monitor.uncertainty import BlockSampler, Inputs
from monitor.uncertainty.monte_carlo.propagation import Model
from monitor.uncertainty.monte_carlo.sourced_trials import Moves, moved_estimator
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.workers.cluster import cluster
from monitor.uncertainty.workers.processes import processes
from monitor.uncertainty.workers.spread import spread
from monitor.workflow.uncertainty.request import UncertaintyRequest

# Threads of this process where nothing else was asked for: the trials release the interpreter's lock.
THREADS = 2


@contextmanager
def trials_of(
    run: MeasuredRun, inputs: Inputs, names: tuple[str, ...], request: UncertaintyRequest, moves: Moves
) -> Iterator[tuple[Model, BlockSampler, int]]:
    """Model, sampler and number of threads for ``adaptive_monte_carlo``: the same numbers wherever they are made.

    ``request.workers`` processes of this machine, or the Dask cluster at ``request.cluster``, or else threads of this
    process. ``moves`` are drawn besides the inputs. Raises InputError where both are asked for.
    """
    workers, address = request.workers, request.cluster
    if workers is not None and address is not None:
        raise InputError(
            "--workers starts processes here, --cluster uses those of a cluster: choose one of them"
        )
    recipe = partial(moved_estimator, run, inputs, names, moves, seed=request.seed)
    sampler = BlockSampler(moves.distributions(inputs), seed=request.seed)
    if workers is None and address is None:
        # As in the workers: with several threads the linear algebra of the recipe may round otherwise.
        with threadpool_limits(1, "blas"):
            model = recipe()
        yield model, sampler, THREADS
        return
    with (
        processes(workers) if workers is not None else cluster(str(address)) as engine,
        spread(engine, recipe, sampler) as (remote, blocks),
    ):
        yield remote, blocks, 1
