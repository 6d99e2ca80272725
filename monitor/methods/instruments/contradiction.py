"""Readings that no errors of this machine explain: those of another one, of other signs, points or units."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations

import numpy as np

from monitor.exceptions import MistakenUnitError
from monitor.machine import Chain, evaluate
from monitor.methods.chain.measured import Displaced
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.readings.vector import AtWorkPoint, VectorReading
from monitor.records import Array
from monitor.units import UNIT_WORDS, mistaken_for_mm

# Residuals of directions of more than a tenth of a radian are no errors of this mount.
CONTRADICTS = 0.1
# Residuals of lengths beyond this part of the travel, and beyond a millimetre, are those of another machine: the limit
# of the tracker.
CONTRADICTS_TRAVEL, LEAST_CONTRADICTION = 0.02, 1.0
# mm. A work point is stated to some millimetres. Positions in inches, with another sign or of another column put it a
# hundred away, and the fit follows them: the errors come out as of a machine of another size. A unit is named where it
# takes away all but a tenth of what is more than this.
STATED_WITHIN, LEFT_BY_UNIT = 5.0, 0.1


def contradiction(parts: Sequence[Part], sigma: Array, vectors: Array, travel: float) -> str | None:
    """Why the readings are those of another machine, in words, None where they may be this one's; ``sigma`` and
    ``vectors`` (n, d) after the fit, ``travel`` mm is how far the machine moved. MistakenUnitError where a unit of the
    positions explains it."""
    unit = _wrong_unit(parts)
    if unit is not None:
        raise MistakenUnitError(f"the readings contradict the machine file: {unit}")
    return _wrong_length(parts, sigma, vectors, travel) or _wrong_direction(parts, sigma, vectors)


def _wrong_direction(parts: Iterable[Part], sigma: Array, vectors: Array) -> str | None:
    """The first setup of directions that point elsewhere after the fit, in words; ``sigma`` and ``vectors`` (n, d)."""
    for part in parts:
        if part.reading.name != "direction":
            continue
        # A direction that points the other way has no component across: it is looked at by itself.
        weighted = np.isfinite(sigma[part.at]).all(axis=1)
        off = np.linalg.norm(vectors[part.at][weighted], axis=1) / 1000.0
        if len(off) and float(np.sqrt(np.mean(off**2))) > CONTRADICTS:
            return (
                f"setup {part.id}: after the fit the directions are off by {np.sqrt(np.mean(off**2)):.2g} rad; "
                "check the signs and directions of the axes, tool_direction and the outer frame"
            )
    return None


def _wrong_length(parts: Iterable[Part], sigma: Array, vectors: Array, travel: float) -> str | None:
    """The first setup of lengths whose readings are off by more than any machine's errors, in words; ``travel`` mm is
    how far the machine moved."""
    limit = max(LEAST_CONTRADICTION, CONTRADICTS_TRAVEL * travel)
    for part in parts:
        numbers = vectors[part.at][np.isfinite(sigma[part.at])]
        off = float(np.sqrt(np.mean(numbers**2))) if len(numbers) else 0.0
        if not part.reading.angular and off > limit:
            return (
                f"setup {part.id}: after the fit its readings are off by {off:.3g} mm; check the points, "
                "the directions and the signs of the axes, and the unit of the readings"
            )
    return None


def _wrong_unit(parts: Iterable[Part]) -> str | None:
    """The first setup of vectors that stands where the file says only if axis positions are taken in another unit."""
    for part in parts:
        if not isinstance(part.reading, VectorReading) or not _is_sought(part.reading):
            continue
        as_recorded = _off(part, np.ones(len(part.rows.chain.joints)))
        if as_recorded <= STATED_WITHIN:
            continue
        for columns, scale, in_words in _units(part.rows.chain):
            in_unit = _off(part, scale)
            if in_unit < LEFT_BY_UNIT * as_recorded:
                were = "were" if " " in columns else "was"
                return (
                    f"setup {part.id}: the tool point is {as_recorded:.3g} mm from work_point_mm, and {in_unit:.2g} mm "
                    f"if {columns} {were} {in_words}; positions are in mm"
                )
    return None


def displaced_work_points(parts: Iterable[Part], unknowns: Iterable[Array]) -> Iterator[Displaced]:
    """Stated work points that the unknowns (q,) of a run, in the order of ``parts``, put elsewhere."""
    for part, values in zip(parts, unknowns, strict=True):
        if isinstance(part.reading, AtWorkPoint) and _is_sought(part.reading):
            distance = float(np.linalg.norm(values[:3] - part.reading.setup.work_point))
            if distance > STATED_WITHIN:
                yield Displaced(part.id, distance)


def _is_sought(reading: AtWorkPoint) -> bool:
    """Whether a work point is stated (the machine's zero is what a file without one has), and not as known."""
    return not reading.holds("work_point") and any(reading.setup.work_point)


def _units(chain: Chain) -> Iterator[tuple[str, Array, str]]:
    """The columns of linear axes in each unit: the columns in words, the factors (J,) to mm, the unit in words."""
    linear = [index for index, joint in enumerate(chain.joints) if not joint.turns]
    for unit in mistaken_for_mm():
        for count in range(len(linear), 0, -1):
            for subset in combinations(linear, count):
                scale = np.ones(len(chain.joints))
                scale[list(subset)] = unit.factor
                names = sorted(f"{chain.joints[index].name.lower()}_mm" for index in subset)
                yield " and ".join(filter(None, [", ".join(names[:-1]), names[-1]])), scale, UNIT_WORDS[unit]


def _off(part: Part, scale: Array) -> float:
    """How far (mm, median) a machine without errors is from the stated work point, for positions times ``scale``."""
    assert isinstance(part.reading, AtWorkPoint)
    rows, setup = part.rows, part.reading.setup
    count, joints = len(rows), len(rows.chain.joints)
    work, tool = np.tile(setup.work_point, (count, 1)), np.tile(setup.tool_point, (count, 1))
    none = np.zeros((count, joints, 2, 6))
    r = evaluate(rows.chain, rows.positions * scale, none, work, tool).residual
    return float(np.median(np.linalg.norm(r, axis=1)))
