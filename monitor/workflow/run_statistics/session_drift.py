"""Whether parameters drift over the runs of a day: a part of `monitor stats`."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import DataError
from monitor.records import Campaign
from monitor.reporting.lacks import Part, refused
from monitor.statistics.run_drift import run_drift
from monitor.store import StoredIdentification
from monitor.workflow.run_statistics.answer import ParameterDrift, SessionDrift


def session_drift(campaign: Campaign, identification: StoredIdentification, runs: list[int]) -> SessionDrift:
    """Slopes an hour of every parameter within the days of the selected runs, and which of them drift.

    Empty, with the reason under ``why``, where the runs do not suffice.
    """
    by_run = {run.run: run for run in identification.runs}
    started = {run.run: (run.started_at.timestamp() / 3600.0, run.day) for run in campaign.runs}
    estimates = np.array([by_run[run].estimate for run in runs])
    complete = np.isfinite(estimates).all(axis=0)
    names = [name for name, finite in zip(identification.parameters, complete, strict=True) if finite]
    units = [unit for unit, finite in zip(identification.units, complete, strict=True) if finite]
    factors = np.array([unit.factor for unit in units])
    stated = np.mean([by_run[run].covariance[np.ix_(complete, complete)] for run in runs], axis=0)
    # What an added effect varies together with the others is not stated.
    stated = np.nan_to_num(stated)
    days = np.array([started[run][1] for run in runs])
    hours = np.array([started[run][0] for run in runs])
    try:
        drift = run_drift(estimates[:, complete] / factors, hours, stated / np.outer(factors, factors), days)
    except DataError as error:
        return SessionDrift(why=refused(Part.DAY_DRIFT, error), drifts=(), parameters={})
    return SessionDrift(
        why=None,
        drifts=tuple(name for name, drifts in zip(names, drift.drifts, strict=True) if drifts),
        degrees_of_freedom=drift.dof,
        common_scatter=drift.common,
        parameters={
            name: ParameterDrift(
                per_hour=float(drift.slope[index]),
                u=float(drift.u[index]),
                unit=f"{units[index].name}/h",
                p_value=float(drift.p_value[index]),
                q_value=float(drift.q_value[index]),
                scatter_over_stated=float(drift.scale[index]),
            )
            for index, name in enumerate(names)
        },
    )
