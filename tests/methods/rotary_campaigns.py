"""Campaigns of rotary-probing as records, from what the independent simulator touched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

from monitor.records import Array, Artefact, Ball, Campaign, Machine, Probe, Probings, Run

PAPER = "w C A Y b X Z t"
#: Location errors of an ordinary machine, by our names (mm, rad).
TRUTH = {
    "EX0A": 0.015, "EY0A": 0.024, "EZ0A": 0.027, "EB0A": -2e-5, "EC0A": -1.2e-5, "EY0C": 0.004, "EA0C": -1e-5,
    "EB0C": 6e-6,
}  # fmt: skip


def location(truth: Mapping[str, float]) -> dict[str, Array]:
    """Names such as EX0A as the simulator takes them: six numbers an axis."""
    found: dict[str, Array] = {}
    for name, value in truth.items():
        found.setdefault(name[3:], np.zeros(6))["XYZABC".index(name[1])] = value
    return found


def touched(
    topology: str,
    plan: Sequence[tuple[Any, Mapping[str, float]]],
    runs: Sequence[Mapping[str, Array]],
    *,
    tip: tuple[float, float, float] = (0.0, 0.0, 0.0),
    sigma: float = 0.7e-3,
) -> Campaign:
    """The campaign of runs that all touched ``plan``."""
    count = len(plan)
    balls = {one.target: one for one, _ in plan if one.centre is not None}
    readings = {
        axis: np.concatenate([np.radians(run[axis]) if axis[0] in "ABC" else run[axis] for run in runs])
        for axis in runs[0]
    }
    start = datetime(2026, 3, 2, 8, 0, tzinfo=UTC)
    return Campaign(
        "touched",
        "rotary-probing",
        Machine("M", topology),
        Probe("p", "m", sigma, tip),
        Artefact("", tuple(Ball(one.target, one.centre, 2 * one.radius) for one in balls.values())),
        tuple(Run(k + 1, start + timedelta(minutes=25 * k), 1, False) for k in range(len(runs))),
        Probings(
            np.repeat(np.arange(1, len(runs) + 1), count),
            np.tile(np.arange(1, count + 1), len(runs)),
            np.tile(np.arange(count) * 7.8, len(runs)),
            np.tile([one.target for one, _ in plan], len(runs)),
            readings,
            {
                f"normal_{axis}": np.tile([one.normal[k] for one, _ in plan], len(runs))
                for k, axis in enumerate("xyz")
            },
        ),
    )
