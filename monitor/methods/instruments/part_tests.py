"""Which setups measure a part that the machine cut (ISO 10791-7, NAS 979), and its elements.

A ``point`` whose targets are ``known`` is cut by one tool at places that the axes say; its targets name the elements of
the part (the sides of a square, a bore, the circles of a cone frustum). An element is a line or a circle where the
programmed path is one. The tool's radius moves lines in parallel and circles to another radius, so neither matters. Any
other path is a profile or a face: there the axis of the tool counts, which is ``tool_direction`` of the setup, else the
direction of its ``tool_point_mm``, else Z.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.machine import orientation
from monitor.methods.instruments.frames import seen_points
from monitor.methods.instruments.part import Part, exact_scale_of
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.readings.point import Point
from monitor.methods.standard_test import PartFeature, PartPath, PartTest
from monitor.records import Array

#: A programmed path that keeps to a line or circle within so much is one, mm: positions are written to 0.1 µm or 1 µm.
ON_PATH = 5e-3
#: Points of a line and of a circle below which nothing of its form shows.
FEWEST_OF_LINE, FEWEST_OF_CIRCLE = 4, 6
#: Of a path of any form seven numbers are found: where the part lies, and the radius of the cutter.
FEWEST_OF_PATH = 14
NEEDED = (FEWEST_OF_LINE, FEWEST_OF_CIRCLE, FEWEST_OF_PATH)
#: A circle is measured around by half a turn at least.
SHORTEST_ARC = np.pi
#: A rotary axis that moves by more than this turns, rad.
TURNS = 1e-6


@dataclass(frozen=True)
class _Shape:
    """A programmed path: ``centre`` and ``normal`` (3,) and ``radius`` of a circle, of a line its middle, its direction
    and 0."""

    kind: str
    centre: Array
    normal: Array
    radius: float


def part_tests(problem: InstrumentProblem) -> Iterator[PartTest]:
    """Every part that a setup measured, one a run, that has a line, a circle or another path."""
    for part in problem.parts:
        if not isinstance(part.reading, Point) or not part.reading.holds("targets"):
            continue
        for index in np.unique(part.rows.run):
            mine = np.flatnonzero(part.rows.run == index)
            features, paths, short = _elements(_cut(part, mine))
            # Points with names of their own are no paths: a part of them alone is none of this test.
            if features or paths or max(short.values(), default=0) >= FEWEST_OF_LINE:
                u = float(np.sqrt(np.mean(problem.sigma[part.at[mine], 0] ** 2)))
                yield PartTest(
                    part.id, int(problem.runs[index]), features, paths, u, part.scale or 0.0,
                    exact_scale_of(part.reading.setup), short, NEEDED,
                )  # fmt: skip


@dataclass(frozen=True)
class _Cut:
    """Rows (m,) of a part: ``nominal`` and ``measured`` (m, 3) mm and the tool's ``axes`` (m, 3) in the instrument's
    frame, their ``targets``, and whether rotary axes moved, by ``turned`` (m, r) rad."""

    nominal: Array
    measured: Array
    axes: Array
    targets: npt.NDArray[np.str_]
    turned: Array
    has_heights: bool


def _cut(part: Part, mine: npt.NDArray[np.int64]) -> _Cut:
    """The rows ``mine`` (m,) of a setup in one run."""
    assert isinstance(part.reading, Point)
    rows, read_there, guess = part.rows, part.rows.measured[mine], part.rows.guess[:, :12]
    axes, targets = _tool_axes(part)[mine], rows.target[mine]
    is_plane = read_there.shape[1] == 2
    if is_plane and not part.reading.holds("frame"):
        identity = np.tile(np.concatenate([np.eye(3).reshape(-1), np.zeros(3)]), (len(rows), 1))
        on_work = seen_points(rows, identity, np.array(part.reading.places))[mine]
        nominal = _laid_flat(on_work, _normal(on_work, targets), read_there)
        axes = np.tile(np.eye(3)[2], (len(mine), 1))
    else:
        nominal = seen_points(rows, guess, np.array(part.reading.places))[mine]
        axes = np.einsum("nji,nj->ni", guess[mine, :9].reshape(-1, 3, 3), axes)
    measured = nominal.copy()
    measured[:, : read_there.shape[1]] = np.where(
        np.isnan(read_there), measured[:, : read_there.shape[1]], read_there
    )
    rotary = [joint.kind == "rotary" for joint in rows.chain.joints]
    has_heights = not is_plane and not np.isnan(read_there).any()
    return _Cut(nominal, measured, axes, targets, rows.positions[mine][:, rotary], has_heights)


def _tool_axes(part: Part) -> Array:
    """Unit vectors (n, 3) along the tool's axis in the frame of the last work axis, of a machine without errors."""
    assert isinstance(part.reading, Point)
    setup, rows = part.reading.setup, part.rows
    along = np.array(setup.tool_direction or setup.tool_point)
    along = np.eye(3)[2] if not along.any() else along / np.linalg.norm(along)
    sides = orientation(rows.chain, rows.positions, np.zeros((len(rows), len(rows.chain.joints), 2, 6)))
    return np.asarray(np.swapaxes(sides.work, 1, 2) @ sides.tool @ along)


def _elements(cut: _Cut) -> tuple[tuple[PartFeature, ...], tuple[PartPath, ...], dict[str, int]]:
    """The lines and circles, the paths that are neither, and the points of those that have too few, in the order of
    cutting."""
    features, paths, short = [], [], {}
    for name in dict.fromkeys(cut.targets.tolist()):
        at = cut.targets == name
        nominal, measured, shape = cut.nominal[at], cut.measured[at], _shape(cut.nominal[at])
        if shape is not None:
            turning = bool(np.ptp(cut.turned[at], axis=0).max(initial=0.0) > TURNS)
            features.append(
                PartFeature(
                    str(name),
                    shape.kind,
                    measured,
                    nominal,
                    shape.centre,
                    shape.normal,
                    shape.radius,
                    turning,
                )
            )
        elif len(nominal) >= FEWEST_OF_PATH:
            paths.append(PartPath(str(name), measured, nominal, cut.axes[at], cut.has_heights))
        else:
            short[str(name)] = len(nominal)
    return tuple(features), tuple(paths), short


def _normal(points: Array, targets: npt.NDArray[np.str_]) -> Array:
    """The normal (3,) of a part with programmed points (n, 3): that of its first circle, else of two of its lines, else
    the direction in which its points vary least."""
    lines: list[Array] = []
    for name in dict.fromkeys(targets.tolist()):
        shape = _shape(points[targets == name])
        if shape is not None and shape.kind == "circle":
            return shape.normal
        lines += [] if shape is None else [shape.normal]
    for line in lines:
        across = np.cross(lines[0], line)
        if np.linalg.norm(across) > 0.1:
            return np.asarray(across / np.linalg.norm(across))
    return np.asarray(np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][2])


def _laid_flat(points: Array, normal: Array, read_there: Array) -> Array:
    """Programmed points (n, 3) of the work in the frame of an instrument that reads two numbers (n, 2) of each: the
    part with that ``normal`` (3,) lies flat there, one or the other way up, and is turned until it agrees best."""
    middle = points.mean(axis=0)
    first = np.eye(3)[int(np.abs(normal).argmin())]
    first = first - (first @ normal) * normal
    first = first / np.linalg.norm(first)
    off = read_there - read_there.mean(axis=0)
    candidates = []
    for way in (1.0, -1.0):
        basis = np.vstack([first, way * np.cross(normal, first), way * normal])
        local = (points - middle) @ basis.T
        u, _, vt = np.linalg.svd(off.T @ local[:, :2])
        turn = u @ np.diag([1.0, np.linalg.det(u @ vt)]) @ vt
        flat = local[:, :2] @ turn.T
        candidates.append((float(np.sum((flat - off) ** 2)), flat, local[:, 2]))
    _, flat, height = min(candidates, key=lambda candidate: candidate[0])
    return np.column_stack([flat + read_there.mean(axis=0), height])


def _shape(points: Array) -> _Shape | None:
    """The shape of a programmed path (n, 3); None where it is neither a line nor a circle."""
    middle = points.mean(axis=0)
    about = points - middle
    _, size, axes = np.linalg.svd(about, full_matrices=False)
    if len(points) < FEWEST_OF_LINE or size[0] < ON_PATH:
        return None
    if np.abs(about @ axes[1:].T).max() < ON_PATH:
        return _Shape("line", middle, axes[0], 0.0)
    if len(points) < FEWEST_OF_CIRCLE or np.abs(about @ axes[2]).max() > ON_PATH:
        return None
    flat = about @ axes[:2].T
    # |p|^2 = 2 p.c + (r^2 - |c|^2) is linear.
    columns = np.column_stack([2.0 * flat, np.ones(len(flat))])
    solved = np.linalg.lstsq(columns, np.sum(flat**2, axis=1), rcond=None)[0]
    centre, radius = solved[:2], float(np.sqrt(max(solved[2] + solved[:2] @ solved[:2], 0.0)))
    off = flat - centre
    if np.abs(np.linalg.norm(off, axis=1) - radius).max() > ON_PATH:
        return None
    around = np.sort(np.arctan2(off[:, 1], off[:, 0]))
    gap = float(np.diff(around, append=around[:1] + 2.0 * np.pi).max())
    if 2.0 * np.pi - gap < SHORTEST_ARC:
        return None
    normal = axes[2] * (np.sign(axes[2][np.abs(axes[2]).argmax()]) or 1.0)
    return _Shape("circle", middle + centre @ axes[:2], normal, radius)
