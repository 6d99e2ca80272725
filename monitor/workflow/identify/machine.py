"""The geometric errors of every run of a machine, as they are stored and as people see them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.methods import campaign_method
from monitor.methods.chain.identification import Identification, RunIdentification
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem, Solver, solve_problem
from monitor.methods.model import chain_of
from monitor.readers.row_places import RowPlaces
from monitor.records import Array, Campaign, Machine
from monitor.refusal import Reason, ReasonKind, Refusal
from monitor.reporting.refused import refusal_sentence, refused_parameters
from monitor.store import StoredIdentification, StoredModel, StoredRun
from monitor.units import MICROMETRE, Unit
from monitor.workflow.identify.answer import Estimate, IdentifyAnswer, MachineRun, reversal_value
from monitor.workflow.identify.lack_of_fit import lack_of_fit
from monitor.workflow.identify.notes import elsewhere, note
from monitor.workflow.models import as_model
from monitor.workflow.uncertainty.machine_frame import frames_of, refers_to


def identified(
    campaign: Campaign, model: StoredModel, solve: Solver = solve_problem
) -> tuple[Identification, StoredIdentification]:
    """Identify a campaign under a model; the result, and the same as it is stored, with its lack of fit.

    ``solve`` gives the solution of the method's problem. Raises DataError, EffectError as ``identify``.
    """
    solved: list[tuple[ChainProblem, Solution]] = []

    def remembered(problem: ChainProblem) -> Solution:
        solved.append((problem, solve(problem)))
        return solved[-1][1]

    identification = campaign_method(campaign).identify(campaign, as_model(model), remembered)
    judged = lack_of_fit(*solved[-1], is_gross=bool(identification.gross))
    return identification, replace(_stored(campaign, identification, model), lack_of_fit=judged)


def machine_answer(
    campaign: Campaign, identification: Identification, lack_of_fit_p: float | None = None
) -> IdentifyAnswer:
    """The identification of a campaign of a machine in display units, with notes."""
    machine, places = campaign.machine, RowPlaces(campaign)
    added = _estimates(
        identification.added,
        identification.added_units,
        identification.added_estimate,
        identification.added_covariance,
    )
    values = {
        name: value for name, each in added.items() if (value := reversal_value(name, each)) is not None
    }
    return IdentifyAnswer(
        campaign=identification.campaign,
        model=identification.model,
        machine=machine.id,
        method=identification.method,
        runs=tuple(_run(machine, identification, run, places) for run in identification.runs),
        added=added,
        added_refused=tuple(map(refused_parameters, identification.added_refused)),
        frames=frames_of((*identification.parameters, *identification.added), chain_of(machine)),
        reversal_values=values or None,
        taken_up=identification.taken_up or None,
        as_stated=identification.as_stated or None,
        lack_of_fit_p=lack_of_fit_p,
        work_points_elsewhere=elsewhere(point for run in identification.runs for point in run.displaced),
    )


def _estimates(
    names: tuple[str, ...], units: tuple[Unit, ...], estimate: Array, covariance: Array
) -> dict[str, Estimate]:
    """Every parameter that has a number."""
    return {
        name: Estimate(unit.to_display(float(value)), unit.to_display(float(np.sqrt(variance))), unit.name)
        for name, unit, value, variance in zip(names, units, estimate, np.diag(covariance), strict=True)
        if np.isfinite(value)
    }


def _run(
    machine: Machine, identification: Identification, run: RunIdentification, places: RowPlaces
) -> MachineRun:
    return MachineRun(
        run=run.run,
        parameters=_estimates(identification.parameters, identification.units, run.estimate, run.covariance),
        refused=tuple(map(refused_parameters, run.refused)),
        rms_um=MICROMETRE.to_display(run.rms),
        largest_um=MICROMETRE.to_display(float(np.abs(run.residuals).max())),
        chi_square=run.chi_square,
        degrees_of_freedom=run.degrees_of_freedom,
        iterations=identification.iterations,
        note=note(machine, identification, run, places),
    )


def _stored(campaign: Campaign, identification: Identification, model: StoredModel) -> StoredIdentification:
    """The runs with their own parameters and, behind them, the added effects as each run alone determines them."""
    probings, followed = campaign.probings, identification.followed
    runs = []
    for index, run in enumerate(identification.runs):
        count, more = len(run.estimate), len(followed.names)
        # How the two depend on each other is not stated: the run's own parameters know the effects from all runs.
        covariance = np.full((count + more, count + more), np.nan)
        covariance[:count, :count] = run.covariance
        covariance[count:, count:] = followed.covariance[index]
        unseen = tuple(
            Refusal((name,), Reason(ReasonKind.UNSEEN))
            for name, value in zip(followed.names, followed.estimate[index], strict=True)
            if np.isnan(value)
        )
        runs.append(
            StoredRun(
                run=run.run,
                estimate=np.concatenate([run.estimate, followed.estimate[index]]),
                covariance=covariance,
                refused=tuple(
                    (refusal.parameters, refusal_sentence(refusal)) for refusal in (*run.refused, *unseen)
                ),
                rms_mm=run.rms,
                iterations=identification.iterations,
                degrees_of_freedom=run.degrees_of_freedom,
                chi_square=run.chi_square,
                sequence=probings.sequence[probings.run == run.run],
                residuals=run.residuals,
                # What each run alone says of an added effect is taken as its own.
                common_parts={
                    quantity: np.concatenate([part, np.zeros(more)])
                    for quantity, part in run.common_parts.items()
                },
            )
        )
    return StoredIdentification(
        campaign=identification.campaign,
        model=model.name,
        model_version=model.version,
        method=identification.method,
        parameters=(*identification.parameters, *followed.names),
        units=(*identification.units, *followed.units),
        runs=tuple(runs),
        refers_to=refers_to((*identification.parameters, *followed.names), chain_of(campaign.machine)),
    )
