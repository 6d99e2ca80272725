"""The method ``l-shape``: spots of an angle sensor at the modules of an L-shaped standard piece."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from monitor.exceptions import Fault
from monitor.readers.faults import one_of, quoted
from monitor.readers.method_rules import DeclaredPlaces, MethodRules, Plan
from monitor.records import Artefact
from monitor.units import CONDITION_SUFFIXES

SPOTS = ("plane_u_um", "plane_v_um", "paraboloid_u_um", "paraboloid_v_um")
PLACEMENT = "placement"


def check(plan: Plan) -> Iterable[Fault]:
    """Faults of the plan: columns or cells that are missing, a placement that is not described, a module unknown."""
    piece = plan.artefact.l_shape
    channels = plan.probings.channels
    for column in (PLACEMENT, *SPOTS):
        if column not in channels:
            yield Fault(
                plan.file, 1, column, f"the column is missing; l-shape needs {', '.join((PLACEMENT, *SPOTS))}"
            )
            continue
        empty = np.flatnonzero(np.isnan(channels[column]))
        if len(empty):
            text = f"{len(empty)} cells are empty, the first here; every scanned module has four spots and a placement"
            yield Fault(plan.file, int(plan.lines[empty[0]]), column, text)
    if piece is None:
        return
    if PLACEMENT in channels:
        numbers = np.arange(1, len(piece.placements) + 1)
        described = np.isin(channels[PLACEMENT], numbers) | np.isnan(channels[PLACEMENT])
        for row in np.flatnonzero(~described)[:1]:
            text = (
                f"{quoted(f'{channels[PLACEMENT][row]:g}')} is no placement; campaign.toml lists "
                f"{len(piece.placements)}, numbered from 1 in their order"
            )
            yield Fault(plan.file, int(plan.lines[row]), PLACEMENT, text)
    names = {module.id for module in piece.modules}
    for name in sorted({str(target) for target in plan.probings.target} - names):
        line = int(plan.lines[np.flatnonzero(plan.probings.target == name)[0]])
        text = f"there is no module {quoted(name)}; the modules are {one_of(sorted(names))}"
        yield Fault(plan.file, line, "target", text)


def declared(artefact: Artefact) -> DeclaredPlaces | None:
    """The calibrated centres of the modules in the plane of the piece."""
    piece = artefact.l_shape
    if piece is None:
        return None
    return DeclaredPlaces("modules", {module.id: np.array([*module.centre, 0.0]) for module in piece.modules})


RULES = MethodRules(
    "l-shape",
    needs_l_shape=True,
    suffixes=(*CONDITION_SUFFIXES, "um"),
    plain_columns=(PLACEMENT,),
    check=check,
    declared=declared,
)
