"""What one evaluated run knows of its machine: geometric errors with their covariance, and what it does not know."""

from __future__ import annotations

import numpy as np

from monitor.effects import ChainEffect
from monitor.methods.least_squares import eliminate
from monitor.records import Array
from monitor.uncertainty.volumetric import GeometricErrors
from monitor.workflow.uncertainty import Evaluated


def geometric_errors(found: Evaluated) -> tuple[GeometricErrors, dict[str, str]]:
    """What is known of the machine from one evaluated run, and what is not, with the reason."""
    problem, solution = found.fit.problem, found.fit.solution
    context = problem.context
    fixed, coefficients = problem.resolved(solution.common)
    left_out = {name: refusal.why for refusal in found.refused for name in refusal.parameters}
    effects: list[ChainEffect] = []
    names: list[str] = []
    for effect in problem.base:
        own = effect.parameters(context)
        if isinstance(effect, ChainEffect) and all(name in found.framework.names for name in own):
            effects.append(effect)
            names += own
        elif isinstance(effect, ChainEffect):
            left_out |= {name: "it has no number in this run" for name in own if name not in left_out}
    places = [found.framework.names.index(name) for name in names]
    local = [problem.base_names.index(name) for name in names]
    estimate = [float(found.framework.estimate[place]) for place in places]
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
    covariance[: len(places), : len(places)] = found.framework.covariance[np.ix_(places, places)]
    if len(solution.common):
        covariance += _of_shared(found, local, shared)
    run = int(np.flatnonzero(problem.runs == found.run)[0])
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
            degrees_of_freedom=float(np.min(found.framework.dof_by_output)),
        ),
        left_out,
    )


def _of_shared(found: Evaluated, local: list[int], shared: list[int]) -> Array:
    """What the uncertainty of the shared effects adds: their own, and what they pull the run's parameters by.

    The parameters of a run answer a change of the shared ones by D = -pinv(A) B of the whitened Jacobians. For
    white noise the shared ones and the run's at held shared ones are uncorrelated, because the former rest on
    what the latter leave of the readings.
    """
    solution = found.fit.solution
    place = int(np.flatnonzero(found.fit.problem.runs == found.run)[0])
    space = eliminate(solution.last.local[[place]])
    answer = -(space.inverse[0] @ (space.basis[0].T @ solution.last.common[place]))
    count = len(solution.common)
    both = np.concatenate([answer[local], np.eye(count)[shared]])
    covariance = np.where(np.isfinite(solution.common_covariance), solution.common_covariance, 0.0)
    added: Array = found.fit.scale**2 * both @ covariance @ both.T
    return added
