"""Plans of angles of a table: expected uncertainties, and which angles to probe at next."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import InputError
from monitor.methods import AnglePlan
from monitor.methods.method import AngleCandidates, ExpectedAngles
from monitor.records import Campaign
from monitor.store import StoredModel
from monitor.units import MICROMETRE
from monitor.workflow.models import as_model, label
from monitor.workflow.plan.answer import (
    AngleParameter,
    AnglePlanAnswer,
    AnglesOfTable,
    OneMoreAngle,
    ShapeUncertainty,
)
from monitor.workflow.plan.request import PlanRequest

#: Angles are tried every so many degrees; the best one lies broad.
STEP_DEG = 5
MOST_ANGLES = 12
#: So many single angles are listed.
LISTED = 5
#: JCGM 100 6.3.3: k = 2, as the figures of the method's source have it.
K = 2.0


def plan_angles(
    method: AnglePlan, campaign: Campaign, model: StoredModel, request: PlanRequest
) -> AnglePlanAnswer:
    """What the plan of the campaign's first run promises, the worth of one more angle, and the best next ones.

    Raises InputError for what such a plan does not have and a number of angles that cannot be, DataError for a
    campaign that cannot be planned.
    """
    if request.balls is not None or request.wanted or request.separate is not None:
        raise InputError(
            f"a plan of the method {campaign.method} is its angles of the table: --poses N proposes the next N "
            "of them"
        )
    count = 1 if request.poses is None else request.poses
    if not 1 <= count <= MOST_ANGLES:
        raise InputError(f"--poses {count}: choose 1 to {MOST_ANGLES} more angles")
    if request.figures is not None:
        raise InputError("--figures: a plan of table angles has no figure yet; leave it out")
    candidates = method.candidates_of(campaign, as_model(model), range(0, 360, STEP_DEG))
    single, following = candidates.next_angles(count)
    column = f"{candidates.table.lower()}_deg"
    return AnglePlanAnswer(
        campaign=campaign.name,
        machine=campaign.machine.id,
        method=campaign.method,
        model=label(model),
        p=request.p,
        k=K,
        table=candidates.table,
        stated_uncertainty_um=MICROMETRE.to_display(campaign.probe.standard_uncertainty),
        conditions=dict(candidates.conditions),
        present=_plan(candidates, candidates.expected(candidates.present)),
        angles=tuple(
            OneMoreAngle({column: plan.angles[-1]}, _shape(plan), plan.nullity) for plan in single[:LISTED]
        ),
        next_angles_deg=following,
        proposed=_plan(candidates, candidates.expected((*candidates.present, *following))),
    )


def _shape(plan: ExpectedAngles) -> ShapeUncertainty:
    u = plan.shape[np.isfinite(plan.shape)]
    um = K * MICROMETRE.to_display(1.0)
    return ShapeUncertainty(
        largest_expanded_shape_um=um * float(u.max()) if len(u) else None,
        median_expanded_shape_um=um * float(np.median(u)) if len(u) else None,
        points_without_number=int(np.isnan(plan.shape).sum()),
        points_beyond_nodes=plan.left_out,
    )


def _plan(candidates: AngleCandidates, plan: ExpectedAngles) -> AnglesOfTable:
    units = candidates.units
    return AnglesOfTable(
        angles_deg=plan.angles,
        probings=plan.probings,
        unseen_dimensions=plan.nullity,
        shape=_shape(plan),
        parameters={
            name: AngleParameter(None if np.isnan(u) else units[name].to_display(u), units[name].name)
            for name, u in plan.u.items()
        },
        refused=tuple(name for name, u in plan.u.items() if np.isnan(u)),
    )
