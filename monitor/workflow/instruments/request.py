"""The request of `contributions`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class InstrumentsRequest:
    """The instruments of a ``run`` (the last with None) of a campaign under a model (the method's own with None)."""

    campaign: str
    run: int | None = None
    model: str | None = None
