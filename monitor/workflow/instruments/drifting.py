"""Setups whose readings run off with the time: the drifts that chance does not explain."""

from __future__ import annotations

from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.reading import LEVER
from monitor.methods.method import Instruments, SetupDrift, Unable
from monitor.units import MICROMETRE, MICRORADIAN
from monitor.workflow.instruments.answer import RunsWithTime
from monitor.workflow.instruments.instruments import DOUBTFUL


def running_with_time(
    problem: ChainProblem, solution: Solution, ability: Instruments | Unable
) -> tuple[RunsWithTime, ...]:
    """The drifts of a fit that chance does not explain, the surest first; none where nothing drifts."""
    if not isinstance(ability, Instruments):
        return ()
    drifts = ability.drifts(problem, solution)
    sure = [drift for drift in drifts if drift.p * len(drifts) <= DOUBTFUL]
    return tuple(_shown(drift, len(drifts)) for drift in sorted(sure, key=lambda drift: drift.p))


def _shown(drift: SetupDrift, comparisons: int) -> RunsWithTime:
    unit, lever = (MICRORADIAN, LEVER) if drift.angular else (MICROMETRE, 1.0)
    size, u = (unit.to_display(value / lever) for value in (drift.size, drift.u))
    return RunsWithTime(
        drift.run, drift.setup, drift.number, unit.name, size, u, comparisons, min(1.0, comparisons * drift.p)
    )
