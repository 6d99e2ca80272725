"""``probe:group``: every group has its own mean."""

from __future__ import annotations

import numpy as np

from monitor.effects.curve.effect import CurveEffect, Inputs, group_names
from monitor.effects.curve.shape import GROUPS, Subject
from monitor.effects.description import Description
from monitor.records import Array


class Group:
    """One column a label but the first."""

    def columns(self, effect: CurveEffect, inputs: Inputs, value: float | None) -> Array:
        labels = inputs.groups[effect.column]
        return np.stack([labels == name for name in group_names(labels)[1:]], axis=1).astype(float)

    def names(self, effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
        first, *others = group_names(inputs.groups[effect.column])
        return tuple(f"{effect.column}={name} - {first}" for name in others)

    def described(self, subject: Subject) -> Description:
        name = subject.effect.column
        return Description(
            f"{subject.response} differs between the groups of {name}",
            f"each {name} has a bias of its own: another device, hand, set-up or condition that belongs to it",
            f"calibrate every {name} against the same standard and correct for its bias, or count the spread between "
            "them as an uncertainty",
            GROUPS,
        )


SHAPES = {"group": Group()}
