"""Sets the uncertainties that follow from several selections of runs side by side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from monitor.store import Database
from monitor.workflow.run_statistics.request import StatisticsRequest
from monitor.workflow.run_statistics.statistics import stats
from monitor.workflow.selections.request import SelectionScatter, SideBySideAnswer, SideBySideRequest
from monitor.workflow.selections.select import group
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stating import statement


def side_by_side(db: Database, request: SideBySideRequest) -> SideBySideAnswer:
    """Scatter of the runs and expanded uncertainty of a calibration for several selections or campaigns.

    The expanded uncertainty is that of one calibration whose readings scatter as the selection's do (GUM framework,
    U = k_q u for all parameters together with probability ``p``, k_q with the degrees of freedom as `monitor
    uncertainty` states it; ``k_q`` is that of JCGM 102 for a known covariance).
    """
    scatters = {name: _scatter(db, name, request) for name in dict.fromkeys(request.names)}
    answer = SideBySideAnswer(request.p, scatters)
    if request.figures is None:
        return answer
    return replace(answer, figures=_figure(answer, request.figures))


def _scatter(db: Database, name: str, request: SideBySideRequest) -> SelectionScatter:
    selection = group(db, name)
    campaign = name if selection is None else selection.campaign
    scatter = stats(db, StatisticsRequest(campaign, model=request.model, select=name))
    evaluated = evaluate(
        db,
        UncertaintyRequest(
            campaign, model=request.model, method="guf", p=request.p, select=name, model_uncertainty=False
        ),
    )
    answer = statement(evaluated)
    framework = answer.guf
    return SelectionScatter(
        campaign=campaign,
        condition=None if selection is None else selection.condition,
        runs=sum(scatter.groups.values()),
        input_covariance=answer.input_covariance,
        k_q=framework.k_q,
        k_q_with_degrees_of_freedom=framework.k_q_with_degrees_of_freedom,
        degrees_of_freedom=framework.degrees_of_freedom,
        units=answer.units,
        mean={parameter: statistics.mean for parameter, statistics in scatter.parameters.items()},
        u_all={parameter: statistics.u_all for parameter, statistics in scatter.parameters.items()},
        u=framework.u,
        expanded=framework.expanded,
        refers_to=scatter.refers_to,
    )


def _figure(answer: SideBySideAnswer, folder: Path) -> tuple[str, ...]:
    """The expanded uncertainties of the selections, bars side by side."""
    # The drawing library takes longer to load than most commands to run.
    from monitor.reporting.figures import titles
    from monitor.reporting.figures.trend import selections_side_by_side
    from monitor.workflow.figure_files import make_folder, save_figure

    make_folder(folder)
    units, scatters = answer.units, answer.selections
    figure = selections_side_by_side(
        list(units), list(units.values()),
        [titles.selection_name(name, scatter.runs) for name, scatter in scatters.items()],
        [[scatter.expanded.get(name, np.nan) for name in units] for scatter in scatters.values()],
        title=titles.SELECTIONS,
        meaning=titles.selections_note(answer.p),
    )  # fmt: skip
    return tuple(save_figure(figure, folder, "selections"))
