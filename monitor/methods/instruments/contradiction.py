"""Readings that no errors of this machine explain: those of another one, of other signs, points or units."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt

from monitor.exceptions import MistakenAxesError
from monitor.machine import Chain
from monitor.methods.chain.measured import Displaced
from monitor.methods.instruments.mistaken_axes import (
    STATED_WITHIN,
    mistaken_axes,
    nominal,
    read_in_work,
    tool_in_work,
)
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.reading import direction_of
from monitor.methods.instruments.readings.displacement import BEAM_ANGLES, Displacement
from monitor.methods.instruments.readings.distance import FLAT, DistanceReading
from monitor.methods.instruments.readings.vector import AtWorkPoint, VectorReading
from monitor.records import Array
from monitor.units import UNIT_WORDS, mistaken_for_mm

# Residuals of directions of more than a tenth of a radian are no errors of this mount.
CONTRADICTS = 0.1
# Residuals of lengths beyond this part of the travel, and beyond a millimetre, are those of another machine: the limit
# of the tracker.
CONTRADICTS_TRAVEL, LEAST_CONTRADICTION = 0.02, 1.0
# A unit is named where it takes away all but this part of what a work point is off.
LEFT_BY_UNIT = 0.1
# A laser's readings are its travel to some hundredths: gains of machines are thousands of times smaller. A travel of
# less than a millimetre says nothing of that.
SAME_TRAVEL, LEAST_TRAVEL = 0.02, 1.0
# A path that leaves its point by more than this, mm, beside what sensors read is no error of a machine; another point
# of the tool explains it where it takes away all but this part.
LEAST_POINT, LEFT_BY_POINT = 0.1, 0.2
# rad. A beam that the readings turn by more reads another travel: a laser is set up to a milliradian.
LARGEST_BEAM = 0.05
# Tool points that lie this part further from the centre of their bar, or nearer, than its length are those of another
# bar; of a length in another unit the factor is met to the same part.
OTHER_LENGTH = 0.02
# What a stated length is to the right one where it is in another unit, or another length of the bar.
OTHER_LENGTHS = (
    (1.0 / 25.4, "it is in inches"),
    (0.1, "it is in cm"),
    (1e-3, "it is in m"),
    (1e3, "it is in µm"),
    (2.0, "it is the diameter of the circle"),
)
# What readings of a travel are where they are not µm of it along n: the factor, and what to look at.
OTHER_TRAVELS = (
    (-1.0, "with the other sign: look at the signs of the readings, of `direction` and of the axis"),
    (1e-3, "in mm: the column is in µm"),
    (1e3, "in nm: the column is in µm"),
    (1.0 / 25400.0, "in inches: the column is in µm"),
    (
        1.0 / 25.4,
        "in thousandths of an inch, or the axis is written 25.4 times too large: columns are in µm and mm",
    ),
    (25.4, "as if the axis were written in inches: positions are in mm"),
)


def contradiction(
    parts: Sequence[Part],
    unknowns: Sequence[Array],
    numbers: npt.NDArray[np.int64],
    sigma: Array,
    vectors: Array,
    targets: Array,
) -> str | None:
    """Why the readings are those of another machine, in words, None where they may be this one's; ``unknowns`` (R, q)
    of the parts, ``numbers`` (R,) of the runs, ``sigma`` and ``vectors`` (n, d) after the fit, ``targets`` (n, 3) mm
    as the file puts them. MistakenAxesError where a unit of the positions, a sign or exchanged columns explain it."""
    travel = float(np.linalg.norm(targets.std(axis=0)))
    wrong = _wrong_unit(parts)
    if wrong is None and _puts_work_points_elsewhere(parts, unknowns):
        wrong = mistaken_axes(parts, numbers, everywhere=True)
    if wrong is not None:
        raise MistakenAxesError(f"the readings contradict the machine file: {wrong}")
    return (
        _wrong_length(parts, sigma, vectors, travel)
        or _wrong_direction(parts, sigma, vectors)
        or _turned_beam(parts, unknowns)
    )


def _turned_beam(parts: Sequence[Part], unknowns: Sequence[Array]) -> str | None:
    """The first laser whose beam the fit turned until it read another travel than along its direction, in words."""
    for part, values in zip(parts, unknowns, strict=True):
        beam = [index for index, name in enumerate(part.unknowns) if name in BEAM_ANGLES]
        turned = float(np.linalg.norm(values[:, beam], axis=1).max(initial=0.0)) if beam else 0.0
        if turned > LARGEST_BEAM:
            return (
                f"setup {part.id} fits only a beam that is turned by {turned:.2g} rad from `direction`; look at the "
                "labels of its rows and at the axis that they move"
            )
    return None


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


def bars_of_one_direction(parts: Iterable[Part]) -> tuple[str, ...]:
    """Setups whose bar kept one direction, so that its centre is held across it where it was stated."""
    return tuple(
        part.id
        for part in parts
        if isinstance(part.reading, DistanceReading) and part.reading.keeps_one_direction
    )


def unsettled(parts: Sequence[Part]) -> str:
    """What may keep a fit from settling, as the end of a refusal: lasers that read something else than the travel, and
    bars that kept one direction, so that a centre which is stated some millimetres wrong cannot be mended."""
    travels = (f"the readings of setup {name} are {what}" for name, what in other_travels(parts))
    hints = (*travels, *_other_lengths(parts), *_other_tool_points(parts))
    suspected = "".join(f"; {what}" for what in hints)
    return suspected + "".join(
        f"; the bar of setup {name} kept one direction, which shows nothing of its centre across it: state "
        "work_point_mm to 0.1 mm, or add rows with the bar in two other directions"
        for name in bars_of_one_direction(parts)
    )


def other_travels(parts: Iterable[Part]) -> Iterator[tuple[str, str]]:
    """The setups of lasers whose readings are not the travel of the tool point along their direction: the id, and what
    they are in words."""
    for part in parts:
        if not isinstance(part.reading, Displacement):
            continue
        for index in np.unique(part.rows.run):
            mine = part.rows.run == index
            travel = nominal(part)[mine] @ direction_of(part.reading.setup)
            travel = travel - travel.mean()
            read = part.rows.measured[mine, 0] - part.rows.measured[mine, 0].mean()
            what = _travel_in_words(travel, read)
            if what is not None:
                yield part.id, what
                break


def _other_lengths(parts: Iterable[Part]) -> Iterator[str]:
    """The setups of bars whose tool points lie on a circle of another radius than the bar is long, in words."""
    named: set[float] = set()
    for part in parts:
        if not isinstance(part.reading, DistanceReading) or part.reading.setup.length in named:
            continue
        length = part.reading.setup.length
        assert length is not None  # the reader asks for it
        stated = np.linalg.norm(nominal(part), axis=1)
        off = (abs(np.median(long) / length - 1.0) < OTHER_LENGTH for long in (stated, _radii(nominal(part))))
        if any(off):
            continue
        named.add(length)
        radius = float(np.median(_radii(nominal(part))))
        meant = (
            f": {why}" for factor, why in OTHER_LENGTHS if abs(length / radius / factor - 1.0) < OTHER_LENGTH
        )
        yield (
            f"the tool points of setup {part.id} lie {radius:.5g} mm from the middle of their circle, and length_mm "
            f"says {length:.5g}{next(meant, '')}"
        )


def _radii(points: Array) -> Array:
    """How far points (n, 3) mm lie from the centre of the circle or sphere through them."""
    about = points - points.mean(axis=0)
    _, size, axes = np.linalg.svd(about, full_matrices=False)
    inside = about @ axes[size > FLAT * size[0]].T
    right = 0.5 * np.sum(inside**2, axis=1)
    centre = np.linalg.lstsq(inside - inside.mean(axis=0), right - right.mean(), rcond=None)[0]
    return np.asarray(np.linalg.norm(inside - centre, axis=1))


def _other_tool_points(parts: Iterable[Part]) -> Iterator[str]:
    """The setups of vectors that fit another tool point than the stated one, in words: a head that turns shows it."""
    for part in parts:
        if not isinstance(part.reading, VectorReading) or not _is_sought(part.reading):
            continue
        rows, setup = part.rows, part.reading.setup
        first = (rows.run == rows.run[0]) & np.isfinite(rows.measured).all(axis=1)
        tool = tool_in_work(part)[first]
        off = (nominal(part) - read_in_work(part))[first]
        before = off - off.mean(axis=0)
        by_point = (tool - tool.mean(axis=0)).reshape(-1, 3)
        move = np.linalg.lstsq(by_point, -before.reshape(-1), rcond=1e-3)[0]
        remaining, as_stated = (
            float(np.sqrt(np.mean(each**2))) for each in (before.reshape(-1) + by_point @ move, before)
        )
        if as_stated > LEAST_POINT and remaining < LEFT_BY_POINT * as_stated:
            point = ", ".join(f"{value:.2f}" for value in np.round(np.add(setup.tool_point, move), 2) + 0.0)
            yield (
                f"the readings of setup {part.id} fit tool_point_mm = [{point}], with {remaining:.2g} mm left where "
                f"the stated one leaves {as_stated:.2g} mm; write it, or state how well it is known as "
                "tool_point_standard_uncertainty_mm, and it is solved for"
            )


def _travel_in_words(travel: Array, read: Array) -> str | None:
    """What readings (n,) mm of a travel (n,) mm are instead; None where they are it."""
    size, change = float(np.ptp(travel)), float(np.ptp(read))
    if size < LEAST_TRAVEL:
        if change < LEAST_TRAVEL:
            return None
        return f"a travel of {change:.3g} mm where its tool point moves {size:.2g} mm along `direction`"
    slope = float(travel @ read / (travel @ travel))
    if abs(slope - 1.0) < SAME_TRAVEL:
        return None
    for factor, what in OTHER_TRAVELS:
        if abs(slope / factor - 1.0) < SAME_TRAVEL:
            return f"its travel {what}"
    if abs(slope) < 0.1 * SAME_TRAVEL:
        return "no travel: the whole travel is read, not its error (add the position along `direction`)"
    return f"{slope:.3g} times its travel along `direction`"


def displaced_work_points(parts: Iterable[Part], unknowns: Iterable[Array]) -> Iterator[Displaced]:
    """Stated work points that the unknowns (q,) of a run, in the order of ``parts``, put elsewhere."""
    for part, values in zip(parts, unknowns, strict=True):
        if isinstance(part.reading, AtWorkPoint) and _is_sought(part.reading) and len(part.rows):
            # Across the plane of a bar's swing the unknown goes where it likes, and the point stays.
            work, _ = part.ends(np.tile(values, (len(part.rows), 1)))
            distance = float(np.linalg.norm(work[0] - part.reading.setup.work_point))
            if distance > STATED_WITHIN:
                yield Displaced(part.id, distance)


def _puts_work_points_elsewhere(parts: Sequence[Part], unknowns: Sequence[Array]) -> bool:
    """Whether a fit puts a work point of a vector elsewhere than stated in a run, or where nothing states one."""
    for part, values in zip(parts, unknowns, strict=True):
        if isinstance(part.reading, VectorReading) and not part.reading.holds("work_point"):
            off = np.linalg.norm(values[:, :3] - part.reading.setup.work_point, axis=1)
            if not any(part.reading.setup.work_point) or off.max(initial=0.0) > STATED_WITHIN:
                return True
    return False


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
    return float(np.median(np.linalg.norm(nominal(part, scale), axis=1)))
