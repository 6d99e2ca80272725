"""The values of the effects that were added to a certified run's model, from what each run of its campaign says."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.effects import ChainEffect
from monitor.effects.shapes import Step
from monitor.methods import campaign_method
from monitor.records import Array
from monitor.reporting.between_points import LEAST_STEP
from monitor.reporting.certificate.model_effect import Lies, ModelEffect
from monitor.reporting.run_coefficient import run_of
from monitor.store import Database, MachineHistory, machine_history
from monitor.workflow.identify.answer import Estimate, reversal_value
from monitor.workflow.models import as_model
from monitor.workflow.uncertainty.stored import StatedUncertainty


def effects_of(db: Database, evaluated: StatedUncertainty) -> tuple[ModelEffect, ...] | None:
    """Return the effects of the model that are no parameters of a run; None where it has none.

    Those among the results have their value from there. Of another the value is the mean of what the runs of the
    campaign say, each by itself; its u is the largest of what the noise of the readings, the scatter of the runs and
    that of the days' means leave of such a mean. Of an effect that has a coefficient a run it is that of the run
    itself, as `identify` gives it. One of a campaign that is not identified under the model is named without a value,
    and so is a coefficient of which nothing is known beside others of the same effect.
    """
    names_of = _coefficients(evaluated)
    if not names_of:
        return None
    joint = _joint(evaluated)
    alone = _alone(db, evaluated, names_of, joint)
    outside = evaluated.answer.effects_outside
    places = _places(evaluated)
    return tuple(
        replace(effect, lies=places.get(effect.name))
        # The map says nothing of a smaller step either.
        if effect.value is not None and abs(effect.value) >= LEAST_STEP
        else effect
        for effect in map(
            _said_of_its_run, (*joint.values(), *(replace(each, outside=outside) for each in alone))
        )
    )


def _said_of_its_run(effect: ModelEffect) -> ModelEffect:
    """An effect, said to be of one run where its name is that of one."""
    return effect if run_of(effect.name) is None else replace(effect, of_one_run=True)


def _alone(
    db: Database,
    evaluated: StatedUncertainty,
    names_of: Mapping[str, Sequence[str]],
    joint: Collection[str],
) -> list[ModelEffect]:
    """The coefficients of effects, by their text, that are no results."""
    others = {text: [name for name in names if name not in joint] for text, names in names_of.items()}
    every = [name for names in others.values() for name in names]
    values = _from_history(db, evaluated, every) | _of_the_run(evaluated, every)
    alone: list[ModelEffect] = []
    for text, names in others.items():
        stated = [values[name] for name in names if name in values]
        unstated = [name for name in names if name not in values]
        # An effect of which nothing is known is named as a whole.
        whole = len(unstated) == len(names_of[text])
        alone += [*stated, *map(ModelEffect, [text] if whole else unstated)]
    return alone


def _coefficients(evaluated: StatedUncertainty) -> dict[str, tuple[str, ...]]:
    """The names of the coefficients of every effect that all runs share, by its text, without those of other runs; an
    effect on what did not measure in this campaign by its text alone."""
    problem = campaign_method(evaluated.campaign).problem_of(evaluated.campaign, as_model(evaluated.model))
    names = {
        added.effect.text: tuple(name for name in added.names() if run_of(name) in (None, evaluated.run))
        for added in problem.shared
    }
    outside = (
        text for text in problem.left_out if text not in names and run_of(text) in (None, evaluated.run)
    )
    # Of an effect of another run there is nothing to say here.
    return {text: of_run for text, of_run in names.items() if of_run} | {text: (text,) for text in outside}


def _places(evaluated: StatedUncertainty) -> dict[str, Lies]:
    """Where the steps of the model lie, by the names of their coefficients."""
    problem = campaign_method(evaluated.campaign).problem_of(evaluated.campaign, as_model(evaluated.model))
    stepped = [
        effect
        for effect in problem.added
        if isinstance(effect, ChainEffect) and isinstance(effect.shape, Step)
    ]
    if not stepped:
        return {}
    # Loaded here: a certificate without steps waits for no solver.
    from monitor.discovery import fit, steps_of_model

    between = steps_of_model(fit(problem))
    places = {}
    for effect in stepped:
        steps = between[effect.text]
        names = effect.parameters(problem.context)
        # A driver may have several columns for each step.
        each = len(names) // len(steps)
        for number, name in enumerate(names):
            step = steps[number // each]
            first, last = step.middle
            places[name] = Lies(effect.joint.name, first, last, step.width or None)
    return places


def _from_history(db: Database, evaluated: StatedUncertainty, names: Sequence[str]) -> dict[str, ModelEffect]:
    """Coefficients as the runs of the campaign have them stored; without those of which none has a value."""
    if not names:
        return {}
    model, campaign = evaluated.model, evaluated.campaign
    history = machine_history(db, campaign.machine.id, model=model.name, version=model.version)
    history = history.part(history.campaign == campaign.name)
    values = {name: _effect(history, name) for name in names if name in history.parameters}
    return {name: effect for name, effect in values.items() if effect is not None}


def _of_the_run(evaluated: StatedUncertainty, names: Sequence[str]) -> dict[str, ModelEffect]:
    """The coefficients that are of the run alone."""
    of_run = [name for name in names if run_of(name) is not None]
    if not of_run:
        return {}
    # Loaded here, as above.
    from monitor.workflow.identify.machine import identified, machine_answer

    identification, _ = identified(evaluated.campaign, evaluated.model)
    added = machine_answer(evaluated.campaign, identification).added
    return {
        name: _stated(name, estimate, 1, 1)
        for name in of_run
        if isinstance(estimate := added.get(name), Estimate)
    }


def _joint(evaluated: StatedUncertainty) -> dict[str, ModelEffect]:
    """The effects among the results, by name."""
    answer = evaluated.answer
    runs = evaluated.campaign.runs
    effects = {}
    for name in answer.effects or ():
        amplitude = Estimate(answer.guf.estimate[name], answer.guf.u[name], answer.units[name])
        of_its_runs = [run for run in runs if run_of(name) in (None, run.run)]
        days = len({run.day for run in of_its_runs})
        effects[name] = _stated(name, amplitude, len(of_its_runs), days, joint=True)
    return effects


def _effect(history: MachineHistory, name: str) -> ModelEffect | None:
    """The value of an effect over the runs of a campaign; None where no run states it."""
    column = history.parameters.index(name)
    values, u = history.values[:, column], history.u[:, column]
    stated = np.isfinite(values) & np.isfinite(u)
    if not stated.any():
        return None
    values, u, days = values[stated], u[stated], history.day[stated]
    amplitude = Estimate(float(values.mean()), _u_of_mean(values, u, days), history.units[column])
    return _stated(name, amplitude, len(values), len(np.unique(days)))


def _stated(name: str, amplitude: Estimate, runs: int, days: int, *, joint: bool = False) -> ModelEffect:
    """An effect of that amplitude, with the reversal value where it is a play."""
    reversal = reversal_value(name, amplitude)
    return ModelEffect(
        name, amplitude.unit, amplitude.value, amplitude.u, runs, days,
        None if reversal is None else reversal.value, None if reversal is None else reversal.u, joint,
    )  # fmt: skip


def _u_of_mean(values: Array, u: Array, days: npt.NDArray[np.int64]) -> float:
    """The standard uncertainty of a mean of runs: by their own u, by their scatter, by that of the days' means."""
    runs = len(values)
    candidates = [math.sqrt(float(np.sum(u**2))) / runs]
    if runs > 1:
        candidates.append(float(values.std(ddof=1)) / math.sqrt(runs))
    means = np.array([values[days == day].mean() for day in np.unique(days)])
    if len(means) > 1:
        candidates.append(float(means.std(ddof=1)) / math.sqrt(len(means)))
    return max(candidates)
