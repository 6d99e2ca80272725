"""Steps of a machine at which it began to be measured by other instruments: theirs, or the machine's?

A calibrated scale is off by the same in all results that rest on it, so that the scatter of the days says nothing of
it, and a step between two instruments has the parts of both in its uncertainty (JCGM 100:2008, F.1.2.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.reporting.messages import step_between_instruments
from monitor.statistics import Change
from monitor.store import MachineHistory
from monitor.workflow.history.in_common import calibrated_alike
from monitor.workflow.history.past import ParameterPast

#: Expanded uncertainties have this coverage factor; what is no larger may be all of a step.
K = 2.0


@dataclass(frozen=True)
class OtherInstruments:
    """A step lies between runs that were measured ``before`` by other methods or instruments than ``after`` it.

    ``u`` is the standard uncertainty of their difference by what is calibrated, as stated, in the unit of the step,
    None where nothing is known of that; ``may_be_all``: with the u of the step it holds the step within the factor 2.
    """

    before: str
    after: str
    u: float | None
    may_be_all: bool

    def in_words(self, unit: str) -> str:
        """What is said of it beside the step."""
        stated = None if self.u is None else f"{self.u:.2g} {unit}"
        return step_between_instruments(self.before, self.after, stated, self.may_be_all)


def other_instruments(
    history: MachineHistory, past: ParameterPast, change: Change
) -> OtherInstruments | None:
    """Return what changed in the measuring at a step of a parameter; None where nothing did, or for another change."""
    if change.kind != "step":
        return None
    runs, t = np.flatnonzero(past.mask), past.series.t
    before, after = runs[t <= change.interval[0]], runs[t >= change.interval[1]]
    if not len(before) or not len(after):
        return None
    last, first = before[-1], after[0]
    methods = str(history.measured_by[last]), str(history.measured_by[first])
    if methods[0] == methods[1]:
        return None
    column = history.parameters.index(past.series.name)
    parts = np.array(
        [part[[last, first], column] for part in calibrated_alike(history.common_parts).values()]
    )
    u = float(np.linalg.norm(parts[:, 0] - parts[:, 1])) if np.any(parts) else None
    return OtherInstruments(*methods, u, u is None or abs(change.size) <= K * float(np.hypot(change.u, u)))
