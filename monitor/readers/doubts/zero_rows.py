"""Rows of zeros among readings of directions and points: what programs write that got no answer.

A tracker's 0, 0, 0 is refused; a direction may point along an axis and a point lie at a frame's origin. Directions of
zero that stand in several rows of a setup whose axes differ there, points of zero where the axes bring no point of the
tool to one place, and axes at zero whose targets differ, are no readings.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from monitor.readers.doubts.blank_rows import named_rows
from monitor.readers.doubts.tool_frames import ToolFrames, apart
from monitor.records import Array, Campaign, Setup
from monitor.units import DEGREE

#: Readings of one pose differ by less than this part of a radian, or so many mm; those of two poses by more.
SAME_DIRECTION, SAME_POINT = DEGREE.factor, 1.0
#: The columns of a target, and what azimuth and elevation of zero, or a point that was not seen, come to in them.
POINT = (("point_x_mm", "point_y_mm", "point_z_mm"), (0.0, 0.0, 0.0), SAME_POINT, "the point 0, 0, 0")
DIRECTION = (
    ("direction_x", "direction_y", "direction_z"),
    (1.0, 0.0, 0.0),
    SAME_DIRECTION,
    "the direction of azimuth 0 and elevation 0",
)
TARGETS = {"point": POINT, "pose": POINT, "direction": DIRECTION}
#: A machine without its errors brings one point of the tool to one place within this part of its travel: zeros of a
#: robot that are off by a degree move it by 1 % of its reach.
OFF_SHARE = 0.02
#: Of a plate whose balls stand where its certificate says one may be its origin, and lie anew: zeros at so many places,
#: where no other point recurs, are no ball.
FEWEST_OF_PLATE = 3


def zero_rows(campaign: Campaign, frames: ToolFrames | None = None) -> Iterator[str]:
    """A sentence for each setup of which some rows are zeros that no reading explains; points only with ``frames``."""
    channels = campaign.probings.channels
    for index, setup in enumerate(campaign.artefact.setups if "setup" in channels else ()):
        if setup.reading in TARGETS and set(TARGETS[setup.reading][0]) <= channels.keys():
            yield from _of_setup(campaign, setup, np.flatnonzero(channels["setup"] == index + 1), frames)


def _of_setup(
    campaign: Campaign, setup: Setup, mine: npt.NDArray[np.int64], frames: ToolFrames | None
) -> Iterator[str]:
    """The sentences on one setup, whose rows are ``mine`` (m,)."""
    probings = campaign.probings
    columns, at_zero, same, target_word = TARGETS[setup.reading]
    targets = np.column_stack([probings.channels[name][mine] for name in columns])
    poses, series = _poses(campaign, mine), _series(campaign, setup, mine)
    zeros, still = np.all(targets == at_zero, axis=1), np.all(poses == 0.0, axis=1)
    stated = "targets" in setup.known
    if setup.reading == "direction":
        wrong = not stated and any(_differ(poses[rows], zeros[rows], SAME_DIRECTION) for rows in series)
    else:
        may_be_balls = stated and _is_plate(targets, zeros)
        wrong = not may_be_balls and any(_at_places(frames, mine[rows], zeros[rows]) for rows in series)
    if wrong:
        yield _sentence(campaign, setup.id, mine[zeros], f"{target_word} at different poses")
    if not stated and any(_differ(targets[rows], still[rows], same) for rows in series):
        yield _sentence(campaign, setup.id, mine[still], "all axes at 0 and different targets")


def _poses(campaign: Campaign, mine: npt.NDArray[np.int64]) -> Array:
    """The readings (m, J) of the axes: millimetres count as radians do, each in its own tolerance."""
    unit = {True: SAME_DIRECTION / SAME_POINT, False: 1.0}
    readings = campaign.probings.readings.items()
    return np.column_stack(
        [unit[campaign.machine.is_linear(axis)] * values[mine] for axis, values in readings]
    )


def _series(campaign: Campaign, setup: Setup, mine: npt.NDArray[np.int64]) -> list[npt.NDArray[np.int64]]:
    """Which of the rows (m,) are of one run and one point of the tool: of one pose each sees another target."""
    run, name = campaign.probings.run[mine], campaign.probings.target[mine]
    if setup.reading == "direction":
        name = np.full(len(mine), "")
    names = np.array([f"{number} {target}" for number, target in zip(run, name, strict=True)])
    return [np.flatnonzero(names == each) for each in np.unique(names)]


def _sentence(campaign: Campaign, setup: str, rows: npt.NDArray[np.int64], what: str) -> str:
    return (
        f"setup {setup}: {len(rows)} rows have {what} ({_named(campaign, rows)}): zeros that a program writes where it "
        "got no reading? Leave these rows out"
    )


def _is_plate(points: Array, zeros: npt.NDArray[np.bool_]) -> bool:
    """Whether points (m, 3) recur, or too few stand at zero to be no ball of a plate."""
    others = points[~zeros]
    return int(np.count_nonzero(zeros)) < FEWEST_OF_PLATE or len(np.unique(others, axis=0)) < len(others)


def _at_places(frames: ToolFrames | None, rows: npt.NDArray[np.int64], zeros: npt.NDArray[np.bool_]) -> bool:
    """Whether no point of the tool stands at one place in those of the rows (m,) that have ``zeros``."""
    if frames is None or np.count_nonzero(zeros) < 2:
        return False
    return apart(frames(rows[zeros])) > max(
        SAME_POINT, OFF_SHARE * float(np.ptp(frames(rows)[:, :, 3], axis=0).max())
    )


def _differ(values: Array, rows: npt.NDArray[np.bool_], tolerance: float) -> bool:
    """Whether values (m, k) of some, not most, of the rows (m,) differ among each other."""
    count = int(np.count_nonzero(rows))
    if count < 2 or 2 * count > len(rows):
        return False
    return bool(np.nanmax(np.ptp(values[rows], axis=0)) > tolerance)


def _named(campaign: Campaign, rows: npt.NDArray[np.int64]) -> str:
    """Run and sequence numbers of rows, the first of many."""
    probings = campaign.probings
    return "; ".join(
        named_rows(run, probings.sequence[rows[probings.run[rows] == run]].tolist())
        for run in np.unique(probings.run[rows]).tolist()
    )
