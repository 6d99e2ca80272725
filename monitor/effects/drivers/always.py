"""No driver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context
from monitor.effects.driver import DescribedDriver
from monitor.records import Array


@dataclass(frozen=True)
class Always(DescribedDriver):
    """No driver: the multiplier is 1."""

    pattern: ClassVar[str] = r""

    def columns(self, context: Context, joint: int | None) -> Array:
        return np.ones((len(context), 1))


REGISTERED = (Always,)
