"""Places of a plate, or points, that are read in another unit or under each other's names: seen without a fit.

Where one point of the tool is brought to points whose places are stated, or a place is measured at each position, the
positions of X, Y and Z are those points turned and shifted, but for errors of micrometres. Each setup says so by
itself: a setup in inches is that with a factor, and two balls that were exchanged in it lie where the other one does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.readers.faults import and_of
from monitor.records import Array, Campaign, Setup
from monitor.units import UNIT_WORDS, Unit, mistaken_for_mm

#: Rows of a setup in a run from which on anything is said, and part of them that may be wrong.
FEWEST, MOST_WRONG = 8, 0.3
#: Rows of a tracker in a run that are looked at: of a million the first ones.
MOST_ROWS = 20_000
#: Factors of units are met within this part, and points within this part of their spread.
NEAR_UNIT, NEAR = 5e-3, 2e-3
#: Of targets on a tool this part of their distance, which is tens of mm: a tracker scatters by some hundredths.
NEAR_TRACKER, CHANGES = 0.02, 2
#: mm by which a row lies off from which on it is another point's.
OFF = 1.0
#: Steps by which rows that lie off lose their say, and directions along which a plate has no extent.
STEPS, FLAT = 30, 1e-6
#: So many sequence numbers are named.
MOST_NAMED = 8


@dataclass(frozen=True)
class _Plate:
    """The rows (m,) of a setup in a run, their positions and points (m, 3) in mm."""

    run: int
    setup: Setup
    rows: npt.NDArray[np.int64]
    read: Array
    points: Array


def plate_doubts(campaign: Campaign) -> Iterator[str]:
    """Yield a sentence on each setup whose positions are its points in another unit, or under exchanged names."""
    plates = _plates(campaign)
    in_units = [(plate, *_in_unit(plate)) for plate in plates]
    if any(unit is None for _, unit, _ in in_units):
        yield from (
            _unit_words(plate, unit, columns) for plate, unit, columns in in_units if unit is not None
        )
    for plate, unit, _ in in_units:
        if unit is None:
            yield from _exchanged(campaign, plate)


def _plates(campaign: Campaign) -> list[_Plate]:
    """The setups of runs that read points with one point of the tool and no rotary axis that turns."""
    probings, setups = campaign.probings, campaign.artefact.setups
    channels, readings = probings.channels, probings.readings
    names = [f"point_{axis}_mm" for axis in "xyz"]
    if "setup" not in channels or not (set(names) <= channels.keys() and {"X", "Y", "Z"} <= readings.keys()):
        return []
    read = np.column_stack([readings[axis] for axis in "XYZ"])
    points = np.column_stack([channels[name] for name in names])
    turning = [values for axis, values in readings.items() if not campaign.machine.is_linear(axis)]
    number = channels["setup"].astype(np.int64) - 1
    pairs, of_pair = np.unique(np.column_stack([probings.run, number]), axis=0, return_inverse=True)
    plates = []
    for pair, (run, index) in enumerate(pairs.tolist()):
        rows = np.flatnonzero((of_pair.reshape(-1) == pair) & np.isfinite(points).all(axis=1))
        setup = setups[index]
        of_one_point = "targets" in setup.known or len(np.unique(probings.target[rows])) == 1
        turns = any(np.ptp(values[rows]) > 0.0 for values in turning if len(rows))
        if setup.reading in ("point", "pose") and of_one_point and not turns and len(rows) >= FEWEST:
            plates.append(_Plate(int(run), setup, rows, read[rows], points[rows]))
    return plates


def _in_unit(plate: _Plate) -> tuple[Unit | None, str]:
    """The unit in which positions, or points, are those of a plate, and their columns; None where mm will do."""
    arms, to = plate.points - plate.points.mean(axis=0), plate.read - plate.read.mean(axis=0)
    left_vectors, sizes, right_vectors = np.linalg.svd(arms.T @ to)
    if sizes[1] < FLAT * sizes[0]:
        return None, ""
    factor = float(sizes.sum() / np.sum(arms**2))
    off = factor * arms @ left_vectors @ right_vectors - to
    if np.sqrt(np.mean(off**2)) > NEAR * np.sqrt(np.mean(to**2)):
        return None, ""
    for ratio, columns in (
        (factor, "x_mm, y_mm and z_mm"),
        (1.0 / factor, "point_x_mm, point_y_mm and point_z_mm"),
    ):
        units = mistaken_for_mm(ratio, NEAR_UNIT) if ratio < 1.0 else ()
        if units:
            return units[0], columns
    return None, ""


def _unit_words(plate: _Plate, unit: Unit, columns: str) -> str:
    return (
        f"columns {columns} of setup {plate.setup.id} in run {plate.run} look as if they were {UNIT_WORDS[unit]}: "
        "positions and points have the same distances only then, as they have in other setups; lengths are in mm"
    )


def _exchanged(campaign: Campaign, plate: _Plate) -> Iterator[str]:
    """Points that were read where others of the setup are stated."""
    moved = _carried(plate)
    if moved is None:
        return
    size = np.linalg.norm(moved - plate.read, axis=1)
    wrong = np.flatnonzero(size > max(OFF, NEAR * float(np.std(plate.read))))
    if not 0 < len(wrong) <= MOST_WRONG * len(size):
        return
    right = np.setdiff1d(np.arange(len(size)), wrong)
    names = campaign.probings.target[plate.rows]
    others = []
    for row in wrong:
        apart = np.linalg.norm(moved - plate.read[row], axis=1)
        nearest = int(np.argmin(apart))
        if apart[nearest] > OFF / 2.0 or np.array_equal(plate.points[nearest], plate.points[row]):
            return
        others.append(nearest)
    pairs = {tuple(sorted((str(names[row]), str(names[at])))) for row, at in zip(wrong, others, strict=True)}
    if len(right) < FEWEST or any(first == second for first, second in pairs):
        return
    sequences = campaign.probings.sequence[plate.rows[wrong]].tolist()
    shown = ", ".join(map(str, sequences[:MOST_NAMED])) + (", ..." if len(sequences) > MOST_NAMED else "")
    exchanged = " and of ".join(and_of(list(pair)) for pair in sorted(pairs))
    yield (
        f"setup {plate.setup.id}: in {len(wrong)} row{'s' * (len(wrong) > 1)} of run {plate.run} (sequence {shown}) "
        f"the points of {exchanged} were exchanged: the positions are those of the other one. Exchange their names "
        "and points there"
    )


def _carried(plate: _Plate) -> Array | None:
    """The points (m, 3) turned and shifted to the positions that most of them have; None where they lie in a line."""
    weight = np.ones(len(plate.read))
    moved = plate.read
    for _ in range(STEPS):
        share = (weight / weight.sum())[:, None]
        middle, centre = np.sum(share * plate.points, axis=0), np.sum(share * plate.read, axis=0)
        arms, to = plate.points - middle, plate.read - centre
        left_vectors, sizes, right_vectors = np.linalg.svd((share * arms).T @ to)
        if sizes[1] < FLAT * sizes[0]:
            return None
        moved = arms @ left_vectors @ right_vectors + centre
        # Sizes and not squares are made least: a few rows far off move nothing.
        weight = 1.0 / np.maximum(np.linalg.norm(moved - plate.read, axis=1), 1e-3)
    return moved


def tracker_doubts(campaign: Campaign) -> Iterator[str]:
    """Yield a sentence on rows of a tracker in another unit than the others of their run: two targets on a tool are as
    far apart at every pose, but there."""
    probings = campaign.probings
    names = [f"tracker_{axis}_mm" for axis in "xyz"]
    if not set(names) <= probings.channels.keys():
        return
    points = np.column_stack([probings.channels[name] for name in names])
    beside = {reflector.id for reflector in campaign.artefact.reflectors if reflector.fixed}
    for run in np.unique(probings.run).tolist():
        rows = np.flatnonzero(probings.run == run)
        rows = rows[~np.isin(probings.target[rows], list(beside))][:MOST_ROWS]
        if len(rows) < FEWEST:
            continue
        odd = _rows_in_unit(points[rows], probings.target[rows], _poses(campaign, rows))
        if odd is not None:
            unit, of_unit = odd
            sequences = probings.sequence[rows[of_unit]]
            yield (
                f"columns {and_of(names)} look as if they were {UNIT_WORDS[unit]} in {len(sequences)} rows of run "
                f"{run} (about sequences {sequences[0]} to {sequences[-1]}): the targets on the tool are as far apart "
                "as in the other rows only then; lengths are in mm"
            )


def _poses(campaign: Campaign, rows: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """The number (m,) of the pose of rows that follow each other."""
    state = np.column_stack([values[rows] for values in campaign.probings.readings.values()])
    return np.concatenate([[0], np.cumsum(np.any(np.diff(state, axis=0) != 0.0, axis=1))])


def _rows_in_unit(
    points: Array, names: npt.NDArray[np.str_], pose: npt.NDArray[np.int64]
) -> tuple[Unit, npt.NDArray[np.int64]] | None:
    """The unit and the rows of a part of the points (m, 3), by the steps from one row to the next at one pose; None
    where all rows have one unit."""
    second = np.flatnonzero(np.diff(pose) == 0) + 1
    steps = np.linalg.norm(points[second] - points[second - 1], axis=1)
    pairs = np.array([f"{names[row - 1]} {names[row]}" for row in second])
    for unit in mistaken_for_mm():
        in_mm = np.full(len(second), np.nan)
        for pair in np.unique(pairs) if unit.factor > 1.0 else ():
            of_pair = steps[pairs == pair]
            larger = of_pair[of_pair > np.sqrt(unit.factor) * of_pair.min()]
            in_mm[pairs == pair] = np.median(larger) if len(larger) else np.nan
        right = np.abs(steps / in_mm - 1.0) < NEAR_TRACKER
        wrong = np.abs(steps * unit.factor / in_mm - 1.0) < NEAR_TRACKER
        few = min(np.count_nonzero(right), np.count_nonzero(wrong)) < FEWEST
        # A pose within which the unit changes has steps of neither.
        if not few and np.count_nonzero(~(right | wrong)) <= CHANGES:
            return unit, np.flatnonzero(np.isin(pose, pose[second[wrong]]))
    return None
