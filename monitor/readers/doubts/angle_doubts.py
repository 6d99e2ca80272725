"""Columns of rotary axes that look like radians, or begin anew where the axis went on: seen without a fit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from monitor.readers.faults import and_of
from monitor.records import Array, Campaign
from monitor.units import DEGREE

#: A full turn in radians, with room for the last printed digit.
FULL_TURN = 6.3
#: People index at multiples of 5 degrees; radians of three decimals come back to them within 0.03 degrees.
INDEX_DEG, INDEX_TOLERANCE_DEG = 5.0, 0.03
#: Degrees by which what an axis turned has to become less where its angles go on, for it to be said.
SHORTER_BY = 45.0
#: Degrees within which the angles of a column that begins anew come near both of its ends.
NEAR_END = 30.0
#: Degrees within which two angles are one.
SAME_PLACE = 1e-3
#: An axis that follows scans or a path usually moves by at most so many degrees, makes so many moves at least, and over
#: the end of its column at most so many usual ones. Poses in any order (a robot's) move by 120 degrees.
USUAL_DEG, FEWEST_MOVES, OVER_END = 45.0, 4, 2.0


def radians(campaign: Campaign) -> Iterator[str]:
    """Columns of degrees that hold radians."""
    turning = {
        axis: np.unique(values / DEGREE.factor)
        for axis, values in campaign.probings.readings.items()
        if not campaign.machine.is_linear(axis)
    }
    moving = {axis: values for axis, values in turning.items() if len(values) > 1}
    largest = {axis: float(np.abs(values).max()) for axis, values in moving.items()}
    if len(moving) > 2 and max(largest.values()) <= FULL_TURN:
        columns = and_of([f"{axis.lower()}_deg" for axis in moving])
        yield f"{columns} never exceed {max(largest.values()):.3g}: is the unit degree? Radians look like this"
        return
    for axis, values in moving.items():
        used = values[np.abs(values) > 1e-9]
        as_degrees = used / DEGREE.factor
        off_index = np.abs(as_degrees - INDEX_DEG * np.round(as_degrees / INDEX_DEG))
        off_grid = np.abs(used - np.round(used, 2))
        if largest[axis] <= FULL_TURN and np.all(off_index < INDEX_TOLERANCE_DEG) and np.any(off_grid > 1e-4):
            shown = used[int(np.argmax(np.abs(used)))]
            yield (
                f"{axis.lower()}_deg never exceeds {largest[axis]:.4g}, and taken as radians its values are round "
                f"angles ({shown:.6g} rad are {shown / DEGREE.factor:.0f}°): is the unit degree?"
            )


def angles_begun_anew(campaign: Campaign) -> Iterator[str]:
    """Columns that go from 180 to -180 degrees, or from 360 to 0, where the axis may have gone on."""
    probings = campaign.probings
    for axis, values in probings.readings.items():
        degrees = values / DEGREE.factor
        jumps = np.flatnonzero((np.abs(np.diff(degrees)) > 180.0) & (np.diff(probings.run) == 0))
        if campaign.machine.is_linear(axis) or not len(jumps):
            continue
        around = np.sort(degrees)
        least, largest = float(around[0]), float(around[-1])
        end = 180.0 if least < 0.0 else 360.0
        if not (end - NEAR_END < largest <= end and end - 360.0 <= least < end - 360.0 + NEAR_END):
            continue
        if largest - least > 360.0 - SAME_PLACE:
            continue  # Indexed over a whole turn, and turned back for the next pass.
        widest = int(np.argmax(np.diff(around)))
        turned = 360.0 - float(np.diff(around)[widest])
        if largest - least - turned < SHORTER_BY:
            continue
        added = np.where(degrees < around[widest + 1], degrees + 360.0, degrees)
        if not _goes_on(degrees, added, probings.run):
            continue
        row = int(jumps[0])
        yield (
            f"{axis.lower()}_deg goes from {degrees[row]:.6g} to {degrees[row + 1]:.6g} (run {probings.run[row]}, "
            f"sequences {probings.sequence[row]} and {probings.sequence[row + 1]}); if the axis went on past "
            f"{end:.0f} there, its angles span {turned:.4g} degrees and not {largest - least:.4g}: then add 360 to "
            f"those below {around[widest + 1]:.6g}, because wind-up, cables and gravity follow the way that it turned"
        )


def _goes_on(degrees: Array, added: Array, runs: npt.NDArray[np.int64]) -> bool:
    """Whether an axis that follows scans or a path stood at the angles (n,) with 360 ``added``.

    Passes that really went from -170 to 170 degrees, and back at once, jump less often as they stand than with 360
    added, where each is cut in the middle.
    """
    within = np.diff(runs) == 0
    jumped, step = np.abs(np.diff(degrees)[within]) > 180.0, np.abs(np.diff(added)[within])
    moves = step[step > SAME_PLACE]
    if len(moves) < FEWEST_MOVES or np.count_nonzero(step > 180.0) >= np.count_nonzero(jumped):
        return False
    usual = float(np.median(moves))
    over_end = step[jumped & (np.abs(step - np.ptp(added)) > SAME_PLACE)]
    return usual <= USUAL_DEG and bool(len(over_end)) and bool(np.median(over_end) <= OVER_END * usual)
