"""Draws the volumetric error in three slices through the workspace, as SVG in greys: for certificates and reports.

Areas and lines only: a picture that the reader smooths (``/Interpolate``) has no place in PDF/A (ISO 19005-3:2012,
6.2.8). The command line draws the same with colours (``figures.volumetric``).
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
    readings_mm: npt.ArrayLike, vectors_um: npt.ArrayLike, expanded_um: npt.ArrayLike, names: Sequence[str]
) -> tuple[Slice, ...]:
    """Return the three middle slices of a regular grid of points (n, 3) of three axes, across the third axis first.

    ``vectors_um`` (n, 3) is the error along the machine's X, Y and Z, ``expanded_um`` (n,) the expanded uncertainty of
    its length. Raises DataError where the shapes do not fit or the points are no grid.
    """
    positions = np.asarray(readings_mm, dtype=np.float64)
    vectors = np.asarray(vectors_um, dtype=np.float64)
    expanded = np.asarray(expanded_um, dtype=np.float64)
    levels = [np.unique(np.round(positions[:, axis], 6)) for axis in range(3)] if positions.ndim == 2 else []
    shape = tuple(len(level) for level in levels)
    if positions.shape != vectors.shape or expanded.shape != (len(positions),) or len(names) != 3:
        raise DataError(
            f"a map needs points and vectors (n, 3), n uncertainties and 3 names, not {positions.shape}, "
            f"{vectors.shape}, {expanded.shape} and {len(names)}"
        )
    if int(np.prod(shape)) != len(positions) or min(shape) < 2:
        raise DataError(f"{len(positions)} points are no grid of {shape[0]} x {shape[1]} x {shape[2]}")
    order = np.lexsort((positions[:, 2], positions[:, 1], positions[:, 0]))
    cube = vectors[order].reshape(*shape, 3)
    spread = expanded[order].reshape(shape)
    slices = []
    for across in (2, 1, 0):
        first, second = (axis for axis in range(3) if axis != across)
        middle = len(levels[across]) // 2
        part = np.take(cube, middle, axis=across)
        slices.append(
            Slice(
                names[across], float(levels[across][middle]) + 0.0, (names[first], names[second]),
                tuple(map(float, levels[first])), tuple(map(float, levels[second])),
                _nodes(part[..., first]), _nodes(part[..., second]), _nodes(np.linalg.norm(part, axis=-1)),
                _nodes(np.take(spread, middle, axis=across)),
            )
        )  # fmt: skip
    return tuple(slices)


def _nodes(values: Array) -> Nodes:
    """Round to a tenth of a nanometre, for pictures."""
    return tuple(tuple(round(float(value), 4) + 0.0 for value in row) for row in values)


def map_drawing(slices: Sequence[Slice], *, title: str, scale_words: str, sign: str = ".") -> Drawing:
    """Draw the slices side by side with the scale of their greys, which ``scale_words`` names."""
    frames = [_frame(part, 104.0 + index * (_SIDE + 112.0)) for index, part in enumerate(slices)]
    most = max(frame.high for frame in frames)
    on = Drawing(PAGE_WIDTH_MM, (_TOP + most + _BELOW) / SCALE, title)
    longest = max(max(map(max, part.lengths_um)) for part in slices)
    steps = nice_ticks(0.0, longest if longest > 0.0 else 1.0, _STEPS - 1)
    edges = [*steps, steps[-1] + (steps[1] - steps[0])] if steps[-1] < longest or len(steps) < 2 else steps
    for part, frame in zip(slices, frames, strict=True):
        _slice(on, part, frame, longest, edges, sign)
    _scale(on, edges, scale_words, sign, most)
    return on


@dataclass(frozen=True)
class _Frame:
    """The frame of a slice in tenths of a millimetre; ``unit`` of these a mm of the machine, cells in mm."""

    x0: float
    wide: float
    high: float
    unit: float
    cell: tuple[float, float]


def _frame(part: Slice, start: float) -> _Frame:
    """Return the frame of a slice: both axes to one scale, half a cell around the outer nodes."""
    cell = float(np.diff(part.first_mm).min()), float(np.diff(part.second_mm).min())
    spans = float(np.ptp(part.first_mm)) + cell[0], float(np.ptp(part.second_mm)) + cell[1]
    unit = _SIDE / max(spans)
    wide, high = spans[0] * unit, spans[1] * unit
    return _Frame(start + (_SIDE - wide) / 2.0, wide, high, unit, cell)


def _grey(step: int, steps: int) -> str:
    level = round(255 - (255 - _DARKEST) * step / max(1, steps - 1))
    return f"#{level:02x}{level:02x}{level:02x}"


def _slice(on: Drawing, part: Slice, frame: _Frame, longest: float, edges: list[float], sign: str) -> None:
    first, second = np.array(part.first_mm), np.array(part.second_mm)
    x0, wide, high, unit, cell = frame.x0, frame.wide, frame.high, frame.unit, frame.cell
    top = _TOP

    def x(value: float) -> float:
        return x0 + (value - float(first[0]) + cell[0] / 2.0) * unit

    def y(value: float) -> float:
        return top + high - (value - float(second[0]) + cell[1] / 2.0) * unit

    cells: dict[int, list[str]] = {}
    shafts, heads = [], []
    magnify = _LONGEST * min(cell) * unit / longest if longest > 0.0 else 0.0
    for i, at in enumerate(first):
        for j, up in enumerate(second):
            step = int(
                np.clip(np.searchsorted(edges, part.lengths_um[i][j], side="right") - 1, 0, len(edges) - 2)
            )
            cells.setdefault(step, []).append(
                f"M{x(at) - cell[0] * unit / 2:.1f} {y(up) - cell[1] * unit / 2:.1f}"
                f"h{cell[0] * unit:.1f}v{cell[1] * unit:.1f}h{-cell[0] * unit:.1f}z"
            )
            across, along = part.first_um[i][j] * magnify, part.second_um[i][j] * magnify
            x1, y1 = x(at), y(up)
            x2, y2 = x1 + across, y1 - along
            shafts.append(f"M{x1:.1f} {y1:.1f}L{x2:.1f} {y2:.1f}")
            heads.append(arrow_head(x1, y1, x2, y2, _HEAD))
    for step, marks in sorted(cells.items()):
        on.path("".join(marks), fill=_grey(step, len(edges) - 1))
    on.path(f"M{x0:.1f} {top:.1f}h{wide:.1f}v{high:.1f}h{-wide:.1f}z", stroke=MID, width=2.0)
    on.dots("".join(shaft.split("L")[0] + "h0" for shaft in shafts), INK, 6.0)
    on.path("".join(shafts), stroke=INK, width=2.8)
    on.path("".join(heads), fill=INK)
    written: list[tuple[float, float, float]] = []
    for i in np.unique(np.linspace(0, len(first) - 1, _NUMBERS).astype(int)):
        for j in np.unique(np.linspace(0, len(second) - 1, _NUMBERS).astype(int)):
            label = f"±{part.expanded_um[i][j]:.1f}".replace(".", sign)
            # Away from the arrow: below a node where it points up, else above.
            below = part.second_um[i][j] >= 0.0
            at_x, at_y = x(first[i]), y(second[j]) + (10.0 + LETTER if below else -13.0)
            at_y = max(min(at_y, top + high - 5.0), top + LETTER)
            room = 0.58 * LETTER * len(label)
            # A narrow slice has no room for all of them.
            if any(
                abs(at_x - other_x) < (room + other_room) / 2 and abs(at_y - other_y) < 0.9 * LETTER
                for other_x, other_y, other_room in written
            ):
                continue
            written.append((at_x, at_y, room))
            on.path(
                f"M{at_x - room / 2:.1f} {at_y + 3:.1f}h{room:.1f}v{-0.95 * LETTER:.1f}h{-room:.1f}z",
                fill="white",
            )
            on.text(at_x, at_y, label, anchor="middle")
    on.text(x0, top - 10.0, f"{part.across} = {tick_words(round(part.at_mm), sign)} mm", bold=True)
    for value in nice_ticks(float(first[0]), float(first[-1]), max(1, min(4, int(wide / 90.0)))):
        on.line(x(value), top + high, x(value), top + high + 8.0, MID, 2.0)
        on.text(x(value), top + high + 12.0 + LETTER, tick_words(value, sign), anchor="middle")
    for value in nice_ticks(float(second[0]), float(second[-1]), max(1, min(4, int(high / (2.0 * LETTER))))):
        on.line(x0 - 8.0, y(value), x0, y(value), MID, 2.0)
        on.text(x0 - 12.0, y(value) + 0.36 * LETTER, tick_words(value, sign), anchor="end")
    on.text(x0 + wide / 2, top + high + 16.0 + 2.1 * LETTER, f"{part.along[0]} / mm", anchor="middle")
    on.text(x0 - 76.0, top + high / 2, f"{part.along[1]} / mm", anchor="middle", turned=True)


def _scale(on: Drawing, edges: list[float], name: str, sign: str, high: float) -> None:
    """Draw the greys and the lengths that they stand for, at the right edge."""
    x0, wide = PAGE_WIDTH_MM * SCALE - 96.0, 26.0
    steps = len(edges) - 1
    for step in range(steps):
        y = _TOP + high * (steps - 1 - step) / steps
        on.path(
            f"M{x0:g} {y:.1f}h{wide:g}v{high / steps:.1f}h{-wide:g}z",
            fill=_grey(step, steps),
            stroke=MID,
            width=1.2,
        )
    for index, edge in enumerate(edges):
        y = _TOP + high * (steps - index) / steps
        on.text(x0 + wide + 7.0, y + 0.36 * LETTER, tick_words(edge, sign))
    on.text(PAGE_WIDTH_MM * SCALE, _TOP - 24.0, name, anchor="end")
