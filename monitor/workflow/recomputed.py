"""Identifications computed anew from the stored readings: the numbers are those that the readings give."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.exceptions import MonitorError
from monitor.reporting import messages
from monitor.store import (
    Database,
    MadeBy,
    StoredIdentification,
    identification_by_number,
    identifications_made,
    load_campaign,
    load_model,
)

#: In standard uncertainties: the last bits depend on the processor and its libraries; 1e-3 u moves no printed digit.
TOLERANCE_U = 1e-3


@dataclass(frozen=True)
class Recomputation:
    """How many identifications were computed anew, of how many that this version made, and what came out otherwise.

    ``computed_of_others`` are computed anew ``of_others`` that other versions made, where fewer of this one were drawn
    than asked for. These may have estimated otherwise: ``notes`` say by how much, and are no faults.
    """

    computed: int = 0
    of: int = 0
    computed_of_others: int = 0
    of_others: int = 0
    faults: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def recompute(db: Database, generator: np.random.Generator, count: int) -> Recomputation:
    """Identify campaigns again, drawn at random: whoever alters one cannot know which will be looked at."""
    identifications = identifications_made(db)
    by_this = [each for each in identifications if each.is_this]
    by_others = [each for each in identifications if not each.is_this]
    # Those of this version first: of these alone another number is a fault.
    drawn = [by_this[k] for k in generator.permutation(len(by_this))[:count]]
    rest = [by_others[k] for k in generator.permutation(len(by_others))[: count - len(drawn)]]
    computed, faults = _differences(db, drawn)
    computed_of_others, notes = _differences(db, rest)
    return Recomputation(computed, len(by_this), computed_of_others, len(by_others), faults, notes)


def _differences(db: Database, drawn: Sequence[MadeBy]) -> tuple[int, tuple[str, ...]]:
    """Compute identifications anew: how many could be, and a sentence on each that comes out otherwise."""
    sentences, computed = [], 0
    for identification in sorted(drawn, key=lambda each: each.number):
        # What cannot be computed is no evidence: the hashes say whether readings or model were altered.
        with contextlib.suppress(MonitorError):
            difference = _difference(db, identification.number)
            computed += 1
            if difference is not None:
                sentences.append(_sentence(identification, difference))
    return computed, tuple(sentences)


def _sentence(made_by: MadeBy, difference: str) -> str:
    if made_by.is_this:
        return messages.not_reproduced(made_by.number, difference)
    day = f"{made_by.computed_at:%Y-%m-%d}"
    return messages.made_by_another_version(made_by.number, made_by.software_version, day, difference)


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
