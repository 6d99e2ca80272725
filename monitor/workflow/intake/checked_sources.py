"""Refuses a campaign with a source of uncertainty that its machine, method or artefact cannot have."""

from __future__ import annotations

from monitor.exceptions import CampaignError, EffectError, Fault, InputError
from monitor.methods import campaign_method
from monitor.readers import line_of_source
from monitor.records import Campaign
from monitor.uncertainty.runs.row_run import measured_run
from monitor.uncertainty.type_b import source_columns
from monitor.workflow.campaign_parts import only_run

_FILE = "campaign.toml"


def check_sources(campaign: Campaign) -> None:
    """Raise CampaignError with every source that does not fit, by its line, before anything is stored."""
    if not campaign.sources or not campaign.runs:
        return
    number = campaign.runs[0].run
    single = only_run(campaign, number)
    problem = campaign_method(single).problem_of(single)
    run = measured_run(problem, number)
    content = next((file.content for file in campaign.files if file.name == _FILE), b"")
    faults = []
    for index, source in enumerate(campaign.sources):
        try:
            source_columns(run, problem.start[0], single, number, (source,))
        except (InputError, EffectError) as error:
            line = line_of_source(content, index)
            faults.append(Fault(_FILE, line, f"sources[{index + 1}]", str(error)))
    if faults:
        raise CampaignError(campaign.name, faults)
