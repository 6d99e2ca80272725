"""``const``: the same everywhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context
from monitor.effects.shape import DescribedShape
from monitor.records import Array


@dataclass(frozen=True)
class Const(DescribedShape):
    """The same everywhere."""

    pattern: ClassVar[str] = r"const"

    def columns(self, context: Context, joint: int) -> Array:
        return np.ones((len(context), 1))


REGISTERED = (Const,)
