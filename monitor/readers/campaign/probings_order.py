"""Order within a run: no sequence number twice, and no time that runs backwards."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.readers.faults import Faults
from monitor.readers.tables.csv_table import CsvTable
from monitor.readers.tables.csv_values import Mask, Numbers, Wholes


def refuse_disorder(
    table: CsvTable, run: Wholes, sequence: Wholes | None, time: Numbers, faults: Faults
) -> Mask:
    """Return which rows are in order. Time must not run backwards from row to row nor from sequence to sequence."""
    fine: Mask = np.ones(len(table), dtype=np.bool_)
    early = time.good & (time.values < 0.0)
    for row in np.flatnonzero(early).tolist():
        message = "time_s counts from the start of the run; it must be 0 or more"
        faults.add(table.file, table.lines[row], "time_s", message)
    fine &= ~early

    rows = np.flatnonzero(run.good & time.good & ~early)
    late = _backwards(rows[np.argsort(run.values[rows], kind="stable")], run, time)
    if sequence is not None:
        both = rows[sequence.good[rows]]
        by_sequence = both[np.lexsort((sequence.values[both], run.values[both]))]
        fine[_refuse_repeated(table, by_sequence, run, sequence, faults)] = False
        if not late:
            late = _backwards(by_sequence, run, time)
    for before, after in late:
        earlier, later = float(time.values[before]), float(time.values[after])
        faults.add(
            table.file,
            table.lines[after],
            "time_s",
            f"time runs backwards in run {run.values[after]}: {later!r} s after {earlier!r} s on line "
            f"{table.lines[before]}; keep the order in which the points were probed",
        )
        fine[after] = False
    return fine


def _backwards(rows: npt.NDArray[np.intp], run: Wholes, time: Numbers) -> list[tuple[int, int]]:
    """Return pairs of rows, next to each other in a run, of which the second is earlier."""
    before, after = rows[:-1], rows[1:]
    wrong = (run.values[before] == run.values[after]) & (time.values[after] < time.values[before])
    return list(zip(before[wrong].tolist(), after[wrong].tolist(), strict=True))


def _refuse_repeated(
    table: CsvTable, rows: npt.NDArray[np.intp], run: Wholes, sequence: Wholes, faults: Faults
) -> list[int]:
    """Note every sequence number that a run has twice; return the second rows."""
    before, after = rows[:-1], rows[1:]
    same = (run.values[before] == run.values[after]) & (sequence.values[before] == sequence.values[after])
    for first, again in zip(before[same].tolist(), after[same].tolist(), strict=True):
        faults.add(
            table.file,
            table.lines[again],
            "sequence",
            f"sequence {sequence.values[again]} stands twice in run {run.values[again]}, also on line "
            f"{table.lines[first]}; number the probings of a run one by one",
        )
    repeated: list[int] = after[same].tolist()
    return repeated
