"""Readings that are the nominal ones, pasted: to the last digit that is written they follow from what the file states.

What is measured scatters. Positions of a plate that are its stated places moved as a whole, a laser that reads what the
axis shows, or a deviation that is one number at all poses, say nothing of the machine, and pull at whatever is fitted
beside them. They are known by arithmetic: no fit is made. Where a digit is as coarse as the scatter nobody can know,
and nothing is said.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.readers.faults import and_of
from monitor.records import Array, Campaign, Setup

#: Decimals that are looked for, and in mm what positions differ by that are the same in floating point.
MOST_DECIMALS, SAME_NUMBER = 7, 1e-9
#: Rows at different places, or poses, from which on equal numbers are no chance.
FEWEST = 6
#: A digit that is more than this part of the stated standard uncertainty hides the scatter.
COARSE = 0.2
#: What others scatter is so many times the last digit at least.
DIGITS_OF_OTHERS = 3.0
#: Directions along which a plate has no extent, as a part of the largest.
FLAT = 1e-6
#: mm or rad of the columns of deviations, by their ending.
UNITS = {"_um": 1e-3, "_urad": 1e-6}
DEVIATIONS = ("dx_um", "dy_um", "dz_um", "reading_um", "reading_urad")


@dataclass(frozen=True)
class NominalReadings:
    """Rows (m,) of one ``run`` and ``setup`` whose readings are nominal: ``what`` they are and ``why``, in words."""

    run: int
    setup: str
    rows: npt.NDArray[np.int64]
    what: str
    why: str


@dataclass(frozen=True)
class _Block:
    """The rows (m,) of a setup in a run, and what is stated of one of its readings, in mm or rad."""

    run: int
    setup: Setup
    rows: npt.NDArray[np.int64]
    stated: float


@dataclass(frozen=True)
class _Moved:
    """Which rows (m,) of a block are the stated points moved as a whole, to within a ``digit``, and what the others
    scatter about theirs; None where there are none."""

    exact: npt.NDArray[np.bool_]
    digit: float
    scatter: float | None


def nominal_readings(campaign: Campaign) -> tuple[NominalReadings, ...]:
    """Return the rows that hold nominal numbers in place of readings, of each setup in each run."""
    blocks = _blocks(campaign)
    return (*_places(campaign, blocks), *_displacements(campaign, blocks), *_constants(campaign, blocks))


def nominal_words(campaign: Campaign) -> Iterator[str]:
    """Yield a sentence on each setup and run with nominal numbers in place of readings; none for none."""
    for each in nominal_readings(campaign):
        yield (
            f"setup {each.setup}: in {_named_range(campaign, each.rows)} {each.what} {each.why}: nominal values are no "
            "measurement, and pull at what is fitted beside them. Put in what was read, or leave these rows out"
        )


def nominal_mistake(campaign: Campaign, nominal: Sequence[NominalReadings]) -> str:
    """What is wrong with nominal readings, as the end of "it looks as if"."""
    return " and ".join(
        f"{each.what} of setup {each.setup} were no readings in {_named_range(campaign, each.rows)}, but nominal "
        "values that were put in (undone: without these rows)"
        for each in nominal
    )


def _named_range(campaign: Campaign, rows: npt.NDArray[np.int64]) -> str:
    """Name rows of one run by their count and their first and last sequence number."""
    probings, first, last = campaign.probings, rows[0], rows[-1]
    return (
        f"{len(rows)} rows of run {probings.run[first]} (sequences {probings.sequence[first]} to "
        f"{probings.sequence[last]})"
    )


def _blocks(campaign: Campaign) -> list[_Block]:
    """The rows of each setup in each run; none of a method without setups."""
    probings, setups = campaign.probings, campaign.artefact.setups
    if "setup" not in probings.channels:
        return []
    number = probings.channels["setup"].astype(np.int64) - 1
    pairs, of_pair = np.unique(np.column_stack([probings.run, number]), axis=0, return_inverse=True)
    return [
        _Block(int(run), setups[index], np.flatnonzero(of_pair.reshape(-1) == pair), stated)
        for pair, (run, index) in enumerate(pairs.tolist())
        if (stated := setups[index].standard_uncertainty) is not None
    ]


def _places(campaign: Campaign, blocks: Sequence[_Block]) -> Iterator[NominalReadings]:
    """Positions that are the stated points moved as a whole, where others scatter about theirs."""
    readings, channels = campaign.probings.readings, campaign.probings.channels
    of_points = [block for block in blocks if block.setup.reading in ("point", "pose")]
    if not (of_points and "point_x_mm" in channels and {"X", "Y", "Z"} <= readings.keys()):
        return
    read = np.column_stack([readings[axis] for axis in "XYZ"])
    none = np.full(len(read), np.nan)
    stated = np.nan_to_num(np.column_stack([channels.get(f"point_{axis}_mm", none) for axis in "xyz"]))
    finest = _digit(read)
    looked_at = [
        (block, _as_moved(read[block.rows], stated[block.rows], finest, COARSE * block.stated))
        for block in of_points
        if finest <= COARSE * block.stated and not _turns(campaign, block)
    ]
    scatters = [moved.scatter for _, moved in looked_at if moved.scatter is not None]
    usual = float(np.median(scatters)) if scatters else np.inf
    for block, moved in looked_at:
        if moved.exact.any() and usual >= DIGITS_OF_OTHERS * moved.digit:
            yield NominalReadings(
                block.run, block.setup.id, block.rows[moved.exact], "the positions of X, Y and Z",
                "are the stated points moved as a whole, to the last digit that is written",
            )  # fmt: skip


def _turns(campaign: Campaign, block: _Block) -> bool:
    """Whether a rotary axis moved in the rows of a block."""
    readings = campaign.probings.readings.items()
    return any(
        np.ptp(values[block.rows]) > 0.0 for axis, values in readings if not campaign.machine.is_linear(axis)
    )


def _as_moved(read: Array, stated: Array, finest: float, most: float) -> _Moved:
    """How positions (m, 3) are stated points (m, 3): all of them turned and shifted, or those of at least ``FEWEST``
    that one shift along the axes brings there. Their digit is at least the ``finest`` of the column and at ``most``
    what still shows their scatter."""
    none = np.zeros(len(read), dtype=bool)
    digit = min(max(_digit(read), finest), most)
    if len(np.unique(stated, axis=0)) < FEWEST:
        return _Moved(none, digit, None)
    arms, to = stated - stated.mean(axis=0), read - read.mean(axis=0)
    left_vectors, sizes, right_vectors = np.linalg.svd(arms.T @ to)
    if sizes[1] < FLAT * sizes[0]:
        return _Moved(none, digit, None)
    turn = left_vectors @ right_vectors
    off = arms @ turn - to
    if np.abs(off).max() <= digit:
        return _Moved(~none, digit, None)
    scatter = float(np.sqrt(np.mean(off**2)))
    shifted = _shifted_alike(read, stated, np.round(turn), max(finest, SAME_NUMBER))
    return _Moved(none, digit, scatter) if shifted is None else _Moved(shifted, finest, scatter)


def _shifted_alike(read: Array, stated: Array, turn: Array, digit: float) -> npt.NDArray[np.bool_] | None:
    """The positions (m, 3) of most that one shift makes of the stated points (m, 3) turned from axes to axes; None of
    fewer places than ``FEWEST``, or where that is no turn."""
    if not np.array_equal(turn @ turn.T, np.eye(3)):
        return None
    steps = np.round((read - stated @ turn) / digit).astype(np.int64)
    _, group, count = np.unique(steps, axis=0, return_inverse=True, return_counts=True)
    of_most = group.reshape(-1) == np.argmax(count)
    return of_most if len(np.unique(stated[of_most], axis=0)) >= FEWEST else None


def _displacements(campaign: Campaign, blocks: Sequence[_Block]) -> Iterator[NominalReadings]:
    """Lasers that read what the axis shows along which they stand."""
    readings = campaign.probings.readings
    of_lasers = [block for block in blocks if block.setup.reading == "displacement"]
    travel = campaign.probings.channels.get("reading_um", np.zeros(0))
    finest = min((UNITS["_um"] * _digit(travel[block.rows]) for block in of_lasers), default=0.0)
    for block in of_lasers:
        moving = [axis for axis, values in readings.items() if np.ptp(values[block.rows]) > SAME_NUMBER]
        if len(moving) != 1 or not campaign.machine.is_linear(moving[0]):
            continue
        shown = readings[moving[0]][block.rows]
        read = UNITS["_um"] * travel[block.rows]
        off = min(float(np.ptp(read - sign * shown)) for sign in (1.0, -1.0))
        if off <= max(finest, SAME_NUMBER) <= COARSE * block.stated and len(np.unique(shown)) >= FEWEST:
            yield NominalReadings(
                block.run, block.setup.id, block.rows, "reading_um",
                f"is what {moving[0].lower()}_mm shows, to the last digit that is written",
            )  # fmt: skip


def _constants(campaign: Campaign, blocks: Sequence[_Block]) -> Iterator[NominalReadings]:
    """Deviations that are one number at all poses of a setup in a run, where others of its kind scatter."""
    probings = campaign.probings
    for block in blocks:
        kind = block.setup.reading
        columns = [name for name in DEVIATIONS if name in probings.channels]
        still = [name for name in columns if np.ptp(probings.channels[name][block.rows]) == 0.0]
        poses = np.column_stack([values[block.rows] for values in probings.readings.values()])
        if kind == "displacement" or not still or len(np.unique(poses, axis=0)) < FEWEST:
            continue
        others = [other for other in blocks if other.setup.reading == kind and other is not block]
        if not all(_scatters(probings.channels[name], others, name, block.stated) for name in still):
            continue
        value = probings.channels[still[0]][block.rows[0]]
        yield NominalReadings(
            block.run, block.setup.id, block.rows, and_of(still),
            f"{'is' if len(still) == 1 else 'are'} {value:g} at all poses",
        )  # fmt: skip


def _scatters(column: Array, others: Sequence[_Block], name: str, stated: float) -> bool:
    """Whether a column scatters in other setups or runs, with digits that show what is ``stated``."""
    values = [column[other.rows] for other in others if np.isfinite(column[other.rows]).all()]
    digit = max((_digit(each) for each in values), default=np.inf)
    unit = next(factor for ending, factor in UNITS.items() if name.endswith(ending))
    return unit * digit <= COARSE * stated and all(
        np.std(each) >= DIGITS_OF_OTHERS * digit for each in values
    )


def _digit(values: Array) -> float:
    """The last decimal digit that values have, in their unit; 0 where that is too far behind the point."""
    rounding = SAME_NUMBER + 1e-13 * float(np.abs(values).max())
    for decimals in range(MOST_DECIMALS):
        if np.allclose(values, np.round(values, decimals), rtol=0.0, atol=rounding):
            return float(10.0**-decimals)
    return 0.0
