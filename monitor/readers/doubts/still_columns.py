"""Columns of axes that stand still in all rows while what was read says that the axes moved: seen without a fit.

A log that lost a channel repeats its last value. Axes are kept still, too, as Y and Z are while a laser looks along X:
nothing is said of these. Of a plate whose balls are stated, positions and stated points differ by what one axis did not
show: the products of the arms of all points, stated less read, are those of one column of numbers, whichever way the
plate stands. Where no axis moves at all, readings differ by their scatter alone, or by a drift.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from monitor.readers.doubts.nominal_readings import DEVIATIONS, UNITS
from monitor.readers.faults import and_of
from monitor.records import Array, Campaign, Setup

#: Rows from which on anything is said, and of a plate so many at most that are looked at.
FEWEST, MOST = 8, 300
#: mm that an axis moved unseen by, as the root of a mean square; what is left of the products beside that is less than
#: this part of it: errors of machines and plates are a thousandth at most.
MOVED, SMALL = 1.0, 5e-3
#: Readings at one pose that scatter so many times as stated say that it was not one.
SCATTERS = 5.0


def still_columns(campaign: Campaign) -> Iterator[str]:
    """Yield a sentence on columns that stand still though the readings contradict it; none for none."""
    readings = campaign.probings.readings
    still = {
        axis: float(values[0]) for axis, values in readings.items() if len(values) and np.ptp(values) == 0.0
    }
    if not still or not campaign.artefact.setups or "setup" not in campaign.probings.channels:
        return
    if len(still) == len(readings):
        yield from _of_all(campaign, still)
        return
    linear = [axis for axis in still if campaign.machine.is_linear(axis)]
    if len(linear) == 1 and {"X", "Y", "Z"} <= readings.keys() and linear[0] in "XYZ":
        yield from _of_plates(campaign, linear[0])


def _columns(campaign: Campaign, axes: list[str]) -> str:
    """The columns of axes as the subject of a sentence with its verb."""
    names = [f"{axis.lower()}_{'mm' if campaign.machine.is_linear(axis) else 'deg'}" for axis in axes]
    return f"column {names[0]} stands" if len(names) == 1 else f"columns {and_of(names)} stand"


def _of_all(campaign: Campaign, still: dict[str, float]) -> Iterator[str]:
    """Readings of setups that differ though no axis moves in any row."""
    channels = campaign.probings.channels
    for setup, rows in _setups(campaign):
        if setup.standard_uncertainty is None or len(rows) < FEWEST:
            continue
        scatters = [
            float(np.std(channels[name][rows])) * UNITS[f"_{name.rpartition('_')[2]}"]
            for name in DEVIATIONS
            if name in channels and np.isfinite(channels[name][rows]).all()
        ]
        times = max(scatters, default=0.0) / setup.standard_uncertainty
        if times > SCATTERS:
            yield (
                f"{_columns(campaign, list(still))} still in all rows, and what setup {setup.id} read scatters "
                f"{times:.0f} times as much as it states: did the column stop while the axis went on? Then put in "
                "where the axis stood; where it did stand still, this is a drift, and no plan of a machine"
            )
            return


def _of_plates(campaign: Campaign, axis: str) -> Iterator[str]:
    """Stated points whose distances the positions lack by what one column does."""
    probings = campaign.probings
    channels = probings.channels
    if not {"point_x_mm", "point_y_mm", "point_z_mm"} <= channels.keys():
        return
    stated = np.column_stack([channels[f"point_{name}_mm"] for name in "xyz"])
    read = np.column_stack([probings.readings[name] for name in "XYZ"])
    turning = [values for name, values in probings.readings.items() if not campaign.machine.is_linear(name)]
    for setup, rows in _setups(campaign):
        rows = rows[np.isfinite(stated[rows]).all(axis=1)][:MOST]
        turned = any(np.ptp(values[rows]) > 0.0 for values in turning if len(rows))
        if setup.reading not in ("point", "pose") or len(rows) < FEWEST or turned:
            continue
        moved = _moved_unseen(stated[rows], read[rows])
        if moved is not None:
            yield (
                f"{_columns(campaign, [axis])} still in all rows, and the stated points of setup {setup.id} lie "
                f"further apart than the positions by what {axis} alone would do if it had moved over {moved:.0f} mm: "
                f"did the column stop while {axis} went on? Put in where it stood"
            )
            return


def _moved_unseen(stated: Array, read: Array) -> float | None:
    """Over how many mm one axis moved that the positions (m, 3) do not show, by the stated points (m, 3); None where
    they show all, or one axis is not enough."""
    arms, seen_arms = stated - stated.mean(axis=0), read - read.mean(axis=0)
    # Of the products of arms (m, m) all but six directions are zero: they are those of the two sets of columns.
    columns = np.column_stack([arms, seen_arms])
    basis, triangle = np.linalg.qr(columns)
    inner = triangle @ np.diag([1.0, 1.0, 1.0, -1.0, -1.0, -1.0]) @ triangle.T
    sizes, vectors = np.linalg.eigh(inner)
    if sizes[-1] < MOVED**2 * len(stated) or np.abs(sizes[:-1]).max() > SMALL * sizes[-1]:
        return None
    return float(np.ptp(basis @ vectors[:, -1]) * np.sqrt(sizes[-1]))


def _setups(campaign: Campaign) -> Iterator[tuple[Setup, npt.NDArray[np.int64]]]:
    """Each setup in each run with its rows."""
    probings = campaign.probings
    number = probings.channels["setup"].astype(np.int64) - 1
    for run in np.unique(probings.run):
        for index, setup in enumerate(campaign.artefact.setups):
            rows = np.flatnonzero((probings.run == run) & (number == index))
            if len(rows):
                yield setup, rows
