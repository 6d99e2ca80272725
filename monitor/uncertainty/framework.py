"""The GUM uncertainty framework for many outputs: first order, U_y = C U_x C^T (JCGM 102:2011 clause 6).

Fast and exact for a linear model with normal inputs; ``validation`` says whether it is good enough for a
model that is not. The budget splits U_y by source. It is never trimmed: its lines add up to U_y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.uncertainty.covariance import Inputs
from monitor.uncertainty.coverage_regions.regions import RegionFactors, region_factors
from monitor.uncertainty.degrees_of_freedom import effective_dof
from monitor.uncertainty.parts import BudgetLine, OutputContribution, known, one_of_each_estimate
from monitor.uncertainty.roots import WithCovariance, checked_covariance, covariance_root


@dataclass(frozen=True)
class FrameworkResult(WithCovariance):
    """Estimates, covariance and coverage factors of the outputs after JCGM 102 clause 6.

    ``sensitivity`` is C (m, n) over the inputs ``input_names``. ``dof`` are the effective degrees of freedom
    of U_y as a whole, a summary that no factor is taken from; ``dof_by_output`` (m,) of every variance. ``rank`` is
    that of U_y. ``factors`` are k_p for so many dimensions and k_q for all m outputs, for the sum of the budget's lines
    with what is known of each; with ``finite_dof`` false those of a known covariance.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    estimate: Array
    covariance: Array
    input_names: tuple[str, ...]
    sensitivity: Array
    budget: tuple[BudgetLine, ...]
    dof: float
    dof_by_output: Array
    rank: int
    finite_dof: bool
    factors: RegionFactors

    @property
    def p(self) -> float:
        """Coverage probability."""
        return self.factors.p

    @property
    def k_p(self) -> float:
        """Coverage factor of the hyper-ellipsoid, infinite where the budget bounds none."""
        return self.factors.k_p

    @property
    def k_q(self) -> float:
        """Coverage factor of the hyper-rectangle."""
        return self.factors.k_q

    @property
    def expanded(self) -> Array:
        """U_j = k_q u_j (m,): intervals that all hold at once with probability p."""
        return self.k_q * self.u

    def budget_shares(self) -> Array:
        """Every line's part of every output's variance (lines, m); the lines of an output add up to 1."""
        total = np.diag(self.covariance)
        return np.array([line.variance / np.where(total > 0.0, total, 1.0) for line in self.budget])


def gum_framework(
    inputs: Inputs,
    sensitivity: Array,
    estimate: Array,
    names: Sequence[str],
    units: Sequence[str],
    *,
    p: float = 0.95,
    finite_dof: bool = True,
    contributions: Sequence[OutputContribution] = (),
) -> FrameworkResult:
    """First-order propagation of ``inputs`` (n of them) through ``sensitivity`` (m, n).

    ``estimate`` (m,) are the outputs at the inputs' estimates. ``contributions`` act on the outputs without
    passing through the inputs. With ``finite_dof`` k_p and k_q are those of the sum of lines known to different
    degrees (``regions``), else of a known covariance. Neglected: everything of second order; see ``validation``.
    Raises DataError where shapes do not match or two sources have the same name.
    """
    sensitivity = np.atleast_2d(np.asarray(sensitivity, dtype=np.float64))
    outputs = len(names)
    if sensitivity.shape != (outputs, len(inputs.names)):
        raise DataError(
            f"{outputs} outputs and {len(inputs.names)} inputs need a sensitivity matrix of shape "
            f"({outputs}, {len(inputs.names)}), not {sensitivity.shape}"
        )
    if np.shape(estimate) != (outputs,) or len(units) != outputs:
        raise DataError(f"{outputs} outputs need as many estimates and units")
    if not np.all(np.isfinite(sensitivity)):
        raise DataError("the sensitivity matrix must be finite")
    budget = _input_lines(inputs, sensitivity) + _output_lines(contributions, outputs, inputs.source_names)
    covariance = np.sum([line.covariance for line in budget], axis=0)
    covariance = 0.5 * (covariance + covariance.T)
    estimates = one_of_each_estimate(budget)
    proper = [line for line in estimates if line.dof is not None]
    dofs = [line.dof for line in proper if line.dof is not None]
    joint = effective_dof([line.covariance for line in proper], dofs)
    single = np.array(
        [
            effective_dof([line.covariance[j : j + 1, j : j + 1] for line in proper], dofs)
            for j in range(outputs)
        ]
    )
    rank = covariance_root(covariance).rank
    return FrameworkResult(
        names=tuple(names),
        units=tuple(units),
        estimate=np.asarray(estimate, dtype=np.float64),
        covariance=covariance,
        input_names=inputs.names,
        sensitivity=sensitivity,
        budget=budget,
        dof=joint,
        dof_by_output=single,
        rank=rank,
        finite_dof=finite_dof,
        factors=region_factors(estimates if finite_dof else known(estimates), p),
    )


def _input_lines(inputs: Inputs, sensitivity: Array) -> tuple[BudgetLine, ...]:
    sources = inputs.source_names
    places = {source: inputs.indices(source) for source in sources}
    lines = [
        BudgetLine(
            source,
            sensitivity[:, at] @ inputs.covariance[np.ix_(at, at)] @ sensitivity[:, at].T,
            inputs.degrees_of_freedom(source),
            inputs.estimated_of(source),
        )
        for source, at in places.items()
    ]
    for i, first in enumerate(sources):
        for second in sources[i + 1 :]:
            between = inputs.covariance[np.ix_(places[first], places[second])]
            if np.any(between):
                cross = sensitivity[:, places[first]] @ between @ sensitivity[:, places[second]].T
                lines.append(BudgetLine(f"{first} × {second}", cross + cross.T, None))
    return tuple(lines)


def _output_lines(
    contributions: Sequence[OutputContribution], outputs: int, taken: Sequence[str]
) -> tuple[BudgetLine, ...]:
    lines: list[BudgetLine] = []
    names = set(taken)
    for part in contributions:
        if part.source in names:
            raise DataError(f"two lines of the budget are named '{part.source}'; name them apart")
        names.add(part.source)
        covariance = checked_covariance(part.covariance)
        if covariance.shape != (outputs, outputs):
            raise DataError(f"'{part.source}' must have shape ({outputs}, {outputs}), not {covariance.shape}")
        lines.append(BudgetLine(part.source, covariance, part.dof, part.estimated, part.estimated_with))
    return tuple(lines)
