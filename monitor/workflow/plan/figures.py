"""The figure of a plan of balls."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from monitor.reporting.figures import titles
from monitor.reporting.figures.volumetric import expected_uncertainties
from monitor.workflow.figure_files import make_folder, save_figure
from monitor.workflow.plan.answer import BallPlan, BallPlanAnswer


def plan_figures(answer: BallPlanAnswer, folder: Path) -> tuple[str, ...]:
    """The expected uncertainties of the present plan, and of the proposed one beside them."""
    make_folder(folder)
    present, proposed = answer.present, answer.proposed
    names = list(present.parameters)

    def uncertainties(plan: BallPlan) -> list[float]:
        return [np.nan if (u := plan.parameters[name].u) is None else u for name in names]

    figure = expected_uncertainties(
        names,
        [present.parameters[name].unit for name in names],
        uncertainties(present),
        None if proposed is None else uncertainties(proposed),
        title=titles.expected_of_plan(
            answer.campaign, _size(present), None if proposed is None else _size(proposed)
        ),
        note=titles.expected_note(answer.stated_uncertainty_um),
    )
    return tuple(save_figure(figure, folder, "expected-uncertainties"))


def _size(plan: BallPlan) -> titles.PlanSize:
    return titles.PlanSize(len(plan.balls), len(plan.poses), plan.seconds)
