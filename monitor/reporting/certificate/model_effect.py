"""An effect that was added to the model of a certificate, as numbers to be kept with its results."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from monitor.documents import OMITTED


class Outside(StrEnum):
    """Why effects of a model are no part of the joint region; the value is the key among the texts of ``outside``."""

    SHARED_LENGTHS = "shared_lengths"
    LINEAR_AXES = "linear_axes"
    FEW_RUNS = "few_runs"


@dataclass(frozen=True)
class Lies:
    """Where a step lies as far as the readings tell: somewhere from ``low_mm`` to ``high_mm`` of the ``axis``, the
    middle of one that goes over ``width_mm``."""

    axis: str
    low_mm: float
    high_mm: float
    width_mm: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class ModelEffect:
    """An effect of the model that all runs share: its size with standard uncertainty, in its display unit.

    With ``joint`` it is one of the results, the value of all runs together, or of its run where it is of one alone.
    Else the size is the mean of what ``runs`` runs on ``days`` days say by themselves, and ``outside`` says why.
    ``reversal_value`` (ISO 230-2) and ``u_reversal`` of a play, twice its amplitude; None of another effect. ``value``
    is None where nothing is stored of it. ``lies`` is where a step lies; None of another effect. ``of_one_run``: it is
    of the run alone and the page says so, which those of version 0.2.0 do not.
    """

    name: str
    unit: str = ""
    value: float | None = None
    u: float | None = None
    runs: int = 0
    days: int = 0
    reversal_value: float | None = None
    u_reversal: float | None = None
    joint: bool = field(default=False, metadata=OMITTED)
    outside: Outside | None = field(default=None, metadata=OMITTED)
    lies: Lies | None = field(default=None, metadata=OMITTED)
    of_one_run: bool = field(default=False, metadata=OMITTED)
