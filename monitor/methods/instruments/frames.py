"""First guesses of frames, from directions and from points, where nothing of them is known.

Rotations come from a singular value decomposition (B. K. P. Horn, H. M. Hilden, S. Negahdaripour, J. Opt. Soc. Am. A
5 (1988) 1127). Points on the tool are unknown too: with the nine numbers of the rotation free, frame and places are
linear in what the nominal chain says. Where all axes meet in one point these equations have no right-hand side, and
their null vector is the solution up to its length, which is that of a rotation; where axes are parallel, what they
leave open gets the smallest value. Both this guess and one that begins with the stated places are improved in turn
(frame for places, places for frame), and the one that leaves less is taken.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.machine import evaluate
from monitor.methods.instruments.reading import Rows
from monitor.records import Array

# Frame and places are improved in turn so often: what is left then is far less than errors of a machine.
TURNS = 60
# Singular values below this part of the largest belong to what the axes leave open.
OPEN = 1e-8


def nearest_rotation(wanted: Array, vectors: Array) -> Array:
    """The rotation (3, 3) that brings vectors ``vectors`` (m, 3) closest to ``wanted`` (m, 3)."""
    return _as_rotation(wanted.T @ vectors)


def _as_rotation(matrix: Array) -> Array:
    """The rotation (3, 3) nearest to a matrix."""
    u, _, vt = np.linalg.svd(matrix)
    return np.asarray(u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt)


def first_frame(rows: Rows, places: Array, *, held: bool) -> tuple[Array, Array]:
    """Frames of all rows (m, 12): rotation and shift from the instrument's frame to that of the last work axis, one a
    run, and places (T, 3) of the targets on the tool.

    ``places`` (T, 3) are the stated ones, ``held`` where they are known. ``rows.measured`` has two columns or three.
    """
    at = np.unique(rows.target, return_inverse=True)[1].reshape(-1)
    count = len(rows)
    none = np.zeros((count, len(rows.chain.joints), 2, 6))
    pose = evaluate(rows.chain, rows.positions, none, np.zeros((count, 3)), np.zeros(3))
    guesses = np.zeros((count, 12))
    sums, times = np.zeros_like(places), np.zeros(len(places))
    for run in np.unique(rows.run):
        mine = np.flatnonzero(rows.run == run)
        complete = mine[~np.isnan(rows.measured[mine]).any(axis=1)]
        turn, shift, improved = _best(
            pose.by_tip[complete],
            pose.residual[complete],
            rows.measured[complete],
            at[complete],
            places,
            held,
        )
        guesses[mine] = np.concatenate([turn.reshape(9), shift])
        of_run = np.unique(at[complete])
        sums[of_run] += improved[of_run]
        times[of_run] += 1.0
    mean = sums / np.maximum(times, 1.0)[:, None]
    return guesses, places if held else np.where(times[:, None] > 0.0, mean, places)


def seen_points(rows: Rows, frames: Array, places: Array) -> Array:
    """The points (m, 3) of targets at ``places`` (T, 3) in the instrument's frame, by frames (m, 12) and a chain
    without errors."""
    at = np.unique(rows.target, return_inverse=True)[1].reshape(-1)
    none = np.zeros((len(rows), len(rows.chain.joints), 2, 6))
    points = evaluate(rows.chain, rows.positions, none, np.zeros((len(rows), 3)), places[at]).residual
    turn = frames[:, :9].reshape(-1, 3, 3)
    return np.asarray(np.einsum("nji,nj->ni", turn, points - frames[:, 9:]))


def _best(
    rotation: Array, origin: Array, points: Array, at: npt.NDArray[np.int64], places: Array, held: bool
) -> tuple[Array, Array, Array]:
    """Rotation (3, 3), shift (3,) and places (T, 3) such that rotation_i place + origin_i = turn point_i + shift."""
    starts: list[Array] = [places]
    if not held and points.shape[1] == 3:
        starts += _linear(rotation, origin, points, at, len(places))
    best: tuple[Array, Array, Array] | None = None
    least = np.inf
    for start in starts:
        trial = start
        for _ in range(1 if held else TURNS):
            carried = np.einsum("nij,nj->ni", rotation, trial[at]) + origin
            turn, shift = _frame(carried, points)
            if not held:
                trial = _places((rotation, origin), points, at, trial, (turn, shift))
        carried = np.einsum("nij,nj->ni", rotation, trial[at]) + origin
        shown = ((carried - shift) @ turn)[:, : points.shape[1]]
        squares = float(np.sum((shown - points) ** 2))
        if squares < least:
            best, least = (turn, shift, trial), squares
    assert best is not None
    return best


def _frame(carried: Array, points: Array) -> tuple[Array, Array]:
    """Rotation (3, 3) and shift (3,) that bring points (m, 2 or 3) closest to ``carried`` (m, 3), seen by the
    instrument."""
    middle, of_points = carried.mean(axis=0), points.mean(axis=0)
    arm, measured = carried - middle, points - of_points
    if points.shape[1] == 3:
        turn = nearest_rotation(arm, measured)
        return turn, middle - turn @ of_points
    # Two numbers: the linear map to them, of least norm, and the two nearest perpendicular unit vectors.
    plan = np.linalg.lstsq(arm, measured, rcond=OPEN)[0].T
    u, _, vt = np.linalg.svd(plan, full_matrices=False)
    flat = u @ vt
    turn = np.vstack([flat, np.cross(flat[0], flat[1])]).T
    return turn, middle - turn @ np.array([*of_points, 0.0])


def _places(
    poses: tuple[Array, Array],
    points: Array,
    at: npt.NDArray[np.int64],
    places: Array,
    frame: tuple[Array, Array],
) -> Array:
    """Places (T, 3) for a frame, nearest to those before where rows leave them open."""
    (rotation, origin), (turn, shift) = poses, frame
    kinds = points.shape[1]
    better = places.copy()
    for number in np.unique(at):
        mine = at == number
        columns = np.einsum("ai,nij->naj", turn.T[:kinds], rotation[mine])
        shown = (np.einsum("nij,j->ni", rotation[mine], places[number]) + origin[mine] - shift) @ turn
        wanted = (points[mine] - shown[:, :kinds]).reshape(-1)
        better[number] += np.linalg.lstsq(columns.reshape(-1, 3), wanted, rcond=1e-6)[0]
    return better


def _linear(
    rotation: Array, origin: Array, points: Array, at: npt.NDArray[np.int64], kinds: int
) -> list[Array]:
    """Places (T, 3) from the linear equations, one guess or none."""
    count = len(points)
    arm = points - points.mean(axis=0)
    size = max(float(np.sqrt(np.mean(arm**2))), 1.0)
    columns = np.zeros((count, 3, 12 + 3 * kinds))
    for row in range(3):
        columns[:, row, 3 * row : 3 * row + 3] = -arm / size
    columns[:, :, 9:12] = -np.eye(3)
    for axis in range(3):
        columns[np.arange(count), :, 12 + 3 * at + axis] = rotation[:, :, axis]
    flat, wanted = columns.reshape(3 * count, -1), -origin.reshape(-1)
    if np.abs(origin - origin.mean(axis=0)).max() > 1e-9 * size:
        free = np.linalg.lstsq(flat, wanted, rcond=OPEN)[0]
    else:
        free = np.linalg.svd(flat, full_matrices=False)[2][-1]
    stretch = float(np.cbrt(np.linalg.det(free[:9].reshape(3, 3) / size)))
    if abs(stretch) < OPEN:
        return []
    # Where all axes meet the equations fix everything but the length; else the scale is 1 already.
    meets = np.abs(origin - origin.mean(axis=0)).max() <= 1e-9 * size
    return [np.asarray(free[12:].reshape(kinds, 3) / (stretch if meets else 1.0), dtype=np.float64)]
