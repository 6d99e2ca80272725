"""Identifications computed anew from the stored readings: the numbers are those that the readings give."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import numpy as np

from monitor import __version__
from monitor.exceptions import MonitorError
from monitor.reporting import messages
from monitor.store import (
    Database,
    StoredIdentification,
    identification_by_number,
    identification_numbers,
    load_campaign,
    load_model,
)

#: In standard uncertainties: the last bits depend on the processor and its libraries; 1e-3 u moves no printed digit.
TOLERANCE_U = 1e-3


@dataclass(frozen=True)
class Recomputation:
    """How many identifications were computed anew, of how many that this version made, and what came out otherwise.

    ``of_others`` is how many other versions made: these may have estimated otherwise, and none is drawn.
    """

    computed: int
    of: int
    of_others: int
    faults: tuple[str, ...]


def recompute(db: Database, generator: np.random.Generator, count: int) -> Recomputation:
    """Identify campaigns again, drawn at random: whoever alters one cannot know which will be looked at."""
    numbers = identification_numbers(db, __version__)
    drawn = generator.permutation(numbers)[:count].tolist()
    faults, computed = [], 0
    for number in sorted(drawn):
        # What cannot be computed is no evidence: the hashes say whether readings or model were altered.
        with contextlib.suppress(MonitorError):
            fault = _difference(db, number)
            computed += 1
            if fault is not None:
                faults.append(messages.not_reproduced(number, fault))
    others = len(identification_numbers(db)) - len(numbers)
    return Recomputation(computed, len(numbers), others, tuple(faults))


def _difference(db: Database, number: int) -> str | None:
    """Where a stored identification differs from the same one computed now; None where it does not."""
    # Loaded here: a verification without a recomputation waits for no solver.
    from monitor.workflow.campaign_parts import only_run
    from monitor.workflow.identify.machine import identified

    stored = identification_by_number(db, number)
    campaign = load_campaign(db, stored.campaign)
    if len(stored.runs) == 1:
        campaign = only_run(campaign, stored.runs[0].run)
    again = identified(campaign, load_model(db, stored.model, stored.model_version))[1]
    return _first_difference(stored, again)


def _first_difference(stored: StoredIdentification, again: StoredIdentification) -> str | None:
    if stored.parameters != again.parameters or [run.run for run in stored.runs] != [
        run.run for run in again.runs
    ]:
        return messages.OTHER_RUNS_OR_PARAMETERS
    for before, after in zip(stored.runs, again.runs, strict=True):
        u = np.sqrt(np.diag(after.covariance))
        off = np.abs(before.estimate - after.estimate) / np.where(u > 0.0, u, 1.0)
        refused = np.isnan(before.estimate) != np.isnan(after.estimate)
        worst = int(np.argmax(np.where(refused, np.inf, np.nan_to_num(off))))
        if refused[worst] or off[worst] > TOLERANCE_U:
            name = stored.parameters[worst]
            return messages.parameter_differs(name, before.run, stored.campaign, float(off[worst]))
    return None
