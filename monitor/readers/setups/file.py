"""The setups of instruments of ``campaign.toml``: ``[[setups]]``, each with the keys of its kind of reading."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from monitor.exceptions import did_you_mean
from monitor.readers.axes import FARTHEST_MM
from monitor.readers.campaign.chain_tables import LETTERS, unit_vector
from monitor.readers.faults import one_of, quoted
from monitor.readers.setups.agreement import DIRECTION, LENGTH, check_agreement, check_one_statement
from monitor.readers.setups.known_key import read_known
from monitor.readers.setups.scale_key import SCALE_UNCERTAINTY, read_scale_uncertainty
from monitor.readers.toml_table import Table
from monitor.records import Branch, Probe, Probings, Setup, Vector
from monitor.units import METRE, MICROMETRE, MICRORADIAN

#: A setup's id stands in names of unknowns and in a column: letters, digits and the signs between them.
IDENTITY = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]{0,40}")
#: A standard uncertainty of an angle beyond this is a slip of unit: 0.1 rad.
LARGEST_URAD = 1e5
_LENGTH_UNCERTAINTY = LENGTH.key
_DIRECTION_UNCERTAINTY = DIRECTION.key
_DRIFT_UNCERTAINTY = "drift_standard_uncertainty"
_TOOL_UNCERTAINTY = "tool_point_standard_uncertainty_mm"
POINT = "[0.0, 0.0, -120.0]"
BRANCHES: tuple[Branch, ...] = ("tool", "work")


@dataclass(frozen=True)
class ReadingFormat:
    """What a kind of reading asks of the file: its ``columns`` (those of ``optional`` may be empty or missing), whether
    they are angles, the keys that it needs, those that it allows, the unknowns that may be ``known``, and whether it
    ``turns``: an orientation besides lengths, with an uncertainty of its own; ``drifts``: whether its zero may be
    stated to drift within a run."""

    columns: tuple[str, ...]
    angular: bool = False
    optional: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    allows: tuple[str, ...] = ()
    holdable: tuple[str, ...] = ()
    turns: bool = False
    drifts: bool = True


ONE_LENGTH, ONE_ANGLE = ("reading_um",), ("reading_urad",)
POINTS = ("point_x_mm", "point_y_mm", "point_z_mm")
QUATERNION = ("quaternion_w", "quaternion_x", "quaternion_y", "quaternion_z")
FORMATS: Mapping[str, ReadingFormat] = MappingProxyType({
    "vector": ReadingFormat(("dx_um", "dy_um", "dz_um"), allows=("frame", _TOOL_UNCERTAINTY), holdable=("work_point",)),
    "component": ReadingFormat(
        ONE_LENGTH, needs=("direction",), allows=(_TOOL_UNCERTAINTY,), holdable=("zero",)
    ),
    "distance": ReadingFormat(
        ONE_LENGTH, needs=("length_mm",), allows=(_LENGTH_UNCERTAINTY, _TOOL_UNCERTAINTY, SCALE_UNCERTAINTY),
        holdable=("work_point", "length"),
    ),
    "displacement": ReadingFormat(
        ONE_LENGTH, needs=("direction",), allows=(_DIRECTION_UNCERTAINTY, _TOOL_UNCERTAINTY, SCALE_UNCERTAINTY),
        holdable=("direction", "scale"),
    ),
    "offset": ReadingFormat(
        ONE_LENGTH, needs=("direction", "along"), allows=(_TOOL_UNCERTAINTY,), holdable=("zero", "slope")
    ),
    "angle": ReadingFormat(ONE_ANGLE, angular=True, needs=("direction",), holdable=("zero",)),
    "level": ReadingFormat(ONE_ANGLE, angular=True, needs=("direction",), allows=("side",), holdable=("zero",)),
    "direction": ReadingFormat(
        ("direction_x", "direction_y", "direction_z"), angular=True, needs=("tool_direction",), holdable=("frame",),
        drifts=False,
    ),
    "point": ReadingFormat(
        POINTS, optional=("point_z_mm",), allows=("tool_direction", SCALE_UNCERTAINTY),
        holdable=("frame", "targets", "scale"),
    ),
    "pose": ReadingFormat(
        (*POINTS, *QUATERNION), allows=("tool_direction", SCALE_UNCERTAINTY), holdable=("frame", "targets", "scale"),
        turns=True, drifts=False,
    ),
})  # fmt: skip


def read_setups(top: Table) -> tuple[Setup, ...] | None:
    """Read the setups; None if anything in them is wrong, or there is none."""
    before = len(top.faults)
    setups: dict[str, Setup] = {}
    read: list[tuple[Table, Setup]] = []
    rows = top.tables("setups")
    if not rows and len(top.faults) == before:
        top.fault(
            "setups", "the tables [[setups]] are missing; the method needs one for each instrument set up"
        )
    for row in rows:
        setup = _setup(row)
        if setup is not None and setup.id in setups:
            row.fault("id", f"setup {quoted(setup.id)} is listed twice; give every setup its own id")
        elif setup is not None:
            setups[setup.id] = setup
            read.append((row, setup))
    check_agreement(read, [kind for kind, form in FORMATS.items() if SCALE_UNCERTAINTY in form.allows])
    return None if len(top.faults) > before else tuple(setups.values())


def _setup(table: Table) -> Setup | None:
    before = len(table.faults)
    identity = table.text("id", required=True, example='"bar-xy"')
    if identity is not None and not IDENTITY.fullmatch(identity):
        table.fault("id", f"{quoted(identity)} cannot name a setup: write letters, digits and . _ + - only")
    kind = _kind(table)
    instrument = table.text("instrument")
    if kind is None or identity is None:
        return None
    form = FORMATS[kind]
    setup = Setup(
        id=identity,
        reading=kind,
        standard_uncertainty=_uncertainty(table, form),
        instrument=instrument,
        tool_point=_point(table, "tool_point_mm"),
        work_point=_point(table, "work_point_mm"),
        direction=_unit(table, "direction") if "direction" in form.needs else None,
        tool_direction=_unit(table, "tool_direction", required="tool_direction" in form.needs)
        if "tool_direction" in (*form.needs, *form.allows)
        else None,
        length=_length(table) if "length_mm" in form.needs else None,
        length_uncertainty=_length_uncertainty(table) if _LENGTH_UNCERTAINTY in form.allows else None,
        direction_uncertainty=_direction_uncertainty(table, form),
        along=table.text("along", required=True, example='"X"') if "along" in form.needs else None,
        side=_branch(table, "side", "tool") if "side" in form.allows else "tool",
        frame=_branch(table, "frame", "work") if "frame" in form.allows else "work",
        known=read_known(table, form.holdable),
        turn_uncertainty=_stated(table, "urad") if form.turns else None,
        certificate=table.text("certificate"),
        drift_uncertainty=_drift(table, form),
        tool_point_uncertainty=_tool_uncertainty(table, form),
        scale_uncertainty=read_scale_uncertainty(table) if SCALE_UNCERTAINTY in form.allows else None,
    )
    check_one_statement(table, setup.known)
    table.finish()
    return None if len(table.faults) > before else setup


def _kind(table: Table) -> str | None:
    """Return the kind of reading; None where it is missing or none."""
    kind = table.text("reading", required=True, example='"distance"')
    if kind is None or kind in FORMATS:
        return kind
    table.fault(
        "reading",
        f"{quoted(kind)} is no kind of reading; {did_you_mean(kind, FORMATS)}the kinds are {one_of(FORMATS)}",
    )
    return None


def _uncertainty(table: Table, form: ReadingFormat) -> float | None:
    """The standard uncertainty of one reading in mm or rad; None where the rows have to state it."""
    right, wrong = ("urad", "um") if form.angular else ("um", "urad")
    other = f"standard_uncertainty_{wrong}"
    if other in table.data and not form.turns:
        table.raw(other, required=False, example="")
        what = "an angle" if form.angular else "a length"
        table.fault(other, f"the reading is {what}: write standard_uncertainty_{right}")
    return _stated(table, right)


def _drift(table: Table, form: ReadingFormat) -> float | None:
    """The standard uncertainty of the drift over a run in mm or rad; None where it is not stated."""
    if not form.drifts:
        return None
    right, wrong = ("urad", "um") if form.angular else ("um", "urad")
    other = f"{_DRIFT_UNCERTAINTY}_{wrong}"
    if other in table.data:
        table.raw(other, required=False, example="")
        what = "an angle" if form.angular else "a length"
        table.fault(other, f"the reading is {what}: write {_DRIFT_UNCERTAINTY}_{right}")
    return _stated(table, right, _DRIFT_UNCERTAINTY, "2.0")


def _stated(
    table: Table, name: str, stem: str = "standard_uncertainty", example: str = "0.5"
) -> float | None:
    """A standard uncertainty in mm or rad, written in ``um`` or ``urad``; None where it is not stated."""
    unit, largest = (
        (MICRORADIAN, LARGEST_URAD) if name == "urad" else (MICROMETRE, MICROMETRE.to_display(FARTHEST_MM))
    )
    value = table.number(f"{stem}_{name}", positive=True, largest=largest, unit=name, example=example)
    return None if value is None else unit.to_internal(value)


def _point(table: Table, key: str) -> Vector:
    point = table.numbers(key, 3, largest=FARTHEST_MM, unit="mm", example=POINT)
    return (0.0, 0.0, 0.0) if point is None else (point[0], point[1], point[2])


def _length(table: Table) -> float | None:
    return table.number(
        "length_mm", required=True, positive=True, largest=FARTHEST_MM, unit="mm", example="150.0"
    )


def _length_uncertainty(table: Table) -> float | None:
    """Return the standard uncertainty of the length in mm; None where it is not stated."""
    value = table.number(
        _LENGTH_UNCERTAINTY, positive=True, largest=1e3 * FARTHEST_MM, unit="um", example="0.3"
    )
    return None if value is None else MICROMETRE.to_internal(value)


def _direction_uncertainty(table: Table, form: ReadingFormat) -> float | None:
    """Return the standard uncertainty of a beam's direction in rad; None where it is not stated."""
    if _DIRECTION_UNCERTAINTY not in form.allows:
        return None
    value = table.number(
        _DIRECTION_UNCERTAINTY, positive=True, largest=LARGEST_URAD, unit="urad", example="200.0"
    )
    return None if value is None else MICRORADIAN.to_internal(value)


def _tool_uncertainty(table: Table, form: ReadingFormat) -> float | None:
    """Return the standard uncertainty of each coordinate of the tool point in mm; None where it is as stated."""
    if _TOOL_UNCERTAINTY not in form.allows:
        return None
    return table.number(_TOOL_UNCERTAINTY, positive=True, largest=FARTHEST_MM, unit="mm", example="1.0")


def _unit(table: Table, key: str, *, required: bool = True) -> Vector | None:
    value = table.raw(key, required=required, example="[1.0, 0.0, 0.0]")
    if value is None:
        return None
    if isinstance(value, str) and value in LETTERS:
        return LETTERS[value]
    return unit_vector(table, key)


def _branch(table: Table, key: str, default: Branch) -> Branch:
    value = table.text(key)
    for branch in BRANCHES:
        if value == branch:
            return branch
    if value is not None:
        table.fault(key, f'{quoted(value)} is no side of the machine; write "tool" or "work"')
    return default


def probe_of(setups: tuple[Setup, ...], probings: Probings) -> Probe:
    """Return what stands for the probe of a campaign of instruments: their names, and the smallest standard uncertainty
    of a reading, of an angle that at one metre."""
    stated = [
        setup.standard_uncertainty * (METRE.factor if FORMATS[setup.reading].angular else 1.0)
        for setup in setups
        if setup.standard_uncertainty is not None
    ]
    rows = [probings.channels[name] for name in ("u_um", "u_urad") if name in probings.channels]
    stated += [MICROMETRE.to_internal(float(np.nanmedian(u))) for u in rows if np.isfinite(u).any()]
    names = dict.fromkeys(setup.instrument or setup.reading for setup in setups)
    return Probe("; ".join(setup.id for setup in setups), "; ".join(names), min(stated))
