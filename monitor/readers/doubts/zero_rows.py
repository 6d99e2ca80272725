"""Rows of zeros among readings of directions and points: what programs write that got no answer.

A tracker's 0, 0, 0 is refused; a direction may point along an axis and a point lie at a frame's origin. Zeros that
stand in several rows of a setup whose axes differ there, or axes at zero whose targets differ, are no readings.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from monitor.records import Array, Campaign
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
#: So many sequence numbers are named.
MOST_NAMED = 12


def zero_rows(campaign: Campaign) -> Iterator[str]:
    """A sentence for each setup of which some rows are zeros that no reading explains."""
    probings, channels = campaign.probings, campaign.probings.channels
    for index, setup in enumerate(campaign.artefact.setups if "setup" in channels else ()):
        if setup.reading not in TARGETS:
            continue
        columns, at_zero, same, target_word = TARGETS[setup.reading]
        if "targets" in setup.known or not set(columns) <= channels.keys():
            continue  # Balls of a plate stand where its certificate says, one of them at its origin.
        mine = np.flatnonzero(channels["setup"] == index + 1)
        targets = np.column_stack([channels[name][mine] for name in columns])
        # Millimetres of linear axes count as radians do, each in its own tolerance.
        unit = {
            axis: SAME_DIRECTION / SAME_POINT
            for axis in probings.readings
            if campaign.machine.is_linear(axis)
        }
        poses = np.column_stack(
            [unit.get(axis, 1.0) * values[mine] for axis, values in probings.readings.items()]
        )
        # Of one pose every run sees each point of the tool elsewhere.
        names = probings.target[mine] if setup.reading != "direction" else np.full(len(mine), "")
        series = np.array([f"{run} {name}" for run, name in zip(probings.run[mine], names, strict=True)])
        for zeros, others, tolerance, what in (
            (np.all(targets == at_zero, axis=1), poses, SAME_DIRECTION, f"{target_word} at different poses"),
            (np.all(poses == 0.0, axis=1), targets, same, "all axes at 0 and different targets"),
        ):
            if any(
                _differ(others[series == each], zeros[series == each], tolerance)
                for each in np.unique(series)
            ):
                where = mine[zeros]
                yield (
                    f"setup {setup.id}: {len(where)} rows have {what} ({_named(campaign, where)}): zeros that a "
                    "program writes where it got no reading? Leave these rows out"
                )


def _differ(values: Array, rows: npt.NDArray[np.bool_], tolerance: float) -> bool:
    """Whether values (m, k) of some, not most, of the rows (m,) differ among each other."""
    count = int(np.count_nonzero(rows))
    if count < 2 or 2 * count > len(rows):
        return False
    return bool(np.nanmax(np.ptp(values[rows], axis=0)) > tolerance)


def _named(campaign: Campaign, rows: npt.NDArray[np.int64]) -> str:
    """Run and sequence numbers of rows, the first of many."""
    probings, named = campaign.probings, []
    for run in np.unique(probings.run[rows]):
        numbers = probings.sequence[rows[probings.run[rows] == run]].tolist()
        more = ", ..." if len(numbers) > MOST_NAMED else ""
        named.append(f"run {run}, sequence {', '.join(map(str, numbers[:MOST_NAMED]))}{more}")
    return "; ".join(named)
