"""The readings of the runs of a stored selection, for the covariance of a campaign of the same plan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array
from monitor.store import Database, StoredModel, load_campaign
from monitor.uncertainty.runs.row_run import repeated_readings
from monitor.workflow.models import as_model
from monitor.workflow.selections.select import group


@dataclass(frozen=True)
class SelectedReadings:
    """Readings (runs, 3n) in mm of the runs of the stored selection ``name``, and the day of each."""

    name: str
    values: Array
    days: npt.NDArray[np.int64]


def selected_readings(
    db: Database, name: str, campaign: str, model: StoredModel, problem: ChainProblem
) -> SelectedReadings:
    """The readings of the runs of selection ``name``, or of all runs of a campaign of that name; the plan is that of
    ``problem``, which is of ``campaign``.

    The selection may be of another campaign that followed the same plan. Raises DataError where it did not.
    """
    selection = group(db, name, campaign)
    owner = name if selection is None else selection.campaign
    loaded = load_campaign(db, owner)
    of_owner = problem
    if owner != campaign:
        of_owner = campaign_method(loaded).problem_of(loaded, as_model(model))
        if not _same_plan(of_owner, problem):
            raise DataError(
                f"--select {name}: its campaign {owner} followed another plan than {campaign}; a covariance of the "
                "readings needs the same targets and indexations in the same order"
            )
    runs = of_owner.runs
    selected = np.ones(len(runs), dtype=np.bool_) if selection is None else np.isin(runs, selection.runs)
    days = {run.run: run.day for run in loaded.runs}
    labels = np.array([days[int(run)] for run in runs[selected]], dtype=np.int64)
    return SelectedReadings(name, repeated_readings(of_owner)[selected], labels)


def _same_plan(first: ChainProblem, second: ChainProblem) -> bool:
    """Whether the first runs of both probed the same targets at the same angles."""
    plans = []
    for problem in (first, second):
        context = problem.context
        rows = context.run == problem.runs[0]
        turning = [index for index, joint in enumerate(context.chain.joints) if joint.turns]
        plans.append((context.target[rows], context.positions[rows][:, turning]))
    (targets, angles), (other_targets, other_angles) = plans
    return bool(
        np.array_equal(targets, other_targets)
        and angles.shape == other_angles.shape
        and np.allclose(angles, other_angles)
    )
