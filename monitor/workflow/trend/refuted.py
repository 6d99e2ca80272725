"""Whether the readings of the latest campaign refute the model that the followed values come from."""

from __future__ import annotations

from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from monitor.exceptions import MonitorError
from monitor.records import CurveCampaign
from monitor.store import Database, probing_counts
from monitor.workflow.measured import load_measured
from monitor.workflow.models import label, resolve_for

#: One right model in a thousand, as certificates and `compare` ask; noise of neighbours is allowed for.
LEVEL = 1e-3


@dataclass(frozen=True)
class RefutedModel:
    """A campaign whose readings refute its ``model``: ``p_value`` of lack of fit over the scatter of the runs."""

    campaign: str
    model: str
    p_value: float


def refuted_model(db: Database, campaign: str, model: str | None) -> RefutedModel | None:
    """Return that a campaign refutes its model; None where it does not, or where nothing can tell.

    Nothing tells where no two runs follow one plan, or where the model cannot be fitted: `monitor explain` says why.
    """
    # What an archive keeps of a campaign, and a copy of results, may be values without readings.
    if len(probing_counts(db, campaign)) < 2:
        return None
    # Loaded here: a page of a machine with one run needs none of it.
    from monitor.discovery.machine.noise.beyond_noise import beyond_neighbours
    from monitor.workflow.explain.explain import first_fit

    try:
        measured = load_measured(db, campaign)
        if isinstance(measured, CurveCampaign):
            return None
        stored = resolve_for(db, model, measured.method, measured.machine.id)
        with threadpool_limits(1, "blas"):
            p_value = beyond_neighbours(first_fit(measured, stored).fit)
    except MonitorError:
        return None
    if p_value is None or p_value >= LEVEL:
        return None
    return RefutedModel(campaign, label(stored), p_value)
