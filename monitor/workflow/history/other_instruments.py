"""Steps of a machine at which it began to be measured by other instruments, or by newly calibrated ones: theirs, or the
machine's?

A calibrated scale is off by the same in all results that rest on it, so that the scatter of the days says nothing of
it, and a step between two calibrations has the parts of both in its uncertainty (JCGM 100:2008, F.1.2.3). Steps of
several parameters at one exchange have them in common: whether one error of the calibrations explains all of them is
one question (chi-square with their covariance), asked of the parameters that did not step there, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import scipy

from monitor.documents import OMITTED
from monitor.records import Array
from monitor.reporting.calibration_messages import calibrations_apart, step_between_instruments
from monitor.sources import CommonQuantity
from monitor.statistics import Change
from monitor.store import MachineHistory
from monitor.workflow.history.calendar import SECONDS_PER_DAY
from monitor.workflow.history.in_common import with_unstored
from monitor.workflow.history.past import ParameterPast
from monitor.workflow.history.series import Series

#: Expanded uncertainties have this coverage factor; what is no larger may be all of a step.
K = 2.0
#: Steps that are as improbable together as a step of K standard uncertainties are not all of the calibrations.
LEVEL = 0.05


#: Calibrations with less than this of a parameter, in its display unit (1 nm, 1 nrad), have nothing of it.
LEAST_U = 1e-3


@dataclass(frozen=True)
class OtherInstruments:
    """A step lies between runs that were measured ``before`` by other methods or instruments, or by other certificates
    of them, than ``after`` it.

    ``u`` is the standard uncertainty of their difference by what is calibrated, as stated, in the unit of the step,
    None where nothing is known of that; ``e_n`` is the step over the expanded uncertainty of both (ISO 13528, 9.7);
    ``may_be_all``: no larger. Where several parameters stepped there, those ``together`` are judged at once:
    ``p_value`` is that of all their differences there coming from the calibrations and the scatter alone.
    """

    before: str
    after: str
    u: float | None
    may_be_all: bool
    e_n: float | None = field(default=None, metadata=OMITTED)
    together: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    p_value: float | None = field(default=None, metadata=OMITTED)

    def in_words(self, unit: str) -> str:
        """What is said of it beside the step."""
        if self.u is not None and self.u < LEAST_U:
            return calibrations_apart(self.before, self.after)
        stated = None if self.u is None else f"{self.u:.2g} {unit}"
        return step_between_instruments(self.before, self.after, stated, self.may_be_all, self.together or ())


class _Step(NamedTuple):
    """A found step: its parameter, the change, the last run before it and the first after it."""

    past: ParameterPast
    change: Change
    last: int
    first: int


@dataclass(frozen=True, eq=False)
class _Measuring:
    """The runs of a machine, and what values have of each of q calibrated quantities, ``parts`` (q, n, p)."""

    history: MachineHistory
    quantities: tuple[CommonQuantity, ...]
    parts: Array

    def by(self, last: int, first: int) -> tuple[str, str] | None:
        """By what two runs were measured, where that is not the same: methods with instruments, else the instruments of
        which the certificate is another one."""
        history = self.history
        methods = str(history.measured_by[last]), str(history.measured_by[first])
        if methods[0] != methods[1]:
            return methods
        earlier, later = (self._certificates(run) for run in (last, first))
        renewed = [name for name in earlier if later.get(name, earlier[name]) != earlier[name]]
        if not renewed:
            return None
        before, after = (
            " and ".join(f"{name} ({of[name] or 'no certificate'})" for name in renewed)
            for of in (earlier, later)
        )
        return before, after

    def _certificates(self, run: int) -> Mapping[str, str]:
        return self.history.calibrations.certificates.get(str(self.history.campaign[run]), {})

    def apart(self, name: str, last: int, first: int) -> Array:
        """What the difference of a parameter in two runs has of each quantity (q,)."""
        column = self.history.parameters.index(name)
        return np.asarray(self.parts[:, first, column] - self.parts[:, last, column])

    def is_known(self, last: int, first: int) -> bool:
        """Whether anything is known of the calibrations that two runs do not have in common."""
        earlier, later = (self._certificates(run) for run in (last, first))
        renewed = {name for name in {*earlier, *later} if earlier.get(name) != later.get(name)}
        return any(quantity.of in renewed for quantity in self.quantities)


def between_instruments(
    history: MachineHistory, past: Mapping[str, ParameterPast]
) -> dict[Change, OtherInstruments]:
    """Return what changed in the measuring at the steps of all parameters; nothing of those where nothing did."""
    by_quantity = with_unstored(history)[0]
    parts = np.array(list(by_quantity.values())).reshape(len(by_quantity), *history.values.shape)
    measuring = _Measuring(history, tuple(by_quantity), parts)
    exchanges: dict[tuple[str, str], list[_Step]] = {}
    for parameter in past.values():
        for step in _steps(parameter):
            names = measuring.by(step.last, step.first)
            if names is not None:
                exchanges.setdefault(names, []).append(step)
    judged = {}
    for names, steps in exchanges.items():
        for together in _at_once(steps):
            of_all = _jointly(measuring, past, together) if len(together) > 1 else None
            for step in together:
                alone = _alone(measuring, step, names)
                is_joint = of_all is not None and alone.u and step.past.series.name in of_all.together
                judged[step.change] = replace(alone, **of_all._asdict()) if of_all and is_joint else alone
    return judged


def _steps(past: ParameterPast) -> Iterator[_Step]:
    runs, t = np.flatnonzero(past.mask), past.series.t
    for change in past.search.changes:
        before, after = runs[t <= change.interval[0]], runs[t >= change.interval[1]]
        if change.kind == "step" and len(before) and len(after):
            yield _Step(past, change, int(before[-1]), int(after[0]))


def _at_once(steps: Sequence[_Step]) -> list[list[_Step]]:
    """The steps by exchange: those whose intervals overlap are one's."""
    groups: list[list[_Step]] = []
    for step in sorted(steps, key=lambda each: (each.last, each.first)):
        if groups and step.last < min(other.first for other in groups[-1]):
            groups[-1].append(step)
        else:
            groups.append([step])
    return groups


def _alone(measuring: _Measuring, step: _Step, names: tuple[str, str]) -> OtherInstruments:
    """A step by itself."""
    apart = measuring.apart(step.past.series.name, step.last, step.first)
    if not apart.any() and not measuring.is_known(step.last, step.first):
        return OtherInstruments(*names, u=None, may_be_all=True)
    u = float(np.linalg.norm(apart))
    e_n = step.change.size / (K * float(np.hypot(step.change.u, u)))
    return OtherInstruments(*names, u=u, may_be_all=abs(e_n) <= 1.0, e_n=e_n)


class _Jointly(NamedTuple):
    """Whether the calibrations may be all of the steps of the parameters judged ``together``."""

    may_be_all: bool
    together: tuple[str, ...]
    p_value: float


def _jointly(
    measuring: _Measuring, past: Mapping[str, ParameterPast], steps: Sequence[_Step]
) -> _Jointly | None:
    """The steps of one exchange at once; None where nothing is known of the calibrations."""
    last, first = min(step.last for step in steps), max(step.first for step in steps)
    stepped = {step.past.series.name: (step.change.size, step.change.u) for step in steps}
    differences: dict[str, tuple[float, float]] = {}
    for name, parameter in past.items():
        difference = stepped.get(name) or _difference(parameter.series.steady, measuring.history, last, first)
        if difference is not None and measuring.apart(name, last, first).any():
            differences[name] = difference
    if len(differences.keys() & stepped.keys()) < 2:
        return None
    sizes, u = np.array(list(differences.values())).T
    apart = np.array([measuring.apart(name, last, first) for name in differences])
    chi_square = float(sizes @ np.linalg.solve(np.diag(u**2) + apart @ apart.T, sizes))
    p_value = float(scipy.special.chdtrc(len(sizes), chi_square))
    return _Jointly(p_value >= LEVEL, tuple(differences), p_value)


def _difference(series: Series, history: MachineHistory, last: int, first: int) -> tuple[float, float] | None:
    """The mean of the days after an exchange less that of those before, with u by the scatter of the days; None where
    these are too few."""
    if series.campaign is None:
        return None
    t = history.seconds[[last, first]] / SECONDS_PER_DAY
    sides = []
    for run in (series.t <= t[0], series.t >= t[1]):
        index = np.unique(series.days[run], return_inverse=True)[1]
        sides.append(
            np.bincount(index, series.values[run]) / np.bincount(index) if run.any() else np.empty(0)
        )
    counts = np.array([len(side) for side in sides])
    freedom = int(counts.sum()) - 2
    if not counts.all() or freedom < 1:
        return None
    variance = sum(float(((side - side.mean()) ** 2).sum()) for side in sides) / freedom
    u = float(np.sqrt(variance * (1.0 / counts).sum()))
    return (float(sides[1].mean() - sides[0].mean()), u) if u > 0.0 else None
