"""Residuals as people look at them: along the machine's axes, over the workspace, against what they may depend on."""

from __future__ import annotations

import numpy as np

from monitor.discovery import Fit
from monitor.discovery.machine.noise.plan_cells import plan_cells
from monitor.records import Array
from monitor.reporting.figures import driver_names
from monitor.units import HOUR, MICROMETRE, MINUTE

#: Of the drivers of the residual so many are drawn: those that explain most, the others in the document.
MOST_DRIVERS = 4
#: Groups of equal size into which the values of a driver are divided.
GROUPS = 8


def in_machine_frame(fit: Fit, vectors: Array | None = None) -> tuple[Array, Array]:
    """Positions of the tip, mm, and the residual, µm, both (n, 3) along the machine's axes.

    ``vectors`` (n, 3) mm are residuals in the frame of the last work axis, with None those of the fit.
    """
    context = fit.problem.context
    evaluated = fit.problem.evaluated(fit.solution.local, fit.solution.common)
    whole = evaluated.residual
    if fit.problem.observes_numbers:
        whole = fit.problem.as_vectors(whole)
    turned = np.einsum("nij,nj->ni", evaluated.work_rotation, whole if vectors is None else vectors)
    linear = [index for index, joint in enumerate(context.chain.joints) if not joint.turns]
    positions = np.zeros((len(context), 3))
    if len(linear) < 3:
        # Seen from outside: the measured points, carried into the machine's frame.
        positions += np.nan_to_num(context.nominal)
        linear = []
    for index in linear:
        sign = 1.0 if index >= len(context.chain.work) else -1.0
        positions += sign * context.positions[:, [index]] * np.array(context.chain.joints[index].direction)
    residual_um: Array = MICROMETRE.to_display(1.0) * turned
    return positions, residual_um


def mean_over_runs(fit: Fit, positions: Array, vectors: Array) -> tuple[Array, Array]:
    """Means (m, 3) of positions and residuals (n, 3) at the m poses of the plan; probings left out take no part."""
    pose = plan_cells(fit.problem)
    weighed = ~fit.left_out
    count = np.bincount(pose[weighed]).astype(float)
    count[count == 0] = np.nan

    def mean(rows: Array) -> Array:
        sums = [
            np.bincount(pose[weighed], weights=rows[weighed, axis], minlength=len(count)) for axis in range(3)
        ]
        means: Array = np.stack(sums, axis=1) / count[:, None]
        return means

    mean_positions, mean_vectors = mean(positions), mean(vectors)
    finite = np.isfinite(mean_positions).all(axis=1)
    return mean_positions[finite], mean_vectors[finite]


def drivers_followed(fit: Fit) -> list[tuple[str, Array, str, Array]]:
    """The drivers that the residual follows most, with the axis in which it does: name, values, axis, residual."""
    _, vectors = in_machine_frame(fit)
    weighed = ~fit.left_out
    scored = []
    columns = drivers_of(fit)
    for name, values in columns.items():
        scored += [(_explained(values, vectors[weighed, axis]), name, axis) for axis in range(3)]
    best: dict[str, tuple[float, int]] = {}
    for score, name, axis in sorted(scored, reverse=True):
        best.setdefault(name, (score, axis))
    names = sorted(best, key=lambda name: -best[name][0])[:MOST_DRIVERS]
    return [(name, columns[name], "XYZ"[best[name][1]], vectors[weighed, best[name][1]]) for name in names]


def drivers_of(fit: Fit) -> dict[str, Array]:
    """Return what changed during the campaign and that a residual may depend on, of the probings that have weight."""
    columns = {name: values[~fit.left_out] for name, values in _drivers(fit).items()}
    return {
        name: values for name, values in columns.items() if np.isfinite(values).all() and np.ptp(values) > 0.0
    }


def _drivers(fit: Fit) -> dict[str, Array]:
    """Everything that a residual may depend on (n,): positions of the axes, recorded temperatures, time."""
    context = fit.problem.context
    columns = {
        driver_names.reading(joint.name, turns=joint.turns): joint.sign
        * context.positions[:, index]
        * (180.0 / np.pi if joint.turns else 1.0)
        for index, joint in enumerate(context.chain.joints)
    }
    columns |= {name: values for name, values in context.columns.items() if name.endswith("_degC")}
    columns[driver_names.TIME_IN_RUN] = context.time / MINUTE.factor
    columns[driver_names.TIME_OF_DAY] = context.day_time / HOUR.factor
    return columns


def _explained(values: Array, residual: Array) -> float:
    """Sum of squares of the residual (n,) that its means over groups of a driver's values (n,) explain."""
    cuts = np.unique(np.quantile(values, np.linspace(0, 1, GROUPS + 1)[1:-1]))
    group = np.searchsorted(cuts, values, side="right")
    count = np.bincount(group)
    means = np.bincount(group, weights=residual) / np.maximum(count, 1)
    return float(np.sum(count * means**2))
