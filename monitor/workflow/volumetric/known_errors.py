"""What one evaluated run knows of its machine: geometric errors with their covariance, and what it does not know."""

from __future__ import annotations

import numpy as np

from monitor.discovery import Fit
from monitor.effects import ChainEffect
from monitor.methods.chain.least_squares import eliminate
from monitor.records import Array
from monitor.uncertainty.volumetric import GeometricErrors
from monitor.workflow.uncertainty.evaluations import Evaluation


def geometric_errors(found: Evaluation, fit: Fit) -> tuple[GeometricErrors, dict[str, str]]:
    """What is known of the machine from one evaluated run, and what is not, with the reason.

    ``fit`` is the evaluated model fitted to the campaign.
    """
    problem, solution = fit.problem, fit.solution
    context = problem.context
    run = int(np.flatnonzero(problem.runs == found.run)[0])
    fixed, coefficients = problem.resolved(solution.common)
    left_out = {name: why for parameters, why in found.refused for name in parameters}
    effects: list[ChainEffect] = []
    names: list[str] = []
    factors: list[float] = []
    for effect in problem.base:
        own = effect.parameters(context)
        if isinstance(effect, ChainEffect) and all(name in found.names for name in own):
            effects.append(effect)
            names += own
            factors += [effect.unit.factor] * len(own)
        elif isinstance(effect, ChainEffect):
            left_out |= {name: "it has no number in this run" for name in own if name not in left_out}
    places = [found.names.index(name) for name in names]
    local = [problem.base_names.index(name) for name in names]
    estimate = [float(found.estimate[place]) * factor for place, factor in zip(places, factors, strict=True)]
    shared: list[int] = []
    at = coefficient = 0
    for one, plain in zip(problem.shared, fixed.added, strict=True):
        own_places = range(at, at + one.size)
        at += one.unknowns
        if not isinstance(plain, ChainEffect):
            left_out |= dict.fromkeys(one.names(), "it is no error of the machine")
        elif not all(solution.common_free[list(own_places)]):
            left_out |= dict.fromkeys(one.names(), "the plan does not determine it")
        else:
            effects.append(plain)
            names += one.effect.parameters(context)
            estimate += map(float, coefficients[coefficient : coefficient + one.size])
            shared += own_places
        coefficient += one.size
    covariance = np.zeros((len(names), len(names)))
    covariance[: len(places), : len(places)] = found.covariance[np.ix_(places, places)] * np.outer(
        factors, factors
    )
    if len(solution.common):
        covariance += _of_shared(fit, run, local, shared)
    for effect, name in problem.known_errors:
        # Measured by other means: its uncertainty is the stated one, and what the others share with it is first order.
        place = problem.local_names.index(name)
        effects.append(effect)
        names.append(name)
        estimate.append(float(solution.local[run, place]))
        beside = np.zeros(len(covariance))
        beside[: len(local)] = solution.local_covariance[run, place, local]
        own_variance = solution.local_covariance[run, place, place]
        covariance = np.block([[covariance, beside[:, None]], [beside[None, :], own_variance]])
    return (
        GeometricErrors(
            effects=tuple(effects),
            names=tuple(names),
            estimate=np.array(estimate),
            covariance=covariance,
            context=context,
            run=found.run,
            tip=problem.ends(problem.own_of(solution.local))[1][int(np.argmax(context.run == found.run))],
            degrees_of_freedom=found.fewest_dof,
        ),
        left_out,
    )


def _of_shared(fit: Fit, run: int, local: list[int], shared: list[int]) -> Array:
    """What the uncertainty of the shared effects adds: their own, and what they pull the run's parameters by.

    The parameters of a run answer a change of the shared ones by D = -pinv(A) B of the whitened Jacobians. For
    white noise the shared ones and the run's at held shared ones are uncorrelated, because the former rest on
    what the latter leave of the readings.
    """
    solution = fit.solution
    space = eliminate(solution.last.local[[run]])
    answer = -(space.inverse[0] @ (space.basis[0].T @ solution.last.common[run]))
    count = len(solution.common)
    both = np.concatenate([answer[local], np.eye(count)[shared]])
    covariance = np.where(np.isfinite(solution.common_covariance), solution.common_covariance, 0.0)
    added: Array = fit.scale**2 * both @ covariance @ both.T
    return added
