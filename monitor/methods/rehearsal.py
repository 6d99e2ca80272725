"""Virtual campaigns of a method: what makes them, of its own machine or of any."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from monitor.records import Campaign


@dataclass(frozen=True)
class Able:
    """The method answers the question."""


YES = Able()


class VirtualCampaign(Protocol):
    """Makes a campaign with an effect whose largest displacement is ``peak`` (mm), under a ``noise`` (mm) of a reading.

    Raises EffectError for an effect that the virtual machine does not have or that does nothing in its plan.
    """

    def __call__(
        self,
        name: str,
        rng: np.random.Generator,
        *,
        effect: str | None = None,
        peak: float = 0.0,
        noise: float = ...,
    ) -> Campaign: ...


class ChosenCampaign(Protocol):
    """Makes a campaign of ``days`` of the method's own plan, of a machine of a ``topology`` with chosen ``errors``.

    ``errors`` by effect in display units, as many numbers as it has coefficients; ``noise`` (mm) of a reading. Raises
    TopologyError, EffectError, InputError, and DataError for a machine on which the plan cannot be measured.
    """

    def __call__(
        self,
        name: str,
        rng: np.random.Generator,
        *,
        topology: str,
        errors: Mapping[str, tuple[float, ...]],
        days: int,
        noise: float = ...,
    ) -> Campaign: ...


@dataclass(frozen=True)
class Rehearsal(Able):
    """Virtual campaigns of a ``machine``; ``noise_um`` is the standard deviation of a reading where none is named.

    ``chosen_campaign`` makes those of any machine; None where the method has no plan for any machine.
    """

    machine: Literal["machine tool", "robot"]
    virtual_campaign: VirtualCampaign
    noise_um: float
    chosen_campaign: ChosenCampaign | None = None
