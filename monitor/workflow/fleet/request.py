"""The question after all machines at once."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.exceptions import InputError


@dataclass(frozen=True)
class FleetRequest:
    """Every machine and parameter under a model (by default that which each machine is followed by; while nobody has
    identified a machine by the newest version of a method's own, the newest that somebody did).

    ``top`` rows are listed (0: all). ``weekly_looks`` adds what looks at all of them every week noticed, each
    machine by the same model.
    """

    model: str | None = None
    top: int = 20
    weekly_looks: bool = False

    def __post_init__(self) -> None:
        if self.top < 0:
            raise InputError(f"--top {self.top}: a number of rows, 0 for all")
