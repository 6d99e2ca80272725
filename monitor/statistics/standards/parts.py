"""Form, orientation and place of the elements of a part that a machine cut, from points measured on it.

What ISO 10791-7 and NAS 979 ask of their test parts: straightness of sides, their perpendicularity, parallelism or
angularity to the first side, circularity and concentricity, the place of bores, and of a cone frustum its circles and
its half apex angle. No text of either was at hand; widths of zones are those of ISO 1101, forms those of least squares
and of minimum zones (ISO/TS 12180 to 12780). The size of an element is not looked at: it is the tool's.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from monitor.records import Array
from monitor.statistics.standards.circles import minimum_zone

#: Draws for the uncertainties: the standard deviation of so many is known to 4 %.
DRAWS = 400
#: Nominal centres, heights and radii within so much agree, mm; nominal directions within so much, rad.
SAME, SAME_DIRECTION = 0.01, 1e-3


class FormKind(StrEnum):
    """What a figure of a part says."""

    STRAIGHTNESS = "straightness"
    STRAIGHTNESS_ZONE = "straightness_zone"
    PERPENDICULARITY = "perpendicularity"
    PARALLELISM = "parallelism"
    ANGULARITY = "angularity"
    CIRCULARITY = "circularity"
    CIRCULARITY_ZONE = "circularity_zone"
    CONCENTRICITY = "concentricity"
    POSITION = "position"
    HALF_ANGLE = "half_angle"
    PROFILE = "profile"
    PROFILE_ZONE = "profile_zone"
    FLATNESS = "flatness"
    FLATNESS_ZONE = "flatness_zone"


#: What another unit of length changes: the others are of one size, or compare directions.
FROM_SCALE = frozenset({FormKind.POSITION, FormKind.PROFILE, FormKind.PROFILE_ZONE})


@dataclass(frozen=True)
class Element:
    """A line or circle (``is_circle``): points ``measured`` (n, 3) and programmed (n, 3) mm in one frame.

    ``centre`` and ``normal`` (3,) are those of the programmed circle, of a line its middle and direction. Circles
    ``of_cone`` were cut while the tool turned: those around one axis are a cone frustum.
    """

    name: str
    is_circle: bool
    measured: Array
    nominal: Array
    centre: Array
    normal: Array
    radius: float
    of_cone: bool = False


@dataclass(frozen=True)
class FormFigure:
    """A figure of ``element``, against ``datum`` where it needs one: ``value`` and ``u`` in mm, or in rad of the half
    apex angle, whose value is the deviation from the programmed one."""

    kind: FormKind
    element: str
    datum: str
    value: float
    u: float


def part_figures(
    elements: Sequence[Element], *, u_reading: float, u_scale: float = 0.0, rng: np.random.Generator
) -> tuple[FormFigure, ...]:
    """Every figure of the elements of one part, in their order.

    ``u_reading`` mm is the standard uncertainty of one coordinate, ``u_scale`` that of the unit of length; u is the
    standard deviation of a figure over parts measured again. Widths grow with noise, and u does not correct that.
    """
    if not elements:
        return ()
    plane = _plane(elements)
    elements = _levelled(elements, plane)
    values = list(_figures(elements, [each.measured for each in elements], plane))
    again = (_measured_again(elements, u_reading, u_scale * rng.standard_normal(), rng) for _ in range(DRAWS))
    draws = np.array([[value for *_, value in _figures(elements, points, plane)] for points in again])
    figures = [
        FormFigure(kind, element, datum, value, float(u))
        for (kind, element, datum, value), u in zip(values, draws.std(axis=0), strict=True)
    ]
    return tuple(_with_zones(elements, figures, plane))


def _measured_again(
    elements: Sequence[Element], u_reading: float, off: float, rng: np.random.Generator
) -> list[Array]:
    """The points (n, 3) of the elements with new noise, in a unit of length that is ``off`` in proportion."""
    middle = np.concatenate([each.measured for each in elements]).mean(axis=0)
    return [
        each.measured + off * (each.measured - middle) + u_reading * rng.standard_normal(each.measured.shape)
        for each in elements
    ]


def _plane(elements: Sequence[Element]) -> Array:
    """The normal (3,) of the part: that of its first circle, else of its lines, else the third direction."""
    for element in elements:
        if element.is_circle:
            return element.normal
    lines = [element.normal for element in elements]
    for first in lines:
        across = np.cross(lines[0], first)
        if np.linalg.norm(across) > SAME_DIRECTION:
            return np.asarray(across / np.linalg.norm(across))
    third = np.array([0.0, 0.0, 1.0])
    if abs(third @ lines[0]) > 0.5:
        third = np.array([1.0, 0.0, 0.0])
    third = third - (third @ lines[0]) * lines[0]
    return np.asarray(third / np.linalg.norm(third))


def _levelled(elements: Sequence[Element], plane: Array) -> list[Element]:
    """The elements with what was measured turned until the part lies level: how heights change along the plane."""
    nominal = np.concatenate([element.nominal for element in elements])
    too_high = (np.concatenate([element.measured for element in elements]) - nominal) @ plane
    middle = nominal.mean(axis=0)
    off = nominal - middle
    flat = off - np.outer(off @ plane, plane)
    slope = np.linalg.lstsq(np.column_stack([flat, np.ones(len(flat))]), too_high, rcond=1e-6)[0][:3]
    # A turn t lifts a point by n . (t x p): a part that rises by slope . p is turned by slope x n.
    turn = np.cross(slope, plane)
    return [
        replace(element, measured=element.measured - np.cross(turn, element.nominal - middle))
        for element in elements
    ]


def _figures(
    elements: Sequence[Element], measured: Sequence[Array], plane: Array
) -> Iterator[tuple[FormKind, str, str, float]]:
    """Kind, element, datum and value of every figure of points (n, 3) that were measured."""
    datum: tuple[Element, float] | None = None
    for element, points in zip(elements, measured, strict=True):
        if element.is_circle:
            continue
        along, across = _line_of(element, points, plane)
        slope = float(np.polyfit(along, across, 1)[0])
        yield FormKind.STRAIGHTNESS, element.name, "", float(np.ptp(across - slope * along))
        if datum is None:
            datum = element, slope
            continue
        # The part is turned until the datum lies as programmed: what is left of the slope is the element's.
        yield (
            _orientation(element, datum[0]),
            element.name,
            datum[0].name,
            float(np.ptp(across - datum[1] * along)),
        )
    yield from _of_circles(elements, measured, datum, plane)


def _line_of(element: Element, points: Array, plane: Array) -> tuple[Array, Array]:
    """The place (n,) of points along a line and across it in the plane of the part."""
    across = np.cross(plane, element.normal)
    across /= np.linalg.norm(across)
    off = points - element.centre
    return np.asarray(off @ element.normal), np.asarray(off @ across)


def _orientation(element: Element, datum: Element) -> FormKind:
    cosine = abs(float(element.normal @ datum.normal))
    if cosine < SAME_DIRECTION:
        return FormKind.PERPENDICULARITY
    return FormKind.PARALLELISM if cosine > 1.0 - 0.5 * SAME_DIRECTION**2 else FormKind.ANGULARITY


@dataclass(frozen=True)
class _Circle:
    """A circle as measured: what its centre (3,) is off the programmed one, its radius, and deviations (n,) from it."""

    element: Element
    off: Array
    radius: float
    deviation: Array


def _of_circles(
    elements: Sequence[Element], measured: Sequence[Array], datum: tuple[Element, float] | None, plane: Array
) -> Iterator[tuple[FormKind, str, str, float]]:
    circles = [
        _circle_of(element, points, _taper(element, elements))
        for element, points in zip(elements, measured, strict=True)
        if element.is_circle
    ]
    for circle in circles:
        yield FormKind.CIRCULARITY, circle.element.name, "", float(np.ptp(circle.deviation))
    for circle in circles[1:]:
        first = circles[0]
        apart = circle.element.centre - first.element.centre
        off = circle.off - first.off
        if _coaxial(circle.element, first.element):
            off = off - (off @ first.element.normal) * first.element.normal
            yield (
                FormKind.CONCENTRICITY, circle.element.name, first.element.name, float(2.0 * np.linalg.norm(off)),
            )  # fmt: skip
        elif datum is not None:
            # A part that lies turned by the datum's slope has its bores turned too.
            off = off - datum[1] * np.cross(plane, apart)
            off = off - (off @ plane) * plane
            yield FormKind.POSITION, circle.element.name, datum[0].name, float(2.0 * np.linalg.norm(off))
    for first, last in _cones(circles):
        height = float((last.element.centre - first.element.centre) @ first.element.normal)
        nominal = np.arctan2(last.element.radius - first.element.radius, height)
        angle = np.arctan2(last.radius - first.radius, height)
        yield (
            FormKind.HALF_ANGLE, last.element.name, first.element.name, float(np.sign(nominal) * (angle - nominal)),
        )  # fmt: skip


def _coaxial(element: Element, other: Element) -> bool:
    apart = element.centre - other.centre
    across = apart - (apart @ other.normal) * other.normal
    parallel = abs(float(element.normal @ other.normal)) > 1.0 - 0.5 * SAME_DIRECTION**2
    return parallel and float(np.linalg.norm(across)) < SAME


def _taper(element: Element, elements: Sequence[Element]) -> float:
    """How the radius of a cone grows along the normal of one of its circles; 0 of a circle by itself."""
    for other in elements:
        if element.of_cone and other.of_cone and other is not element and _coaxial(other, element):
            height = float((other.centre - element.centre) @ element.normal)
            if abs(height) > SAME and abs(other.radius - element.radius) > SAME:
                return (other.radius - element.radius) / height
    return 0.0


def _circle_of(element: Element, points: Array, taper: float) -> _Circle:
    """The least-squares circle in the programmed plane; what a point of a cone lies too high, its radius is taken back
    by. The centre is first that of |p|^2 = 2 p.c + const, so that the limacon about it is exact to second order."""
    first = element.nominal[0] - element.centre
    first = first / np.linalg.norm(first)
    second = np.cross(element.normal, first)
    off = points - element.centre
    flat = off @ np.column_stack([first, second])
    too_high = (points - element.nominal) @ element.normal
    columns = np.column_stack([2.0 * flat, np.ones(len(flat))])
    centre = np.linalg.lstsq(columns, np.sum(flat**2, axis=1), rcond=None)[0][:2]
    about = flat - centre
    angle = np.arctan2(about[:, 1], about[:, 0])
    length = np.linalg.norm(about, axis=1) - taper * too_high
    limacon = np.column_stack([np.ones(len(angle)), np.cos(angle), np.sin(angle)])
    solved = np.linalg.lstsq(limacon, length, rcond=None)[0]
    centre = centre + solved[1:]
    return _Circle(
        element,
        centre[0] * first + centre[1] * second,
        float(solved[0]),
        np.asarray(length - limacon @ solved),
    )


def _cones(circles: Sequence[_Circle]) -> Iterator[tuple[_Circle, _Circle]]:
    """Of every cone its first circle and the one that is furthest from it."""
    taken: set[str] = set()
    for first in circles:
        if first.element.name in taken or not _taper(first.element, [each.element for each in circles]):
            continue
        mine = [
            each
            for each in circles
            if each is not first and each.element.of_cone and _coaxial(each.element, first.element)
        ]
        taken |= {each.element.name for each in mine}
        # Along their common axis the one that is furthest away is that whose centre is.
        yield first, max(mine, key=lambda each: _distance(each, first))


def _distance(circle: _Circle, other: _Circle) -> float:
    return float(np.linalg.norm(circle.element.centre - other.element.centre))


def _with_zones(
    elements: Sequence[Element], figures: Sequence[FormFigure], plane: Array
) -> Iterator[FormFigure]:
    """The figures, every form followed by its minimum zone, whose u is that of the least-squares form."""
    of = {element.name: element for element in elements}
    for figure in figures:
        yield figure
        element = of[figure.element]
        if figure.kind is FormKind.STRAIGHTNESS:
            along, across = _line_of(element, element.measured, plane)
            scale = np.abs(along - along.mean()).max()
            columns = np.column_stack([np.ones(len(along)), (along - along.mean()) / scale])
            kind, width = FormKind.STRAIGHTNESS_ZONE, minimum_zone(columns, across - across.mean())
        elif figure.kind is FormKind.CIRCULARITY:
            circle = _circle_of(element, element.measured, _taper(element, elements))
            kind, width = FormKind.CIRCULARITY_ZONE, minimum_zone(_columns_of(element), circle.deviation)
        else:
            continue
        yield FormFigure(kind, figure.element, "", width, figure.u)


@dataclass(frozen=True)
class Form:
    """What a plot shows of an element: places (n, 2) mm in the part's plane, the directions (n, 2) across it, and the
    deviations (n,) mm from its least-squares form."""

    name: str
    places: Array
    across: Array
    deviation: Array


def plan_of(elements: Sequence[Element], axis: Array) -> Array:
    """Two directions (3, 2) in the plane of a part; across ``axis`` (3,) where it has no elements."""
    plane = _plane(elements) if elements else axis
    first = np.eye(3)[int(np.abs(plane).argmin())]
    first = first - (first @ plane) * plane
    first = first / np.linalg.norm(first)
    return np.column_stack([first, np.cross(plane, first)])


def forms(elements: Sequence[Element], flat: Array) -> tuple[Form, ...]:
    """The forms of the elements of one part, in their order, seen along two directions (3, 2)."""
    if not elements:
        return ()
    plane = _plane(elements)
    elements = _levelled(elements, plane)
    drawn = []
    for element in elements:
        if element.is_circle:
            off = element.nominal - element.centre
            out = off / np.linalg.norm(off, axis=1)[:, None]
            deviation = _circle_of(element, element.measured, _taper(element, elements)).deviation
        else:
            along, across = _line_of(element, element.measured, plane)
            side = np.cross(plane, element.normal)
            out = np.tile(side / np.linalg.norm(side), (len(along), 1))
            deviation = across - np.polyval(np.polyfit(along, across, 1), along)
        drawn.append(Form(element.name, element.nominal @ flat, out @ flat, np.asarray(deviation)))
    return tuple(drawn)


def _columns_of(element: Element) -> Array:
    """Columns (n, 3) of a limacon at the programmed angles of a circle."""
    first = element.nominal[0] - element.centre
    second = np.cross(element.normal, first)
    off = element.nominal - element.centre
    angle = np.arctan2(off @ second, off @ first)
    return np.column_stack([np.ones(len(angle)), np.cos(angle), np.sin(angle)])
