"""States an evaluated uncertainty as the answer that is shown, stored and certified."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from monitor.discovery import compare
from monitor.discovery.machine.noise.beyond_noise import beyond_neighbours
from monitor.machine import Chain
from monitor.methods.model import chain_of
from monitor.records import Array, Verdict
from monitor.reporting.covariance_source import covariance_sentence
from monitor.reporting.factor_sampling import FactorSampling
from monitor.reporting.refused import refused_parameters
from monitor.uncertainty.coverage_regions.coverage import joint_coverage, single_factor
from monitor.uncertainty.coverage_regions.regions import region_factors
from monitor.uncertainty.parts import known
from monitor.uncertainty.validation import Comparison, Validation
from monitor.units import MICROMETRE
from monitor.workflow.models import label
from monitor.workflow.uncertainty.answer import (
    FrameworkAnswer,
    LackOfFitCause,
    MonteCarloAnswer,
    RunResiduals,
    UncertaintyAnswer,
    ValidationAnswer,
)
from monitor.workflow.uncertainty.lack_in_budget import decides
from monitor.workflow.uncertainty.machine_frame import MachineFrameAnswer, frames_of, in_machine_frame
from monitor.workflow.uncertainty.result import RunUncertainty

#: So many effects that lack of fit may come from are named.
MOST_CAUSES = 5


def answer_of(result: RunUncertainty) -> UncertaintyAnswer:
    """The answer as people see it."""
    answer = statement(result)
    coverage = joint_coverage(result.framework.correlation).value
    return replace(answer, guf=replace(answer.guf, joint_coverage_of_k_2_each=coverage))


def statement(result: RunUncertainty) -> UncertaintyAnswer:
    """As ``answer_of``, without what k = 2 each covers: half a second of sampling that no certificate states."""
    chain = chain_of(result.campaign.machine)
    framework = _framework(result)
    causes = tuple(LackOfFitCause(effect, probability) for effect, probability in result.causes[:MOST_CAUSES])
    return UncertaintyAnswer(
        campaign=result.campaign.name,
        machine=result.campaign.machine.id,
        run=result.run,
        model=label(result.model),
        p=result.framework.p,
        asked=result.asked,
        parameters=result.framework.names,
        units={name: unit.name for name, unit in zip(result.framework.names, result.units, strict=True)},
        input_covariance=covariance_sentence(result.covariance_source),
        input_covariance_source=result.covariance_source,
        refused=tuple(map(refused_parameters, result.refused)),
        residuals=_residuals(result, framework),
        guf=framework,
        frames=frames_of(result.framework.names, chain),
        machine_frame=_in_machine_frame(result, chain),
        lack_of_fit_causes=causes or None,
        mcm=_monte_carlo(result),
        validation=None if result.validation is None else _validation(result, result.validation),
        holds_for=result.behind.holds_for,
        day_to_day=result.behind.day_to_day,
        sources=result.behind.sources or None,
        length=result.behind.length,
        unchecked=result.behind.unchecked,
        effects=result.effects or None,
        effects_outside=result.effects_outside,
    )


def _in_machine_frame(result: RunUncertainty, chain: Chain) -> MachineFrameAnswer:
    framework = result.framework
    factors = np.array([unit.factor for unit in result.units])
    covariance = framework.correlation * np.outer(framework.u / factors, framework.u / factors)
    unknown = [name for refusal in result.refused for name in refusal.parameters]
    frame = in_machine_frame(framework.names, framework.estimate / factors, covariance, chain, unknown)
    fewest = float(np.min(framework.dof_by_output, initial=np.inf))
    return replace(frame, k=single_factor(framework.p, fewest))


def _displayed(result: RunUncertainty, values: Iterable[float]) -> dict[str, float]:
    """Values (m,) in internal units by parameter, in display units."""
    return {
        name: unit.to_display(float(value))
        for name, unit, value in zip(result.framework.names, result.units, values, strict=True)
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _framework(result: RunUncertainty) -> FrameworkAnswer:
    framework = result.framework
    pairs = list(zip(framework.budget, framework.budget_shares(), strict=True))
    # The line that matters most for any parameter first; none is dropped.
    lines = sorted(pairs, key=lambda pair: -float(np.max(np.abs(pair[1]), initial=0.0)))
    factors = framework.factors
    # Where nothing was estimated the factors are those already.
    estimated = any(not line.known for line in framework.budget)
    of_known = region_factors(known(framework.budget), framework.p) if estimated else factors
    return FrameworkAnswer(
        estimate=_displayed(result, framework.estimate),
        u=_displayed(result, framework.u),
        correlation=framework.correlation,
        # JCGM 102:2011 6.5 as it stands: normal outputs. Beside them what so few runs allow to claim.
        k_p=of_known.k_p,
        k_q=of_known.k_q,
        lambda_max=framework.lambda_max,
        rank=framework.rank,
        degrees_of_freedom=_finite(framework.dof),
        fewest_degrees_of_freedom=_finite(float(np.min(framework.dof_by_output, initial=np.inf))),
        k_p_with_degrees_of_freedom=_finite(framework.k_p),
        k_q_with_degrees_of_freedom=_finite(framework.k_q),
        expanded=_displayed(result, framework.expanded),
        budget={
            line.source: dict(zip(framework.names, map(float, shares), strict=True)) for line, shares in lines
        },
        budget_degrees_of_freedom={
            line.source: None if line.dof is None else _finite(line.dof) for line, _ in lines
        },
        degrees_of_freedom_by_parameter={
            name: _finite(float(dof))
            for name, dof in zip(framework.names, framework.dof_by_output, strict=True)
        },
        coverage_sampling=FactorSampling(factors.seed, factors.trials, factors.k_p_error, factors.k_q_error),
    )


def _monte_carlo(result: RunUncertainty) -> MonteCarloAnswer | None:
    sampled = result.monte_carlo
    if sampled is None:
        return None
    return MonteCarloAnswer(
        estimate=_displayed(result, sampled.estimate),
        u=_displayed(result, sampled.u),
        correlation=sampled.correlation,
        k_p=sampled.k_p,
        k_q=sampled.k_q,
        lambda_max=sampled.lambda_max,
        trials=sampled.trials,
        not_converged=sampled.not_converged,
        seconds=sampled.seconds,
        stable=sampled.stable,
        seed=sampled.seed,
    )


def _validation(result: RunUncertainty, validation: Validation) -> ValidationAnswer:
    units = dict(zip(result.framework.names, result.units, strict=True))

    def displayed(comparison: Comparison, value: float) -> float:
        return units[comparison.output].to_display(value) if comparison.output else float(value)

    return ValidationAnswer(
        passed=validation.passed,
        verdict=validation.verdict,
        differences={
            _quantity(comparison): displayed(comparison, comparison.difference)
            for comparison in validation.comparisons
        },
        tolerances={
            _quantity(comparison): displayed(comparison, comparison.tolerance)
            for comparison in validation.comparisons
        },
    )


def _quantity(comparison: Comparison) -> str:
    return f"{comparison.quantity} {comparison.output}".strip()


def _rms(vectors: Array) -> float:
    return MICROMETRE.to_display(float(np.sqrt(np.mean(vectors**2))))


def _residuals(result: RunUncertainty, framework: FrameworkAnswer) -> RunResiduals:
    compared = compare(result.fit, result.campaign.name, result.model.name)
    context, vectors = result.fit.problem.context, result.fit.vectors
    of_run = context.run == result.run
    touched = {str(name): of_run & (context.target == name) for name in result.fit.problem.targets}
    return RunResiduals(
        rms_um=MICROMETRE.to_display(compared.rms),
        expected_rms_um=MICROMETRE.to_display(compared.expected_rms),
        something_is_missing=compared.verdict is Verdict.SOMETHING_IS_MISSING,
        by_target_um={name: _rms(vectors[rows]) for name, rows in touched.items() if int(np.sum(rows)) > 1},
        lack_of_fit_p=beyond_neighbours(result.fit) if decides(framework) else None,
    )
