"""``flexure:tool@gravity`` and ``flexure:DEC@gravity``: a tube or an axis that sags under its own weight.

What sags turns downwards by one coefficient times the component of gravity across it, whichever way it points: the
tilts about both directions across share that coefficient (P. T. Wallace, TPOINT, terms TF and DAF; a beam of constant
section in small deflection). One way alone of an alt-azimuth mount is the cosine of the elevation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import OWN_DOCUMENT, Description
from monitor.effects.registry import BuiltIn
from monitor.exceptions import EffectError
from monitor.machine import Chain
from monitor.records import Array
from monitor.units import MICRORADIAN, Unit


@dataclass(frozen=True)
class Flexure(BuiltIn):
    """Sagging of the tool along its own direction, or of what a rotary axis carries along that axis."""

    part: str
    unit: Unit = MICRORADIAN
    pattern: ClassVar[str] = r"flexure:(?P<part>[A-Za-z][A-Za-z0-9]*)@gravity"

    @property
    def text(self) -> str:
        return f"flexure:{self.part}@gravity"

    @property
    def is_of_tool(self) -> bool:
        """Whether it is the tool that sags."""
        return self.part == "tool"

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def joint(self, chain: Chain) -> int:
        if not self.is_of_tool:
            turning = [joint.name for joint in chain.joints if joint.turns]
            if self.part not in turning:
                names = ", ".join(["tool", *turning])
                raise EffectError(
                    f"'{self.text}': {self.part} is nothing that sags here; write one of {names}"
                )
            return chain.index(self.part)
        if not chain.tool:
            raise EffectError(
                f"'{self.text}': '{chain.topology}' has no axis on the tool's side that carries a tool"
            )
        return len(chain.joints) - 1

    def turns(self, context: Context) -> Array:
        joint = self.joint(context.chain)
        along = np.array(context.chain.joints[joint].direction)
        if self.is_of_tool:
            if context.sight is None:
                raise EffectError(f"'{self.text}': nothing says where the tool points (tool_direction)")
            along = context.sight
        return np.cross(along, context.gravity[:, joint])[:, :, None]

    def described(self, driven: str) -> Description:
        what = "tool (tube, ram, arm)" if self.is_of_tool else f"axis {self.part}"
        return Description(
            f"the {what} sags under its own weight, in proportion to the component of gravity across it{driven}",
            f"the {what} and its fastening give way under the weight that hangs on them",
            "stiffen or balance it, check the fastening for play, or compensate the direction by the pose",
            OWN_DOCUMENT,
        )


REGISTERED = (Flexure,)
