"""The values of the effects that were added to a certified run's model, from what each run of its campaign says."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.reporting.certificate.model_effect import ModelEffect
from monitor.store import Database, MachineHistory, machine_history
from monitor.workflow.identify.answer import Estimate, reversal_value
from monitor.workflow.uncertainty.stored import StatedUncertainty


def effects_of(db: Database, evaluated: StatedUncertainty) -> tuple[ModelEffect, ...] | None:
    """Return the effects of the model that are no parameters of a run; None where it has none.

    The value is the mean of what the runs of the campaign say, each by itself. Its u is the largest of what the noise
    of the readings, the scatter of the runs and that of the days' means leave of such a mean. An effect of a campaign
    that is not identified under the model is named without a value.
    """
    model, campaign = evaluated.model, evaluated.campaign
    local_names = {
        *evaluated.names,
        *(name for refused in evaluated.answer.refused for name in refused.parameters),
    }
    shared = [text for text in model.effects if not any(name.startswith(text) for name in local_names)]
    if not shared:
        return None
    history = machine_history(db, campaign.machine.id, model=model.name, version=model.version)
    history = history.part(history.campaign == campaign.name)
    effects: list[ModelEffect] = []
    for text in shared:
        names = [name for name in history.parameters if name.startswith(text) and name not in local_names]
        stated = [_effect(history, name) for name in names]
        effects += [effect for effect in stated if effect is not None] or [ModelEffect(text)]
    return tuple(effects)


def _effect(history: MachineHistory, name: str) -> ModelEffect | None:
    """The value of an effect over the runs of a campaign; None where no run states it."""
    column = history.parameters.index(name)
    values, u = history.values[:, column], history.u[:, column]
    stated = np.isfinite(values) & np.isfinite(u)
    if not stated.any():
        return None
    values, u, days = values[stated], u[stated], history.day[stated]
    amplitude = Estimate(float(values.mean()), _u_of_mean(values, u, days), history.units[column])
    reversal = reversal_value(name, amplitude)
    return ModelEffect(
        name, amplitude.unit, amplitude.value, amplitude.u, len(values), len(np.unique(days)),
        None if reversal is None else reversal.value, None if reversal is None else reversal.u,
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
