"""The residual against what drives a missing effect, before and after it is added, and over the workspace: what
the pictures of an explanation are drawn from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.discovery import Explanation, Fit
from monitor.effects import ArtefactEffect, ChainEffect, parse_effect
from monitor.effects.drivers import Channel, EachRun, RunTime, WarmUp
from monitor.effects.shapes import Const, Cyclic, FormulaShape, Reversal
from monitor.exceptions import InputError
from monitor.records import Array
from monitor.units import COLUMN_UNITS, MICROMETRE, MINUTE
from monitor.workflow.explain.residuals import drivers_followed, in_machine_frame, mean_over_runs

Document = dict[str, Any]
#: Up to so many different values of a driver are groups of their own; of more, parts of equal width are made.
OWN_GROUPS, PARTS = 16, 10
#: Single points kept for a picture; more only blacken it.
POINTS = 240
#: Digits kept of what is only drawn.
DIGITS = 4


@dataclass(frozen=True)
class Against:
    """Residuals (n,) in µm along what an effect displaces, against what drives it (n,), before and after it is added.

    ``after`` is None where no fit has the effect. ``driver`` and ``along`` are in words.
    """

    driver: str
    along: str
    at: Array
    before: Array
    after: Array | None

    @property
    def groups(self) -> npt.NDArray[np.int64]:
        """The group (n,) of each point: its value, or a part of the range."""
        return _groups(self.at)


def against_effect(found: Explanation, effect: str) -> Against | None:
    """The residual in the direction in which ``effect`` acts, against what drives it; of several that do (position,
    channel, their product) that which it follows most. None for an effect that cannot be drawn so.

    A positive residual is what the measurement calls for. Of a channel that also changes from run to run, only the
    change within the run is seen, since balls and tip are free in every run: then it is taken from its mean there.
    """
    final, keep = found.final, ~found.final.left_out
    problem = final.problem
    place = 0
    own: tuple[ChainEffect | ArtefactEffect, Array] | None = None
    for one in problem.added:
        size = one.basis(problem.context).size
        if one.text == effect and isinstance(one, ChainEffect | ArtefactEffect):
            own = one, final.solution.common[place : place + size]
        place += size
    try:
        chosen = parse_effect(effect, problem.context.chain) if own is None else own[0]
        basis = chosen.basis(problem.context)
    except InputError:
        return None
    if isinstance(chosen, ChainEffect):
        term = chosen.term
        by_term = final.by_error[:, :, term.joint, term.stage, term.component]
        direction = problem.observe(by_term[:, :, None])[:, :, 0]
        along = term.symbol
    else:
        direction = np.sum(final.moved_by(basis) * (1.0 if own is None else own[1]), axis=2)
        along = chosen.text
    length = np.linalg.norm(direction, axis=1)
    seen = keep & (length > 1e-9 * max(float(length.max()), 1e-300))
    if not seen.any():
        return None
    unit = direction[seen] / length[seen, None]
    um = -MICROMETRE.to_display(1.0)
    before = um * np.sum(found.comparison.vectors[seen] * unit, axis=1)
    after = None if own is None else um * np.sum(final.vectors[seen] * unit, axis=1)
    columns = {name: values[seen] for name, values in _what_drives(final, chosen).items()}
    if own is not None:
        moved = -um * np.sum(np.sum(final.moved_by(basis) * own[1], axis=2)[seen] * unit, axis=1)
        if not columns or (isinstance(chosen, ChainEffect) and len(columns) > 1):
            columns[f"what {effect} predicts / µm"] = moved
    columns = {
        name: x for name, x in columns.items() if np.isfinite(x).all() and np.ptp(x) > 1e-9 * np.abs(x).max()
    }
    if not columns:
        return None
    name = max(columns, key=lambda one: _followed(columns[one], before))
    return Against(name, along, columns[name], before, after)


def _what_drives(final: Fit, effect: ChainEffect | ArtefactEffect) -> dict[str, Array]:
    """The columns (n,) that an effect names: its axis's position and its driver, each as people know it."""
    context = final.problem.context
    found: dict[str, Array] = {}
    if isinstance(effect, ChainEffect) and not isinstance(effect.shape, Const | FormulaShape):
        joint, at = effect.joint, context.positions[:, effect.term.joint]
        reading = joint.sign * at * (180.0 / np.pi if joint.turns else 1.0)
        if isinstance(effect.shape, Reversal):
            found[f"direction of the last travel of {joint.name}"] = (
                joint.sign * context.travel[:, effect.term.joint]
            )
        elif isinstance(effect.shape, Cyclic):
            found[f"{joint.name} within its pitch of {effect.shape.pitch:g} mm / mm"] = (
                reading % effect.shape.pitch
            )
        else:
            found[f"{joint.name} / {'°' if joint.turns else 'mm'}"] = reading
    driver = effect.driver
    if isinstance(driver, Channel):
        stem, _, suffix = driver.name.rpartition("_")
        unit = COLUMN_UNITS[suffix].name
        values = context.columns[driver.name]
        found[f"{stem.replace('_', ' ')} / {unit}"] = values
        found[f"{stem.replace('_', ' ')}, from its mean in the run / {unit}"] = _within_run(
            context.run, values
        )
    elif isinstance(driver, WarmUp):
        minutes = context.day_time / MINUTE.factor
        found["time since the day's first start / min"] = minutes
        warmth = driver.columns(context, None)[:, 0]
        found["warm-up, from its mean in the run"] = _within_run(context.run, warmth)
    elif isinstance(driver, RunTime):
        found["part of the run / %"] = 100.0 * context.run_time
    elif isinstance(driver, EachRun) or (not found and isinstance(effect, ChainEffect)):
        found["run"] = context.run.astype(np.float64)
    return found


def _within_run(run: npt.NDArray[np.int64], values: Array) -> Array:
    _, place = np.unique(run, return_inverse=True)
    mean: Array = np.bincount(place, weights=values) / np.bincount(place)
    return values - mean[place]


def _groups(values: Array) -> npt.NDArray[np.int64]:
    distinct, place = np.unique(np.round(values, 6), return_inverse=True)
    if len(distinct) > OWN_GROUPS:
        low, high = np.quantile(values, [0.02, 0.98])
        cuts = np.linspace(low, high, PARTS + 1)[1:-1]
        place = np.unique(np.searchsorted(cuts, values, side="right"), return_inverse=True)[1]
    return np.asarray(place, dtype=np.int64)


def _followed(driver: Array, residual: Array) -> float:
    """How much of the residual's sum of squares its means over the groups of a driver explain, beyond chance."""
    place = _groups(driver)
    count = np.bincount(place)
    means = np.bincount(place, weights=residual) / count
    return float(np.sum(count * means**2) - len(count) * np.var(residual))


def picture_documents(found: Explanation, effect: str | None) -> Document:
    """What the pictures of an explanation show: the mean residual over the workspace (``residual_map``), and the
    residual against what drives the missing ``effect``, or where none is known against what it follows most."""
    final = found.final
    document: Document = {"residual_map": None, "residual_against": None}
    if found.comparison.vectors.shape[1] == 3:
        places, vectors = mean_over_runs(final, *in_machine_frame(final, found.comparison.vectors))
        document["residual_map"] = {"place_mm": _rounded(places), "residual_um": _rounded(vectors)}
    against = None if effect is None else against_effect(found, effect)
    if against is None and found.comparison.vectors.shape[1] == 3:
        name, values, axis, residual = drivers_followed(final)[0]
        against = Against(name.replace("_", " "), axis, values, residual, None)
    if against is not None:
        document["residual_against"] = _against_document(against)
    return document


def _against_document(found: Against) -> Document:
    place = found.groups
    count = np.bincount(place)
    middle = _means(found.at, place)[0]
    columns: dict[str, Array | None] = {"at": middle}
    for name, values in (("before", found.before), ("after", found.after)):
        columns[f"{name}_um"], columns[f"u_{name}_um"] = (
            (None, None) if values is None else _means(values, place)
        )
    shown = np.unique(np.linspace(0, len(place) - 1, min(POINTS, len(place))).astype(int))
    return {
        "driver": found.driver,
        "along": found.along,
        "groups": [
            {"n": int(count[group])}
            | {name: None if values is None else _number(values[group]) for name, values in columns.items()}
            for group in np.argsort(middle)
        ],
        "at": _rounded(found.at[shown]),
        "before_um": _rounded(found.before[shown]),
    }


def _means(values: Array, place: npt.NDArray[np.int64]) -> tuple[Array, Array]:
    """Means over the groups and their standard uncertainties (0 where a group has one point)."""
    count = np.bincount(place)
    means = np.bincount(place, weights=values) / count
    scatter = np.bincount(place, weights=(values - means[place]) ** 2)
    return means, np.sqrt(scatter / np.maximum(count - 1, 1) / count)


def _number(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _rounded(values: Array) -> list[Any]:
    return [_rounded(one) if one.ndim else _number(float(one)) for one in np.asarray(values)]
