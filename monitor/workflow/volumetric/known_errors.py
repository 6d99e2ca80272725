"""The geometric errors that one evaluated run determines, with their covariance, and those that it does not."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.discovery import Fit
from monitor.effects import ChainEffect
from monitor.methods.chain.least_squares import eliminate
from monitor.records import Array
from monitor.refusal import Reason, ReasonKind, Refusal
from monitor.reporting.certificate.model_effect import Outside
from monitor.reporting.refused import RefusedParameters, refused_parameters
from monitor.uncertainty.geometric_errors import GeometricErrors
from monitor.workflow.uncertainty.stored import StatedUncertainty


def geometric_errors(
    evaluated: StatedUncertainty, fit: Fit
) -> tuple[GeometricErrors, dict[str, RefusedParameters]]:
    """What is known of the machine from one evaluated run, and what is not, with the reason.

    ``fit`` is the evaluated model fitted to the campaign.
    """
    problem, solution = fit.problem, fit.solution
    run = int(np.flatnonzero(problem.runs == evaluated.run)[0])
    of_run, left_out = _of_run(evaluated, fit)
    shared, places, settled, reasons = _shared(fit)
    covariance = np.zeros((len(of_run.names) + len(shared.names),) * 2)
    local = [problem.base_names.index(name) for name in of_run.names]
    joint = [name for name in shared.names if name in (evaluated.answer.effects or ())]
    units = dict(zip(shared.names, shared.factors, strict=True))
    columns = [evaluated.names.index(name) for name in (*of_run.names, *joint)]
    at = [*range(len(of_run.names)), *(len(of_run.names) + shared.names.index(name) for name in joint)]
    factors = [*of_run.factors, *(units[name] for name in joint)]
    covariance[np.ix_(at, at)] = evaluated.covariance[np.ix_(columns, columns)] * np.outer(factors, factors)
    if len(solution.common) and len(joint) < np.count_nonzero(settled):
        # Effects outside of the joint region are known by what the readings say of them alone.
        added = _of_shared(fit, run, local, places)
        unsettled = len(local) + np.flatnonzero(~settled)
        added[unsettled] = 0.0
        added[:, unsettled] = 0.0
        if joint or evaluated.answer.effects_outside is Outside.FEW_RUNS:
            # What they pull the run's parameters by is in these already, and those inside have their own.
            inside = [row for row in range(len(added)) if row in at]
            added[np.ix_(inside, inside)] = 0.0
        covariance += added
    effects = [*of_run.effects, *shared.effects]
    names = [*of_run.names, *shared.names]
    estimate = [*of_run.estimate, *shared.estimate]
    for effect, name in problem.known_errors:
        # Measured by other means: its uncertainty is the stated one, and what the others share with it is first order.
        index = problem.local_names.index(name)
        effects.append(effect)
        names.append(name)
        estimate.append(float(solution.local[run, index]))
        beside = np.zeros(len(covariance))
        beside[: len(local)] = solution.local_covariance[run, index, local]
        variance = solution.local_covariance[run, index, index]
        covariance = np.block([[covariance, beside[:, None]], [beside[None, :], variance]])
    errors = GeometricErrors(
        effects=tuple(effects),
        names=tuple(names),
        estimate=np.array(estimate),
        covariance=covariance,
        context=problem.context,
        run=evaluated.run,
        tip=problem.ends(problem.own_of(solution.local))[1][
            int(np.argmax(problem.context.run == evaluated.run))
        ],
        degrees_of_freedom=evaluated.fewest_dof,
    )
    return errors, left_out | reasons


@dataclass(frozen=True)
class _Known:
    """Effects with their parameters: names, estimates in internal units, and what turns display units into these."""

    effects: tuple[ChainEffect, ...]
    names: tuple[str, ...]
    estimate: tuple[float, ...]
    factors: tuple[float, ...]


def _of_run(evaluated: StatedUncertainty, fit: Fit) -> tuple[_Known, dict[str, RefusedParameters]]:
    """The effects whose parameters all have a number in the run, and the other parameters with the reason."""
    left_out = {name: refused for refused in evaluated.answer.refused for name in refused.parameters}
    effects: list[ChainEffect] = []
    names: list[str] = []
    factors: list[float] = []
    for effect in fit.problem.base:
        parameters = effect.parameters(fit.problem.context)
        if isinstance(effect, ChainEffect) and all(name in evaluated.names for name in parameters):
            effects.append(effect)
            names += parameters
            factors += [effect.unit.factor] * len(parameters)
        elif isinstance(effect, ChainEffect):
            left_out |= _refused([name for name in parameters if name not in left_out], ReasonKind.NO_NUMBER)
    estimates = evaluated.answer.guf.estimate
    values = tuple(estimates[name] * factor for name, factor in zip(names, factors, strict=True))
    return _Known(tuple(effects), tuple(names), values, tuple(factors)), left_out


def _shared(
    fit: Fit,
) -> tuple[_Known, list[int], npt.NDArray[np.bool_], dict[str, RefusedParameters]]:
    """The effects that all runs share, the indices of their common unknowns, which of their parameters (k,) the plan
    determines, and the others with the reason. Those of an effect that are not determined beside some that are stand
    at zero: whatever they are, the readings are the same with these."""
    problem, solution = fit.problem, fit.solution
    fixed, coefficients = problem.resolved(solution.common)
    effects: list[ChainEffect] = []
    names: list[str] = []
    estimate: list[float] = []
    factors: list[float] = []
    indices: list[int] = []
    determined: list[bool] = []
    left_out: dict[str, RefusedParameters] = {}
    # What is held at zero is in the numbers of others.
    settled = solution.common_free | solution.common_held
    first = coefficient = 0
    for shared, plain in zip(problem.shared, fixed.added, strict=True):
        unknowns = range(first, first + shared.size)
        is_settled = settled[list(unknowns)]
        first += shared.unknowns
        if not isinstance(plain, ChainEffect):
            left_out |= _refused(shared.names(), ReasonKind.NO_MACHINE_ERROR)
        elif not np.any(is_settled):
            left_out |= _refused(shared.names(), ReasonKind.NOT_DETERMINED)
        else:
            parameters = shared.effect.parameters(problem.context)
            unknown = [name for name, stated in zip(parameters, is_settled, strict=True) if not stated]
            left_out |= _refused(unknown, ReasonKind.NOT_DETERMINED)
            effects.append(plain)
            names += parameters
            of_effect = coefficients[coefficient : coefficient + shared.size]
            estimate += map(float, np.where(is_settled, of_effect, 0.0))
            factors += [plain.unit.factor] * shared.size
            indices += unknowns
            determined += map(bool, is_settled)
        coefficient += shared.size
    of_machine = _Known(tuple(effects), tuple(names), tuple(estimate), tuple(factors))
    return of_machine, indices, np.array(determined, dtype=bool), left_out


def _refused(names: Iterable[str], kind: ReasonKind) -> dict[str, RefusedParameters]:
    """Parameters that are left out of the map for another reason than that they have no number in any run."""
    return {name: refused_parameters(Refusal((name,), Reason(kind))) for name in names}


def _of_shared(fit: Fit, run: int, local: list[int], shared: list[int]) -> Array:
    """What the uncertainty of the shared effects adds: their own, and what they pull the run's parameters by.

    The parameters of a run answer a change of the shared ones by D = -pinv(A) B of the whitened Jacobians. For
    white noise the shared ones and the run's at held shared ones are uncorrelated, because the former rest on
    what the latter leave of the readings.
    """
    solution = fit.solution
    space = eliminate(solution.last.local[[run]])
    count = len(solution.common)
    response = -(space.inverse[0] @ (space.basis[0].T @ solution.last.common[run, :, :count]))
    both = np.concatenate([response[local], np.eye(count)[shared]])
    covariance = np.where(np.isfinite(solution.common_covariance), solution.common_covariance, 0.0)
    added: Array = fit.scale**2 * both @ covariance @ both.T
    return added
