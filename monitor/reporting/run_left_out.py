"""A run that an explanation leaves out, as answers say it."""

from __future__ import annotations

from dataclasses import dataclass, field

from monitor.documents import OMITTED


@dataclass(frozen=True)
class RunLeftOut:
    """A run that was left out: its ``readings`` determine as many unknowns of the model, and none is left over to judge
    it by; or they leave as many ``undetermined`` as this says that the other runs determine, and no fit holds with it.
    It may have been broken off."""

    run: int
    readings: int
    undetermined: int | None = field(default=None, metadata=OMITTED)

    def __str__(self) -> str:
        why = (
            "determine as many unknowns of the model, and nothing is left over to judge it by"
            if self.undetermined is None
            else f"leave {self.undetermined} unknown{'s' * (self.undetermined > 1)} of the model open that the other "
            "runs determine, and no fit holds with it"
        )
        return (
            f"Run {self.run} is left out: its {self.readings} readings {why}. Every other question refuses the "
            "campaign until its rows are taken out and the campaign is imported again; do that before you add an "
            "effect."
        )
