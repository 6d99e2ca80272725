"""The method ``rotary-probing``: touching a test piece at indexed angles of rotary axes.

Every row is one touch, with the outward normal of the touched surface in the frame of the last work axis. A target
is a point of the piece, which keeps its normal and comes back at other angles, or a ball of ``[[artefact.balls]]``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from monitor.exceptions import Fault, did_you_mean
from monitor.readers.faults import quoted
from monitor.readers.method_rules import DeclaredPlaces, MethodRules, Plan
from monitor.records import Artefact

NORMAL = ("normal_x", "normal_y", "normal_z")
# Four decimals of a direction are enough to be read as one; the length is divided out.
LENGTH_TOLERANCE = 0.01
# Normals of one point agree to what four decimals round.
SAME_NORMAL = 1e-3
#: Diameters of certificates differ in their last digits; steps are held against millimetres.
SAME_DIAMETER_MM = 0.1
#: A point touched at one pose says nothing of the axes; a sphere has four unknowns, so fewer touches say nothing.
FEWEST_POSES, FEWEST_TOUCHES = 2, 4


def check(plan: Plan) -> Iterable[Fault]:
    """Faults of the plan: no rotary axis, a normal that is none, a point that does not come back."""
    if not plan.turning:
        text = "the topology has no rotary axis; the method rotary-probing finds the errors of rotary axes"
        yield Fault("campaign.toml", None, "machine.topology", text)
        return
    missing = [name for name in NORMAL if name not in plan.probings.channels]
    for name in missing:
        text = (
            "the column is missing; the method rotary-probing needs normal_x, normal_y and normal_z, the outward "
            "normal of the touched surface in the frame of the last work axis"
        )
        yield Fault(plan.file, 1, name, text)
    if missing:
        return
    normal = np.column_stack([plan.probings.channels[name] for name in NORMAL])
    length = np.linalg.norm(normal, axis=1)
    wrong = ~(np.abs(length - 1.0) <= LENGTH_TOLERANCE)
    for row in np.flatnonzero(wrong).tolist():
        yield Fault(plan.file, int(plan.lines[row]), *_what_is_wrong(normal[row]))
    balls = {ball.id for ball in plan.artefact.balls}
    intact = np.isin(plan.probings.run, plan.runs)
    for run in plan.runs:
        rows = np.flatnonzero((plan.probings.run == run) & intact)
        yield from _points(plan, rows, normal, wrong, balls)


def _what_is_wrong(normal: npt.NDArray[np.float64]) -> tuple[str, str]:
    for name, value in zip(NORMAL, normal, strict=True):
        if not np.isfinite(value):
            return name, "the cell is empty; every touch needs its normal"
    shown = ", ".join(f"{value:g}" for value in normal)
    return NORMAL[0], f"the normal ({shown}) has length {np.linalg.norm(normal):.4g}; a normal has length 1"


def _points(
    plan: Plan,
    rows: npt.NDArray[np.int64],
    normal: npt.NDArray[np.float64],
    wrong: npt.NDArray[np.bool_],
    balls: set[str],
) -> Iterator[Fault]:
    probings, run = plan.probings, int(plan.probings.run[rows[0]]) if len(rows) else 0
    turned = np.column_stack([probings.readings[axis] for axis in plan.turning])
    for target in dict.fromkeys(probings.target[rows].tolist()):
        mine = rows[probings.target[rows] == target]
        line = int(plan.lines[mine[0]])
        if target in balls:
            if len(mine) < FEWEST_TOUCHES:
                yield Fault(
                    plan.file,
                    line,
                    "target",
                    f"run {run}: ball {quoted(target)} was touched {len(mine)} times; a sphere of unknown centre and "
                    f"radius needs {FEWEST_TOUCHES} or more, from different sides",
                )
            continue
        other = mine[~wrong[mine] & (np.linalg.norm(normal[mine] - normal[mine[0]], axis=1) > SAME_NORMAL)]
        poses = len(np.unique(turned[mine], axis=0))
        meant = did_you_mean(target, balls) if len(other) or poses < FEWEST_POSES else ""
        if meant:
            yield Fault(
                plan.file,
                line,
                "target",
                f"run {run}: {quoted(target)} is no ball of [[artefact.balls]]; {meant.strip()} As a point it "
                + (
                    f"has another normal on line {plan.lines[other[0]]}"
                    if len(other)
                    else "was touched at one pose only"
                ),
            )
            continue
        if len(other) and not wrong[mine[0]]:
            yield Fault(
                plan.file,
                int(plan.lines[other[0]]),
                NORMAL[0],
                f"run {run}: point {quoted(target)} has another normal than on line {line}; normals are in the frame "
                "of the last work axis, where a point keeps its own; name each point of the surface differently",
            )
        if poses < FEWEST_POSES:
            yield Fault(
                plan.file,
                line,
                "target",
                f"run {run}: point {quoted(target)} was touched at one pose only; its place is unknown, so touch it "
                "again with other rotary angles",
            )


def declared(artefact: Artefact) -> DeclaredPlaces | None:
    """The nominal centres of balls of one nominal diameter, the commonest; None where fewer than two have it."""
    alike = [
        {
            ball.id: np.array(ball.nominal)
            for ball in artefact.balls
            if abs(ball.diameter - of.diameter) < SAME_DIAMETER_MM
        }
        for of in artefact.balls
    ]
    places = max(alike, key=len, default={})
    return DeclaredPlaces("balls", places, by_normals=True) if len(places) > 1 else None


RULES = MethodRules("rotary-probing", plain_columns=NORMAL, check=check, declared=declared)
