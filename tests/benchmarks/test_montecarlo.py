"""Monte Carlo of SAMBA beside what cannot be avoided, and beside solving trial by trial; ratios are printed.

Run with ``pytest tests/benchmarks/test_montecarlo.py -s``. The bound is drawing the same number of normals, one
product to correlate them and one to project them, in the same blocks and threads.
"""

import time
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from monitor.methods.samba.method import problem_of
from monitor.readers import read_campaign
from monitor.uncertainty import (
    BlockSampler,
    MonteCarloOptions,
    block_generator,
    joined,
    measured_run,
    monte_carlo,
    normal_inputs,
    overall,
    pooled_by_day,
    repeated_readings,
    run_estimator,
    sensitivity_of,
    uncorrelated,
)

TRIALS, BLOCK, WORKERS, ROUNDS = 100_000, 1000, 2, 7


def full_rank(run):
    """187 correlated inputs of full rank, 1 µm each, as many runs as that would take."""
    rng = np.random.default_rng(1)
    values = rng.standard_normal((600, 186)) + rng.standard_normal((600, 1))
    values += run.inputs[:-1] / 1e-3 - values.mean(axis=0)
    return overall(1e-3 * values, run.input_names[:-1], ("mm",) * 186, source="probing")


@pytest.fixture(scope="module")
def problem():
    return problem_of(read_campaign(Path(__file__).parents[2] / "examples" / "five-days"))


def set_up(problem, covariance):
    run = measured_run(problem, 1)
    if covariance == "full rank":
        probing = full_rank(run)
    else:
        days = np.repeat(np.arange(5), 4)
        readings = repeated_readings(problem)
        probing = pooled_by_day(readings, days, run.input_names[:-1], ("mm",) * 186, source="probing")
    bar = uncorrelated(run.input_names[-1:], ("mm",), run.inputs[-1:], [1.2e-3], source="scale bar")
    inputs = joined(probing, bar)
    estimator = run_estimator(run, inputs, run.problem.local_names)
    return run, estimator, BlockSampler(normal_inputs(inputs), 1, BLOCK)


def best_of(work, blocks):
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(WORKERS) as pool:
        times = []
        for _ in range(ROUNDS):
            begin = time.perf_counter()
            list(pool.map(work, range(blocks)))
            times.append(time.perf_counter() - begin)
    return min(times)


@pytest.mark.parametrize("covariance", ["full rank", "rank 16 from 20 runs"])
def test_100_000_full_trials_beside_the_bound(benchmark, problem, covariance):
    _, estimator, sampler = set_up(problem, covariance)
    root = sampler.groups[0].elliptical[1]
    matrix = estimator.sensitivity.matrix

    def unavoidable(block):
        normals = block_generator(1, block).standard_normal((root.shape[1], BLOCK))
        return matrix @ (root @ normals)

    def trials(block):
        return estimator(sampler.draw(block))[1].all()

    blocks = TRIALS // BLOCK
    bound = best_of(unavoidable, blocks)
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(WORKERS) as pool:
        good = benchmark.pedantic(
            lambda: list(pool.map(trials, range(blocks))), rounds=ROUNDS, warmup_rounds=1
        )
    ratio = benchmark.stats.stats.min / bound
    benchmark.extra_info |= {"bound_s": bound, "ratio": ratio, "kantorovich": estimator.counts.largest_number}
    print(
        f"\n{covariance}: bound {bound:.3f} s, {TRIALS} trials {benchmark.stats.stats.min:.3f} s, ratio {ratio:.2f}, "
        f"Kantorovich number {estimator.counts.largest_number:.4f}, by Gauss-Newton {estimator.by_gauss_newton}"
    )
    assert all(good)
    assert estimator.by_gauss_newton == 0


def test_beside_solving_trial_by_trial_with_a_fresh_jacobian(benchmark, problem):
    run, estimator, sampler = set_up(problem, "full rank")
    drawn = np.ascontiguousarray(sampler.draw(0)[:20].T)
    start = estimator.sensitivity.unknowns

    def plain():
        return np.column_stack([run.solve(drawn[:, [trial]], start)[0][:, 0] for trial in range(20)])

    found = benchmark.pedantic(plain, rounds=3, warmup_rounds=1)
    one_by_one = benchmark.stats.stats.min / 20
    many = best_of(lambda block: estimator(sampler.draw(block))[1].all(), TRIALS // BLOCK) / TRIALS
    benchmark.extra_info["ratio"] = one_by_one / many
    print(
        f"\na trial alone {1e3 * one_by_one:.2f} ms, in the batch {1e6 * many:.2f} µs: {one_by_one / many:.0f} times"
    )
    batch = estimator.unknowns(drawn)[0]
    assert np.max(np.abs(batch - found) / estimator.u[:, None]) < 1e-6


def test_sensitivity_beside_one_identification(benchmark, problem):
    run = measured_run(problem, 1)
    start = run.problem.start[0]
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        run.solve(run.inputs[:, None], start)
        times.append(time.perf_counter() - begin)
    found = benchmark.pedantic(lambda: sensitivity_of(run), rounds=ROUNDS, warmup_rounds=1)
    ratio = benchmark.stats.stats.min / min(times)
    benchmark.extra_info["ratio"] = ratio
    print(
        f"\nexact sensitivity {1e3 * benchmark.stats.stats.min:.1f} ms: {ratio:.1f} times one identification"
    )
    assert found.matrix.shape == (34, 187)


def test_peak_memory_does_not_grow_with_the_trials(benchmark, problem):
    _, estimator, sampler = set_up(problem, "rank 16 from 20 runs")
    peaks = []

    def run(trials):
        tracemalloc.start()
        monte_carlo(
            estimator, sampler, estimator.outputs, ("",) * 34, trials, MonteCarloOptions(workers=WORKERS)
        )
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()

    run(300_000)
    benchmark.pedantic(run, args=(1_500_000,), rounds=1)
    print(f"\npeak memory {peaks[0] / 1e6:.0f} MB at 300 000 trials, {peaks[1] / 1e6:.0f} MB at 1 500 000")
    assert peaks[1] < 1e9
    assert peaks[1] < 1.1 * peaks[0]
