"""Measured points that are of another size than the chain: in another unit, or not the points of these poses.

A fit whose links are free follows points in metres by a robot of a thousandth of its size. With the nine elements of
the frame's rotation taken as free, the linear equations of frame and places say how many times as large the points
would have to be. Where that is the ratio of two units, or points of that size fit, the unit is wrong. Else nothing
says so: points in another order than the poses are best explained by shrinking them to one.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.methods.chain.first_frame import all_axes_meet, best_frame, frame_equations
from monitor.records import Array

#: Points this many times too small or too large are in another unit (cm, inch, m); no error of a chain comes near.
OTHER_UNIT = 5.0
#: Units of length stand in such ratios (mm to cm, dm, m and inch), met to this part: errors of a chain are smaller.
UNIT_RATIOS, RATIO_TOLERANCE = (10.0, 25.4, 100.0, 1000.0), 0.05
#: A guess that leaves this part of the spread of the points, or so many mm, is that of the chain with its errors.
LEFT, LEAST_LEFT = 0.02, 1.0
#: Points in another order leave most of their spread; walls that a cutter stands off from its path leave a twentieth.
SHUFFLED = 0.3
#: Where more than this part of an element of the rotation is open, the size is.
OPEN = 1e-6


def refuse_other_size(
    rotation: Array,
    origin: Array,
    points: Array,
    at: npt.NDArray[np.int64],
    rms_of_guess: float,
    columns: str,
    alone: float | None = None,
) -> None:
    """DataError where points are of another size than the chain, or not of these poses.

    ``rotation`` (m, 3, 3) and ``origin`` (m, 3) mm carry points of the tool by the nominal chain, ``points`` (m, 3)
    mm were measured, of the targets ``at`` (m,); a guess at the size as measured leaves ``rms_of_guess`` mm.
    ``columns`` says in words where the points stand. ``alone`` is what ``best_frame`` of these points by themselves,
    as measured, leaves in mm, where it is known.
    """
    arm = points - points.mean(axis=0)
    size = max(float(np.sqrt(np.mean(arm**2))), 1.0)
    if rms_of_guess <= max(LEFT * size, LEAST_LEFT) or all_axes_meet(origin, size):
        return
    kinds = int(at.max()) + 1
    places = np.zeros((kinds, 3))
    # A guess may hold what all runs say of places that each leaves open: its run by itself is asked.
    if alone is None:
        alone = left_of(best_frame(rotation, origin, points, at, places, False), rotation, origin, points, at)
    if alone <= max(LEFT * size, LEAST_LEFT):
        return
    times = _size(*frame_equations(rotation, origin, arm / size, at, kinds)) / size
    if not times or 1.0 / OTHER_UNIT < times < OTHER_UNIT:
        return
    guess = best_frame(rotation, origin, times * points, at, places, False)
    rms_at_size, spread = left_of(guess, rotation, origin, times * points, at), times * float(arm.std())
    if _is_ratio_of_units(times) or rms_at_size <= LEFT * spread:
        raise DataError(
            f"the measured points would have to be {times:.3g} times as large to come from this chain: check the units "
            f"of {columns} (mm) and of offset_mm"
        )
    if alone <= SHUFFLED * size:
        return
    raise DataError(
        f"measured points and joint readings do not belong together row by row: in no frame and at no size do these "
        f"points come from this chain ({alone:.3g} mm are left as measured); check that each row of {columns} stands "
        "beside the joint readings of its own pose and that all of them are in mm, then the order, the signs and the "
        "directions of the axes"
    )


def left_of(
    guess: tuple[Array, Array, Array],
    rotation: Array,
    origin: Array,
    points: Array,
    at: npt.NDArray[np.int64],
) -> float:
    """Root mean square in mm of what a guess (rotation, shift and places) leaves of points (n, 3)."""
    turn, shift, places = guess
    apart = np.einsum("nij,nj->ni", rotation, places[at]) + origin - points @ turn.T - shift
    return float(np.sqrt(np.mean(apart**2)))


def _size(equations: Array, wanted: Array) -> float:
    """The size of the rotation that solves the equations; 0 where they leave it open."""
    _, values, directions = np.linalg.svd(equations, full_matrices=False)
    open_part = directions[values <= 1e-8 * values[0], :9]
    if np.abs(open_part).max(initial=0.0) > OPEN:
        return 0.0
    free = np.linalg.lstsq(equations, wanted, rcond=1e-8)[0]
    return float(np.cbrt(abs(np.linalg.det(free[:9].reshape(3, 3)))))


def _is_ratio_of_units(times: float) -> bool:
    """Whether lengths of two units are so many times each other."""
    larger = max(times, 1.0 / times)
    return any(abs(larger / ratio - 1.0) <= RATIO_TOLERANCE for ratio in UNIT_RATIOS)
