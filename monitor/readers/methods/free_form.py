"""Free-form: points of an unknown workpiece, each with its nominal place and the surface normal there.

A row is a probing of one point: the axis readings at contact, as for a ball. ``nominal_x_mm`` and so on say where the
centre of the stylus sphere should be at contact (the point of the surface plus the sphere's radius along the normal),
``normal_x`` and so on the unit normal, both in the frame of the last work axis at all axes zero.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt

from monitor.exceptions import Fault
from monitor.readers.faults import one_of, quoted
from monitor.readers.method_rules import MethodRules, Plan
from monitor.records import Array

NORMALS = ("normal_x", "normal_y", "normal_z")
NOMINALS = ("nominal_x_mm", "nominal_y_mm", "nominal_z_mm")
#: A unit vector typed to four decimals may be this far from length 1.
LENGTH_TOLERANCE = 1e-3
#: A parameter of a table at a place, as the conditions name it.
CONDITION = re.compile(r"E[XYZABC]0?[A-Z][A-Za-z0-9]*\(\s*[-+]?\d+(\.\d+)?\s*\)|shape (shift [uv]|turn)")


def check(plan: Plan) -> Iterable[Fault]:
    """Faults of the plan: no normal or no nominal place, one point at two places, an axis beyond its table."""
    columns = [(names, _vectors(plan, names)) for names in (NOMINALS, NORMALS)]
    for names, vectors in columns:
        if vectors is None:
            yield Fault(
                plan.file,
                1,
                names[0],
                f"there is no column {quoted(names[0])}; the method free-form needs two or three of {one_of(names)}",
            )
    if plan.artefact.self_calibration is not None:
        yield from _conditions(plan.artefact.self_calibration.conditions)
        yield from _beyond(plan, plan.artefact.self_calibration.nodes)
    if any(vectors is None for _, vectors in columns) or not len(plan.probings):
        return
    for names, vectors in columns:
        assert vectors is not None
        yield from _changing(plan, names, vectors)
    normals = columns[1][1]
    assert normals is not None
    length = np.linalg.norm(normals, axis=1)
    for row in np.flatnonzero(np.abs(length - 1.0) > LENGTH_TOLERANCE).tolist():
        yield Fault(
            plan.file,
            int(plan.lines[row]),
            NORMALS[0],
            f"the normal has length {length[row]:.4f}; give a unit vector, such as 0.8, 0.6",
        )


def _vectors(plan: Plan, names: tuple[str, ...]) -> Array | None:
    """The vectors (n, 3), zero where a column is not there; None where fewer than two are."""
    present = [plan.probings.channels.get(name) for name in names]
    if sum(column is not None for column in present) < 2:
        return None
    zero = np.zeros(len(plan.probings))
    return np.column_stack([zero if column is None else column for column in present])


def _changing(plan: Plan, names: tuple[str, ...], vectors: Array) -> Iterable[Fault]:
    """Empty cells, and rows whose vector is not that of the point's first row."""
    empty = ~np.all(np.isfinite(vectors), axis=1)
    for row in np.flatnonzero(empty).tolist():
        column = next(name for name, value in zip(names, vectors[row], strict=True) if not np.isfinite(value))
        yield Fault(plan.file, int(plan.lines[row]), column, "this cell is empty; every probing needs it")
    points, first, which = np.unique(plan.probings.target, return_index=True, return_inverse=True)
    for row in np.flatnonzero(~empty & np.any(vectors != vectors[first[which]], axis=1)).tolist():
        if empty[first[which[row]]]:
            continue
        column = next(
            name
            for name, value, other in zip(names, vectors[row], vectors[first[which[row]]], strict=True)
            if value != other
        )
        yield Fault(
            plan.file,
            int(plan.lines[row]),
            column,
            f"point {quoted(str(points[which[row]]))} has another value on line {plan.lines[first[which[row]]]}; "
            "a point keeps its nominal place and normal, in the workpiece's frame, at every angle",
        )


def _beyond(plan: Plan, nodes: Mapping[str, tuple[float, ...]]) -> Iterable[Fault]:
    for axis, places in nodes.items():
        if axis not in plan.probings.readings or axis in plan.turning:
            linear = [name for name in plan.probings.readings if name not in plan.turning]
            yield Fault(
                "campaign.toml",
                None,
                f"artefact.self_calibration.nodes_mm.{axis}",
                f"the topology has no linear axis {quoted(axis)}; its linear axes are {one_of(linear)}",
            )
            continue
        reading = plan.probings.readings[axis]
        outside: npt.NDArray[np.int64] = np.flatnonzero((reading < places[0]) | (reading > places[-1]))
        for row in outside.tolist():
            yield Fault(
                plan.file,
                int(plan.lines[row]),
                f"{axis.lower()}_mm",
                f"{reading[row]:g} mm lies beyond the nodes of {axis}, {places[0]:g} to {places[-1]:g} mm; add a node",
            )


def _conditions(conditions: tuple[str, ...]) -> Iterable[Fault]:
    for condition in conditions:
        if not CONDITION.fullmatch(condition):
            yield Fault(
                "campaign.toml",
                None,
                "artefact.self_calibration.conditions",
                f"{quoted(condition)} is no condition; write a parameter that is zero, such as 'EYX(0)', or "
                "'shape shift u', 'shape shift v', 'shape turn'",
            )


RULES = MethodRules("free-form", needs_self_calibration=True, plain_columns=NORMALS, check=check)
