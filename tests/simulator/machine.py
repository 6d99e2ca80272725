"""The simulated machine: its topology, its errors, and how its parameters wander from run to run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .chain import Chain, read_topology
from .effects import Effect
from .plans import Schedule

SAMBA_TERMS = {
    "EA0B": 12e-6,
    "EC0B": -8e-6,
    "EX0C": 0.006,
    "EA0C": -15e-6,
    "EB0C": 9e-6,
    "EB0Z": 20e-6,
    "EA0Y": -11e-6,
    "EC0Y": 14e-6,
    "EX0C1": 0.004,
    "EY0C1": -0.003,
    "EXX:poly1": 18e-6,
    "EYY:poly1": -12e-6,
    "EZZ:poly1": 25e-6,
}
"""A made-up state of the HU40-T's thirteen parameters (mm, rad, mm/mm), of an ordinary size."""

SAMBA_PARAMETERS = tuple(name.partition(":")[0] for name in SAMBA_TERMS)
"""Their names as a SAMBA result has them, in the order of docs/conventions.md, section What SAMBA identifies."""


@dataclass(frozen=True)
class SimulatedMachine:
    """Topology, signs, errors. `terms` are plain coefficients by name, each a number or one number a run.

    `down` is the direction of gravity in the machine frame: (0, -1, 0) for a horizontal spindle along Z.
    """

    topology: str = "w C B X b Z Y (C1) t"
    signs: Mapping[str, float] = field(default_factory=dict)
    terms: Mapping[str, float | np.ndarray] = field(default_factory=dict)
    effects: Sequence[Effect] = ()
    tip_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    down: tuple[float, float, float] = (0.0, -1.0, 0.0)

    @property
    def chain(self) -> Chain:
        return read_topology(self.topology, dict(self.signs))


def hu40(
    terms: Mapping[str, float | np.ndarray] | None = None, effects: Sequence[Effect] = ()
) -> SimulatedMachine:
    """The machine of the sample campaigns: five axes, every sign +1."""
    signs = dict.fromkeys(("X", "Y", "Z", "B", "C", "C1"), 1.0)
    return SimulatedMachine(
        signs=signs, terms=SAMBA_TERMS if terms is None else terms, effects=tuple(effects)
    )


def wandering(
    terms: Mapping[str, float],
    schedule: Schedule,
    rng: np.random.Generator,
    per_run: float = 0.1,
    per_day: float = 0.0,
) -> dict[str, np.ndarray]:
    """Terms that vary from run to run and step from day to day, in parts of each value (one sigma)."""
    days = np.array(schedule.day) - 1
    steps = {name: rng.standard_normal(days.max() + 1)[days] for name in terms}
    return {
        name: value * (1.0 + per_run * rng.standard_normal(schedule.runs) + per_day * steps[name])
        for name, value in terms.items()
    }
