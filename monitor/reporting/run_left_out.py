"""Runs that an explanation leaves out, as answers and refusals say it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import OMITTED
from monitor.reporting.messages import joined_by_and


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


def poor_runs_refused(readings: Mapping[int, int], undetermined: Mapping[int, int]) -> str:
    """Return that runs leave as many unknowns ``undetermined``, and that no fit holds with them, up to what to do."""
    each = [
        f"the {readings[run]} readings of run {run} leave {count} unknown{'s' * (count > 1)} of the model open"
        for run, count in undetermined.items()
    ]
    runs = f"run{'s' * (len(undetermined) > 1)} {joined_by_and(list(undetermined))}"
    return (
        f"{joined_by_and(each)} that the other runs determine: with {runs} no fit holds, without one does; measure "
        f"the rest of the poses; or leave {runs} out"
    )


def poses_too_few(run: int | None, hardly: int) -> str:
    """Return that the poses of a run, or of every run, may be too few: as many unknowns are ``hardly`` told."""
    whose = "every run" if run is None else f"run {run}"
    return (
        f"or the poses are too few: those of {whose} hardly tell {hardly} unknown{'s' * (hardly > 1)} of the model "
        "from others; if the measurement was broken off, measure the rest"
    )
