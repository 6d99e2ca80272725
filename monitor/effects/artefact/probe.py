"""``probe:lobing3``: a touch probe whose pre-travel depends on the direction in which it touches.

What the probe travels further before it triggers, the touched surface seems to give way: each touched point shifts
along its normal. The direction is that of the normal seen from the last tool axis, with which the probe turns.
Of a ball touched all around, whose centre a row states, nothing says the direction: it has no lobes to be seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.artefact.workpiece import normals_of
from monitor.effects.context import Context
from monitor.effects.description import Description
from monitor.effects.registry import BuiltIn
from monitor.records import Array
from monitor.units import MICROMETRE, Unit


@dataclass(frozen=True)
class ProbeLobing(BuiltIn):
    """Cosine and sine of so many ``lobes`` times the angle of the direction about the tool's main axis, by the part of
    the direction that lies across it."""

    lobes: int
    unit: Unit = MICROMETRE
    pattern: ClassVar[str] = r"probe:lobing(?P<lobes>[23])"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(int(groups["lobes"]))

    @property
    def text(self) -> str:
        return f"probe:lobing{self.lobes}"

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".cos", ".sin")

    def shifts(self, context: Context) -> Array:
        normals = normals_of(context, self.text)
        direction = _from_tool(context, normals)
        # The tool points along the Z of its frame at all axes zero, as the chain is described.
        across = np.hypot(direction[:, 0], direction[:, 1])
        angle = self.lobes * np.arctan2(direction[:, 1], direction[:, 0])
        lobes = across[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        shifts: Array = normals[:, :, None] * lobes[:, None, :]
        return shifts

    def described(self, driven: str) -> Description:
        return Description(
            f"the probe triggers by the direction of touching, {self.lobes} lobes a turn{driven}",
            "the trigger force of the probe depends on the direction, or the ball of the stylus is not round",
            "calibrate the probe in the directions that are used, turn it with the spindle so that it always touches "
            "with the same side, or use a probe with less pre-travel; the machine needs no correction",
            "ISO 230-10:2016 (probing systems of machine tools); docs/effects.md",
        )


def _from_tool(context: Context, normals: Array) -> Array:
    """Directions (n, 3) of the last work axis's frame, seen from that of the last tool axis."""
    chain, (rotations, _) = context.chain, context.axis_frames
    if chain.work:
        normals = np.einsum("nij,nj->ni", rotations[:, len(chain.work) - 1], normals)
    if chain.tool:
        normals = np.einsum("nji,nj->ni", rotations[:, -1], normals)
    return normals


REGISTERED = (ProbeLobing,)
