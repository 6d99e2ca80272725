"""The columns of a campaign's runs that may be grouped and selected by, and the groups they make."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.effects.formula import Formula
from monitor.exceptions import DataError, InputError
from monitor.records import Array, Campaign, Run


def run_columns(runs: tuple[Run, ...]) -> dict[str, Array]:
    """Columns of the runs that may be grouped and selected by: run, day, warm_up, hour and every condition."""
    names = sorted({name for run in runs for name in run.conditions})
    first = min(run.started_at for run in runs)
    columns = {
        "run": np.array([float(run.run) for run in runs]),
        "day": np.array([float(run.day) for run in runs]),
        "warm_up": np.array([float(run.warm_up) for run in runs]),
        "hours": np.array([(run.started_at - first).total_seconds() / 3600.0 for run in runs]),
    }
    for name in names:
        columns[name] = np.array([run.conditions.get(name, np.nan) for run in runs])
    return columns


def campaign_columns(campaign: Campaign) -> dict[str, Array]:
    """Those of the runs and, under the channel's name, the mean of each recorded channel over each run."""
    columns = run_columns(campaign.runs)
    for name, values in campaign.probings.channels.items():
        if name in columns:
            continue
        means = np.full(len(campaign.runs), np.nan)
        for index, run in enumerate(campaign.runs):
            of_run = values[campaign.probings.run == run.run]
            if np.isfinite(of_run).any():
                means[index] = np.nanmean(of_run)
        columns[name] = means
    return columns


def group_labels(columns: dict[str, Array], by: str) -> list[str]:
    """The group of every run by a column; a measured condition makes three groups of like size.

    Raises InputError for a column that is not there, DataError for one that some runs lack.
    """
    if by not in columns:
        raise InputError(f"--by {by}: there is no such column; there are {', '.join(columns)}")
    values = columns[by]
    if by == "warm_up":
        return ["true" if value else "false" for value in values]
    if by in ("day", "run"):
        return [str(int(value)) for value in values]
    if np.isnan(values).any():
        raise DataError(f"--by {by}: {int(np.isnan(values).sum())} runs have no value of it")
    if np.ptp(values) == 0.0:
        raise DataError(f"--by {by}: it is {values[0]:g} in every run; there is nothing to group by")
    # A measured condition is cut at its terciles: three groups of like size.
    low, high = np.quantile(values, [1 / 3, 2 / 3])
    names = (f"below {low:g}", f"{low:g} to {high:g}", f"above {high:g}")
    return [names[0] if value <= low else names[1] if value <= high else names[2] for value in values]


def selected(columns: dict[str, Array], where: str | None, count: int) -> npt.NDArray[np.bool_]:
    """Which of ``count`` runs meet a condition on the columns; all without one. Raises InputError."""
    if where is None:
        return np.ones(count, dtype=bool)
    try:
        meets: npt.NDArray[np.bool_] = Formula(where).evaluate(columns, count) != 0
        return meets
    except InputError as error:
        # The language is that of effects, whose rows are probings; here a row is a run.
        message = str(error).replace(" probings", " runs").replace("sin(2*pi*x_mm/20)", "hours > 6")
        raise InputError(f"--where: {message}") from error
