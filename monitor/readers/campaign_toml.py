"""Writes ``campaign.toml`` from the records of a campaign."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

from monitor.readers.axes import axes_of_machine
from monitor.readers.setups.file import FORMATS, probe_of
from monitor.readers.tables.decimals import decimal_in
from monitor.records import (
    Artefact,
    Campaign,
    ChainAxis,
    LShape,
    Machine,
    Probe,
    ScaleBar,
    SelfCalibration,
    Setup,
)
from monitor.sources import HALF_WIDTHS, QUANTITIES, Law, Sharing, Source
from monitor.units import METRE, MICROMETRE, MICRORADIAN


def campaign_toml(campaign: Campaign) -> str:
    """Return the text of the file, without the keys that the records leave open."""
    lines = [
        "format = 1",
        f"campaign = {_text(campaign.name)}",
        f"method = {_text(campaign.method)}",
        *_machine(campaign.machine),
        *(() if _is_derived(campaign) else _probe(campaign.probe)),
        *_artefact(campaign.artefact),
        *_sources(campaign.sources),
        *(line for setup in campaign.artefact.setups for line in _setup(setup)),
    ]
    return "\n".join(lines) + "\n"


def _machine(machine: Machine) -> Iterator[str]:
    yield from ("", "[machine]", f"id = {_text(machine.id)}")
    plate = {key: getattr(machine, key) for key in ("manufacturer", "model", "serial_number", "location")}
    yield from (f"{key} = {_text(value)}" for key, value in plate.items() if value is not None)
    if not machine.chain:
        yield f"topology = {_text(machine.topology)}"
    yield from ("virtual = true",) * machine.virtual
    if machine.gravity is not None:
        yield f"gravity = {_numbers(machine.gravity)}"
    for placed in machine.chain:
        yield from _placed(placed)
    axes = {axis.name: axis for axis in axes_of_machine(machine)}
    for name, settings in machine.axes.items():
        yield from ("", f"[machine.axes.{_text(name)}]")
        if settings.sign is not None:
            yield f"sign = {settings.sign}"
        if settings.stroke is not None and name in axes:
            ends = ", ".join(map(decimal_in(axes[name].unit), settings.stroke))
            yield f"stroke_{axes[name].suffix} = [{ends}]"
        if settings.scale_pitch is not None:
            yield f"scale_pitch_mm = {settings.scale_pitch!r}"
        if settings.gear_ratio is not None:
            yield f"gear_ratio = {float(settings.gear_ratio)!r}"
    if machine.tolerances:
        yield from ("", "[machine.tolerances]")
        yield from (f"{_text(name)} = {float(limit)!r}" for name, limit in machine.tolerances.items())


def _placed(axis: ChainAxis) -> Iterator[str]:
    yield from (
        "",
        f"[[machine.{axis.branch}_chain]]",
        f"name = {_text(axis.name)}",
        f"kind = {_text(axis.kind)}",
    )
    yield f"{'along' if axis.kind == 'linear' else 'about'} = {_numbers(axis.direction)}"
    yield f"offset_mm = {_numbers(axis.offset)}"
    if axis.sign is not None:
        yield f"sign = {axis.sign}"


def _probe(probe: Probe) -> Iterator[str]:
    yield from ("", "[probe]", f"id = {_text(probe.id)}", f"model = {_text(probe.model)}")
    yield f"standard_uncertainty_um = {decimal_in(MICROMETRE)(probe.standard_uncertainty)}"
    if probe.tip is not None:
        yield f"tip_mm = {_numbers(probe.tip)}"
    if probe.certificate is not None:
        yield f"certificate = {_text(probe.certificate)}"
    if probe.scale_uncertainty is not None:
        yield f"scale_standard_uncertainty_um_per_m = {decimal_in(MICROMETRE.per(METRE))(probe.scale_uncertainty)}"
    if probe.known:
        yield f"known = [{', '.join(map(_text, probe.known))}]"


def _artefact(artefact: Artefact) -> Iterator[str]:
    yield from ("", "[artefact]")
    if artefact.id:
        yield f"id = {_text(artefact.id)}"
    for ball in artefact.balls:
        yield from ("", "[[artefact.balls]]", f"id = {_text(ball.id)}")
        yield f"nominal_mm = {_numbers(ball.nominal)}"
        yield f"diameter_mm = {float(ball.diameter)!r}"
    for reflector in artefact.reflectors:
        yield from ("", "[[artefact.reflectors]]", f"id = {_text(reflector.id)}")
        if reflector.fixed:
            yield "fixed = true"
    yield from _scale_bar(artefact.scale_bar)
    yield from _l_shape(artefact.l_shape)
    yield from _self_calibration(artefact.self_calibration)


def _is_derived(campaign: Campaign) -> bool:
    """Whether the probe is what the setups make of it."""
    setups = campaign.artefact.setups
    return bool(setups) and campaign.probe == probe_of(setups, campaign.probings)


def _number(value: float) -> str:
    return repr(float(value))


def _setup(setup: Setup) -> Iterator[str]:
    form = FORMATS[setup.reading]
    yield from ("", "[[setups]]", f"id = {_text(setup.id)}", f"reading = {_text(setup.reading)}")
    if setup.instrument is not None:
        yield f"instrument = {_text(setup.instrument)}"
    unit, name = (MICRORADIAN, "urad") if form.angular else (MICROMETRE, "um")
    urad, um = decimal_in(MICRORADIAN), decimal_in(MICROMETRE)
    keys: tuple[tuple[str, Any, Callable[[Any], str]], ...] = (
        (f"standard_uncertainty_{name}", setup.standard_uncertainty, decimal_in(unit)),
        (f"drift_standard_uncertainty_{name}", setup.drift_uncertainty, decimal_in(unit)),
        ("standard_uncertainty_urad", setup.turn_uncertainty, urad),
        ("tool_point_mm", setup.tool_point, _numbers),
        ("tool_point_standard_uncertainty_mm", setup.tool_point_uncertainty, _number),
        ("work_point_mm", setup.work_point, _numbers),
        ("direction", setup.direction, _numbers),
        ("tool_direction", setup.tool_direction, _numbers),
        ("length_mm", setup.length, _number),
        ("length_standard_uncertainty_um", setup.length_uncertainty, um),
        ("direction_standard_uncertainty_urad", setup.direction_uncertainty, urad),
        ("scale_standard_uncertainty_um_per_m", setup.scale_uncertainty, decimal_in(MICROMETRE.per(METRE))),
    )
    yield from (f"{key} = {write(value)}" for key, value, write in keys if value is not None)
    if setup.along is not None:
        yield f"along = {_text(setup.along)}"
    yield from (f"{key} = {_text(getattr(setup, key))}" for key in ("side", "frame") if key in form.allows)
    if setup.known:
        yield f"known = [{', '.join(map(_text, setup.known))}]"
    if setup.certificate is not None:
        yield f"certificate = {_text(setup.certificate)}"


def _scale_bar(bar: ScaleBar | None) -> Iterator[str]:
    if bar is None:
        return
    yield from ("", "[artefact.scale_bar]", f"balls = [{_text(bar.balls[0])}, {_text(bar.balls[1])}]")
    yield f"length_mm = {float(bar.length)!r}"
    yield f"standard_uncertainty_mm = {float(bar.standard_uncertainty)!r}"
    yield f"certificate = {_text(bar.certificate)}"
    if bar.expansion_coefficient is not None:
        yield f"expansion_coefficient_per_K = {float(bar.expansion_coefficient)!r}"
    if bar.reference_temperature is not None:
        yield f"reference_temperature_degC = {float(bar.reference_temperature)!r}"


def _self_calibration(calibration: SelfCalibration | None) -> Iterator[str]:
    if calibration is None:
        return
    yield from ("", "[artefact.self_calibration]")
    if calibration.conditions:
        yield f"conditions = [{', '.join(map(_text, calibration.conditions))}]"
    yield from ("", "[artefact.self_calibration.nodes_mm]")
    yield from (f"{_text(axis)} = {_numbers(places)}" for axis, places in calibration.nodes.items())
    length = calibration.length
    yield from ("", "[artefact.self_calibration.length]", f"parameter = {_text(length.parameter)}")
    yield f"error_um = {decimal_in(MICROMETRE)(length.value)}"
    yield f"standard_uncertainty_um = {decimal_in(MICROMETRE)(length.standard_uncertainty)}"
    yield f"certificate = {_text(length.certificate)}"


def _l_shape(piece: LShape | None) -> Iterator[str]:
    if piece is None:
        return
    length, angle = decimal_in(MICROMETRE), decimal_in(MICRORADIAN)
    yield from ("", "[artefact.l_shape]", f"focal_length_mm = {float(piece.focal_length)!r}")
    yield f"paraboloid_mm = {float(piece.paraboloid)!r}"
    yield f"place_standard_uncertainty_um = {length(piece.place_uncertainty)}"
    yield f"tilt_standard_uncertainty_urad = {angle(piece.tilt_uncertainty)}"
    for module in piece.modules:
        yield from ("", "[[artefact.l_shape.modules]]", f"id = {_text(module.id)}")
        yield f"centre_mm = {_numbers(module.centre)}"
        yield f"tilt_urad = [{', '.join(map(angle, module.tilt))}]"
    for placement in piece.placements:
        yield from ("", "[[artefact.l_shape.placements]]", f"plane = {_text(placement.plane)}")
        yield f"corner_mm = {_numbers(placement.corner)}"


def _sources(sources: tuple[Source, ...]) -> Iterator[str]:
    for source in sources:
        yield from (
            "",
            "[[sources]]",
            f"name = {_text(source.name)}",
            f'quantity = "{source.quantity.value}"',
        )
        suffixes = QUANTITIES[source.quantity].suffixes
        suffix = next(key for key, unit in suffixes.items() if unit == source.unit)
        stem = "half_width" if source.law in HALF_WIDTHS else "standard_uncertainty"
        yield f"{stem}_{suffix} = {decimal_in(source.unit)(source.size)}"
        if source.law is not Law.NORMAL:
            yield f'distribution = "{source.law.value}"'
        if source.degrees_of_freedom is not None:
            yield f"degrees_of_freedom = {float(source.degrees_of_freedom)!r}"
        if source.shared_by is not Sharing.ALL_RUNS:
            yield f'shared_by = "{source.shared_by.value}"'
        for key, text in (("axis", source.axis), ("along", source.along), ("effect", source.effect)):
            if text is not None:
                yield f"{key} = {_text(text)}"
        if source.expansion_coefficient is not None:
            yield f"expansion_coefficient_per_K = {float(source.expansion_coefficient)!r}"
        if source.temperature_offset is not None:
            yield f"temperature_offset_K = {float(source.temperature_offset)!r}"
        if source.node_spacing is not None:
            yield f"node_spacing_mm = {_numbers(source.node_spacing)}"


def _numbers(values: tuple[float, ...]) -> str:
    return "[" + ", ".join(repr(float(value)) for value in values) + "]"


def _text(value: str) -> str:
    # A JSON string is a TOML basic string, but for DEL, which the reader refuses like every control character.
    return json.dumps(value, ensure_ascii=False)
