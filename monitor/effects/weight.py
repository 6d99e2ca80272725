"""What weights further out on the chain do to an axis: the drivers of the shape ``compliance``.

A drive gives way in proportion to the torque about its axis, a bearing in proportion to the torque across it.
``@gravity`` takes one load at the origin of the last axis (the flange), as the chain places it. ``@link_weights``
takes the weight of everything between, wherever its centre of mass lies: for each axis further out the moments of
the mass that it carries along the three directions of its frame. Multipliers are the torques of a unit weight, mm,
and for ``@link_weights`` those of a unit weight 1 mm off the axis's origin.
``@load_each_run`` is the load of ``@gravity``, of another size in every run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import OF_RUNS, ROBOTS, Explanation
from monitor.effects.driver import DescribedDriver
from monitor.effects.drivers.each_run import EachRun
from monitor.effects.joint_error import JointError
from monitor.effects.shapes.compliance import example_of
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import METRE, MILLIMETRE, Unit


def _carried(context: Context, joint: int) -> range:
    """Return the joint and those further out on its branch."""
    work = len(context.chain.work)
    return range(joint, work if joint < work else len(context.chain.joints))


def _levered(context: Context, joint: int, error: JointError) -> Array:
    """Torque (n, 3) about the axis of an error of a unit weight 1 mm off that axis along X, Y and Z of the bed's frame:
    axis . (arm x down) = arm . (down x axis)."""
    rotations, _ = context.axis_frames
    axis = rotations[:, joint, :, error.term.component - 3]
    levered: Array = np.cross(np.array(context.chain.gravity), axis)
    return levered


def _phrase(weight: str, error: JointError) -> str:
    axis = "its axis" if error.is_along else "XYZ"[error.term.component - 3]
    return f", in proportion to the torque of {weight} about {axis}"


@dataclass(frozen=True)
class Load(DescribedDriver):
    """The torque, about the axis of a term, of a unit weight at the flange."""

    error: JointError

    @property
    def phrase(self) -> str:
        return _phrase("a load at the flange", self.error)

    def columns(self, context: Context, joint: int | None) -> Array:
        assert joint is not None
        _, origins = context.axis_frames
        arm = origins[:, _carried(context, joint)[-1]] - origins[:, joint]
        torque: Array = np.sum(_levered(context, joint, self.error) * arm, axis=1)
        return torque[:, None]

    def unit(self) -> Unit:
        return METRE


@dataclass(frozen=True)
class LoadEachRun(EachRun, Load):
    """The same torque, of another load in every run: what hangs at the flange was changed in between."""

    @property
    def phrase(self) -> str:
        return f"{Load.phrase.fget(self)}, of another size in every run"  # type: ignore[attr-defined]

    def columns(self, context: Context, joint: int | None) -> Array:
        return Load.columns(self, context, joint) * EachRun.columns(self, context, joint)

    def explanation(self, error: JointError) -> Explanation:
        return Explanation(
            f"another load hung at the flange in each run: {error.name} gives way by another amount",
            "enter the payload and its centre of mass of every run in the control, and measure one payload at a time",
            ROBOTS,
            OF_RUNS,
        )


@dataclass(frozen=True)
class LinkWeights(DescribedDriver):
    """The torques of weights fixed to the axis itself and to each one further out, each anywhere on its link.

    A weight off a turning axis along this axis is a weight on the link before it: it has no column of its own, nor has
    it on the first link where it causes no torque.
    """

    error: JointError

    @property
    def phrase(self) -> str:
        return _phrase("the weight of all that it carries", self.error)

    def labels(self, context: Context) -> tuple[str, ...]:
        moments = self._moments(context, context.chain.index(self.error.name))
        return tuple(f".{context.chain.joints[link].name}{'xyz'[axis]}" for link, axis in moments)

    def _moments(self, context: Context, joint: int) -> list[tuple[int, int]]:
        """The links and directions of their frames that have a column."""
        joints = context.chain.joints
        return [
            (link, axis)
            for link in _carried(context, joint)
            for axis in range(3)
            if not joints[link].turns
            or axis != joints[link].main
            or (link == joint and self.error.term.component - 3 != axis)
        ]

    def columns(self, context: Context, joint: int | None) -> Array:
        assert joint is not None
        rotations, _ = context.axis_frames
        levered = _levered(context, joint, self.error)
        torques = [
            np.sum(levered * rotations[:, link, :, axis], axis=1)
            for link, axis in self._moments(context, joint)
        ]
        return np.column_stack(torques)

    def unit(self) -> Unit:
        return MILLIMETRE


#: What a compliance answers to, by the names of the drivers.
WEIGHTS: dict[str, type[Load | LinkWeights]] = {
    "gravity": Load,
    "load_each_run": LoadEachRun,
    "link_weights": LinkWeights,
}


def weight_driver(effect_text: str, driver_text: str, error: JointError) -> Load | LinkWeights:
    """Return the driver that a compliance is written with. Raises EffectError for any other name."""
    weight = WEIGHTS.get(driver_text)
    if weight is None:
        raise EffectError(
            f"'{effect_text}': a compliance answers to weights: write @gravity (a load at the flange), @load_each_run "
            f"(another load in every run) or @link_weights (the weight of every link), for example {example_of(error)}"
        )
    return weight(error)
