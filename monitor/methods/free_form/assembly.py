"""The problem of a free-form campaign under a model: its nodes, its angles, its boundary conditions, its length."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from monitor.effects import context_of
from monitor.exceptions import DataError
from monitor.methods.free_form.axes import (
    WORKPIECE_CONDITIONS,
    Plane,
    all_conditions,
    at,
    base_texts,
    plane_of,
)
from monitor.methods.free_form.problem import FreeFormProblem
from monitor.methods.model import Model, chain_of
from monitor.records import Campaign, SelfCalibration
from monitor.units import DEGREE

NAME = "free-form"
DEFAULT_MODEL = Model(NAME)


def angles_of(campaign: Campaign, table: str) -> tuple[float, ...]:
    """The readings of the table in degrees at which the campaign probed, in rising order."""
    degrees = np.round(campaign.probings.readings[table] / DEGREE.factor, 6)
    return tuple(float(angle) for angle in np.unique(degrees))


def problem_of(campaign: Campaign, model: Model = DEFAULT_MODEL) -> FreeFormProblem:
    """The least-squares problem of a campaign under a model.

    Every probing has the probe's stated standard uncertainty along the normal. Raises DataError where the machine
    has no table across two linear axes, or the campaign names nodes or conditions that there are not.
    """
    calibration = _calibration(campaign)
    chain = chain_of(campaign.machine)
    plane = plane_of(chain)
    for axis in (plane.u.name, plane.v.name):
        if axis not in calibration.nodes:
            raise DataError(f"[artefact.self_calibration.nodes_mm] lacks axis {axis}; list its nodes in mm")
    angles = angles_of(campaign, plane.table.name)
    first_angle = float(np.round(campaign.probings.readings[plane.table.name][0] / DEGREE.factor, 6))
    nodes = {axis: tuple(positions) for axis, positions in calibration.nodes.items()}
    tables = {symbol: nodes[axis.name] for symbol, axis in plane.axis_terms.items()}
    tables |= dict.fromkeys(plane.table_terms, angles)
    parameters = {at(symbol, position) for symbol, positions in tables.items() for position in positions}
    length = replace(calibration.length, parameter=_known(calibration.length.parameter, parameters, "length"))
    conditions = calibration.conditions or tuple(
        name for name in all_conditions(plane, nodes, first_angle) if name != length.parameter
    )
    on_shape = tuple(name for name in conditions if name in WORKPIECE_CONDITIONS)
    held = tuple(_known(name, parameters, "conditions") for name in conditions if name not in on_shape)
    _check_length(length.parameter, held, plane, nodes)
    texts = model.base or base_texts(plane, calibration, angles, {*held, length.parameter})
    whole = Model(model.name, texts, model.added)
    problem = FreeFormProblem(
        context=context_of(campaign, chain),
        base=whole.base_of(chain),
        added=whole.added_to(chain),
        sigma=np.full((len(campaign.probings), 1), campaign.probe.standard_uncertainty),
        plane=plane,
        length=length,
        length_at_rows=np.full(len(campaign.probings), length.value),
        held=held,
        on_shape=on_shape,
        nodes=nodes,
        first_angle=first_angle,
    )
    return problem.foreseen() if problem.added else problem


def _calibration(campaign: Campaign) -> SelfCalibration:
    calibration = campaign.artefact.self_calibration
    if calibration is None:
        raise DataError(
            f"campaign {campaign.name} says no nodes; free-form needs [artefact.self_calibration]"
        )
    return calibration


def _check_length(
    parameter: str, held: tuple[str, ...], plane: Plane, nodes: Mapping[str, tuple[float, ...]]
) -> None:
    """DataError where the known error gives no unit of length."""
    if parameter in held:
        raise DataError(f"{parameter} is both a condition and the known length; take it out of conditions")
    if parameter.partition("(")[0] not in plane.axis_terms:
        raise DataError(
            f"[artefact.self_calibration.length] parameter: {parameter} gives no unit of length; name the error "
            f"of a linear axis, such as {at(plane.term(plane.u, plane.u), nodes[plane.u.name][-1])}"
        )


def _known(name: str, parameters: set[str], where: str) -> str:
    plain = name.replace(" ", "")
    if plain not in parameters:
        near = sorted(
            parameter for parameter in parameters if parameter.partition("(")[0] == plain.partition("(")[0]
        )
        raise DataError(
            f"[artefact.self_calibration] {where}: there is no parameter '{name}'; write for example "
            f"{', '.join(near[:3] or sorted(parameters)[:3])} or one of {', '.join(WORKPIECE_CONDITIONS)}"
        )
    return plain
