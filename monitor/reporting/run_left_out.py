"""A run that an explanation leaves out, as answers say it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from monitor.reporting.messages import joined_by_and


@dataclass(frozen=True)
class RunLeftOut:
    """A run that was left out: its ``readings`` determine as many unknowns of the model, and none is left over to judge
    it by. It may have been broken off."""

    run: int
    readings: int


def runs_left_out(runs: Sequence[RunLeftOut]) -> str:
    """Say which runs are left out, why, and what to do, once for all of them."""
    count = joined_by_and([run.readings for run in runs])
    if len(runs) == 1:
        which = (
            f"Run {runs[0].run} is left out: its {count} readings determine as many unknowns of the model, and nothing "
            "is left over to judge it by."
        )
    else:
        which = (
            f"Runs {joined_by_and([run.run for run in runs])} are left out: their {count} readings determine as "
            "many unknowns of the model each, and nothing is left over to judge them by."
        )
    whose = "its" if len(runs) == 1 else "their"
    return (
        f"{which} Every other question refuses the campaign until {whose} rows are taken out and "
        "the campaign is imported again; do that before you add an effect."
    )
