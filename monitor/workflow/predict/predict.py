"""A model against rows that took no part in its fit: of another campaign, or parts of its own left out in turn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.discovery import Fit, fit
from monitor.discovery.machine.evidence.held_out import poses_of
from monitor.effects import ArtefactEffect, ChainEffect, Context, Effect, InstrumentEffect, TurnEffect
from monitor.effects.drivers import EachRun, RunTime, Sequence, SettlingDriver
from monitor.exceptions import DataError
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array, Campaign, CurveCampaign, Probings
from monitor.store import Database, StoredModel
from monitor.units import MICROMETRE
from monitor.workflow.explain.compare_answer import MachinePart
from monitor.workflow.identify.fitting import machine_fit, machine_problem
from monitor.workflow.measured import load_measured
from monitor.workflow.models import label, resolve_for, subject_of
from monitor.workflow.predict.answer import PredictAnswer, PredictedRow
from monitor.workflow.predict.request import PredictRequest

# Blocks of neighbouring poses, which share drifts, are dealt out to so many parts at random, always in the same way.
PARTS, BLOCKS, DEAL = 10, 50, 20260302
#: Drivers that begin at nothing with every run or day.
FROM_START = (RunTime, Sequence, SettlingDriver)


def predict(db: Database, request: PredictRequest) -> PredictAnswer:
    """Predict rows with a model that was fitted to others.

    The rows of another campaign are predicted with the tracker's frame and the targets' places of the fitted one: it is
    the same set-up. Raises NotFoundError, DataError where the readings do not suffice or cannot stand side by side.
    """
    campaign = _machine_campaign(db, request.campaign)
    model = resolve_for(db, request.model, campaign.method, subject_of(campaign))
    if request.of is None:
        return _by_parts(campaign, model)
    other = _machine_campaign(db, request.of)
    joined, rows = beside(campaign, other)
    problem = _of_one_set_up(machine_problem(joined, model), ~rows)
    fitted = fit(problem, rows)
    answer = _answer(campaign, model, problem, rows, fitted.vectors[rows])
    # The joined rows are numbered on; a reader looks for those of the other file.
    return replace(
        answer,
        of=other.name,
        fitted_rms_um=_rms(fitted, ~rows),
        rows=_numbered_as(answer.rows, other),
        taken_over=_driven_by(problem, (EachRun,)),
        from_own_start=_driven_by(problem, FROM_START),
    )


def _machine_campaign(db: Database, name: str) -> Campaign:
    measured = load_measured(db, name)
    if isinstance(measured, CurveCampaign):
        raise DataError(
            f"{name} is a curve: explain and model history already give the error of its rows left out"
        )
    return measured


def beside(campaign: Campaign, other: Campaign) -> tuple[Campaign, npt.NDArray[np.bool_]]:
    """The campaign with the run of another one of the same set-up behind its own, and marks (n,) of the rows of that
    one. It is on a day of its own, so that its times count from its own start.

    Raises DataError where they are not of one run each, or not of the same machine and targets.
    """
    for each in (campaign, other):
        if len(each.runs) != 1:
            raise DataError(
                f"{each.name} has {len(each.runs)} runs, each with a set-up of its own; rows of another campaign can "
                "be predicted from a single run only (leave --of out to predict parts of the runs from each other)"
            )
    probings, more = campaign.probings, other.probings
    if (campaign.machine.id, campaign.method) != (other.machine.id, other.method):
        raise DataError(
            f"{other.name} measured {other.machine.id} by {other.method}, {campaign.name} {campaign.machine.id} by "
            f"{campaign.method}: a model of the one says nothing of the other"
        )
    unknown = sorted(set(more.target.tolist()) - set(probings.target.tolist()))
    if unknown:
        raise DataError(
            f"{other.name} measured {', '.join(unknown)}, whose place {campaign.name} does not determine; it has "
            f"{', '.join(sorted(set(probings.target.tolist())))}"
        )
    (run,), (later,) = campaign.runs, other.runs
    behind = replace(later, run=run.run + 1, day=run.day + 1)
    count = len(more)
    joined = Probings(
        run=np.concatenate([probings.run, np.full(count, behind.run)]),
        sequence=np.concatenate([probings.sequence, int(probings.sequence.max()) + 1 + np.arange(count)]),
        time=np.concatenate([probings.time, more.time]),
        target=np.concatenate([probings.target, more.target]),
        readings={
            axis: np.concatenate([values, more.readings[axis]]) for axis, values in probings.readings.items()
        },
        channels={
            name: np.concatenate([values, more.channels[name]])
            for name, values in probings.channels.items()
            if name in more.channels
        },
    )
    return replace(campaign, runs=(run, behind), probings=joined), joined.run == behind.run


def _of_one_set_up(problem: ChainProblem, is_fitted: npt.NDArray[np.bool_]) -> ChainProblem:
    """The problem of two runs as one of a single run, with one frame and one place of every target; times and
    conditions stay those of each, nothing goes on from the one to the other, and shapes extend over the rows (n,) of
    the fit, as they do in the model."""
    context = problem.context
    added = tuple(_of_its_stretch(effect) for effect in problem.added)
    apart = replace(problem, added=added, context=replace(context, stretch=context.run))
    # Until now each run has its rows in a frame of its own, a guess that is millimetres off.
    joined = apart.taken(np.arange(len(context)), np.full(len(context), problem.runs[0])).guessed_anew()
    fitted = joined.context.taken(np.flatnonzero(is_fitted))
    return replace(joined, context=replace(joined.context, measured=fitted))


@dataclass(frozen=True)
class _DriftOfStretch(RunTime):
    """A drift in one run alone, where the runs are one set-up and only their stretches say which is which."""

    def columns(self, context: Context, joint: int | None) -> Array:
        return np.asarray((context.run_time * (context.stretch == self.run))[:, None])


def _of_its_stretch(effect: Effect) -> Effect:
    """The effect; that of one run alone is none of the other one."""
    if not isinstance(effect, ChainEffect | ArtefactEffect | TurnEffect | InstrumentEffect):
        return effect
    driver = effect.driver
    if not isinstance(driver, RunTime) or driver.run is None:
        return effect
    return replace(effect, driver=_DriftOfStretch(driver.run))


def _driven_by(problem: ChainProblem, drivers: tuple[type, ...]) -> tuple[str, ...]:
    """The added effects that follow one of the drivers; a drift of one run alone follows none in another run."""
    return tuple(
        effect.text
        for effect in problem.added
        if isinstance(driver := getattr(effect, "driver", None), drivers)
        and not isinstance(driver, _DriftOfStretch)
    )


def _by_parts(campaign: Campaign, model: StoredModel) -> PredictAnswer:
    """Every part of the poses predicted from the others."""
    whole = machine_fit(campaign, model)
    problem = whole.problem
    pose = poses_of(whole)
    blocks = min(BLOCKS, int(pose[-1]) + 1)
    parts = min(PARTS, blocks)
    part = np.random.default_rng(DEAL).permutation(np.arange(blocks) % parts)[
        pose * blocks // (int(pose[-1]) + 1)
    ]
    residual = np.zeros_like(whole.vectors)
    for number in range(parts):
        rows = part == number
        residual[rows] = fit(problem, rows, whole).vectors[rows]
    rows = np.ones(len(part), dtype=bool)
    answer = _answer(campaign, model, problem, rows, residual)
    return replace(answer, blocks=parts, fitted_rms_um=_rms(whole, rows))


def _rms(fitted: Fit, rows: npt.NDArray[np.bool_]) -> float:
    return MICROMETRE.to_display(float(np.sqrt(np.mean(fitted.vectors[rows] ** 2))))


def _answer(
    campaign: Campaign,
    model: StoredModel,
    problem: ChainProblem,
    rows: npt.NDArray[np.bool_],
    residual: Array,
) -> PredictAnswer:
    """The answer for rows (marks) with residuals (m, d) mm."""
    context, um = problem.context, MICROMETRE.to_display
    targets = context.target[rows]
    resting = np.isin(targets, list(problem.resting))

    def rms(part: npt.NDArray[np.bool_]) -> float:
        return um(float(np.sqrt(np.mean(residual[part] ** 2))))

    if resting.all():
        raise DataError("no row of a target that the machine moves is left to be predicted")
    return PredictAnswer(
        campaign=campaign.name,
        model=label(model),
        of=campaign.name,
        blocks=1,
        rms_um=rms(~resting),
        resting_rms_um=rms(resting) if resting.any() else None,
        fitted_rms_um=0.0,
        stated_uncertainty_um=um(float(np.sqrt(np.mean(problem.sigma[np.isfinite(problem.sigma)] ** 2)))),
        components=problem.components,
        are_angles=None if problem.is_length.any() else True,
        by_target={
            str(target): MachinePart(
                rms(targets == target), um(float(np.abs(residual[targets == target]).max())),
                int(np.sum(targets == target)),
            )
            for target in dict.fromkeys(targets.tolist())
        },
        rows=tuple(
            PredictedRow(int(run), int(sequence), str(target), tuple(um(float(part)) for part in vector))
            for run, sequence, target, vector in zip(
                context.run[rows], context.sequence[rows], targets, residual, strict=True
            )
        ),
    )  # fmt: skip


def _numbered_as(rows: tuple[PredictedRow, ...], other: Campaign) -> tuple[PredictedRow, ...]:
    """The rows with the runs and sequence numbers of the campaign that they come from."""
    numbers = zip(other.probings.run, other.probings.sequence, strict=True)
    return tuple(
        replace(row, run=int(run), sequence=int(sequence))
        for row, (run, sequence) in zip(rows, numbers, strict=True)
    )
