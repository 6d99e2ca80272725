"""Draws every parameter over the runs of a campaign."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from monitor.records import Campaign
from monitor.reporting.figures import titles
from monitor.reporting.figures.parameters import ParametersOfRuns, parameters_by_run
from monitor.store import StoredIdentification
from monitor.workflow.figure_files import make_folder, save_figure
from monitor.workflow.run_statistics.answer import StatisticsAnswer


def statistics_figure(
    answer: StatisticsAnswer, campaign: Campaign, identification: StoredIdentification, folder: Path
) -> tuple[str, ...]:
    """Every parameter over the runs, days as bands: a step between days is seen at once."""
    make_folder(folder)
    days = {run.run: run.day for run in campaign.runs}
    names = list(answer.parameter_order)
    columns = [identification.parameters.index(name) for name in names]
    factors = np.array([identification.units[column].factor for column in columns])
    estimate = np.array([run.estimate[columns] for run in identification.runs]) / factors
    u = np.sqrt(np.array([np.diag(run.covariance)[columns] for run in identification.runs])) / factors
    moved = list(answer.moved)
    figure = parameters_by_run(
        ParametersOfRuns(
            [run.run for run in identification.runs],
            [days[run.run] for run in identification.runs],
            names,
            [identification.units[column].name for column in columns],
            estimate,
            2.0 * u,
        ),
        title=titles.parameters_of_runs(answer.campaign, moved),
        interval=titles.INTERVAL_OF_RUN,
        highlight=moved,
    )
    return tuple(save_figure(figure, folder, "parameters-by-run"))
