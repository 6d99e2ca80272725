"""Propagation of distributions through any model by Monte Carlo (JCGM 102:2011 clause 7), in bounded memory.

A model takes a block of inputs (trials, n) and returns the outputs (trials, m) and which trials converged
(trials,). Blocks are drawn and evaluated by a pool of threads and merged in their order, so the result is the
same to the last bit for any number of workers. Means and covariances run over all trials; the quantiles
behind k_p and k_q come from a bounded sample, whose standard error the result states.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.uncertainty.coverage_regions.coverage import (
    largest_deviations,
    mahalanobis_distances,
    quantile_of,
)
from monitor.uncertainty.monte_carlo.moments import Moments
from monitor.uncertainty.monte_carlo.sampling import BlockSampler
from monitor.uncertainty.roots import RANK_TOLERANCE, correlation_of

Model = Callable[[Array], tuple[Array, npt.NDArray[np.bool_]]]


@dataclass(frozen=True)
class Summary:
    """What one sequence of trials says, or all together: estimate and u (m,), lambda_max, k_p, k_q."""

    estimate: Array
    u: Array
    lambda_max: float
    k_p: float
    k_q: float

    def as_row(self) -> Array:
        """All numbers in one row (2m + 3,)."""
        return np.concatenate([self.estimate, self.u, [self.lambda_max, self.k_p, self.k_q]])


@dataclass(frozen=True)
class TrialSequence:
    """The outputs (kept trials, m) of one sequence of trials, and how many trials there were."""

    outputs: Array
    trials: int

    @property
    def not_converged(self) -> int:
        """How many trials gave no outputs."""
        return self.trials - len(self.outputs)


def summarise(outputs: Array, moments: Moments, p: float, tolerance: float = RANK_TOLERANCE) -> Summary:
    """The summary of ``moments`` with the coverage factors of ``outputs`` (trials, m) about them."""
    covariance = moments.covariance
    return Summary(
        estimate=moments.mean,
        u=np.sqrt(np.diag(covariance)),
        lambda_max=float(np.linalg.eigvalsh(correlation_of(covariance))[-1]),
        k_p=quantile_of(mahalanobis_distances(outputs, moments.mean, covariance, tolerance), p),
        k_q=quantile_of(largest_deviations(outputs, moments.mean, covariance), p),
    )


class Trials:
    """Evaluates blocks of trials in order; use as ``with Trials(...).pool() as trials``."""

    def __init__(self, model: Model, sampler: BlockSampler, outputs: int, workers: int = 1) -> None:
        if workers < 1:
            raise DataError(f"workers must be at least 1, but is {workers}")
        self.model = model
        self.sampler = sampler
        self.outputs = outputs
        self.workers = workers
        self.next_block = 0

    @contextmanager
    def pool(self) -> Iterator[Trials]:
        """The pool of threads, closed at the end.

        The linear algebra of a block stays on one thread: the blocks keep the processors busy.
        """
        with ThreadPoolExecutor(self.workers) as executor, threadpool_limits(1, "blas"):
            self._executor = executor
            yield self

    def sequence(self, blocks: int) -> TrialSequence:
        """The next ``blocks`` blocks of trials."""
        numbers = range(self.next_block, self.next_block + blocks)
        self.next_block += blocks
        run = map(self._block, numbers) if self.workers == 1 else self._executor.map(self._block, numbers)
        return TrialSequence(np.concatenate(list(run)), blocks * self.sampler.block_size)

    def _block(self, number: int) -> Array:
        drawn = self.sampler.draw(number)
        outputs, converged = self.model(drawn)
        if outputs.shape != (len(drawn), self.outputs) or converged.shape != (len(drawn),):
            raise DataError(
                f"a model of {self.outputs} outputs must return outputs ({len(drawn)}, {self.outputs}) and "
                f"converged ({len(drawn)},), but returned {outputs.shape} and {converged.shape}"
            )
        good = converged & np.all(np.isfinite(outputs), axis=1)
        return outputs if bool(np.all(good)) else outputs[good]


class Accumulator:
    """All sequences so far: running moments, the summary of each sequence and a bounded sample of outputs.

    The trials are independent and alike, so the first ``keep`` of them are as good a sample as any. ``started`` is the
    reading of the performance counter when the accumulator was made.
    """

    def __init__(self, outputs: int, p: float, keep: int, tolerance: float) -> None:
        self.started = time.perf_counter()
        self.p = p
        self.tolerance = tolerance
        self.moments = Moments(0, np.zeros(outputs), np.zeros((outputs, outputs)))
        self.rows: list[Array] = []
        self.trials = 0
        self.not_converged = 0
        self._keep = keep
        self._kept: list[Array] = []
        self._held = 0
        self._sample: Array | None = None

    def add(self, sequence: TrialSequence) -> None:
        """Take one more sequence in."""
        self.trials += sequence.trials
        self.not_converged += sequence.not_converged
        outputs = sequence.outputs
        if len(outputs) < 2:
            return
        moments = Moments.of(outputs)
        self.rows.append(summarise(outputs, moments, self.p, self.tolerance).as_row())
        self.moments = self.moments.merged(moments)
        room = self._keep - self._held
        if room > 0:
            self._kept.append(outputs[:room])
            self._held += len(self._kept[-1])
            self._sample = None

    @property
    def sample(self) -> Array:
        """The kept outputs (kept, m)."""
        if self._sample is None:
            self._sample = np.concatenate(self._kept) if self._kept else np.empty((0, len(self.moments.mean)))
            self._kept = [self._sample]
        return self._sample

    def summary(self) -> Summary:
        """Over all trials; the coverage factors from the kept sample about the moments of all."""
        return summarise(self.sample, self.moments, self.p, self.tolerance)

    def quick(self) -> Summary:
        """The same with the mean of the sequences' coverage factors, at no cost."""
        covariance = self.moments.covariance
        largest, k_p, k_q = np.mean([row[-3:] for row in self.rows], axis=0)
        return Summary(
            self.moments.mean, np.sqrt(np.diag(covariance)), float(largest), float(k_p), float(k_q)
        )

    def standard_errors(self) -> Array:
        """Standard deviation of the mean over the sequences of every number of a summary (2m + 3,).

        JCGM 102 7.8.3; NaN before two sequences.
        """
        rows = self.rows
        if len(rows) < 2:
            return np.full(2 * len(self.moments.mean) + 3, math.nan)
        return np.asarray(np.std(np.array(rows), axis=0, ddof=1) / math.sqrt(len(rows)))
