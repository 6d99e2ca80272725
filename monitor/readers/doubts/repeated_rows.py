"""Rows of a run that repeat rows before them in every number: a file that was joined with itself, or exported twice.

Counted as independent they make u too small. Readings of one pose agree where they are rounded, in most of the rows
where a display is coarse and the machine stable. So a block of rows, each equal to the one so many rows before it, is
judged by how often its rows equal earlier ones of it whose pose was reached in the same way, which shows what the
readings scatter. Where too few come back so, the rows around it say how often rows are equal; these may be of a machine
that was warming up, and where the display is coarse, both things that it may be are said.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.records import Campaign

#: Fewer rows one behind the other, or fewer different first readings among them, say nothing.
LEAST_ROWS, LEAST_DIFFERENT = 8, 4
#: A block is told where rows as often equal as those around it have one in less than this part of all such files.
CHANCE = 1e-6
#: So many rows on either side are those around a block, or as many as it has: a machine that warmed up first repeats
#: itself in no row, and later in nine of ten.
AROUND = 50
#: Where fewer are around, all rows of the series count whose pose came back; where these are few too, as in a file of
#: one pass that is joined with itself, all rows of it.
FEW_AROUND, FEW = 30, 10
#: How often rows are equal is taken at the upper end of what the rows around allow with this probability.
UPPER = 0.95
#: A display whose digit is finer than this part of what is stated of a reading hides no scatter.
COARSE = 0.1
#: Columns of readings by the ending of their names, in mm and rad.
READINGS = {"_um": 1e-3, "_urad": 1e-6, "_mm": 1.0}
#: Decimals that are looked for.
MOST_DECIMALS = 6
#: Distances between rows that are tried: those of the longest blocks.
MOST_DISTANCES = 20
#: Numbers that mix the columns of a row into one (Knuth's multiplicative hashing, by the golden ratio).
MIXING = 0x9E3779B97F4A7C15


@dataclass(frozen=True)
class _Block:
    """``length`` rows from ``begin`` on that equal those ``distance`` rows before them, as do ``equal`` of ``others``;
    ``chance`` is the natural logarithm of its probability; ``is_compared`` where its own rows show the scatter."""

    begin: int
    length: int
    distance: int
    equal: int
    others: int
    chance: float
    is_compared: bool


@dataclass(frozen=True)
class RepeatedRows:
    """Rows of a ``run`` with the numbers ``sequences`` that equal those from number ``of`` on in all but their times,
    as do ``equal`` of ``others``. They ``may_be_passes`` where the display hides what readings scatter."""

    run: int
    sequences: tuple[int, ...]
    of: int
    equal: int
    others: int
    may_be_passes: bool


def repeated_rows(campaign: Campaign) -> Iterator[str]:
    """A sentence on the least likely block of rows that repeats an earlier one in all but its times."""
    rows = rows_repeated(campaign)
    if rows is None:
        return
    equal = (
        f"{len(rows.sequences)} rows of run {rows.run}, from sequence {rows.sequences[0]} on, equal those from "
        f"sequence {rows.of} on in every number"
    )
    if rows.may_be_passes:
        yield (
            f"{equal}: either they were exported twice, or files joined, and counted so often they make u too small; "
            "or the display hides the scatter, and passes that agree so say nothing of repeatability"
        )
        return
    yield (
        f"{equal}; of {rows.others} other rows {rows.equal} repeat one so: were they exported twice, or two files "
        "joined? Counted twice they make u too small"
    )


def rows_repeated(campaign: Campaign) -> RepeatedRows | None:
    """The rows that ``repeated_rows`` tells of; None where there are none."""
    block = _block_of(campaign)
    if block is None:
        return None
    probings, begin = campaign.probings, block.begin
    return RepeatedRows(
        int(probings.run[begin]),
        tuple(probings.sequence[begin : begin + block.length].tolist()),
        int(probings.sequence[begin - block.distance]),
        block.equal,
        block.others,
        not block.is_compared and _is_coarse(campaign, begin),
    )


def repeated_sequences(campaign: Campaign) -> tuple[int, tuple[int, ...]] | None:
    """The run and the sequence numbers of the rows that ``repeated_rows`` tells of; None where there are none."""
    rows = rows_repeated(campaign)
    return None if rows is None else (rows.run, rows.sequences)


def _block_of(campaign: Campaign) -> _Block | None:
    """The least likely block of rows that repeats an earlier one; None where none is unlikely."""
    probings = campaign.probings
    if len(probings) < 2 * LEAST_ROWS:
        return None
    columns = [*probings.readings.values(), *probings.channels.values()]
    numbers = _mixed(probings.run, columns)
    setup = [probings.channels["setup"]] if "setup" in probings.channels else []
    poses = _mixed(probings.run, [*probings.readings.values(), *setup])
    # The same pose is the same only where it was reached from the same one: a reversal is no scatter.
    before = np.concatenate([[np.uint64(0)], poses[:-1]])
    poses = (poses ^ (before >> np.uint64(7))) * np.uint64(MIXING)
    first, previous = _equal_before(numbers)
    rows = _Rows(numbers, _mixed(probings.run, setup), poses, first >= 0)
    distances = {distance for earlier in (first, previous) for distance in _distances(earlier)}
    blocks = [block for distance in sorted(distances) if (block := rows.block(distance)) is not None]
    block = min(blocks, key=lambda each: each.chance, default=None)
    if block is None or block.chance > np.log(CHANCE):
        return None
    different = max(len(np.unique(column[block.begin : block.begin + block.length])) for column in columns)
    return block if different >= LEAST_DIFFERENT else None


def _is_coarse(campaign: Campaign, row: int) -> bool:
    """Whether no reading of the series of a row has a digit far below the stated standard uncertainty."""
    probings, stated = campaign.probings, campaign.probe.standard_uncertainty
    series, is_read_by_axes = probings.run == probings.run[row], False
    if "setup" in probings.channels:
        number = probings.channels["setup"]
        series &= number == number[row]
        setup = campaign.artefact.setups[int(number[row]) - 1]
        stated = setup.standard_uncertainty or stated
        is_read_by_axes = "targets" in setup.known
    digits = [
        factor * _digit(values[series & np.isfinite(values)])
        for name, values in probings.channels.items()
        for ending, factor in READINGS.items()
        if name.endswith(ending) and np.isfinite(values[row])
    ]
    if is_read_by_axes:
        # Balls whose places a certificate gives are measured by the axes: what scatters stands in their columns.
        linear = (name for name in probings.readings if campaign.machine.is_linear(name))
        digits += [_digit(probings.readings[name][series]) for name in linear]
    return min(digits, default=0.0) >= COARSE * stated


def _digit(values: npt.NDArray[np.float64]) -> float:
    """The last decimal digit that values (m,) have; 0 where that is too far behind the point."""
    for decimals in range(MOST_DECIMALS):
        if np.allclose(values, np.round(values, decimals), rtol=0.0, atol=10.0**-MOST_DECIMALS):
            return float(10.0**-decimals)
    return 0.0


def _equal_before(rows: npt.NDArray[np.uint64]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The first and the last of the rows (n,) before each that equal it, -1 where none does."""
    order = np.argsort(rows, kind="stable")
    is_same = np.concatenate([[False], rows[order[1:]] == rows[order[:-1]]])
    previous, first = np.full(len(rows), -1), np.full(len(rows), -1)
    previous[order[is_same]] = order[np.flatnonzero(is_same) - 1]
    begins = np.maximum.accumulate(np.where(is_same, 0, np.arange(len(rows))))
    first[order[is_same]] = order[begins[is_same]]
    return first, previous


def _distances(earlier: npt.NDArray[np.int64]) -> list[int]:
    """The distances of the longest blocks of rows whose ``earlier`` (n,) ones follow one another too."""
    repeats = earlier >= 0
    begins, lengths = _blocks(repeats[1:] & repeats[:-1] & (np.diff(earlier) == 1))
    longest = begins[np.argsort(-lengths, kind="stable")[:MOST_DISTANCES]]
    return [int(begin - earlier[begin]) for begin in longest]


def _blocks(holds: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Where blocks of rows begin for which it ``holds`` (n,), and how many rows they have."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], holds.astype(np.int8), [0]])))
    return edges[::2], np.diff(edges)[::2]


@dataclass(frozen=True)
class _Rows:
    """What is the same in rows (n,): all their ``numbers``, their ``series`` (run and setup), their ``poses`` with the
    way there; and which of them ``repeat`` any row before."""

    numbers: npt.NDArray[np.uint64]
    series: npt.NDArray[np.uint64]
    poses: npt.NDArray[np.uint64]
    repeat: npt.NDArray[np.bool_]

    def block(self, distance: int) -> _Block | None:
        """The longest block at a distance, by its own rows that came back, those around it, or as many others as can
        speak; None where it is too short."""
        is_equal = self.numbers[distance:] == self.numbers[:-distance]
        begins, lengths = _blocks(is_equal)
        length = int(lengths.max(initial=0))
        if length < LEAST_ROWS:
            return None
        begin = int(begins[int(lengths.argmax())])
        reach = max(AROUND, length)
        around = np.arange(max(begin - reach, 0), min(begin + length + reach, len(is_equal)))
        around = around[(around < begin) | (around >= begin + length)]
        others = self.series == self.series[begin]
        same = is_equal[around[others[around] & others[around + distance]]]
        others[distance + begin : distance + begin + length] = False
        last_time = _equal_before(self.poses)[1]
        once = np.arange(begin, begin + min(length, distance))
        back = once[last_time[once] >= begin]
        within = self.numbers[back] == self.numbers[last_time[back]]
        is_compared = len(within) >= FEW
        if is_compared:
            same = within
        elif len(same) < FEW_AROUND:
            came_back = others & (last_time >= 0)
            same = np.concatenate([same, self.numbers[came_back] == self.numbers[last_time[came_back]]])
            if len(same) < FEW:
                same = np.concatenate([same, self.repeat[others & ~came_back]])
        return _Block(
            begin + distance,
            length,
            distance,
            int(np.count_nonzero(same)),
            len(same),
            _log_chance(
                int(np.count_nonzero(self.series[distance:] == self.series[:-distance])), length, same
            ),
            is_compared,
        )


def _log_chance(count: int, length: int, same: npt.NDArray[np.bool_]) -> float:
    """The natural logarithm of how many blocks of a length so many rows begin, where ``same`` (m,) are equal."""
    # Loaded here: of most files no row repeats another.
    from scipy.special import betaincinv

    equal, others = int(np.count_nonzero(same)), len(same)
    rate = float(betaincinv(equal + 1, others - equal, UPPER)) if equal < others else 1.0
    return float(np.log(count) + length * np.log(rate))


def _mixed(run: npt.NDArray[np.int64], columns: list[npt.NDArray[np.float64]]) -> npt.NDArray[np.uint64]:
    """One number (n,) for each row of the run and all columns; different rows share one in 2^-64 of all cases."""
    mixed = run.astype(np.uint64)
    for column in columns:
        # -0.0 is 0.0; one NaN stands for an empty cell.
        bits = (np.asarray(column, dtype=np.float64) + 0.0).view(np.uint64)
        mixed = (mixed ^ bits) * np.uint64(MIXING)
        mixed ^= mixed >> np.uint64(29)
    return mixed
