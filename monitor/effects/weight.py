"""What weights further out on the chain do to an axis: the drivers of the shape ``compliance``.

A drive gives way in proportion to the torque about its axis, a bearing in proportion to the torque across it.
``@gravity`` takes one load at the origin of the last axis (the flange), as the chain places it. ``@link_weights``
takes the weight of everything between, wherever its centre of mass lies: for each axis further out the moments of
the mass that it carries along the three directions of its frame. Multipliers are the torques of a unit weight, mm,
and for ``@link_weights`` those of a unit weight 1 mm off the axis's origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.effects.context import Context
from monitor.machine import Joint, Term, torques_in_joint_frames
from monitor.records import Array
from monitor.units import METRE, MILLIMETRE, Unit


def _carried(context: Context, joint: int) -> range:
    """The joint and those further out on its branch."""
    work = len(context.chain.work)
    return range(joint, work if joint < work else len(context.chain.joints))


@dataclass(frozen=True)
class Load:
    """The torque, about the axis of a term, of a unit weight at the flange."""

    component: int

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def columns(self, context: Context, joint: int | None) -> Array:
        assert joint is not None
        last = _carried(context, joint)[-1]
        torques = torques_in_joint_frames(context.chain, context.positions, last, np.zeros(3))
        return torques[:, joint, self.component, None]

    def unit(self) -> Unit:
        return METRE


@dataclass(frozen=True)
class LinkWeights:
    """The torques of weights fixed to the axis itself and to each one further out, each at any place there."""

    joint: Joint
    component: int

    def labels(self, context: Context) -> tuple[str, ...]:
        carried = _carried(context, context.chain.index(self.joint.name))
        return tuple(f".{context.chain.joints[at].name}{axis}" for at in carried for axis in "xyz")

    def columns(self, context: Context, joint: int | None) -> Array:
        assert joint is not None
        found = []
        for at in _carried(context, joint):
            none = torques_in_joint_frames(context.chain, context.positions, at, np.zeros(3))
            for axis in np.eye(3):
                whole = torques_in_joint_frames(context.chain, context.positions, at, axis)
                found.append((whole - none)[:, joint, self.component])
        return np.column_stack(found)

    def unit(self) -> Unit:
        return MILLIMETRE


def weight_driver(text: str, term: Term, joint: Joint) -> Load | LinkWeights | None:
    """The driver that a compliance is written with; None for any other name."""
    if text == "gravity":
        return Load(term.component - 3)
    if text == "link_weights":
        return LinkWeights(joint, term.component - 3)
    return None
