"""The key by which a setup, or a tracker, states how well the scale of its lengths is known."""

from __future__ import annotations

from monitor.readers.toml_table import Table
from monitor.units import METRE, MICROMETRE

SCALE_UNCERTAINTY = "scale_standard_uncertainty_um_per_m"
#: A standard uncertainty of a scale beyond this is a slip of unit: 1 %, in µm/m.
LARGEST_SCALE = 1e4


def read_scale_uncertainty(table: Table) -> float | None:
    """Return the standard uncertainty of the scale in mm/mm; None where it is taken as exact."""
    value = table.number(SCALE_UNCERTAINTY, positive=True, largest=LARGEST_SCALE, unit="µm/m", example="0.5")
    return None if value is None else MICROMETRE.per(METRE).to_internal(value)
