"""``[artefact.l_shape]`` of ``campaign.toml``: optics, modules and placements of an L-shaped standard piece."""

from __future__ import annotations

from monitor.readers.axes import FARTHEST_MM
from monitor.readers.faults import quoted
from monitor.readers.toml_table import Table
from monitor.records import LShape, Module, Placement
from monitor.units import MICROMETRE, MICRORADIAN

PLANES = ("XY", "XZ", "YZ")
CENTRE, TILT, CORNER = "[50.0, 0.0]", "[0.4, -1.2]", "[10.0, 20.0, -30.0]"
#: A face that is tilted or known worse than this is no reference: 10 mrad are 10 µm over a millimetre.
LARGEST_URAD = 10_000.0


def read_l_shape(artefact: Table) -> LShape | None:
    """Read the table; None where there is none, or anything in it is wrong."""
    table = artefact.table("l_shape")
    if table is None:
        return None
    before = len(table.faults)
    focal = table.number(
        "focal_length_mm", required=True, positive=True, largest=FARTHEST_MM, unit="mm", example="100.0"
    )
    curvature = table.number(
        "paraboloid_mm", required=True, positive=True, largest=FARTHEST_MM, unit="mm", example="57.0"
    )
    position = table.number(
        "place_standard_uncertainty_um", required=True, positive=True, largest=1e3, unit="um", example="0.1"
    )
    tilt = table.number(
        "tilt_standard_uncertainty_urad",
        required=True,
        positive=True,
        largest=LARGEST_URAD,
        unit="urad",
        example="0.5",
    )
    modules = [module for row in table.tables("modules") if (module := _module(row)) is not None]
    placements = [
        placement for row in table.tables("placements") if (placement := _placement(row)) is not None
    ]
    if len(table.faults) == before:
        _judge(table, modules, placements)
    table.finish()
    if len(table.faults) > before:
        return None
    assert focal is not None
    assert curvature is not None
    assert position is not None
    assert tilt is not None
    return LShape(
        focal,
        curvature,
        MICROMETRE.to_internal(position),
        MICRORADIAN.to_internal(tilt),
        tuple(modules),
        tuple(placements),
    )


def _module(table: Table) -> Module | None:
    identity = table.text("id", required=True, example='"A1"')
    centre = table.numbers("centre_mm", 2, required=True, largest=FARTHEST_MM, unit="mm", example=CENTRE)
    tilt = table.numbers("tilt_urad", 2, largest=LARGEST_URAD, unit="urad", example=TILT)
    table.finish()
    if identity is None or centre is None:
        return None
    u, v = tilt or (0.0, 0.0)
    return Module(identity, (centre[0], centre[1]), (MICRORADIAN.to_internal(u), MICRORADIAN.to_internal(v)))


def _placement(table: Table) -> Placement | None:
    plane = table.text("plane", required=True, example='"XY"')
    corner = table.numbers("corner_mm", 3, required=True, largest=FARTHEST_MM, unit="mm", example=CORNER)
    table.finish()
    if plane is not None and plane not in PLANES:
        table.fault("plane", f"{quoted(plane)} is no plane of the machine; write XY, XZ or YZ")
        return None
    if plane is None or corner is None:
        return None
    return Placement(plane, (corner[0], corner[1], corner[2]))


def _judge(table: Table, modules: list[Module], placements: list[Placement]) -> None:
    if len(modules) < 3:
        table.fault("modules", f"{len(modules)} modules are no L; list the corner and those of both arms")
    if not placements:
        table.fault("placements", "no placement is listed; add [[artefact.l_shape.placements]], one a plane")
    for key, names in (
        ("modules", [module.id for module in modules]),
        ("placements", [placement.plane for placement in placements]),
    ):
        for name in sorted({name for name in names if names.count(name) > 1}):
            table.fault(key, f"{quoted(name)} is listed twice; list it once")
