"""Runs that an explanation leaves out, as answers and refusals say it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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


def runs_left_out(runs: Sequence[RunLeftOut]) -> str:
    """Say which runs are left out, why, and what to do, once for all of them."""
    short = [run for run in runs if run.undetermined is None]
    sentences = [_all_used_up(short)] if short else []
    sentences += [
        f"Run {run.run} is left out: its {run.readings} readings leave {run.undetermined} "
        f"unknown{'s' * (run.undetermined > 1)} of the model open that the other runs determine, and no fit holds "
        "with it."
        for run in runs
        if run.undetermined is not None
    ]
    whose = "its" if len(runs) == 1 else "their"
    return (
        f"{' '.join(sentences)} Every other question refuses the campaign until {whose} rows are taken out and "
        "the campaign is imported again; do that before you add an effect."
    )


def _all_used_up(runs: Sequence[RunLeftOut]) -> str:
    count = joined_by_and([run.readings for run in runs])
    if len(runs) == 1:
        return (
            f"Run {runs[0].run} is left out: its {count} readings determine as many unknowns of the model, and nothing "
            "is left over to judge it by."
        )
    return (
        f"Runs {joined_by_and([run.run for run in runs])} are left out: their {count} readings determine as "
        "many unknowns of the model each, and nothing is left over to judge them by."
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


def stands_still(run: int, axes: Sequence[str]) -> str:
    """Return that axes have one position in all rows of a run, and move in the other runs."""
    its = joined_by_and(list(axes))
    stand, move, columns = ("stands", "moves", "column") if len(axes) == 1 else ("stand", "move", "columns")
    return (
        f"in run {run} {its} {stand} still at all readings and {move} in the other runs: first look at the {columns} "
        f"of {its} there"
    )


def poses_too_few(run: int | None, hardly: int) -> str:
    """Return that the poses of a run, or of every run, may be too few: as many unknowns are ``hardly`` told."""
    whose = "every run" if run is None else f"run {run}"
    return (
        f"or the poses are too few: those of {whose} hardly tell {hardly} unknown{'s' * (hardly > 1)} of the model "
        "from others; if the measurement was broken off, measure the rest"
    )
