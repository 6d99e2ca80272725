"""Named selections of runs: made by a condition, used as a group, set side by side.

``hot-cold-star`` is ``hot-cold`` where ``hours >= 6``: Los 2017, 4.6.2, draws the expanded uncertainties with the
covariance of the probed coordinates of each (Figure 4.6).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array
from monitor.store import (
    Database,
    StoredModel,
    StoredSelection,
    find_selection,
    list_campaigns,
    list_selections,
    load_campaign,
    save_selection,
)
from monitor.uncertainty.row_problem import repeated_readings
from monitor.workflow.intake.campaigns import records
from monitor.workflow.models import as_model
from monitor.workflow.run_statistics.columns import campaign_columns, selected

Document = dict[str, Any]


def select(db: Database, campaign: str, name: str, where: str) -> Document:
    """Name the runs of a campaign that meet a condition; the selection is stored.

    Raises InputError for a name that a campaign or a column of the runs has, a condition that cannot be read, or
    one that no run meets.
    """
    loaded = load_campaign(db, campaign)
    if name in set(list_campaigns(db)["campaign"]):
        raise InputError(f"--name {name}: a campaign has that name; a selection needs another")
    columns = campaign_columns(loaded)
    if name in columns:
        raise InputError(
            f"--name {name}: runs are grouped by a column of that name (`stats --by {name}`); a selection needs another"
        )
    keep = selected(columns, where, len(loaded.runs))
    runs = [run.run for run, kept in zip(loaded.runs, keep, strict=True) if kept]
    if not runs:
        raise InputError(f"--where {where}: no run of campaign {campaign} meets it; nothing was kept")
    save_selection(db, campaign, name, where, runs)
    return {"selection": name, "campaign": campaign, "condition": where, "runs": runs}


def selections(db: Database, campaign: str | None = None) -> Document:
    """The selections that are there."""
    return {"selections": records(list_selections(db, campaign))}


def group(db: Database, name: str, campaign: str | None = None) -> StoredSelection | None:
    """A stored selection of a name, of ``campaign`` first; None where the name is that of a campaign: all its runs.

    Raises NotFoundError listing what is there.
    """
    if campaign is not None and name != campaign:
        try:
            return find_selection(db, name, campaign)
        except NotFoundError:
            pass
    if name in set(list_campaigns(db)["campaign"]):
        return None
    return find_selection(db, name)


def selected_readings(
    db: Database, name: str, campaign: str, model: StoredModel, problem: ChainProblem
) -> tuple[Array, npt.NDArray[np.int64]]:
    """Readings (runs, 3n) in mm of the selected runs, and their days; the plan is that of ``problem``.

    The selection may be of another campaign that followed the same plan. Raises DataError where it did not.
    """
    chosen = group(db, name, campaign)
    owner = name if chosen is None else chosen.campaign
    loaded = load_campaign(db, owner)
    own = problem
    if owner != campaign:
        own = campaign_method(loaded).problem_of(loaded, as_model(model))
        if not _same_plan(own, problem):
            raise DataError(
                f"--select {name}: its campaign {owner} followed another plan than {campaign}; a covariance of the "
                "readings needs the same targets and indexations in the same order"
            )
    keep = np.ones(len(own.runs), dtype=np.bool_) if chosen is None else np.isin(own.runs, chosen.runs)
    days = {run.run: run.day for run in loaded.runs}
    labels = np.array([days[int(run)] for run in own.runs[keep]], dtype=np.int64)
    return repeated_readings(own)[keep], labels


def _same_plan(one: ChainProblem, other: ChainProblem) -> bool:
    """Whether the first runs probed the same targets at the same angles."""
    plans = []
    for problem in (one, other):
        context = problem.context
        rows = context.run == problem.runs[0]
        turning = [place for place, joint in enumerate(context.chain.joints) if joint.turns]
        plans.append((context.target[rows], context.positions[rows][:, turning]))
    (targets, angles), (targets2, angles2) = plans
    return bool(
        np.array_equal(targets, targets2) and angles.shape == angles2.shape and np.allclose(angles, angles2)
    )


def side_by_side(db: Database, names: Sequence[str], model: str | None = None, p: float = 0.95) -> Document:
    """Scatter of the runs and expanded uncertainty of a calibration for several selections or campaigns.

    The expanded uncertainty is that of one calibration whose readings scatter as the selection's do (GUM framework,
    U = k_q u for all parameters together with probability ``p``, k_q with the degrees of freedom as `monitor
    uncertainty` states it; ``k_q`` is that of JCGM 102 for a known covariance). Raises InputError for fewer than two
    names.
    """
    # These two come back to this module for the selections.
    from monitor.workflow.run_statistics.statistics import stats
    from monitor.workflow.uncertainty.documents import document
    from monitor.workflow.uncertainty.evaluation import evaluate

    if len(dict.fromkeys(names)) < 2:
        raise InputError("name at least two selections or campaigns to set side by side")
    found: Document = {}
    for name in dict.fromkeys(names):
        chosen = group(db, name)
        campaign = name if chosen is None else chosen.campaign
        scatter = stats(db, campaign, model=model, select=name)
        result = document(
            evaluate(db, campaign, model=model, method="guf", p=p, select=name, model_uncertainty=False)
        )
        guf = result["guf"]
        found[name] = {
            "campaign": campaign,
            "condition": None if chosen is None else chosen.condition,
            "runs": int(sum(scatter["groups"].values())),
            "input_covariance": result["input_covariance"],
            "k_q": guf["k_q"],
            "k_q_with_degrees_of_freedom": guf["k_q_with_degrees_of_freedom"],
            "degrees_of_freedom": guf["degrees_of_freedom"],
            "units": result["units"],
            "mean": {name: one["mean"] for name, one in scatter["parameters"].items()},
            "u_all": {name: one["u_all"] for name, one in scatter["parameters"].items()},
            "u": guf["u"],
            "expanded": guf["expanded"],
        }
    return {"p": p, "selections": found}


def side_by_side_figure(document: Document, folder: Path) -> list[str]:
    """The expanded uncertainties of the selections, bars side by side."""
    # The drawing library takes longer to load than most commands to run.
    from monitor.reporting.figures.style import save
    from monitor.reporting.figures.trend import selections_side_by_side
    from monitor.workflow.figure_files import ENDINGS, make_folder

    make_folder(folder)
    found = document["selections"]
    units: dict[str, str] = {}
    for one in found.values():
        units |= one["units"]
    values = [[one["expanded"].get(name, np.nan) for name in units] for one in found.values()]
    figure = selections_side_by_side(
        list(units), list(units.values()), [f"{name} ({one['runs']} runs)" for name, one in found.items()], values,
        title="Expanded uncertainty of a calibration, by the runs that its covariance is from",
        meaning=f"bars: U = k_q u of all parameters together with p = {document['p']:g}",
    )  # fmt: skip
    return [str(save(figure, folder / f"selections{ending}")) for ending in ENDINGS]
