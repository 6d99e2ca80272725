"""A test of an instrument as answers name it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import OMITTED


@dataclass(frozen=True)
class TestAnswer:
    """A test of an instrument: so many ``poses`` with each axis between two readings (``x_mm``, ``c_deg``), a bar or a
    sphere at ``work_point_mm`` on the work side. ``available``: the campaign has the instrument, else it is a usual
    one. ``u`` are standard uncertainties of all parameters with it, in their units; None where there is no number.
    ``axes_by_pose`` is where the axes stand at each pose, in their order; None where the test is not planned but
    named."""

    instrument: str
    setup: str
    reading: str
    available: bool
    poses: int
    axes: Mapping[str, tuple[float, float]]
    u: Mapping[str, float | None]
    work_point_mm: tuple[float, float, float] | None = field(default=None, metadata=OMITTED)
    axes_by_pose: tuple[Mapping[str, float], ...] | None = field(default=None, metadata=OMITTED)
