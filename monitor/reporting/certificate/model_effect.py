"""An effect that was added to the model of a certificate, as numbers to be kept with its results."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ModelEffect:
    """An effect of the model that all runs share: its size with standard uncertainty, in its display unit.

    The size is the mean of what ``runs`` runs on ``days`` days say. ``reversal_value`` (ISO 230-2) and ``u_reversal``
    of a play, twice its amplitude; None of another effect. ``value`` is None where nothing is stored of it.
    """

    name: str
    unit: str = ""
    value: float | None = None
    u: float | None = None
    runs: int = 0
    days: int = 0
    reversal_value: float | None = None
    u_reversal: float | None = None
