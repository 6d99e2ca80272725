"""Trials of a run whose inputs are moved by sources of their own law, and whose outputs by parts that act on them.

A block holds the inputs as drawn, then the values of the sources, then those of what acts on the outputs: so it is
drawn by one sampler, and every block has its own stream as ever.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.uncertainty.covariance import Inputs
from monitor.uncertainty.marginals import Normal
from monitor.uncertainty.monte_carlo.montecarlo import RunEstimator, run_estimator
from monitor.uncertainty.monte_carlo.propagation import Model
from monitor.uncertainty.monte_carlo.sampling import JointDistribution, normal_inputs
from monitor.uncertainty.parts import OutputContribution
from monitor.uncertainty.roots import covariance_root
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.type_b import SourceColumns


@dataclass(frozen=True)
class FurtherOutputs:
    """Outputs that no run identifies by itself: ``estimate`` (a,), behind the m of the estimator, to first order.

    ``by_inputs`` (m + a, N): what the inputs do to all outputs besides; ``by_values`` (m + a, q) the same of the values
    of all sources.
    """

    estimate: Array
    by_inputs: Array
    by_values: Array


@dataclass(frozen=True)
class Moves:
    """What is drawn besides the inputs: ``sources`` move the inputs, normal ``outputs`` (m, r) the outputs.

    ``further`` outputs are no draws, but follow from what is drawn.
    """

    sources: tuple[SourceColumns, ...] = ()
    outputs: Array | None = None
    further: FurtherOutputs | None = None

    @property
    def any(self) -> bool:
        """Whether there is anything."""
        return bool(self.sources) or self.outputs is not None or self.further is not None

    def of_first(self, count: int) -> Moves:
        """The same for the first ``count`` outputs, those of the estimator."""
        outputs = None if self.outputs is None else self.outputs[:count]
        further = self.further
        if further is not None:
            further = FurtherOutputs(
                further.estimate[:0], further.by_inputs[:count], further.by_values[:count]
            )
        return Moves(self.sources, outputs, further)

    def with_sources(self, inputs: Inputs) -> Inputs:
        """The inputs with the covariance that they have as drawn, sources included."""
        covariance = inputs.covariance
        for part in self.sources:
            drawn = part.law_factor * part.columns
            covariance = covariance + drawn @ drawn.T
        return replace(inputs, covariance=0.5 * (covariance + covariance.T))

    def distributions(self, inputs: Inputs) -> tuple[JointDistribution, ...]:
        """What a sampler draws: the inputs, then the values of the sources and of what acts on the outputs."""
        groups = [*normal_inputs(inputs), *(part.distribution for part in self.sources)]
        if self.outputs is not None:
            count = self.outputs.shape[1]
            names = tuple(f"output part {number}" for number in range(1, count + 1))
            groups.append(
                JointDistribution(names, ("1",) * count, (Normal(0.0, 1.0),) * count, np.eye(count))
            )
        return tuple(groups)


def output_moves(contributions: Sequence[OutputContribution]) -> Array | None:
    """The root (m, r) of what acts on the outputs; None where nothing does."""
    if not contributions:
        return None
    total = np.sum([part.covariance for part in contributions], axis=0)
    root = covariance_root(total).root
    return root if root.shape[1] else None


@dataclass(frozen=True)
class _Moved:
    """The model of a run for blocks of ``Moves``."""

    estimator: RunEstimator
    columns: Array
    outputs: Array | None
    further: FurtherOutputs | None
    centre: Array

    def __call__(self, block: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        """Outputs (trials, m) and which trials converged (trials,) for a ``block`` as drawn."""
        count, values = self.columns.shape
        drawn = block[:, count : count + values]
        outputs, converged = self.estimator(block[:, :count] + drawn @ self.columns.T)
        if self.further is not None:
            estimate = np.broadcast_to(self.further.estimate, (len(block), len(self.further.estimate)))
            outputs = np.concatenate([outputs, estimate], axis=1)
            outputs += (block[:, :count] - self.centre) @ self.further.by_inputs.T
            outputs += drawn @ self.further.by_values.T
        if self.outputs is not None:
            outputs = outputs + block[:, count + values :] @ self.outputs.T
        return outputs, converged


def moved_estimator(
    run: MeasuredRun, inputs: Inputs, outputs: tuple[str, ...], moves: Moves, *, seed: int
) -> Model:
    """The Monte Carlo model of one run, as ``run_estimator``, for blocks of ``moves.distributions(inputs)``."""
    estimator = run_estimator(run, moves.with_sources(inputs), outputs, seed=seed)
    if not moves.any:
        return estimator
    none = np.zeros((len(inputs.names), 0))
    columns = np.concatenate([none, *(part.columns for part in moves.sources)], axis=1)
    return _Moved(estimator, columns, moves.outputs, moves.further, inputs.estimate)
