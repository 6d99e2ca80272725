"""Residuals as people look at them: along the machine's axes, over the workspace, against what they may depend on."""

from __future__ import annotations

from typing import Any

import numpy as np

from monitor.discovery import Fit
from monitor.discovery.machine.anomalies import plan_cells
from monitor.records import Array
from monitor.units import MICROMETRE

Document = dict[str, Any]
#: Of the drivers of the residual so many are drawn: those that explain most, the others in the document.
MOST_DRIVERS = 4


def in_machine_frame(found: Fit, vectors: Array | None = None) -> tuple[Array, Array]:
    """Where the tip stood, mm, and the residual, µm, both (n, 3) along the machine's axes.

    ``vectors`` (n, 3) mm are residuals in the frame of the last work axis, those of the fit where none are given.
    """
    context = found.problem.context
    seen = found.problem.evaluated(found.solution.local, found.solution.common)
    turned = np.einsum("nij,nj->ni", seen.work_rotation, seen.residual if vectors is None else vectors)
    linear = [place for place, joint in enumerate(context.chain.joints) if not joint.turns]
    places = np.zeros((len(context), 3))
    if len(linear) < 3:
        # Seen from outside: the measured points, carried into the machine's frame.
        places += np.nan_to_num(context.nominal)
        linear = []
    for place in linear:
        sign = 1.0 if place >= len(context.chain.work) else -1.0
        places += sign * context.positions[:, [place]] * np.array(context.chain.joints[place].direction)
    shown: Array = MICROMETRE.to_display(1.0) * turned
    return places, shown


def mean_over_runs(found: Fit, places: Array, vectors: Array) -> tuple[Array, Array]:
    """Means (m, 3) of places and residuals (n, 3) at the m poses of the plan; probings left out take no part."""
    numbers = plan_cells(found)
    keep = ~found.left_out
    count = np.bincount(numbers[keep]).astype(float)
    count[count == 0] = np.nan

    def mean(rows: Array) -> Array:
        sums = [
            np.bincount(numbers[keep], weights=rows[keep, axis], minlength=len(count)) for axis in range(3)
        ]
        means: Array = np.stack(sums, axis=1) / count[:, None]
        return means

    first, second = mean(places), mean(vectors)
    good = np.isfinite(first).all(axis=1)
    return first[good], second[good]


def drivers_followed(found: Fit) -> list[tuple[str, Array, str, Array]]:
    """The drivers that the residual follows most, with the axis in which it does: name, values, axis, residual."""
    context = found.problem.context
    _, vectors = in_machine_frame(found)
    keep = ~found.left_out
    scored = []
    columns: dict[str, Array] = {
        f"{joint.name} / {'°' if joint.turns else 'mm'}": joint.sign * context.positions[:, place]
        * (180.0 / np.pi if joint.turns else 1.0)
        for place, joint in enumerate(context.chain.joints)
    }  # fmt: skip
    columns |= {name: values for name, values in context.columns.items() if name.endswith("_degC")}
    columns["time_in_run / min"] = context.time / 60.0
    columns["time_of_day / h"] = context.day_time / 3600.0
    for name, values in columns.items():
        if not np.isfinite(values[keep]).all() or np.ptp(values[keep]) == 0.0:
            continue
        cuts = np.unique(np.quantile(values[keep], np.linspace(0, 1, 9)[1:-1]))
        bins = np.searchsorted(cuts, values[keep], side="right")
        for axis in range(3):
            rows = vectors[keep, axis]
            count = np.bincount(bins)
            means = np.bincount(bins, weights=rows) / np.maximum(count, 1)
            scored.append((float(np.sum(count * means**2)), name, axis))
    best: dict[str, tuple[float, int]] = {}
    for score, name, axis in sorted(scored, reverse=True):
        best.setdefault(name, (score, axis))
    chosen = sorted(best, key=lambda name: -best[name][0])[:MOST_DRIVERS]
    return [
        (name, columns[name][keep], "XYZ"[best[name][1]], vectors[keep, best[name][1]]) for name in chosen
    ]
