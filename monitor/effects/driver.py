"""What a driver is: what an effect is multiplied by.

A driver is one small class like a shape. Another one is one more file of ``drivers`` or a plug-in of the group
``monitor.drivers``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Protocol, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import Explanation
from monitor.effects.joint_error import JointError
from monitor.effects.registry import BuiltIn
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import MINUTE, ONE, Unit


class Driver(Protocol):
    """What every driver offers."""

    def labels(self, context: Context) -> tuple[str, ...]:
        """Return a suffix for each multiplier."""
        ...

    def columns(self, context: Context, joint: int | None) -> Array:
        """Return the multipliers (n, m) at every probing; ``joint`` is None for effects of the artefact."""
        ...

    def unit(self) -> Unit:
        """Return the unit of the multiplier."""
        ...


class DescribedDriver(BuiltIn):
    """A driver with its own words; here with what most have: one multiplier without a unit."""

    @property
    def phrase(self) -> str:
        """The part of an effect's meaning that the driver makes; it begins with a comma."""
        return ""

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def unit(self) -> Unit:
        return ONE

    def explanation(self, error: JointError) -> Explanation | None:
        """Explain an effect of a joint; None where the driver says nothing of its cause."""
        return None


class HeatDriver(DescribedDriver):
    """A driver that stands for a temperature: its effects are explained by heat."""

    def explanation(self, error: JointError) -> Explanation | None:
        return error.explanation_of_heat()


@dataclass(frozen=True, kw_only=True)
class SettlingDriver(HeatDriver, ABC):
    """A driver with a time constant in s, which is searched where it is None."""

    time_constant_s: float | None = None

    @property
    def settled(self) -> str:
        """The name of what remains of the driver where it settles at once; empty where no driver remains."""
        return ""

    @abstractmethod
    def columns(self, context: Context, joint: int | None) -> Array:
        """Return the multipliers (n, m) at every probing."""


@dataclass(frozen=True)
class ExponentialDriver(SettlingDriver):
    """The driver 1 - exp(-t / tau) of a kind of time; ``NAME`` or ``NAME45min`` in an effect."""

    #: Its name in an effect.
    name: ClassVar[str]
    #: Where the search begins, in s, as long as the constant is neither given nor searched.
    typical_time_constant_s: ClassVar[float]

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        if "minutes" not in groups:
            return cls()
        minutes = float(groups["minutes"])
        if minutes == 0:
            raise EffectError(f"the time constant of @{cls.name} must be above 0 min")
        return cls(time_constant_s=MINUTE.to_internal(minutes))

    @abstractmethod
    def time(self, context: Context) -> Array:
        """Return the time (n,) in s since it began to settle."""

    def columns(self, context: Context, joint: int | None) -> Array:
        """Return the approach (n, 1) to what it settles at."""
        tau = self.typical_time_constant_s if self.time_constant_s is None else self.time_constant_s
        return np.asarray(-np.expm1(-self.time(context) / tau)[:, None])
