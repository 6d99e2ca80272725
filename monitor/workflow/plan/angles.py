"""Plans of the method free-form: expected uncertainties, and which angles of the table to probe at next."""

from __future__ import annotations

from typing import Any

import numpy as np

from monitor.exceptions import InputError
from monitor.methods import AnglePlan
from monitor.methods.method import AngleCandidates, ExpectedAngles
from monitor.records import Campaign
from monitor.store import StoredModel
from monitor.units import MICROMETRE
from monitor.workflow.models import as_model, label

Document = dict[str, Any]
#: Angles are tried every so many degrees; the best one lies broad.
STEP_DEG = 5
MOST_ANGLES = 12
#: So many single angles are listed.
LISTED = 5
#: JCGM 100 6.3.3: k = 2, as the figures of the method's source have it.
K = 2.0


def plan_angles(
    method: AnglePlan, loaded: Campaign, stored: StoredModel, count: int | None, p: float
) -> Document:
    """What the plan of the campaign's first run promises, the worth of one more angle, and the best ``count``.

    Raises InputError for a number of angles that cannot be, DataError for a campaign that cannot be planned.
    """
    wanted = 1 if count is None else count
    if not 1 <= wanted <= MOST_ANGLES:
        raise InputError(f"--poses {wanted}: choose 1 to {MOST_ANGLES} more angles")
    there = method.candidates_of(loaded, as_model(stored), range(0, 360, STEP_DEG))
    single, chosen = there.next_angles(wanted)
    table = there.table
    return {
        "campaign": loaded.name,
        "machine": loaded.machine.id,
        "method": loaded.method,
        "model": label(stored),
        "p": p,
        "k": K,
        "table": table,
        "stated_uncertainty_um": MICROMETRE.to_display(loaded.probe.standard_uncertainty),
        "conditions": dict(there.conditions),
        "present": _plan(there, there.expected(there.present)),
        "angles": [
            {f"{table.lower()}_deg": plan.angles[-1], **_shape(plan), "unseen_dimensions": plan.nullity}
            for plan in single[:LISTED]
        ],
        "next_angles_deg": list(chosen),
        "proposed": _plan(there, there.expected((*there.present, *chosen))),
    }


def _shape(plan: ExpectedAngles) -> Document:
    found = plan.shape[np.isfinite(plan.shape)]
    size = K * MICROMETRE.to_display(1.0)
    none = not len(found)
    return {
        "largest_expanded_shape_um": None if none else size * float(found.max()),
        "median_expanded_shape_um": None if none else size * float(np.median(found)),
        "points_without_number": int(np.isnan(plan.shape).sum()),
        "points_beyond_nodes": plan.left_out,
    }


def _plan(there: AngleCandidates, plan: ExpectedAngles) -> Document:
    units = there.units
    return {
        "angles_deg": list(plan.angles),
        "probings": plan.probings,
        "unseen_dimensions": plan.nullity,
        **_shape(plan),
        "parameters": {
            name: {"u": None if np.isnan(u) else units[name].to_display(u), "unit": units[name].name}
            for name, u in plan.u.items()
        },
        "refused": [name for name, u in plan.u.items() if np.isnan(u)],
    }
