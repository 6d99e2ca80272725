"""The volumetric error in three slices through the workspace, as SVG in greys: for certificates and health reports.

Areas and lines only: a picture that the reader smooths (``/Interpolate``) has no place in PDF/A (ISO 19005-3:2012,
6.2.8). The command line draws the same with colours (``figures_volumetric``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.palette import INK, MID, PAGE_WIDTH_MM
from monitor.reporting.svg.plot import LETTER, SCALE, Drawing, arrow_head, nice_ticks, tick_words

#: Steps of grey at most, and the darkest (0 black, 255 white), light enough for the arrows to stay visible.
_STEPS, _DARKEST = 7, 138
#: Numbers are written at so many nodes of each side of a slice.
_NUMBERS = 3
#: The longer side of a slice, the room above and below all of them, a head of an arrow, in tenths of a millimetre.
_SIDE, _TOP, _BELOW, _HEAD = 420.0, 48.0, 72.0, 8.0
#: The longest arrow as a part of a cell.
_LONGEST = 0.62


Nodes = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Slice:
    """One slice across the axis ``across`` at a reading ``at_mm``: nodes (n, m), row by row of the first axis.

    ``first_mm`` (n,) and ``second_mm`` (m,) are readings of the axes ``along``; ``first_um`` and ``second_um`` the
    parts of the error along these, ``lengths_um`` its whole length, ``expanded_um`` the expanded uncertainty of that.
    """

    across: str
    at_mm: float
    along: tuple[str, str]
    first_mm: tuple[float, ...]
    second_mm: tuple[float, ...]
    first_um: Nodes
    second_um: Nodes
    lengths_um: Nodes
    expanded_um: Nodes


def slices_of(
    readings_mm: npt.ArrayLike,
    vectors_um: npt.ArrayLike,
    expanded_um: npt.ArrayLike,
    names: Sequence[str],
) -> tuple[Slice, ...]:
    """The three middle slices of a regular grid of points (n, 3) of three axes, across the third axis first.

    ``vectors_um`` (n, 3) is the error along the machine's X, Y and Z, ``expanded_um`` (n,) the expanded uncertainty of
    its length. Raises DataError where the shapes do not fit or the points are no grid.
    """
    places = np.asarray(readings_mm, dtype=np.float64)
    vectors = np.asarray(vectors_um, dtype=np.float64)
    expanded = np.asarray(expanded_um, dtype=np.float64)
    levels = [np.unique(np.round(places[:, axis], 6)) for axis in range(3)] if places.ndim == 2 else []
    shape = tuple(len(level) for level in levels)
    if places.shape != vectors.shape or expanded.shape != (len(places),) or len(names) != 3:
        raise DataError(
            f"a map needs points and vectors (n, 3), n uncertainties and 3 names, not {places.shape}, "
            f"{vectors.shape}, {expanded.shape} and {len(names)}"
        )
    if int(np.prod(shape)) != len(places) or min(shape) < 2:
        raise DataError(f"{len(places)} points are no grid of {shape[0]} x {shape[1]} x {shape[2]}")
    order = np.lexsort((places[:, 2], places[:, 1], places[:, 0]))
    cube = vectors[order].reshape(*shape, 3)
    spread = expanded[order].reshape(shape)
    found = []
    for across in (2, 1, 0):
        one, two = (axis for axis in range(3) if axis != across)
        middle = len(levels[across]) // 2
        part = np.take(cube, middle, axis=across)
        found.append(
            Slice(
                names[across], float(levels[across][middle]) + 0.0, (names[one], names[two]),
                tuple(map(float, levels[one])), tuple(map(float, levels[two])),
                _nodes(part[..., one]), _nodes(part[..., two]), _nodes(np.linalg.norm(part, axis=-1)),
                _nodes(np.take(spread, middle, axis=across)),
            )
        )  # fmt: skip
    return tuple(found)


def _nodes(values: Array) -> Nodes:
    """To a tenth of a nanometre: for pictures."""
    return tuple(tuple(round(float(value), 4) + 0.0 for value in row) for row in values)


def map_drawing(slices: Sequence[Slice], *, title: str, scale_words: str, sign: str = ".") -> Drawing:
    """The slices side by side with the scale of their greys, named ``scale_words``; ``title`` says what is seen."""
    frames = [_frame(one, 104.0 + place * (_SIDE + 112.0)) for place, one in enumerate(slices)]
    most = max(frame.high for frame in frames)
    on = Drawing(PAGE_WIDTH_MM, (_TOP + most + _BELOW) / SCALE, title)
    longest = max(max(map(max, one.lengths_um)) for one in slices)
    steps = nice_ticks(0.0, longest if longest > 0.0 else 1.0, _STEPS - 1)
    edges = [*steps, steps[-1] + (steps[1] - steps[0])] if steps[-1] < longest or len(steps) < 2 else steps
    for one, frame in zip(slices, frames, strict=True):
        _slice(on, one, frame, longest, edges, sign)
    _scale(on, edges, scale_words, sign, most)
    return on


@dataclass(frozen=True)
class _Frame:
    """Where a slice stands, in tenths of a millimetre; ``unit`` of these a mm of the machine, cells in mm."""

    left: float
    wide: float
    high: float
    unit: float
    cell: tuple[float, float]


def _frame(one: Slice, left: float) -> _Frame:
    """Both axes to one scale, half a cell around the outer nodes."""
    cell = float(np.diff(one.first_mm).min()), float(np.diff(one.second_mm).min())
    spans = float(np.ptp(one.first_mm)) + cell[0], float(np.ptp(one.second_mm)) + cell[1]
    unit = _SIDE / max(spans)
    wide, high = spans[0] * unit, spans[1] * unit
    return _Frame(left + (_SIDE - wide) / 2.0, wide, high, unit, cell)


def _grey(step: int, steps: int) -> str:
    level = round(255 - (255 - _DARKEST) * step / max(1, steps - 1))
    return f"#{level:02x}{level:02x}{level:02x}"


def _slice(on: Drawing, one: Slice, frame: _Frame, longest: float, edges: list[float], sign: str) -> None:
    first, second = np.array(one.first_mm), np.array(one.second_mm)
    left, wide, high, unit, cell = frame.left, frame.wide, frame.high, frame.unit, frame.cell
    top = _TOP

    def x(value: float) -> float:
        return left + (value - float(first[0]) + cell[0] / 2.0) * unit

    def y(value: float) -> float:
        return top + high - (value - float(second[0]) + cell[1] / 2.0) * unit

    cells: dict[int, list[str]] = {}
    shafts, heads = [], []
    magnify = _LONGEST * min(cell) * unit / longest if longest > 0.0 else 0.0
    for i, at in enumerate(first):
        for j, up in enumerate(second):
            step = int(
                np.clip(np.searchsorted(edges, one.lengths_um[i][j], side="right") - 1, 0, len(edges) - 2)
            )
            cells.setdefault(step, []).append(
                f"M{x(at) - cell[0] * unit / 2:.1f} {y(up) - cell[1] * unit / 2:.1f}"
                f"h{cell[0] * unit:.1f}v{cell[1] * unit:.1f}h{-cell[0] * unit:.1f}z"
            )
            across, along = one.first_um[i][j] * magnify, one.second_um[i][j] * magnify
            x1, y1 = x(at), y(up)
            x2, y2 = x1 + across, y1 - along
            shafts.append(f"M{x1:.1f} {y1:.1f}L{x2:.1f} {y2:.1f}")
            heads.append(arrow_head(x1, y1, x2, y2, _HEAD))
    for step, marks in sorted(cells.items()):
        on.path("".join(marks), fill=_grey(step, len(edges) - 1))
    on.path(f"M{left:.1f} {top:.1f}h{wide:.1f}v{high:.1f}h{-wide:.1f}z", stroke=MID, width=2.0)
    on.dots("".join(shaft.split("L")[0] + "h0" for shaft in shafts), INK, 6.0)
    on.path("".join(shafts), stroke=INK, width=2.8)
    on.path("".join(heads), fill=INK)
    for i in np.unique(np.linspace(0, len(first) - 1, _NUMBERS).astype(int)):
        for j in np.unique(np.linspace(0, len(second) - 1, _NUMBERS).astype(int)):
            words = f"±{one.expanded_um[i][j]:.1f}".replace(".", sign)
            # Away from the arrow: below a node where it points up, else above.
            below = one.second_um[i][j] >= 0.0
            at_x, at_y = x(first[i]), y(second[j]) + (10.0 + LETTER if below else -13.0)
            at_y = max(min(at_y, top + high - 5.0), top + LETTER)
            room = 0.58 * LETTER * len(words)
            on.path(
                f"M{at_x - room / 2:.1f} {at_y + 3:.1f}h{room:.1f}v{-0.95 * LETTER:.1f}h{-room:.1f}z",
                fill="white",
            )
            on.text(at_x, at_y, words, anchor="middle")
    on.text(left, top - 10.0, f"{one.across} = {tick_words(round(one.at_mm), sign)} mm", bold=True)
    for value in nice_ticks(float(first[0]), float(first[-1]), 4):
        on.line(x(value), top + high, x(value), top + high + 8.0, MID, 2.0)
        on.text(x(value), top + high + 12.0 + LETTER, tick_words(value, sign), anchor="middle")
    for value in nice_ticks(float(second[0]), float(second[-1]), 4):
        on.line(left - 8.0, y(value), left, y(value), MID, 2.0)
        on.text(left - 12.0, y(value) + 0.36 * LETTER, tick_words(value, sign), anchor="end")
    on.text(left + wide / 2, top + high + 16.0 + 2.1 * LETTER, f"{one.along[0]} / mm", anchor="middle")
    on.text(left - 76.0, top + high / 2, f"{one.along[1]} / mm", anchor="middle", turned=True)


def _scale(on: Drawing, edges: list[float], words: str, sign: str, high: float) -> None:
    """The greys and the lengths that they stand for, at the right edge."""
    left, wide = PAGE_WIDTH_MM * SCALE - 96.0, 26.0
    steps = len(edges) - 1
    for step in range(steps):
        y = _TOP + high * (steps - 1 - step) / steps
        on.path(
            f"M{left:g} {y:.1f}h{wide:g}v{high / steps:.1f}h{-wide:g}z",
            fill=_grey(step, steps),
            stroke=MID,
            width=1.2,
        )
    for place, edge in enumerate(edges):
        y = _TOP + high * (steps - place) / steps
        on.text(left + wide + 7.0, y + 0.36 * LETTER, tick_words(edge, sign))
    on.text(PAGE_WIDTH_MM * SCALE, _TOP - 24.0, words, anchor="end")
