"""``[artefact.self_calibration]`` of ``campaign.toml``: nodes of the error tables, conditions, the known length."""

from __future__ import annotations

from itertools import pairwise

from monitor.readers.axes import FARTHEST_MM
from monitor.readers.faults import quoted
from monitor.readers.toml_table import Table
from monitor.records import KnownError, SelfCalibration
from monitor.units import MICROMETRE

NODES = "[-110.0, -88.0, -66.0, -44.0, -22.0, 0.0, 22.0, 44.0, 66.0, 88.0, 110.0]"
CONDITIONS = '["EXX(0)", "EYX(0)"]'
#: A table of so many nodes asks for more probings than a day has.
MOST_NODES = 99


def read_self_calibration(artefact: Table) -> SelfCalibration | None:
    """Read the table; None where there is none, or anything in it is wrong."""
    table = artefact.table("self_calibration")
    if table is None:
        return None
    nodes = _nodes(table)
    conditions = _conditions(table)
    length = _length(table)
    table.finish()
    if nodes is None or conditions is None or length is None:
        return None
    return SelfCalibration(nodes, length, conditions)


def _nodes(table: Table) -> dict[str, tuple[float, ...]] | None:
    inner = table.table("nodes_mm", required=True)
    if inner is None:
        return None
    nodes = {axis: _nodes_of_axis(inner, axis) for axis in inner.data}
    inner.finish()
    sound = {axis: readings for axis, readings in nodes.items() if readings is not None}
    return sound if len(sound) == len(nodes) else None


def _nodes_of_axis(table: Table, axis: str) -> tuple[float, ...] | None:
    value = table.raw(axis, required=True, example=NODES)
    if not isinstance(value, list) or not 2 <= len(value) <= MOST_NODES:
        table.fault(
            axis, f"{quoted(value)} is not a list of 2 to {MOST_NODES} readings in mm, such as {NODES}"
        )
        return None
    readings = table.numbers(axis, len(value), largest=FARTHEST_MM, unit="mm", example=NODES)
    if readings is None:
        return None
    for before, after in pairwise(readings):
        if after <= before:
            table.fault(axis, f"{after:g} does not lie beyond {before:g}; list the nodes in rising order")
            return None
    return readings


def _conditions(table: Table) -> tuple[str, ...] | None:
    value = table.raw("conditions", required=False, example=CONDITIONS)
    if value is None:
        return ()
    if not isinstance(value, list) or not value or not all(isinstance(condition, str) for condition in value):
        table.fault("conditions", f"{quoted(value)} is not a list of conditions, such as {CONDITIONS}")
        return None
    twice = sorted({condition for condition in value if value.count(condition) > 1})
    if twice:
        table.fault("conditions", f"{quoted(twice[0])} is listed twice; list every condition once")
        return None
    return tuple(value)


def _length(table: Table) -> KnownError | None:
    inner = table.table("length", required=True)
    if inner is None:
        return None
    largest = MICROMETRE.to_display(FARTHEST_MM)
    parameter = inner.text("parameter", required=True, example='"EXX(110)"')
    error = inner.number("error_um", required=True, largest=largest, unit="um", example="2.4")
    uncertainty = inner.number(
        "standard_uncertainty_um", required=True, positive=True, largest=largest, unit="um", example="0.5"
    )
    certificate = inner.text(
        "certificate", required=True, example='"gauge block 100 mm, certificate 2026-03"'
    )
    inner.finish()
    if parameter is None or error is None or uncertainty is None or certificate is None:
        return None
    return KnownError(
        parameter, MICROMETRE.to_internal(error), MICROMETRE.to_internal(uncertainty), certificate
    )
