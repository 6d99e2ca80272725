"""Which run a coefficient is of, as its name says."""

from __future__ import annotations

import re

#: The ends of the names: ``@each_run.run2`` of what has a coefficient a run, ``@run_time(2)`` of a drift in one run,
#: ``:moved(run 2, sequence 30)`` and ``@stepped(run 2, sequence 30)`` of what moved or stepped in one; parts of a shape
#: or a change (``.cos``, ``.x``) follow.
_OF_RUN = re.compile(
    r"each_run(?:\..+)?\.run(?P<each>\d+)$"
    r"|@run_time\((?P<drift>\d+)\)(?:\..+)?$"
    r"|(?::moved|@stepped)\(run (?P<moved>\d+), sequence \d+\)(?:@.+)?(?:\..+)?$"
)


def run_of(name: str) -> int | None:
    """Return the run that a coefficient is of, as its name ends; None for all runs."""
    of_run = _OF_RUN.search(name)
    return None if of_run is None else int(of_run["each"] or of_run["drift"] or of_run["moved"])
