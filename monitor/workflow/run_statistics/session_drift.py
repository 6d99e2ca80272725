"""Whether parameters run off over the runs of a day: a part of `monitor stats`."""

from __future__ import annotations

from typing import Any

import numpy as np

from monitor.exceptions import DataError
from monitor.records import Campaign
from monitor.statistics.run_drift import run_drift
from monitor.store import StoredIdentification

Document = dict[str, Any]


def session_drift(campaign: Campaign, found: StoredIdentification, runs: list[int]) -> Document:
    """Slopes an hour of every parameter within the days of the chosen runs, and which of them drift.

    Empty, with the reason under ``why``, where the runs do not suffice.
    """
    by_run = {one.run: one for one in found.runs}
    started = {one.run: (one.started_at.timestamp() / 3600.0, one.day) for one in campaign.runs}
    estimates = np.array([by_run[run].estimate for run in runs])
    kept = np.isfinite(estimates).all(axis=0)
    names = [name for name, keep in zip(found.parameters, kept, strict=True) if keep]
    units = [unit for unit, keep in zip(found.units, kept, strict=True) if keep]
    factors = np.array([unit.factor for unit in units])
    stated = np.mean([by_run[run].covariance[np.ix_(kept, kept)] for run in runs], axis=0)
    days = np.array([started[run][1] for run in runs])
    hours = np.array([started[run][0] for run in runs])
    try:
        drift = run_drift(estimates[:, kept] / factors, hours, stated / np.outer(factors, factors), days)
    except DataError as error:
        return {"why": f"no drift within a day: {error}", "drifts": [], "parameters": {}}
    return {
        "why": None,
        "drifts": [name for name, moves in zip(names, drift.drifts, strict=True) if moves],
        "degrees_of_freedom": drift.dof,
        "common_scatter": drift.common,
        "parameters": {
            name: {
                "per_hour": float(drift.slope[place]),
                "u": float(drift.u[place]),
                "unit": f"{units[place].name}/h",
                "p_value": float(drift.p_value[place]),
                "q_value": float(drift.q_value[place]),
                "scatter_over_stated": float(drift.scale[place]),
            }
            for place, name in enumerate(names)
        },
    }
