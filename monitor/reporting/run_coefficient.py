"""Which run a coefficient is of, as its name says."""

from __future__ import annotations

import re


def run_of(name: str) -> int | None:
    """Return the run that a coefficient is of, as its name ends: ``EXX:reversal@each_run.run2``; None for all runs."""
    of_run = re.search(r"each_run(?:\..+)?\.run(\d+)$", name)
    return None if of_run is None else int(of_run[1])
