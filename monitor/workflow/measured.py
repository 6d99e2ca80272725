"""The campaign that a question is about, of a machine or a curve, and whether its method has an answer."""

from __future__ import annotations

from collections.abc import Callable

from monitor.methods import Able, Method, Unable, campaign_method, require
from monitor.records import Campaign, CurveCampaign
from monitor.store import Database, is_curve, load_campaign, load_curve


def load_measured(db: Database, name: str) -> Campaign | CurveCampaign:
    """The campaign of that name, of a machine (of a folder without what is in its files) or a curve.

    Raises NotFoundError.
    """
    return load_curve(db, name) if is_curve(db, name) else load_campaign(db, name, with_files=False)


def machine_campaign(
    db: Database, name: str, verb: str, ability: Callable[[Method], Able | Unable]
) -> Campaign:
    """The campaign of a machine to whose method a verb can be put.

    Raises NotFoundError, and DataError, with the reason, where the method's ``ability`` is none.
    """
    measured = load_measured(db, name)
    require(ability(campaign_method(measured)), measured, verb)
    # Refuses a curve whose method claims to answer what is asked of machines.
    return measured if isinstance(measured, Campaign) else load_campaign(db, name)
