"""Jumps at reversal that another order of the plan tells apart: from the other side every axis comes to the same poses.

Poses between the present ones leave such a tie where it is: in one order of touching, which recurs at every pose, the
axes reverse together. The reversed order needs no other pose, target or stylus.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import MachineEffect
from monitor.discovery.machine.scene_columns import raw_columns
from monitor.discovery.machine.separation.distances import (
    DECIDES,
    WORTHWHILE,
    PlanRows,
    distance_of,
    pairs_of,
)
from monitor.effects import ChainEffect, Context
from monitor.effects.drivers import Always
from monitor.effects.shapes import Reversal, WindUp
from monitor.records import Array


def runs_in_reversed_order(
    fit: Fit, effect: MachineEffect, coefficients: Array, rival: MachineEffect
) -> int | None:
    """Return how many runs of the same plan in the reversed order tell an effect of the given coefficients (k,) from a
    rival, both of which jump at reversal; None where as many as there are do not."""
    if not (_jumps(effect) and _jumps(rival)):
        return None
    back = _back_order(fit.problem.context)
    present, fresh = (_rows(fit, (effect, rival), order) for order in (np.arange(len(back)), back))
    # One pose: a run is measured in one order, or in the other.
    whole = PlanRows(fresh.nuisance[:, None], [columns[:, None] for columns in fresh.effects])
    (pair,) = pairs_of(present, whole, np.zeros(len(whole.nuisance), dtype=np.int64), coefficients)
    runs = len(fit.problem.runs)
    least = max(DECIDES, WORTHWHILE * distance_of(pair.present, runs))
    each = (runs * pair.present + more * pair.additions[0] for more in range(1, runs + 1))
    return next((more for more, both in enumerate(each, start=1) if distance_of(both, 1) >= least), None)


def _jumps(effect: MachineEffect) -> bool:
    """Whether an effect follows the direction of its axis, and no driver."""
    return (
        isinstance(effect, ChainEffect)
        and isinstance(effect.shape, Reversal | WindUp)
        and isinstance(effect.driver, Always)
    )


def _back_order(context: Context) -> npt.NDArray[np.int64]:
    """The rows (n,) with each stretch from its last to its first."""
    order = np.arange(len(context))
    for rows in context.stretches:
        order[rows] = rows[::-1]
    return order


def _rows(fit: Fit, effects: tuple[MachineEffect, ...], order: npt.NDArray[np.int64]) -> PlanRows:
    """Whitened rows (N, p) of the first run, its effects as they are where the poses are come to in an ``order``."""
    context = replace(fit.problem.context.taken(order), approach=None)
    white = np.where(fit.has_weight, 1.0 / fit.problem.sigma, 0.0)[..., None]
    columns = []
    for effect in effects:
        basis = effect.basis(context)
        # Of each row what it is when its turn comes, in the place of the row.
        raw = raw_columns(fit, basis.taken(np.argsort(order)))
        columns.append(fit.problem.padded(np.moveaxis(raw, 0, 2) * white)[0])
    nuisance = fit.solution.last.local[0]
    return PlanRows(nuisance[: len(columns[0])], columns)
