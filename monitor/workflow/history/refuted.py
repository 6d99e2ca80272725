"""Campaigns whose readings refute the model that their values come from, as it was stored when they were identified."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.store import CampaignFit, Database, MachineHistory, contradicting_machines
from monitor.workflow.models import label_of, resolve

#: One right model in a thousand, as certificates and `compare` ask; docs/trials-grounds.md has the rates.
REFUTED_P = 1e-3
#: Residuals beyond so many stated standard uncertainties: a probe's statement is seldom wrong by a factor of three.
CONTRADICTED = 3.0


@dataclass(frozen=True)
class RefutedCampaign:
    """A campaign whose readings refute its ``model``: ``p_value`` of lack of fit over the scatter of the runs."""

    campaign: str
    model: str
    p_value: float


@dataclass(frozen=True)
class ContradictedStatement:
    """The last ``run`` of a campaign whose residuals are ``times`` what the stated uncertainties leave of ``model``: a
    statement, a reading or the model is wrong."""

    campaign: str
    model: str
    run: int
    times: float


@dataclass(frozen=True)
class ModelRefuted:
    """The campaigns of a history that refute their model, in the order of time; ``judged`` of all could say so."""

    campaigns: tuple[RefutedCampaign, ...]
    judged: int


def is_refuted(fit: CampaignFit | None) -> bool:
    """Whether readings refute a model; not where nothing judged it."""
    return fit is not None and fit.lack_of_fit_p is not None and fit.lack_of_fit_p < REFUTED_P


def model_refuted(history: MachineHistory) -> ModelRefuted | None:
    """Return the campaigns of a history that refute their model; None where none does, or where nothing judged them.

    Reads what is stored: a campaign that an older version identified is not judged until it is identified again.
    """
    fits = [
        (name, history.fits[name])
        for name in dict.fromkeys(history.campaign.tolist())
        if name in history.fits
    ]
    refuted = tuple(
        RefutedCampaign(name, label_of(fit.model, fit.version), fit.lack_of_fit_p)
        for name, fit in fits
        if fit.lack_of_fit_p is not None and fit.lack_of_fit_p < REFUTED_P
    )
    judged = sum(fit.lack_of_fit_p is not None for _, fit in fits)
    return ModelRefuted(refuted, judged) if refuted else None


def statements_contradicted(
    db: Database, model: str | None = None, machine: str | None = None
) -> dict[str, ContradictedStatement]:
    """Return by machine, or of one, the last run where it contradicts what is stated of its readings.

    Under a ``model`` or a version of it, NAME@VERSION; without it that which the numbers of each machine come from.
    """
    stored = None if model is None else resolve(db, model)
    name, version = (None, None) if stored is None else (stored.name, stored.version)
    return {
        row.machine: ContradictedStatement(row.campaign, label_of(row.model, row.version), row.run, row.times)
        for row in contradicting_machines(db, CONTRADICTED, name, version, machine)
    }
