"""Tracker: reflectors on the tool, and beside the machine, measured from outside at given joint readings."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from monitor.exceptions import Fault
from monitor.readers.faults import quoted
from monitor.readers.method_rules import CHANNELS_ONLY, MethodRules, Plan

#: The frame has six unknowns and a reflector three; fewer poses than this cannot even give these.
FEWEST_POSES = 4
COLUMNS = ("tracker_x_mm", "tracker_y_mm", "tracker_z_mm")


def check(plan: Plan) -> Iterable[Fault]:
    """Faults of the plan: a run without a reflector on the tool, or with too few poses of it."""
    fixed = {reflector.id for reflector in plan.artefact.reflectors if reflector.fixed}
    probings = plan.probings
    on_tool = ~np.isin(probings.target, sorted(fixed))
    joints = np.column_stack([values for _, values in sorted(probings.readings.items())])
    for run in plan.runs:
        rows = probings.run == run
        line = int(plan.lines[np.flatnonzero(rows)[0]])
        poses = len(np.unique(joints[rows & on_tool], axis=0))
        if not np.any(rows & on_tool):
            text = "no reflector on the tool was measured; measure one or more besides the fixed ones"
            yield Fault(plan.file, line, "target", f"run {run}: {text}")
        elif poses < FEWEST_POSES:
            yield Fault(
                plan.file,
                line,
                "target",
                f"run {run}: {poses} pose{'s' * (poses != 1)} of the tool; frame and reflector alone take "
                f"{FEWEST_POSES} or more, and the errors of a robot some tens",
            )
    yield from _lost_beam(plan)
    for name in sorted(fixed - set(probings.target.tolist())):
        yield Fault(
            "campaign.toml", None, "artefact.reflectors", f"reflector {quoted(name)} was never measured"
        )


def _lost_beam(plan: Plan) -> Iterable[Fault]:
    """A fault for every row 0, 0, 0: what trackers write whose beam was lost, never the place of a reflector."""
    readings = np.column_stack([plan.probings.channels[name] for name in COLUMNS])
    for row in np.flatnonzero(np.all(readings == 0.0, axis=1)):
        target = quoted(str(plan.probings.target[row]))
        yield Fault(
            plan.file,
            int(plan.lines[row]),
            COLUMNS[0],
            f"reflector {target} at 0, 0, 0: the tracker had lost the beam; leave the row out",
        )


RULES = MethodRules(
    "tracker",
    targets_are_reflectors=True,
    needs_ambient=False,
    suffixes=CHANNELS_ONLY,
    measured_columns=COLUMNS,
    check=check,
)
