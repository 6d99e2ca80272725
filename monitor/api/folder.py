"""Look at a campaign folder without storing it."""

from __future__ import annotations

from pathlib import Path

from monitor.api.arguments import argument, checked
from monitor.readers import read_campaign
from monitor.records import Campaign, CurveCampaign


@checked
def read(folder: str | Path) -> Campaign | CurveCampaign:
    """Read a campaign folder into a record: runs, probings, machine, probe, artefact (mm, rad, s, °C).

    Raises CampaignError with every fault of the folder, by file and line.
    """
    return read_campaign(argument("folder", folder, Path))
