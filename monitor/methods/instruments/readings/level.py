"""``level``: the turn of one side against gravity about a direction (an electronic level)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.methods.instruments.reading import LEVER, Rows, Shown, Stance, direction_of
from monitor.methods.instruments.readings.angle import turned_about
from monitor.methods.instruments.readings.component import Zeroed
from monitor.records import Array


@dataclass(frozen=True)
class Level(Zeroed):
    """The turn of the tool side or of the work side about n, in the bed's frame, less the zero."""

    name: ClassVar[str] = "level"
    columns: ClassVar[tuple[str, ...]] = ("reading_urad",)
    angular: ClassVar[bool] = True

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        assert stance.nominal is not None
        on_tool = self.setup.side == "tool"
        side, nominal = (stance.tool, stance.nominal.tool) if on_tool else (stance.work, stance.nominal.work)
        value, slope = turned_about(direction_of(self.setup), side, nominal)
        return Shown(
            residual=(value - LEVER * values.sum(axis=1))[:, None] - rows.measured,
            by_tool=slope if on_tool else None,
            by_work=None if on_tool else slope,
            by_own=np.full((len(rows), 1, values.shape[1]), -LEVER),
            along=np.tile(direction_of(self.setup), (len(rows), 1, 1)),
        )


READING = Level
