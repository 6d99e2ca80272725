"""What instruments that stand as first guessed read of a machine without errors, for effects of instruments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.effects import Context, InstrumentRows, ReadBy
from monitor.machine import evaluate, orientation
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.reading import LEVER, Stance
from monitor.records import Array


def ideal_rows(context: Context, parts: Sequence[Part]) -> InstrumentRows:
    """What every row reads, of a machine without errors, for effects of instruments."""
    count = len(context)
    most = max(len(part.reading.numbers) for part in parts)
    ideal, towards = np.full((count, most), np.nan), np.zeros((count, most, 3))
    setup = np.zeros(count, dtype=np.int64)
    for index, part in enumerate(parts):
        setup[part.at] = index
        rows, reading = part.rows, part.reading
        none = np.zeros((len(rows), len(context.chain.joints), 2, 6))
        values = reading.start(1)[np.zeros(len(rows), dtype=np.int64)]
        work, tool = reading.ends(values, rows)
        sides = orientation(context.chain, rows.positions, none)
        turned = np.swapaxes(sides.work, 1, 2) @ sides.tool
        r = evaluate(context.chain, rows.positions, none, work, tool).residual
        stance = Stance(r, turned, sides.work, sides.tool)
        shown = reading.shown(replace(stance, nominal=stance), values, rows)
        numbers = shown.residual.shape[1]
        if rows.measured.shape[1] == numbers:
            read = shown.residual + rows.measured
            ideal[part.at, :numbers] = _since_the_first(read, rows.run) if reading.relative else read
        if shown.by_shift is not None and shown.by_turn is None:
            towards[part.at, :numbers] = np.einsum("nka,nab->nkb", shown.by_shift, turned)
    read_by = [_read_by(part) for part in parts]
    return InstrumentRows(tuple(read_by), setup, ideal, towards, LEVER)


def _read_by(part: Part) -> ReadBy:
    reading = part.reading
    return ReadBy(part.id, part.instrument, reading.name, len(reading.numbers), reading.has_own_frame)


def _since_the_first(read: Array, run: npt.NDArray[np.int64]) -> Array:
    """Numbers (m, k) less those of the first row of their run."""
    _, first, of_row = np.unique(run, return_index=True, return_inverse=True)
    return np.asarray(read - read[first[of_row]])
