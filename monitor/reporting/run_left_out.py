"""A run that an explanation leaves out, as answers say it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RunLeftOut:
    """A run that was left out: its ``readings`` determine as many unknowns of the model, and none is left over to judge
    it by. It may have been broken off."""

    run: int
    readings: int

    def __str__(self) -> str:
        return (
            f"Run {self.run} is left out: its {self.readings} readings determine as many unknowns of the model, and "
            "nothing is left over to judge it by. Every other question refuses the campaign until its rows are taken "
            "out and the campaign is imported again; do that before you add an effect."
        )
