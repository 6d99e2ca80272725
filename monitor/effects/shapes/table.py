"""``table`` and ``table9``: a free form along the travel, on evenly spaced nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.exceptions import EffectError
from monitor.records import Array

# Hats of `table`: seven nodes over the visited range resolve a guideway error of a third of the stroke and
# leave four touches a node with 15 indexations of 4 balls.
TABLE_NODES = 7
PHRASE = ", of free form along its travel"


@dataclass(frozen=True)
class Table(DescribedShape):
    """Hat functions on evenly spaced nodes over the range that the axis visited."""

    nodes: int = TABLE_NODES
    pattern: ClassVar[str] = r"table(?P<nodes>\d{1,2})?"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        nodes = int(groups.get("nodes", TABLE_NODES))
        if nodes < 2:
            raise EffectError(f"table{nodes} has too few nodes; write table or table2 and above")
        return cls(nodes)

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f".node{number}" for number in range(1, self.nodes + 1))

    def columns(self, context: Context, joint: int) -> Array:
        q, visited = context.places[:, joint], context.scaling.places[:, joint]
        grid = np.linspace(visited.min(), visited.max(), self.nodes)
        step = grid[1] - grid[0]
        if step == 0:
            return np.column_stack([np.ones(len(q)), np.zeros((len(q), self.nodes - 1))])
        hats: Array = np.clip(1.0 - np.abs(q[:, None] - grid) / step, 0.0, None)
        return hats

    def phrase(self, error: JointError) -> str:
        return PHRASE


REGISTERED = (Table,)
