"""``shape``: the form of a workpiece, off its nominal one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import Description
from monitor.effects.registry import BuiltIn
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import MICROMETRE, Unit


@dataclass(frozen=True)
class WorkpieceShape(BuiltIn):
    """A deviation of every point of the workpiece from its nominal position, along the normal of the surface there."""

    text: str = "shape"
    unit: Unit = MICROMETRE
    pattern: ClassVar[str] = r"shape"

    def labels(self, context: Context) -> tuple[str, ...]:
        return tuple(f"({target})" for target in dict.fromkeys(context.target.tolist()))

    def shifts(self, context: Context) -> Array:
        is_point = context.target[:, None] == np.array(list(dict.fromkeys(context.target.tolist())))
        shifts: Array = normals_of(context)[:, :, None] * is_point[:, None, :]
        return shifts

    def described(self, driven: str) -> Description:
        return Description(
            f"the points of the workpiece lie off their nominal positions, along the surface's normal{driven}",
            "the workpiece was not machined to its nominal form, or it was distorted when it was clamped",
            "subtract the deviations from what the machine measures, or calibrate the workpiece",
            "docs/free-form.md",
        )


def normals_of(context: Context, asking: str = "shape") -> Array:
    """Return unit normals (n, 3) of the surface at every probing, in the frame of the last work axis.

    A component that was not recorded is zero. Raises EffectError, for the effect that is ``asking``, where none was, or
    where one is empty.
    """
    columns = [context.columns.get(f"normal_{axis}") for axis in "xyz"]
    if all(column is None for column in columns):
        raise EffectError(
            f"'{asking}' needs the normal of the surface: the columns normal_x, normal_y, normal_z"
        )
    zero = np.zeros(len(context))
    normals = np.column_stack([zero if column is None else column for column in columns])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    if not np.all(length > 0.0):
        raise EffectError(f"'{asking}' needs the normal of the surface at every probing; some have none")
    unit: Array = normals / length
    return unit


REGISTERED = (WorkpieceShape,)
