"""Reads a file of the residual errors of a machine's linear axes, as standard uncertainties (TOML).

For methods that take the linear axes as known: ``monitor uncertainty CAMPAIGN --linear-axes FILE``.
"""

from __future__ import annotations

from pathlib import Path

from monitor.exceptions import InputError
from monitor.readers.faults import Faults, quoted
from monitor.readers.files import LARGEST_TOML, decode, read_bytes
from monitor.readers.toml_table import Table, parse_toml
from monitor.records import LINEAR_LETTERS, LinearAxes, LinearAxisErrors
from monitor.units import MICROMETRE

#: Beyond these a unit has slipped: 1 mm, and 1 mm over a metre.
LARGEST_UM, LARGEST_UM_PER_M = 1000.0, 1000.0
#: A node spacing beyond this is longer than any axis.
LARGEST_SPACING_MM = 100_000.0
PER_METRE = 1e-6


def read_linear_axes(path: Path) -> LinearAxes:
    """Read the standard uncertainties of a file. Raises InputError with all its faults."""
    faults = Faults([path.name])
    content = read_bytes(path.parent, path.name, LARGEST_TOML, faults)
    text = None if content is None else decode(path.name, content, faults)
    top = None if text is None else parse_toml(path.name, text, faults)
    errors: dict[str, LinearAxisErrors] = {}
    spacing = None
    if top is not None:
        spacing = top.numbers(
            "node_spacing_mm", 2, required=True, largest=LARGEST_SPACING_MM, unit="mm", example="[20.0, 50.0]"
        )
        if spacing is not None and not 0.0 < spacing[0] <= spacing[1]:
            top.fault(
                "node_spacing_mm", f"{quoted(list(spacing))} must rise from above 0, such as [20.0, 50.0]"
            )
        axes = top.table("axes", required=True)
        if axes is not None:
            for name in axes.data:
                errors[name] = _axis(axes, name)
            axes.finish()
        top.finish()
    if len(faults):
        listed = "\n".join(f"  {fault}" for fault in faults.sorted())
        raise InputError(f"{path} cannot be used:\n{listed}")
    assert spacing is not None
    return LinearAxes(errors, (spacing[0], spacing[1]))


def _axis(axes: Table, name: str) -> LinearAxisErrors:
    table = axes.table(name)
    if table is None:
        return LinearAxisErrors()
    if name[:1] not in LINEAR_LETTERS:
        table.fault(None, f"{quoted(name)} is no linear axis; write [axes.X], [axes.Y], [axes.Z]")

    def of(owner: Table, key: str, unit: str, largest: float, example: str) -> float:
        value = owner.number(key, largest=largest, unit=unit, example=example)
        if value is not None and value < 0.0:
            owner.fault(key, f"{quoted(value)} is negative; a standard uncertainty is not")
        return value or 0.0

    squareness: dict[str, float] = {}
    square = table.table("squareness_um_per_m")
    if square is not None:
        for other in square.data:
            if other == name or other[:1] not in LINEAR_LETTERS:
                square.fault(other, f"a squareness is to another linear axis, not to {quoted(other)}")
            squareness[other] = PER_METRE * of(square, other, "um/m", LARGEST_UM_PER_M, "30.0")
        square.finish()
    errors = LinearAxisErrors(
        proportional=PER_METRE * of(table, "proportional_um_per_m", "um/m", LARGEST_UM_PER_M, "10.0"),
        positioning=MICROMETRE.to_internal(of(table, "positioning_um", "um", LARGEST_UM, "2.0")),
        straightness=MICROMETRE.to_internal(of(table, "straightness_um", "um", LARGEST_UM, "2.0")),
        squareness=squareness,
    )
    table.finish()
    return errors
