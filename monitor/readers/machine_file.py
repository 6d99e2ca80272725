"""The machine of ``campaign.toml``: identity, axes with their strokes, tolerances."""

from __future__ import annotations

import re
from dataclasses import dataclass

from monitor.readers.axes import FARTHEST_MM, Axis, axes_of
from monitor.readers.chain_tables import read_chain, unit_vector
from monitor.readers.faults import near, one_of, quoted
from monitor.readers.toml_table import Table
from monitor.records import AxisSettings, Machine, topology_of

# ISO 230-1:2012, 3.4: E, then the direction (X, Y, Z) or rotation (A, B, C), then the axis; 0 for a location.
TERM = re.compile(r"E([XYZABC])(0?)([A-Za-z][A-Za-z0-9]*)")
#: More turns of a motor for one of its axis than any drive has.
LARGEST_RATIO = 1e4


@dataclass(frozen=True)
class MachinePart:
    """What is known of the machine: None for the record if a required key is wrong.

    ``axes`` is None where the topology cannot be read; ``strokes`` are in the units of the file.
    """

    machine: Machine | None
    axes: tuple[Axis, ...] | None
    strokes: dict[str, tuple[float, float]]


def read_machine(top: Table) -> MachinePart:
    """The ``[machine]`` table."""
    table = top.table("machine", required=True)
    if table is None:
        return MachinePart(None, None, {})
    identity = table.text("id", required=True, example='"HU40-T"')
    free = [key for key in ("work_chain", "tool_chain") if key in table.data]
    topology = table.text("topology", required=not free, example='"w C B X b Z Y (C1) t"')
    chain = read_chain(table)
    words = {key: table.text(key) for key in ("manufacturer", "model", "serial_number", "location")}
    axes: tuple[Axis, ...] | None = None
    if free:
        if topology is not None:
            told = f"[[machine.{free[0]}]] places the axes already; leave out topology, or these tables"
            table.fault("topology", told)
        elif chain:
            topology = topology_of(chain)
            axes = tuple(Axis(axis.name, axis.kind) for axis in chain)
        elif chain is not None:
            table.fault(free[0], "the chain has no axis; write [[machine.tool_chain]] above each of them")
    elif topology is not None:
        found, wrong = axes_of(topology)
        if wrong is not None:
            table.fault("topology", f"{quoted(topology)} cannot be parsed: {wrong}")
        axes = None if wrong is not None else found
    signed = {axis.name for axis in chain or () if axis.sign is not None}
    settings, strokes = _settings(table, axes, signed)
    tolerances = _tolerances(table, axes)
    gravity = unit_vector(table, "gravity") if table.raw("gravity", required=False, example="") else None
    table.finish()
    if identity is None or topology is None or axes is None:
        return MachinePart(None, axes, strokes)
    machine = Machine(
        id=identity,
        topology=topology,
        axes=settings,
        tolerances=tolerances,
        chain=chain or (),
        gravity=gravity,
        **words,
    )
    return MachinePart(machine, axes, strokes)


def _settings(
    machine: Table, axes: tuple[Axis, ...] | None, signed: set[str]
) -> tuple[dict[str, AxisSettings], dict[str, tuple[float, float]]]:
    settings: dict[str, AxisSettings] = {}
    strokes: dict[str, tuple[float, float]] = {}
    outer = machine.table("axes")
    if outer is None or axes is None:
        return settings, strokes
    known = {axis.name: axis for axis in axes}
    for name in outer.data:
        axis = known.get(name)
        if axis is None:
            hint = near(name, known)
            outer.fault(name, f"the topology has no axis {quoted(name)}; {hint}its axes are {one_of(known)}")
            continue
        table = outer.table(name)
        if table is None:
            continue
        sign = table.sign("sign")
        if sign is not None and name in signed:
            table.fault("sign", f"the chain gives axis {name} a sign already; write it in one place")
        stroke = _stroke(table, axis)
        pitch = table.number("scale_pitch_mm", positive=True, largest=FARTHEST_MM, unit="mm", example="0.02")
        ratio = None
        if axis.kind != "linear":
            ratio = table.number(
                "gear_ratio",
                positive=True,
                largest=LARGEST_RATIO,
                unit="turns of the motor a turn",
                example="121.0",
            )
        table.finish()
        inside = None
        if stroke is not None:
            strokes[name] = stroke
            inside = (axis.unit.to_internal(stroke[0]), axis.unit.to_internal(stroke[1]))
        settings[name] = AxisSettings(name, sign, inside, pitch, ratio)
    return settings, strokes


def _stroke(table: Table, axis: Axis) -> tuple[float, float] | None:
    key = f"stroke_{axis.suffix}"
    other = "stroke_deg" if axis.kind == "linear" else "stroke_mm"
    if other in table.data:
        table.raw(other, required=False, example="")
        table.fault(other, f"axis {axis.name} is {axis.kind}: write {key} = [lowest, highest]")
    ends = table.numbers(key, 2, largest=axis.farthest, unit=axis.suffix, example="[-300.0, 300.0]")
    if ends is None:
        return None
    low, high = ends
    if low >= high:
        table.fault(key, f"{low:g} is not below {high:g}; write {key} = [lowest, highest]")
        return None
    return low, high


#: The limit of the volumetric error, the longest error vector over the strokes, beside those of the terms.
VOLUMETRIC = "volumetric"


def _tolerances(machine: Table, axes: tuple[Axis, ...] | None) -> dict[str, float]:
    table = machine.table("tolerances")
    tolerances: dict[str, float] = {}
    if table is None:
        return tolerances
    for name in table.data:
        match = TERM.fullmatch(name)
        if name == VOLUMETRIC:
            limit = table.number(name, positive=True, unit="µm", example="50.0")
            if limit is not None:
                tolerances[name] = limit
        elif match is None:
            table.fault(
                name,
                f"{quoted(name)} is not the name of a term; write it as in ISO 230-1, "
                f"such as EC0Y (location) or EXX (motion), or {VOLUMETRIC}",
            )
        elif axes is not None and match[3] not in {axis.name for axis in axes}:
            table.fault(
                name,
                f"the topology has no axis {match[3][:20]}; its axes are {one_of(a.name for a in axes)}",
            )
        else:
            limit = table.number(
                name, positive=True, unit="the term's display unit, µm, µrad or µm/m", example="20.0"
            )
            if limit is not None:
                tolerances[name] = limit
    return tolerances
