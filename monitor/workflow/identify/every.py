"""Identifies all campaigns: one that cannot be identified does not hinder the others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.store import Database, list_campaigns
from monitor.workflow.identify.answer import IdentificationsAnswer, RefusedCampaign
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest


@dataclass(frozen=True)
class IdentifyAllRequest:
    """Identify every campaign, by default under the model of its machine or method."""

    model: str | None = None


def identify_all(
    db: Database, request: IdentifyAllRequest, *, progress: Callable[[str], None] = lambda name: None
) -> IdentificationsAnswer:
    """Identify and store every campaign, each by itself. Raises NotFoundError where there is no campaign yet."""
    names = [row.campaign for row in list_campaigns(db)]
    if not names:
        raise NotFoundError("the database has no campaign yet; type `monitor import FOLDER`")
    answers, refused = [], []
    for name in names:
        progress(name)
        try:
            answers.append(identify(db, IdentifyRequest(name, request.model)))
        except (DataError, InputError) as error:
            refused.append(RefusedCampaign(name, str(error)))
    return IdentificationsAnswer(tuple(answers), tuple(refused))
