"""The base model of a curve, checked before anything of the folder is stored."""

from __future__ import annotations

from monitor.exceptions import CampaignError, EffectError, Fault
from monitor.methods import campaign_method
from monitor.records import CurveCampaign


def check_base(curve: CurveCampaign) -> None:
    """Raise CampaignError where the base model cannot be read or its columns are not there."""
    try:
        campaign_method(curve).problem_of(curve)
    except EffectError as error:
        raise CampaignError(curve.name, [Fault("campaign.toml", None, "curve.base", str(error))]) from error
