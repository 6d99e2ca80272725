"""What no number of a campaign of instruments holds, and which measurement would show it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.effects import ChainEffect
from monitor.machine import Chain
from monitor.methods import ChainMethod, InstrumentPlan, campaign_method
from monitor.methods.chain.identification import Identification, RunIdentification
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ROWS_AT_ONCE, ChainProblem
from monitor.records import Array, Campaign
from monitor.refusal import AdviceKind, ReasonKind
from monitor.store import StoredModel
from monitor.uncertainty.geometric_errors import GeometricErrors
from monitor.uncertainty.outside_errors import OutsideError, outside_errors
from monitor.uncertainty.volumetric import grid, middle
from monitor.workflow.models import as_model
from monitor.workflow.plan.instruments import measurements_that_show
from monitor.workflow.plan.test_answer import TestAnswer

#: Where rotary axes are looked at, rad: each by itself, and all together.
TURNED = (1.0, -1.0)


def not_seen(
    problem: ChainProblem, solution: Solution, identification: Identification
) -> tuple[OutsideError, ...]:
    """The position and orientation errors that are in no number of the last run, on a machine with three linear axes
    that moved; none where the rows are too many to be looked at at once."""
    chain, run = problem.context.chain, identification.runs[-1]
    ranges = _ranges(chain, problem.context.positions)
    if len(ranges) < 3 or len(problem.context) > ROWS_AT_ONCE:
        return ()
    geometric = _numbers(problem, solution, identification, run)
    refused = [name for refusal in run.refused for name in refusal.parameters]
    refused += [taken.parameter for taken in identification.taken_up if not taken.by]
    poses = grid(chain, ranges, 2, _turned(chain))
    return outside_errors(problem, geometric, poses, middle(chain, ranges), refused)


def seen_by(
    campaign: Campaign, model: StoredModel, identification: Identification, outside: Sequence[OutsideError]
) -> dict[str, TestAnswer]:
    """For the errors that no reading shows or separates the one measurement that gives each a number, where one
    does."""
    method = campaign_method(campaign)
    if not isinstance(method, ChainMethod) or not isinstance(method.plan, InstrumentPlan):
        return {}
    names = [
        name
        for refusal in identification.runs[-1].refused
        if refusal.reason.advice and refusal.reason.advice.kind is AdviceKind.OTHER_MEASUREMENT
        for name in refusal.parameters
    ]
    names += [each.symbol for each in outside if each.refusal.reason.kind is ReasonKind.NOT_SHOWN]
    return measurements_that_show(method.plan, campaign, as_model(model), names) if names else {}


def _ranges(chain: Chain, positions: Array) -> dict[str, tuple[float, float]]:
    """Readings between which linear axes moved."""
    readings = {
        joint.name: joint.sign * positions[:, index]
        for index, joint in enumerate(chain.joints)
        if not joint.turns
    }
    return {
        name: (float(of.min()), float(of.max())) for name, of in readings.items() if float(np.ptp(of)) > 0.0
    }


def _turned(chain: Chain) -> Array:
    """Rotary poses (P, J): all at zero, each axis turned by itself, all of them together."""
    rotary = np.array([joint.kind == "rotary" for joint in chain.joints])
    single = np.eye(len(chain.joints))[rotary]
    return np.concatenate(
        [
            np.zeros((1, len(rotary))),
            *(angle * np.concatenate([single, rotary[None] * 1.0]) for angle in TURNED),
        ]
    )


def _numbers(
    problem: ChainProblem, solution: Solution, identification: Identification, run: RunIdentification
) -> GeometricErrors:
    """The errors of which the run has numbers, and those that all runs share."""
    values = dict(zip(identification.parameters, run.estimate.tolist(), strict=True))
    values |= dict(zip(identification.added, identification.added_estimate.tolist(), strict=True))
    effects: list[ChainEffect] = []
    names: list[str] = []
    for effect in (*problem.base, *problem.added):
        parameters = effect.parameters(problem.context)
        if isinstance(effect, ChainEffect) and all(
            np.isfinite(values.get(name, np.nan)) for name in parameters
        ):
            effects.append(effect)
            names += parameters
    return GeometricErrors(
        effects=tuple(effects),
        names=tuple(names),
        estimate=np.array([values[name] for name in names]),
        covariance=np.zeros((len(names), len(names))),
        context=problem.context,
        run=run.run,
        tip=problem.ends(problem.own_of(solution.local))[1][int(np.argmax(problem.context.run == run.run))],
    )
