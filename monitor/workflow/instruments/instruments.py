"""What each instrument does for each parameter of a machine, and whether the instruments agree."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import scipy

from monitor.exceptions import NotFoundError
from monitor.methods import campaign_method
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.methods.chain.sufficiency import refuse_exact_fits
from monitor.methods.instruments import suspects
from monitor.methods.method import Instruments, InstrumentShare, Unable
from monitor.records import Array
from monitor.store import Database
from monitor.units import Unit
from monitor.workflow.copied_readings import copied_readings
from monitor.workflow.identify.fitting import explained_refusals, machine_problem
from monitor.workflow.instruments.answer import (
    Agreement,
    AloneValue,
    Disagreement,
    InstrumentFit,
    InstrumentsAnswer,
    ParameterShares,
)
from monitor.workflow.instruments.request import InstrumentsRequest
from monitor.workflow.measured import machine_campaign
from monitor.workflow.models import label, resolve_for, subject_of
from monitor.workflow.uncertainty.machine_frame import refers_to

#: Coverage factor of E_n.
K = 2.0
#: A disagreement that comes out by chance more often than this is doubtful: the level at which `compare` judges.
DOUBTFUL = suspects.DOUBTFUL


def instruments(db: Database, request: InstrumentsRequest) -> InstrumentsAnswer:
    """Fit a model to a campaign and share out one run among its instruments; nothing is stored.

    Raises NotFoundError for a campaign or run that is not there, DataError where the readings do not suffice.
    """
    campaign = machine_campaign(db, request.campaign, "contributions", lambda method: method.instruments)
    ability = campaign_method(campaign).instruments
    assert isinstance(ability, Instruments)
    model = resolve_for(db, request.model, campaign.method, subject_of(campaign))
    with explained_refusals(campaign, model):
        problem = machine_problem(campaign, model)
    run = int(problem.runs[-1]) if request.run is None else request.run
    if run not in problem.runs:
        raise NotFoundError(
            f"campaign {campaign.name} has no run {run}; it has runs {', '.join(map(str, problem.runs))}"
        )
    with explained_refusals(campaign, model):
        solution = solve_problem(problem)
        refuse_exact_fits(problem, solution)
    of_all, beforehand = ability.shares(problem, solution, run)
    parameters, open_ones = _parameters(problem, solution, run, of_all, beforehand)
    return InstrumentsAnswer(
        campaign=campaign.name,
        run=run,
        model=label(model),
        instruments=tuple(
            InstrumentFit(
                share.name,
                share.setups,
                share.numbers,
                float(np.sqrt(share.chi_square / max(share.numbers, 1))),
            )
            for share in of_all
        ),
        parameters=parameters,
        not_determined=open_ones,
        by_chance=_by_chance([pair for shares in parameters for pair in shares.agreement]),
        copied_readings=copied_readings(db, campaign),
    )


def disagreement(
    problem: ChainProblem,
    solution: Solution,
    ability: Instruments | Unable,
    run: int | None = None,
    doubtful: float = DOUBTFUL,
) -> Disagreement | None:
    """The E_n between instruments that is the least by chance in a run of a fit, the last one without ``run``; None
    where chance makes it more often than ``doubtful``, or nothing is compared.

    Nothing is fitted anew: what an instrument says alone is one step from the joint point.
    """
    if not isinstance(ability, Instruments):
        return None
    run = int(problem.runs[-1]) if run is None else run
    of_all, beforehand = ability.shares(problem, solution, run)
    parameters, _ = _parameters(problem, solution, run, of_all, beforehand)
    pairs = [(shares.parameter, pair) for shares in parameters for pair in shares.agreement]
    by_chance = _by_chance([pair for _, pair in pairs])
    if by_chance is None or by_chance > doubtful:
        return None
    # Of several that are too rare for a number the largest.
    parameter, worst = min(pairs, key=lambda compared: (_p(compared[1]), -compared[1].e_n))
    return Disagreement(
        run, parameter, worst.first, worst.second, worst.e_n, len(pairs), by_chance, worst.degrees_of_freedom
    )


def _parameters(
    problem: ChainProblem,
    solution: Solution,
    run: int,
    of_all: tuple[InstrumentShare, ...],
    beforehand: Array,
) -> tuple[tuple[ParameterShares, ...], tuple[str, ...]]:
    """The parameters of a run that have a number, each shared out among its instruments, and those that have none."""
    index = int(np.searchsorted(problem.runs, run))
    frames = refers_to(problem.base_names, problem.context.chain)
    parameters, open_ones = [], []
    for number, name in enumerate(problem.base_names):
        if not solution.local_free[index, number]:
            open_ones.append(name)
            continue
        value = float(solution.local[index, number])
        unit = problem.base_units[name]
        shares = _parameter(name, unit, value, number, of_all, float(beforehand[number]))
        parameters.append(replace(shares, refers_to=frames.get(name)))
    return tuple(parameters), tuple(open_ones)


def limit_of(comparisons: int, doubtful: float, degrees_of_freedom: float | None = None) -> float:
    """The E_n that one of so many comparisons exceeds by chance so often at most, as ``_by_chance`` has it."""
    freedom = np.inf if degrees_of_freedom is None else degrees_of_freedom
    return -float(scipy.special.stdtrit(freedom, 0.5 * doubtful / comparisons)) / K


def _by_chance(pairs: list[Agreement]) -> float | None:
    """How often at most the least likely of such comparisons comes about without fault: Bonferroni's bound; None
    without comparisons."""
    return min(1.0, len(pairs) * min(map(_p, pairs))) if pairs else None


def _p(pair: Agreement) -> float:
    """How often chance makes an E_n as large: a normal difference with U = 2 u, Student's t where u is by scatter."""
    freedom = np.inf if pair.degrees_of_freedom is None else pair.degrees_of_freedom
    return 2.0 * float(scipy.special.stdtr(freedom, -K * pair.e_n))


def _parameter(
    name: str, unit: Unit, value: float, number: int, of_all: tuple[InstrumentShare, ...], beforehand: float
) -> ParameterShares:
    show = unit.to_display
    parts = {share.name: float(np.sqrt(share.variance[number])) for share in of_all}
    u = float(np.sqrt(sum(part**2 for part in parts.values()) + beforehand))
    alone = tuple(
        AloneValue(
            share.name,
            show(float(share.alone[number])),
            show(float(np.sqrt(share.alone_variance[number]))),
            float(share.alone_freedom[number]) if np.isfinite(share.alone_freedom[number]) else None,
        )
        for share in of_all
        if np.isfinite(share.alone[number])
    )
    agreement = tuple(_agreement(first, second) for first, second in combinations(alone, 2))
    return ParameterShares(
        name,
        unit.name,
        show(value),
        show(u),
        {instrument: show(part) for instrument, part in parts.items()},
        show(float(np.sqrt(beforehand))),
        alone,
        agreement,
    )


def _agreement(first: AloneValue, second: AloneValue) -> Agreement:
    """E_n of two instruments, with the degrees of freedom of its u (JCGM 100:2008, G.2b)."""
    u = float(np.hypot(first.u, second.u))
    parts = sum(
        alone.u**4 / alone.degrees_of_freedom
        for alone in (first, second)
        if alone.degrees_of_freedom is not None
    )
    e_n = abs(first.value - second.value) / (K * u)
    return Agreement(first.instrument, second.instrument, e_n, u**4 / parts if parts else None)
