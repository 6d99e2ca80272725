"""A first guess of an observer's frame and of points on the tool, where nothing of either is known.

Rotations come from a singular value decomposition (B. K. P. Horn, H. M. Hilden, S. Negahdaripour, J. Opt. Soc. Am. A
5 (1988) 1127). Points on the tool are unknown too: with the nine numbers of the rotation free, frame and places are
linear in what the nominal chain says. Where all axes meet in one point these equations have no right-hand side, and
their null vector is the solution up to its length, which is that of a rotation; where axes are parallel or there is
only one, what they leave open is drawn a few times. Every guess, and one that begins with the stated places, is
improved in turn (frame for places, places for frame), and the one that leaves least is taken.

What linear axes leave open of a place (a shift of the frame does the same) stays as it is stated: it is the lever of
every turn of these axes. Elsewhere it made a turn of Z by 692 urad/m^2 one of -952, and 2.8 um were left that no turn
about such a lever takes away.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.records import Array

# Frame and places are improved in turn so often: what is left then is far less than errors of a machine.
TURNS = 60
# Singular values below this part of the largest belong to what the axes leave open.
OPEN = 1e-8
# Where points spread along one direction by less than this part of what they spread across it, they lie in a plane: two
# numbers of each show a tilt of the frame only through products of errors.
FLAT = 5e-3
# Where axes meet, squares below this part of the largest belong to what the equations leave open: errors of 1 mrad
# leave a millionth. A few guesses are drawn of it.
NULL, DRAWS, SEED = 1e-5, 6, 20261122
# Squares that differ by less than this part, or whose roots by less than this part of the size of the points, differ by
# rounding: the stated places are kept.
ALIKE, ROUNDING = 1e-6, 1e-12


def nearest_rotation(wanted: Array, vectors: Array) -> Array:
    """The rotation (3, 3) that brings vectors ``vectors`` (m, 3) closest to ``wanted`` (m, 3)."""
    return _as_rotation(wanted.T @ vectors)


def _as_rotation(matrix: Array) -> Array:
    """The rotation (3, 3) nearest to a matrix."""
    u, _, vt = np.linalg.svd(matrix)
    return np.asarray(u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt)


def best_frame(
    rotation: Array, origin: Array, points: Array, at: npt.NDArray[np.int64], places: Array, held: bool
) -> tuple[Array, Array, Array]:
    """Rotation (3, 3), shift (3,) and places (T, 3) such that rotation_i place + origin_i = turn point_i + shift.

    ``rotation`` (m, 3, 3) and ``origin`` (m, 3) mm carry points of the tool, ``points`` (m, 2 or 3) mm are those that
    were seen, of the targets ``at`` (m,); ``places`` (T, 3) are the stated ones, ``held`` where they are known.
    """
    starts: list[Array] = [places]
    if not held and points.shape[1] == 3:
        starts += _linear(rotation, origin, points, at, places)
    best: tuple[Array, Array, Array] | None = None
    least = np.inf
    rounding = ROUNDING**2 * float(np.sum(points**2) + np.sum(origin**2))
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
        if best is None or squares < (1.0 - ALIKE) * least - rounding:
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
    # Two numbers: the linear map to them, of least norm, and the two nearest perpendicular unit vectors. Across a plane
    # its points would draw it after their errors.
    plan = np.linalg.lstsq(arm, measured, rcond=FLAT)[0].T
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
        if kinds == 3:
            # Each row says where the place is; all of them say it equally well.
            arms = points[mine] @ turn.T + shift - origin[mine]
            better[number] = np.einsum("nji,nj->i", rotation[mine], arms) / len(arms)
            continue
        columns = np.einsum("ai,nij->naj", turn.T[:kinds], rotation[mine])
        shown = (np.einsum("nij,j->ni", rotation[mine], places[number]) + origin[mine] - shift) @ turn
        wanted = (points[mine] - shown[:, :kinds]).reshape(-1)
        better[number] += np.linalg.lstsq(columns.reshape(-1, 3), wanted, rcond=1e-6)[0]
    return better


def frame_equations(
    rotation: Array, origin: Array, arm: Array, at: npt.NDArray[np.int64], kinds: int
) -> tuple[Array, Array]:
    """Return matrix (3 n, 12 + 3 T) and right side (3 n,) of rotation_i place - turn arm_i - shift = -origin_i.

    Unknown are the nine elements of turn, row by row, the shift and the T = ``kinds`` places; ``at`` (n,) says which.
    """
    count = len(arm)
    columns = np.zeros((count, 3, 12 + 3 * kinds))
    for row in range(3):
        columns[:, row, 3 * row : 3 * row + 3] = -arm
    columns[:, :, 9:12] = -np.eye(3)
    for axis in range(3):
        columns[np.arange(count), :, 12 + 3 * at + axis] = rotation[:, :, axis]
    return columns.reshape(3 * count, -1), -origin.reshape(-1)


def _linear(
    rotation: Array, origin: Array, points: Array, at: npt.NDArray[np.int64], stated: Array
) -> list[Array]:
    """Places (T, 3) from the linear equations, one guess, a few or none; ``stated`` (T, 3) are those of the file."""
    arm, kinds = points - points.mean(axis=0), len(stated)
    size = max(float(np.sqrt(np.mean(arm**2))), 1.0)
    flat, wanted = frame_equations(rotation, origin, arm / size, at, kinds)
    # Where all axes meet the equations fix everything but the length; else the scale is 1 already.
    meets = all_axes_meet(origin, size)
    if not meets:
        guesses = [_nearest_to_stated(flat, wanted, stated)]
    else:
        values, vectors = np.linalg.eigh(flat.T @ flat)
        spanned = vectors[:, values <= max(NULL * values[-1], 2.0 * values[0])]
        draws = np.random.default_rng(SEED).normal(
            size=(spanned.shape[1], DRAWS if spanned.shape[1] > 1 else 1)
        )
        guesses = list((spanned @ draws).T)
    places = []
    for free in guesses:
        stretch = float(np.cbrt(np.linalg.det(free[:9].reshape(3, 3) / size)))
        if abs(stretch) > OPEN * np.linalg.norm(free):
            places.append(
                np.asarray(free[12:].reshape(kinds, 3) / (stretch if meets else 1.0), dtype=np.float64)
            )
    return places


def _nearest_to_stated(equations: Array, wanted: Array, stated: Array) -> Array:
    """The solution (12 + 3 T,) of the equations of frame and places that leaves the places nearest to ``stated`` (T, 3)
    where rows leave them open."""
    free = np.asarray(np.linalg.lstsq(equations, wanted, rcond=OPEN)[0])
    _, values, directions = np.linalg.svd(np.linalg.qr(equations, mode="r"))
    is_open = np.ones(len(directions), dtype=bool)
    is_open[: len(values)] = values <= OPEN * values[0]
    if not is_open.any():
        return free
    open_ways = directions[is_open]
    to_stated = stated.reshape(-1) - free[12:]
    return np.asarray(free + open_ways.T @ np.linalg.lstsq(open_ways[:, 12:].T, to_stated, rcond=OPEN)[0])


def all_axes_meet(origin: Array, size: float) -> bool:
    """Whether the origin (m, 3) of the last axis stays where it is, on the scale of points that spread by ``size``."""
    return bool(np.abs(origin - origin.mean(axis=0)).max() <= 1e-9 * size)
