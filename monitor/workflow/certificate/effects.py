"""The values of the effects that were added to a certified run's model, from what each run of its campaign says."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.reporting.certificate.model_effect import ModelEffect
from monitor.store import Database, MachineHistory, machine_history
from monitor.workflow.identify.answer import Estimate, reversal_value
from monitor.workflow.uncertainty.stored import StatedUncertainty


def effects_of(db: Database, evaluated: StatedUncertainty) -> tuple[ModelEffect, ...] | None:
    """Return the effects of the model that are no parameters of a run; None where it has none.

    Those among the results have their value from there. Of another the value is the mean of what the runs of the
    campaign say, each by itself; its u is the largest of what the noise of the readings, the scatter of the runs and
    that of the days' means leave of such a mean. One of a campaign that is not identified under the model is named
    without a value.
    """
    joint = _joint(evaluated)
    shared = _shared(evaluated, joint)
    if not shared:
        return None
    others = [text for text in shared if not any(name.startswith(text) for name in joint)]
    outside = evaluated.answer.effects_outside
    alone = _from_history(db, evaluated, others) if others else ()
    return (*joint.values(), *(replace(effect, outside=outside) for effect in alone))


def _names_of_run(evaluated: StatedUncertainty, joint: Mapping[str, ModelEffect]) -> set[str]:
    """The parameters of the run itself, with a number and without."""
    refused = (name for group in evaluated.answer.refused for name in group.parameters)
    return {*(name for name in evaluated.names if name not in joint), *refused}


def _shared(evaluated: StatedUncertainty, joint: Mapping[str, ModelEffect]) -> list[str]:
    """The effects of the model, as written, of which no run has parameters of its own."""
    names = _names_of_run(evaluated, joint)
    return [text for text in evaluated.model.effects if not any(name.startswith(text) for name in names)]


def _from_history(
    db: Database, evaluated: StatedUncertainty, effects: Sequence[str]
) -> tuple[ModelEffect, ...]:
    """Effects as the runs of the campaign have them stored, without a value where none has."""
    model, campaign = evaluated.model, evaluated.campaign
    of_run = _names_of_run(evaluated, {})
    history = machine_history(db, campaign.machine.id, model=model.name, version=model.version)
    history = history.part(history.campaign == campaign.name)
    stated: list[ModelEffect] = []
    for text in effects:
        names = [name for name in history.parameters if name.startswith(text) and name not in of_run]
        values = [_effect(history, name) for name in names]
        stated += [effect for effect in values if effect is not None] or [ModelEffect(text)]
    return tuple(stated)


def _joint(evaluated: StatedUncertainty) -> dict[str, ModelEffect]:
    """The effects among the results, by name."""
    answer = evaluated.answer
    runs = evaluated.campaign.runs
    effects = {}
    for name in answer.effects or ():
        amplitude = Estimate(answer.guf.estimate[name], answer.guf.u[name], answer.units[name])
        days = len({run.day for run in runs})
        effects[name] = _stated(name, amplitude, len(runs), days, joint=True)
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
