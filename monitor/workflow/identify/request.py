"""Requests of `identify`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class IdentifyRequest:
    """Identify a campaign, or one ``run`` of it, under a model (the method's own with None)."""

    campaign: str
    model: str | None = None
    run: int | None = None


@dataclass(frozen=True)
class StepwiseRequest:
    """Identify one run step by step as well: with None the last."""

    campaign: str
    model: str | None = None
    run: int | None = None
