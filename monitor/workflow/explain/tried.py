"""A model with one more effect, fitted to its campaign without storing anything: what a page tries."""

from __future__ import annotations

from dataclasses import replace

from monitor.discovery import Fit
from monitor.records import Campaign
from monitor.store import Database
from monitor.workflow.identify.fitting import FittedModel, fit_of
from monitor.workflow.model.subjects import subjects_of


def tried(db: Database, fitted: FittedModel, text: str) -> tuple[str, Fit]:
    """Return the effect as it is written in models, and the fit with it. Raises EffectError, DataError."""
    assert isinstance(fitted.campaign, Campaign)
    effect = subjects_of(db, fitted.model).canonical(text, fitted.campaign.name)
    with_effect = fit_of(fitted.campaign, replace(fitted.model, effects=(*fitted.model.effects, effect)))
    assert isinstance(with_effect, Fit)
    return effect, with_effect
