"""Runs of one folder that are copies of each other: refused, since counted as independent they halve every u.

Readings without noise are the exception: whoever simulates them exactly gets equal runs by right. They are recognised
by residuals at the rounding of the file, which no machine leaves.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np

from monitor.exceptions import CampaignError, Fault, MonitorError
from monitor.methods import campaign_method
from monitor.records import Campaign
from monitor.reporting.messages import joined_by_and
from monitor.reporting.run_notes import CopiedRunsNoted
from monitor.row_files import rows_in, runs_in
from monitor.store import Database, run_fingerprints
from monitor.units import MICROMETRE
from monitor.workflow.campaign_parts import only_run
from monitor.workflow.models import as_model, resolve

#: Residuals below 10 nm are what a simulation rounds; no machine and probe together repeat to that.
EXACT_RMS = 1e-5


def check_copies(db: Database, campaign: Campaign) -> tuple[str, ...]:
    """A note where runs are equal because nothing in them is noise; empty where no run is like another.

    Raises CampaignError naming the runs where measured ones are copies.
    """
    alike = defaultdict(list)
    for run, fingerprint in run_fingerprints(campaign.probings).items():
        alike[fingerprint].append(run)
    copies = [runs for runs in alike.values() if len(runs) > 1]
    if not copies:
        return ()
    rms = _rms(db, campaign, copies[0][0])
    if rms < EXACT_RMS:
        return (str(CopiedRunsNoted(tuple(map(tuple, copies)), rms)),)
    raise CampaignError(
        campaign.name,
        [
            Fault(
                rows_in(campaign),
                None,
                "run",
                f"runs {joined_by_and(runs)} are equal in every reading of their "
                f"{np.sum(campaign.probings.run == runs[0])} probings, which two measurements never are: give each run "
                f"its own readings, or remove the copies here and from {runs_in(campaign)}",
            )
            for runs in copies
        ],
    )


def _rms(db: Database, campaign: Campaign, run: int) -> float:
    """Root mean square of the residuals of a run in mm; infinite where it cannot be identified."""
    try:
        model = as_model(resolve(db, None, campaign.method))
        single_run = only_run(campaign, run)
        # Who simulates without noise may state none either, and nothing can be weighed by it.
        single_run = replace(
            single_run, probe=replace(single_run.probe, standard_uncertainty=MICROMETRE.to_internal(1.0))
        )
        return float(campaign_method(campaign).identify(single_run, model).runs[0].rms)
    except MonitorError:
        return float("inf")
