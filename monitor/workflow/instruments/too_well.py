"""Setups whose readings fit far better than they state: in another unit they show nothing of the machine."""

from __future__ import annotations

from monitor.discovery import Fit
from monitor.methods.method import Instruments, Unable
from monitor.reporting.machine_finding import setups_fit_too_well

#: Residuals of less than this part of what is stated: few owners state ten times what their probe does, and readings in
#: inches, of which nothing else says so, fit 25 times too well.
TOO_WELL = 0.1
#: Chance makes readings fit so well in less than this share of setups.
UNLIKELY = 1e-3


def read_too_well(fit: Fit, ability: Instruments | Unable) -> str | None:
    """What is said of setups whose readings, fitted by themselves, scatter less in every run than a tenth of what
    they state: in another unit, or under a statement far too large.

    None where there are no such, or a single setup: of that the residual of the whole campaign says it.
    """
    if not isinstance(ability, Instruments):
        return None
    most: dict[str, float] = {}
    for run in fit.problem.runs.tolist():
        for scatter in ability.scatters(fit.problem, fit.solution, run):
            # Of readings that chance may have made fit so well nothing is said.
            times = scatter.times if scatter.p < UNLIKELY else 1.0
            most[scatter.setup] = max(times, most.get(scatter.setup, 0.0))
    better = {setup: 1.0 / times for setup, times in most.items() if 0.0 < times < TOO_WELL}
    if len(most) < 2 or not better:
        return None
    return setups_fit_too_well(better)
