"""Machine, probe and artefact as JSON and back, to the last bit (Python prints doubles so that they return).

Each version writes what it knows, with keys that earlier ones lacked. So a hash is of the text that was stored, never
of one that is written again of what was read from it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from monitor.documents import from_document, to_document
from monitor.exceptions import StoreError
from monitor.records import (
    Artefact,
    AxisSettings,
    Ball,
    Campaign,
    ChainAxis,
    KnownError,
    LShape,
    Machine,
    Module,
    Placement,
    Probe,
    Reflector,
    ScaleBar,
    SelfCalibration,
    Setup,
)
from monitor.sources import Source


@contextmanager
def as_imported(campaign: str) -> Iterator[None]:
    """Read what describes a campaign. Raises StoreError that names it, for texts that no import stores."""
    try:
        yield
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise StoreError(
            f"the database has no description of the machine, probe and artefact of campaign '{campaign}' that can be "
            f"read ({type(error).__name__}: {error}): no import stores such a one, so it was written or altered by "
            "another program; restore a backup, or withdraw the campaign and import it again"
        ) from error


@dataclass(frozen=True)
class Described:
    """The texts that describe the machine, probe and artefact of a campaign, as they are stored and hashed."""

    machine: str
    probe: str
    artefact: str

    @classmethod
    def of(cls, campaign: Campaign) -> Described:
        """Write the texts of a campaign as this version writes them."""
        return cls(
            machine_json(campaign.machine),
            probe_json(campaign.probe),
            artefact_json(campaign.artefact, campaign.sources),
        )


def machine_json(machine: Machine) -> str:
    """A machine as text; strokes in mm or rad, pitches and offsets in mm, tolerances in display units.

    What a machine of letters does not have is left out.
    """
    axes = {name: asdict(settings) for name, settings in machine.axes.items()}
    for settings in axes.values():
        if settings["gear_ratio"] is None:
            del settings["gear_ratio"]
    document: dict[str, Any] = {
        "id": machine.id,
        "topology": machine.topology,
        "manufacturer": machine.manufacturer,
        "model": machine.model,
        "serial_number": machine.serial_number,
        "location": machine.location,
        "axes": axes,
        "tolerances": dict(machine.tolerances),
    }
    if machine.chain:
        document["chain"] = [asdict(axis) for axis in machine.chain]
    if machine.virtual:
        document["virtual"] = True
    if machine.gravity is not None:
        document["gravity"] = machine.gravity
    return _text(document)


def machine_record(text: str) -> Machine:
    """The machine of ``machine_json``."""
    document = json.loads(text)
    gravity = _tuple(document.pop("gravity", None))
    axes = {
        name: AxisSettings(**{**settings, "stroke": _tuple(settings["stroke"])})
        for name, settings in document.pop("axes").items()
    }
    chain = tuple(
        ChainAxis(**{**axis, "direction": _tuple(axis["direction"]), "offset": _tuple(axis["offset"])})
        for axis in document.pop("chain", ())
    )
    return Machine(**document, axes=axes, chain=chain, gravity=gravity)


def probe_json(probe: Probe) -> str:
    """A probe as text; lengths in mm. What nobody states of a scale is left out."""
    document = asdict(probe)
    if probe.scale_uncertainty is None:
        del document["scale_uncertainty"]
    if not probe.known:
        del document["known"]
    return _text(document)


def probe_record(text: str) -> Probe:
    """The probe of ``probe_json``."""
    document = json.loads(text)
    return Probe(**{**document, "tip": _tuple(document["tip"]), "known": tuple(document.get("known", ()))})


def artefact_json(artefact: Artefact, sources: Sequence[Source] = ()) -> str:
    """An artefact as text; lengths in mm, expansion in 1/K, temperature in °C.

    The stated ``sources`` of uncertainty stand beside it, where there are any.
    """
    document = asdict(artefact)
    if artefact.self_calibration is None:
        del document["self_calibration"]
    if not artefact.reflectors:
        del document["reflectors"]
    if artefact.l_shape is None:
        del document["l_shape"]
    if sources:
        document["sources"] = [to_document(source) for source in sources]
    if not artefact.setups:
        del document["setups"]
    for setup in document.get("setups", ()):
        for name in ("turn_uncertainty", "certificate"):
            if setup[name] is None:
                del setup[name]
    return _text(document)


def sources_record(text: str) -> tuple[Source, ...]:
    """The sources of ``artefact_json``."""
    return tuple(from_document(Source, source) for source in json.loads(text).get("sources", ()))


def artefact_record(text: str) -> Artefact:
    """The artefact of ``artefact_json``."""
    document = json.loads(text)
    balls = tuple(Ball(**{**ball, "nominal": _tuple(ball["nominal"])}) for ball in document["balls"])
    bar = document["scale_bar"]
    return Artefact(
        document["id"],
        balls,
        None if bar is None else ScaleBar(**{**bar, "balls": _tuple(bar["balls"])}),
        tuple(Reflector(**reflector) for reflector in document.get("reflectors", ())),
        l_shape=_l_shape(document.get("l_shape")),
        self_calibration=_self_calibration(document.get("self_calibration")),
        setups=setups_record(text),
    )


def setups_record(text: str) -> tuple[Setup, ...]:
    """The setups of ``artefact_json``."""
    return tuple(map(_setup, json.loads(text).get("setups", ())))


def _setup(document: dict[str, Any]) -> Setup:
    vectors = ("tool_point", "work_point", "direction", "tool_direction", "known")
    return Setup(**{**document, **{name: _tuple(document[name]) for name in vectors}})


def _self_calibration(document: dict[str, Any] | None) -> SelfCalibration | None:
    if document is None:
        return None
    nodes = {axis: tuple(places) for axis, places in document["nodes"].items()}
    return SelfCalibration(nodes, KnownError(**document["length"]), tuple(document["conditions"]))


def _l_shape(document: dict[str, Any] | None) -> LShape | None:
    if document is None:
        return None
    modules = tuple(
        Module(module["id"], _tuple(module["centre"]), _tuple(module["tilt"]))
        for module in document["modules"]
    )
    placements = tuple(
        Placement(placement["plane"], _tuple(placement["corner"])) for placement in document["placements"]
    )
    return LShape(**{**document, "modules": modules, "placements": placements})


def _text(document: dict[str, Any]) -> str:
    return json.dumps(document, ensure_ascii=False, allow_nan=False)


def _tuple(values: list[Any] | None) -> Any:
    return None if values is None else tuple(values)
