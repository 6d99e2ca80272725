"""The machine of ``campaign.toml``: identity, axes with their strokes, tolerances."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from monitor.exceptions import did_you_mean
from monitor.readers.axes import FARTHEST_MM, Axis, axes_of
from monitor.readers.campaign.chain_tables import read_chain, unit_vector
from monitor.readers.faults import one_of, quoted
from monitor.readers.toml_table import Table
from monitor.records import VOLUMETRIC, AxisSettings, ChainAxis, Machine
from monitor.topology_text import plain_topology, topology_of

# ISO 230-1:2012, 3.4: E, then the direction (X, Y, Z) or rotation (A, B, C), then the axis; 0 for a location.
TERM = re.compile(r"E([XYZABC])(0?)([A-Za-z][A-Za-z0-9]*)")
#: Stands between the term and the shape of an effect, in the name of its parameters.
EFFECT_SIGN = ":"
#: More turns of a motor for one of its axis than any drive has.
LARGEST_RATIO = 1e4


@dataclass(frozen=True)
class MachinePart:
    """The machine as far as it could be read: no record if a required key is wrong.

    ``axes`` is None where the topology cannot be read; ``strokes`` are in the units of the file.
    """

    machine: Machine | None
    axes: tuple[Axis, ...] | None
    strokes: dict[str, tuple[float, float]]


def read_machine(top: Table) -> MachinePart:
    """Read the ``[machine]`` table."""
    table = top.table("machine", required=True)
    if table is None:
        return MachinePart(None, None, {})
    identity = table.text("id", required=True, example='"HU40-T"')
    free = [key for key in ("work_chain", "tool_chain") if key in table.data]
    topology = table.text("topology", required=not free, example='"w C B X b Z Y (C1) t"')
    topology, down = (topology, None) if topology is None else plain_topology(topology)
    chain = read_chain(table)
    plate = {key: table.text(key) for key in ("manufacturer", "model", "serial_number", "location")}
    if free:
        topology, axes = _free_axes(table, free[0], topology, chain)
    else:
        axes = None if topology is None else _named_axes(table, topology)
    signed = {axis.name for axis in chain or () if axis.sign is not None}
    settings, strokes = _settings(table, axes, signed)
    tolerances = _tolerances(table, axes)
    gravity = unit_vector(table, "gravity") if table.raw("gravity", required=False, example="") else down
    virtual = table.truth("virtual")
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
        virtual=virtual,
        **plate,
    )
    return MachinePart(machine, axes, strokes)


def _free_axes(
    table: Table, key: str, topology: str | None, chain: tuple[ChainAxis, ...] | None
) -> tuple[str | None, tuple[Axis, ...] | None]:
    """Return topology and axes of freely positioned axes; no axes where they cannot be read."""
    if topology is not None:
        message = f"[[machine.{key}]] places the axes already; leave out topology, or these tables"
        table.fault("topology", message)
        return topology, None
    if chain:
        return topology_of(chain), tuple(Axis(axis.name, axis.kind) for axis in chain)
    if chain is not None:
        table.fault(key, "the chain has no axis; write [[machine.tool_chain]] above each of them")
    return None, None


def _named_axes(table: Table, topology: str) -> tuple[Axis, ...] | None:
    """Return the axes that a topology names by letters; None where it cannot be parsed."""
    axes, fault = axes_of(topology)
    if fault is None:
        return axes
    table.fault("topology", f"{quoted(topology)} cannot be parsed: {fault}")
    return None


def _settings(
    machine: Table, axes: tuple[Axis, ...] | None, signed: set[str]
) -> tuple[dict[str, AxisSettings], dict[str, tuple[float, float]]]:
    settings: dict[str, AxisSettings] = {}
    strokes: dict[str, tuple[float, float]] = {}
    outer = machine.table("axes")
    if outer is None or axes is None:
        return settings, strokes
    by_name = {axis.name: axis for axis in axes}
    for name in outer.data:
        axis = by_name.get(name)
        if axis is None:
            hint = did_you_mean(name, by_name)
            outer.fault(
                name, f"the topology has no axis {quoted(name)}; {hint}its axes are {one_of(by_name)}"
            )
            continue
        table = outer.table(name)
        if table is not None:
            settings[name], stroke = _axis_settings(table, axis, name in signed)
            if stroke is not None:
                strokes[name] = stroke
    return settings, strokes


def _axis_settings(table: Table, axis: Axis, signed: bool) -> tuple[AxisSettings, tuple[float, float] | None]:
    """Return the settings of an axis, and its stroke in the unit of the file; ``signed`` where the chain has a sign."""
    sign = table.sign("sign")
    if sign is not None and signed:
        table.fault("sign", f"the chain gives axis {axis.name} a sign already; write it in one place")
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
    internal = (
        None if stroke is None else (axis.unit.to_internal(stroke[0]), axis.unit.to_internal(stroke[1]))
    )
    return AxisSettings(axis.name, sign, internal, pitch, ratio), stroke


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


def not_of_effect(effect: str, parameters: Iterable[str]) -> str:
    """The fault of a limit that names no parameter of its effect."""
    return f"is no parameter of the effect {effect}; it has {', '.join(parameters)}"


def _meant(name: str, axes: Iterable[Axis]) -> str:
    """The hint at a term of the axes that differs by a small letter, or by the letter O where the zero stands."""
    terms = {
        term.casefold(): term
        for axis in axes
        for direction in "XYZABC"
        for term in (f"E{direction}0{axis.name}", f"E{direction}{axis.name}")
    }
    written, sign, effect = name.partition(EFFECT_SIGN)
    term = terms.get(written.casefold()) or terms.get(written.casefold().replace("o", "0", 1))
    return "" if term is None else f"did you mean '{term}{sign}{effect}'? "


def _tolerances(machine: Table, axes: tuple[Axis, ...] | None) -> dict[str, float]:
    table = machine.table("tolerances")
    tolerances: dict[str, float] = {}
    if table is None:
        return tolerances
    for name in table.data:
        # A parameter of an effect begins with its term, EXX:reversal; the import asks whether there is such an effect.
        match = TERM.fullmatch(name.split(EFFECT_SIGN)[0])
        is_change = match is None and EFFECT_SIGN in name
        if name == VOLUMETRIC:
            limit = table.number(name, positive=True, unit="µm", example="50.0")
            if limit is not None:
                tolerances[name] = limit
        elif match is None and not is_change:
            table.fault(
                name,
                f"{quoted(name)} is not the name of a term; write it as in ISO 230-1, such as EC0Y (location) or EXX "
                f"(motion), as an effect of the machine's model, such as EXX:reversal, or {VOLUMETRIC}",
            )
        elif axes is not None and match is not None and match[3] not in {axis.name for axis in axes}:
            table.fault(
                name,
                f"the topology has no axis {match[3][:20]}; {_meant(name, axes)}"
                f"its axes are {one_of(axis.name for axis in axes)}",
            )
        else:
            limit = table.number(
                name, positive=True, unit="the term's display unit, µm, µrad or µm/m", example="20.0"
            )
            if limit is not None:
                tolerances[name] = limit
    return tolerances
