"""The same numbers to the last bit on one thread, on processes and on a Dask cluster, whoever dies meanwhile."""

import os
import signal
import sys
import threading
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from monitor.exceptions import InputError, RefusedResultError
from monitor.uncertainty import (
    BlockSampler,
    MonteCarloOptions,
    adaptive_monte_carlo,
    monte_carlo,
    normal_inputs,
    run_estimator,
    uncorrelated,
)
from monitor.uncertainty.workers.cluster import cluster
from monitor.uncertainty.workers.engine import MOST_DEATHS, WorkerLostError, in_order
from monitor.uncertainty.workers.processes import processes
from monitor.uncertainty.workers.spread import NumberedBlocks, spread

TRIALS = 80_000
NAMES = ("EC0Y", "EXX", "EYY", "EZZ")
UNITS = ("µrad", "µm/m", "µm/m", "µm/m")


def all_in_order(engine, task, arguments):
    """The task of every argument, one task each, in their order."""
    return list(in_order(engine, task, ((argument,) for argument in arguments)))


@pytest.fixture(scope="module")
def evaluation(make_run):
    """Recipe of the model, sampler, and the result on one thread of this process."""
    run = make_run("w C B X b Z Y (C1) t", poses=8)
    count = len(run.input_names)
    inputs = uncorrelated(run.input_names, ("mm",) * count, run.inputs, np.full(count, 1e-3), source="r")
    recipe = partial(run_estimator, run, inputs, NAMES, seed=1)
    sampler = BlockSampler(normal_inputs(inputs), seed=5)
    with threadpool_limits(1, "blas"):
        model = recipe()
    return recipe, sampler, _evaluate(model, sampler)


def _evaluate(model, sampler):
    return monte_carlo(model, sampler, NAMES, UNITS, TRIALS)


def _same(one, other):
    return (
        one.trials == other.trials
        and np.array_equal(one.estimate, other.estimate)
        and np.array_equal(one.covariance, other.covariance)
        and np.array_equal(one.sample, other.sample)
        and (one.k_p, one.k_q) == (other.k_p, other.k_q)
    )


def _whole_run(recipe, sampler):
    """The Monte Carlo of one run, for a worker to do as a whole."""
    with threadpool_limits(1, "blas"):
        model = recipe()
        return adaptive_monte_carlo(model, sampler, NAMES, UNITS, MonteCarloOptions(digits=1))


def _two_runs(recipe, sampler):
    """Two runs that differ in their seed, as tasks of a worker."""
    return [partial(_whole_run, recipe, replace(sampler, seed=seed)) for seed in (7, 8)]


def _called(task):
    return task()


def _killing(model, victim, at):
    """The model; before block ``at`` it ends a process that ``victim`` names."""
    killed = []

    def called(block):
        if block[0, 0] == at:
            killed.append(victim())
            os.kill(killed[-1], signal.SIGKILL)
        return model(block)

    return called, killed


@pytest.mark.slow
def test_jcgm102_7_2_same_bits_on_two_processes_of_which_one_is_killed_in_the_middle(evaluation):
    recipe, sampler, alone = evaluation
    with processes(2) as engine, spread(engine, recipe, sampler) as (model, blocks):
        called, killed = _killing(model, lambda: engine.process_ids[0], at=25)
        found = _evaluate(called, blocks)
        after = engine.process_ids
    assert len(killed) == 1
    assert killed[0] not in after
    assert _same(found, alone)


@pytest.mark.slow
def test_jcgm102_7_2_same_bits_on_a_dask_cluster(evaluation):
    distributed = pytest.importorskip("distributed")
    recipe, sampler, alone = evaluation
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None,
            silence_logs=50,
        ) as local,
        cluster(local.scheduler_address) as engine,
        spread(engine, recipe, sampler) as (model, blocks),
    ):  # fmt: skip
        assert _same(_evaluate(model, blocks), alone)


@pytest.mark.slow
def test_jcgm102_7_2_same_bits_on_a_dask_cluster_of_which_one_worker_is_killed_in_the_middle(evaluation):
    distributed = pytest.importorskip("distributed")
    recipe, sampler, alone = evaluation
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None,
            silence_logs=50,
        ) as local,
        cluster(local.scheduler_address) as engine,
    ):  # fmt: skip
        pids = engine.client.run(os.getpid)
        assert len(pids) == 2
        with spread(engine, recipe, sampler) as (model, blocks):
            called, killed = _killing(model, lambda: next(iter(pids.values())), at=25)
            found = _evaluate(called, blocks)
        runs = all_in_order(engine, _called, _two_runs(recipe, sampler))
    assert len(killed) == 1
    assert _same(found, alone)
    assert all(
        _same(one, other) for one, other in zip(runs, map(_called, _two_runs(recipe, sampler)), strict=True)
    )


def test_runs_on_processes_come_back_in_their_order():
    with processes(2) as engine:
        assert all_in_order(engine, abs, range(-20, 0)) == list(range(20, 0, -1))


# What a process does that is killed while it writes: half of an answer stays in its connection.
KILLED_WHILE_ANSWERING = """
import gc, os, signal
from multiprocessing.connection import Connection
mine = next(one for one in gc.get_objects() if isinstance(one, Connection) and not one.closed)
os.write(mine.fileno(), bytes([0, 0, 255, 255]) + bytes(1000))
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
def test_a_worker_killed_in_the_middle_of_its_answer_is_noticed():
    with processes(2) as engine:
        before = engine.process_ids
        with pytest.raises(RefusedResultError, match="5 workers died one after the other"):
            list(in_order(engine, exec, [(KILLED_WHILE_ANSWERING,)]))
        assert engine.process_ids != before
        assert all_in_order(engine, abs, [-1, -2, -3]) == [1, 2, 3]


def test_what_a_task_raises_is_not_taken_for_a_lost_worker():
    with processes(1) as engine, pytest.raises(EOFError, match="of the task"):
        list(in_order(engine, exec, [("raise EOFError('of the task')",)]))


def test_an_answer_that_cannot_be_sent_is_said_so():
    with processes(1) as engine, pytest.raises(RuntimeError, match="the answer of a worker cannot be sent"):
        list(in_order(engine, threading.Lock, [()]))


class _Deadly:
    """An engine whose workers die ``deaths`` times of the task with the argument 1."""

    size = 2

    def __init__(self, deaths):
        self.deaths = deaths
        self.cancelled = []

    def submit(self, task, *arguments):
        return task, arguments

    def result(self, handle):
        task, arguments = handle
        if arguments == (1,) and self.deaths > 0:
            self.deaths -= 1
            raise WorkerLostError
        return task(*arguments)

    def cancel(self, handles):
        self.cancelled += [arguments for _, arguments in handles]


def test_a_task_that_some_workers_die_of_is_done_by_another():
    assert list(in_order(_Deadly(MOST_DEATHS - 1), abs, [(0,), (1,), (2,)])) == [0, 1, 2]


def test_a_task_that_kills_every_worker_is_refused():
    engine = _Deadly(MOST_DEATHS)
    with pytest.raises(RefusedResultError, match="5 workers died one after the other with the same task"):
        list(in_order(engine, abs, [(0,), (1,), (2,)]))
    assert (2,) in engine.cancelled


def test_the_error_of_a_task_arrives_as_it_was_raised():
    with processes(1) as engine, pytest.raises(ValueError, match="invalid literal for int"):
        all_in_order(engine, int, ["1", "one"])


def test_blocks_are_refused_out_of_order(evaluation):
    recipe, sampler, _ = evaluation
    numbered = NumberedBlocks(sampler.groups, sampler.seed, sampler.block_size)
    with (
        spread(_Deadly(0), recipe, sampler) as (model, blocks),
        pytest.raises(InputError, match="blocks are taken in order: 0 is next, not 3"),
    ):
        model(blocks.draw(3))
    assert numbered.draw(3).shape == (sampler.block_size, 1)


def test_fewer_than_one_worker_is_refused():
    with pytest.raises(InputError, match="--workers 0: at least one worker is needed"), processes(0):
        raise AssertionError("no engine without workers")


def test_an_address_without_a_scheduler_is_refused_with_what_to_do():
    pytest.importorskip("distributed")
    with (
        pytest.raises(InputError, match=r"no Dask scheduler answers there.*start one with `dask scheduler`"),
        cluster("tcp://127.0.0.1:9", patience_s=0.5),
    ):
        raise AssertionError("no engine without a scheduler")


def test_a_scheduler_without_workers_is_refused_with_what_to_do():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=0, processes=True, host="127.0.0.1", dashboard_address=None, silence_logs=50
        ) as local,
        pytest.raises(InputError, match="the scheduler has no workers; start some with `dask worker"),
        cluster(local.scheduler_address, patience_s=0.5),
    ):
        raise AssertionError("no engine without workers")


def test_without_the_extra_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(InputError, match="--cluster needs Dask distributed; install it with"),
        cluster("tcp://127.0.0.1:8786"),
    ):
        raise AssertionError("no engine without Dask")
