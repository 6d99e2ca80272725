"""SAMBA: balls at three or more indexations each, and a calibrated bar, in every run."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from monitor.exceptions import Fault
from monitor.readers.faults import quoted
from monitor.readers.method_rules import CHANNELS_ONLY, DeclaredPlaces, MethodRules, Plan
from monitor.records import Artefact

#: Campaign format 1: a ball seen at fewer indexations in a run is refused (the bar's two aside).
FEWEST_INDEXATIONS = 3


def check(plan: Plan) -> Iterable[Fault]:
    """Faults of the plan: a bar that a run did not probe, a ball seen at too few indexations."""
    bar = plan.artefact.scale_bar
    ends = () if bar is None else bar.balls
    balls = [ball.id for ball in plan.artefact.balls if ball.id not in ends]
    probings = plan.probings
    turned = [probings.readings[axis] for axis in plan.turning]
    # Rows of equal run, target and indexation become one.
    names, target = np.unique(probings.target, return_inverse=True)
    name_at = {str(name): index for index, name in enumerate(names)}
    poses = np.zeros(len(probings), dtype=np.int64)
    if turned:
        _, poses = np.unique(np.column_stack(turned), axis=0, return_inverse=True)
    probed = np.unique(np.column_stack([probings.run, target, poses.reshape(-1)]), axis=0)
    pairs, counts = np.unique(probed[:, :2], axis=0, return_counts=True)
    count_of = {(int(run), int(name)): int(n) for (run, name), n in zip(pairs, counts, strict=True)}
    run_numbers, first = np.unique(probings.run, return_index=True)
    line_of = {int(run): int(line) for run, line in zip(run_numbers, plan.lines[first], strict=True)}

    for run in plan.runs:
        missed = [end for end in ends if (run, name_at.get(end, -1)) not in count_of]
        if missed:
            text = " and ".join(quoted(end) for end in missed)
            yield Fault(
                plan.file,
                line_of[run],
                "target",
                f"run {run}: the scale bar was never probed at {text}; probe both of its balls in every run",
            )
        for ball in balls:
            times = count_of.get((run, name_at.get(ball, -1)), 0)
            if times < FEWEST_INDEXATIONS:
                yield Fault(
                    plan.file,
                    line_of[run],
                    "target",
                    f"run {run}: ball {quoted(ball)} was seen at {times} indexation{'s' * (times != 1)}; "
                    f"probe it at {FEWEST_INDEXATIONS} or more, each with other rotary or spindle angles",
                )


def declared(artefact: Artefact) -> DeclaredPlaces:
    """The nominal centres of the balls."""
    return DeclaredPlaces("balls", {ball.id: np.array(ball.nominal) for ball in artefact.balls})


RULES = MethodRules(
    "samba",
    needs_scale_bar=True,
    targets_are_balls=True,
    suffixes=CHANNELS_ONLY,
    check=check,
    declared=declared,
)
