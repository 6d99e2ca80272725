"""The figure of `monitor stats`: every parameter over the runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from monitor.reporting.figures.parameters import ParametersOfRuns, parameters_by_run
from monitor.store import StoredIdentification
from monitor.workflow.figure_files import make_folder, save_figure

Document = dict[str, Any]
# Parameters whose means differ between groups at this false discovery rate are highlighted.
RATE = 0.001


def statistics_figure(
    document: Document, identification: StoredIdentification, days: dict[int, int], folder: Path
) -> list[str]:
    """Draw every parameter over the runs, days as bands, so that a step between days shows."""
    make_folder(folder)
    names = document["parameter_order"]
    indices = [identification.parameters.index(name) for name in names]
    factors = np.array([identification.units[index].factor for index in indices])
    estimate = np.array([run.estimate[indices] for run in identification.runs]) / factors
    u = np.sqrt(np.array([np.diag(run.covariance)[indices] for run in identification.runs])) / factors
    q = {name: document["parameters"][name]["anova_q"] for name in names}
    moved = [name for name in names if q[name] is not None and q[name] < RATE]
    finding = f"differ between days: {', '.join(moved)}" if moved else "no parameter differs between days"
    figure = parameters_by_run(
        ParametersOfRuns(
            [run.run for run in identification.runs],
            [days[run.run] for run in identification.runs],
            names,
            [identification.units[index].name for index in indices],
            estimate,
            2.0 * u,
        ),
        title=f"{document['campaign']}: {finding}",
        interval="± 2 standard uncertainties of the run",
        highlight=moved,
    )
    return save_figure(figure, folder, "parameters-by-run")
