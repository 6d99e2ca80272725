"""The words at upright lines of a history: where they hide no runs, and not each other."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Any, NamedTuple

import numpy as np

from monitor.records import Array

#: Height of words, of the paper, and width of one of their letters, of the time that the runs span: at 11 px on a chart
#: of 1440 px; on a narrow one they are wider.
HIGH, LETTER = 0.055, 0.008
#: Words are cut to so many letters.
MOST_LETTERS = 60


class Line(NamedTuple):
    """An upright line with its words and their colour."""

    at: str
    text: str
    colour: str


class Runs(NamedTuple):
    """Runs as a chart shows them: ``at`` (n,) of the time that they span, ``low`` and ``high`` (n,) the ends of their
    bars on the paper, NaN where a run has no value; ``begin`` and ``end`` of that time."""

    at: Array
    low: Array
    high: Array
    begin: datetime
    end: datetime

    @classmethod
    def of(cls, moments: Sequence[datetime], values: Array, u: Array, lowest: float) -> Runs:
        """The runs of values (n,) with bars of ``u`` (n,) on an axis from ``lowest`` to the top of the paper."""
        begin, end = min(moments), max(moments)
        span = (end - begin).total_seconds() or 1.0
        low, high = values - u, values + u
        least = np.nanmin(low, initial=np.inf)
        across = np.nanmax(high, initial=-np.inf) - least
        part = (1.0 - lowest) / (across if 0.0 < across < np.inf else 1.0)
        at = np.array([(moment - begin).total_seconds() / span for moment in moments])
        return cls(at, lowest + part * (low - least), lowest + part * (high - least), begin, end)

    def hidden(self, start: float, width: float, top: float) -> int:
        """How many runs words hide that begin at ``start`` and are so wide, below ``top``."""
        beside = (self.at >= start) & (self.at <= start + width)
        return int(np.count_nonzero(beside & (self.high >= top - HIGH) & (self.low <= top)))


def words_at_lines(lines: Sequence[Line], runs: Runs, lowest: float) -> list[Any]:
    """Return the words as notes of a chart, each on paper of its own: where they hide the fewest runs and no others; of
    such places the highest, and on the right of its line but in the last quarter of the runs."""
    span = (runs.end - runs.begin).total_seconds() or 1.0
    rungs = np.arange(1.0, lowest + HIGH, -HIGH)
    notes: list[Any] = []
    written: list[tuple[float, float, float]] = []
    for line in lines:
        text = line.text[:MOST_LETTERS]
        at, width = (datetime.fromisoformat(line.at) - runs.begin).total_seconds() / span, LETTER * len(text)
        sides = (at - width, at) if at > 0.75 else (at, at - width)
        _, step, side = min(
            (runs.hidden(start, width, top) + len(runs.at) * _covered(written, start, width, top), step, side)
            for step, top in enumerate(rungs)
            for side, start in enumerate(sides)
        )
        written.append((sides[side], width, rungs[step]))
        notes.append(
            {
                "x": line.at, "yref": "paper", "y": float(rungs[step]), "yanchor": "top", "text": text,
                "showarrow": False, "xanchor": "left" if sides[side] == at else "right", "bgcolor": "@paper",
                "font": {"color": line.colour, "size": 11},
            }
        )  # fmt: skip
    return notes


def _covered(written: Sequence[tuple[float, float, float]], start: float, width: float, top: float) -> int:
    return sum(
        abs(top - other_top) < 0.9 * HIGH and start < other + other_width and other < start + width
        for other, other_width, other_top in written
    )
