"""Steps of a machine at which it began to be measured by other instruments, or by newly calibrated ones: theirs, or the
machine's?

A calibrated scale is off by the same in all results that rest on it, so that the scatter of the days says nothing of
it, and a step between two calibrations has the parts of both in its uncertainty (JCGM 100:2008, F.1.2.3). Steps of
several parameters at one exchange have them in common: whether one error of the calibrations explains all of them is
one question, asked of the parameters that did not step there, too: of how far each jumps beside the line of its drift
(``common_error``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from monitor.documents import OMITTED
from monitor.records import Array
from monitor.reporting.calibration_messages import calibrations_apart, step_between_instruments
from monitor.sources import CommonQuantity
from monitor.statistics import Change
from monitor.statistics.common_error import Jumps, jumps, p_of_common_error
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
#: Coefficients of a jump beside a line, and degrees of freedom besides from which on campaigns say it.
LINE, ENOUGH = 3, 2


def calibrations_may_do(size: float, u: float, apart: Array) -> bool:
    """Return whether what two calibrations are ``apart`` by, (q,) for one standard uncertainty of each quantity, may be
    all of a difference of ``size`` with ``u`` besides; True where nothing is known of them (all 0)."""
    return not apart.any() or abs(size) <= K * float(np.hypot(u, np.linalg.norm(apart)))


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

    def alike(self, run: int) -> npt.NDArray[np.bool_]:
        """The runs (n,) that were measured by the same as one of them."""
        _, firsts, index = np.unique(self.history.campaign, return_index=True, return_inverse=True)
        same = [self.by(run, int(first)) is None for first in firsts]
        return np.array(same)[index.ravel()]

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
    history: MachineHistory, past: Mapping[str, ParameterPast], events: Sequence[float] = ()
) -> dict[Change, OtherInstruments]:
    """Return what changed in the measuring at the steps of all parameters; nothing of those where nothing did.

    ``events`` (days since 1970) may have changed the machine: what is beyond them says nothing of a step."""
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
            of_all = _jointly(measuring, past, together, events) if len(together) > 1 else None
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


@dataclass(frozen=True, eq=False)
class _Piece:
    """The runs (n,) ``before`` and ``after`` an exchange that the same instruments measured as the ones next to it,
    between the changes, events and exchanges nearest to it, from ``begins`` to ``ends`` (days since 1970)."""

    before: npt.NDArray[np.bool_]
    after: npt.NDArray[np.bool_]
    begins: float
    ends: float

    def holds(self, parameter: ParameterPast) -> bool:
        """Whether a parameter changed nowhere in it."""
        return not any(self.begins < change.at < self.ends for change in parameter.search.changes)


def _jointly(
    measuring: _Measuring, past: Mapping[str, ParameterPast], steps: Sequence[_Step], events: Sequence[float]
) -> _Jointly | None:
    """The steps of one exchange at once, with the parameters that did not change there; None where nothing is known of
    the calibrations, or where too few days say how far the parameters jumped."""
    last, first = min(step.last for step in steps), max(step.first for step in steps)
    piece = _piece(measuring, steps, last, first, events)
    stepped = {step.past.series.name for step in steps}
    touched = {
        name: parameter
        for name, parameter in past.items()
        if (name in stepped or piece.holds(parameter)) and measuring.apart(name, last, first).any()
    }
    if len(touched.keys() & stepped) < 2:
        return None
    runs = piece.before | piece.after
    for name in stepped & touched.keys():
        runs = runs & _steady(touched[name])
    together = {
        name: parameter for name, parameter in touched.items() if bool(_steady(parameter)[runs].all())
    }
    sizes = _jumps(measuring.history, list(together.values()), runs, piece.after)
    if sizes is None:
        return None
    apart = np.array([measuring.apart(name, last, first) for name in together])
    scale = np.array([_scatter_stated(parameter.series) for parameter in together.values()])
    p_value = p_of_common_error(sizes, apart, scale)
    return _Jointly(p_value >= LEVEL, tuple(together), p_value)


def _piece(
    measuring: _Measuring, steps: Sequence[_Step], last: int, first: int, events: Sequence[float]
) -> _Piece:
    t = measuring.history.seconds / SECONDS_PER_DAY
    of_exchange = {step.change for step in steps}
    changes = (change for step in steps for change in step.past.search.changes if change not in of_exchange)
    bounds = [*events, *(change.at for change in changes)]
    begins = max((at for at in bounds if at <= t[last]), default=-np.inf)
    ends = min((at for at in bounds if at > t[first]), default=np.inf)
    before, after = (measuring.alike(run) for run in (last, first))
    return _Piece(before & (t >= begins) & (t <= t[last]), after & (t < ends) & (t >= t[first]), begins, ends)


def _steady(parameter: ParameterPast) -> npt.NDArray[np.bool_]:
    """The runs of the machine that count in the long view of a parameter."""
    mask = parameter.mask.copy()
    mask[mask] = np.isin(parameter.series.t, parameter.series.steady.t)
    return mask


def _scatter_stated(series: Series) -> float:
    weights = series.weights()
    return 1.0 if weights is None else float(np.median(weights))


def _jumps(
    history: MachineHistory,
    together: Sequence[ParameterPast],
    runs: npt.NDArray[np.bool_],
    after: npt.NDArray[np.bool_],
) -> Jumps | None:
    """How far parameters jump between runs (n,) and those ``after``: by their campaigns beside a line, as at events,
    where these are enough; else by their days, beside a line where a side lasts as long as the time between them."""
    t, later = history.seconds[runs] / SECONDS_PER_DAY, after[runs]
    if later.all() or not later.any():
        return None
    values = np.column_stack([_of_machine(each, each.series.values)[runs] for each in together])
    days = _of_machine(together[0], together[0].series.days)[runs]
    campaigns = np.unique(history.campaign[runs], return_inverse=True)[1].ravel()
    by_campaign, by_day = (
        _means(np.column_stack([values, t]), later, labels) for labels in (campaigns, days)
    )
    if len(by_campaign[0]) >= ENOUGH + LINE:
        means, side = by_campaign
        return jumps(means[:, :-1], means[:, -1], side, line=True)
    means, side = by_day
    of_days = means[:, -1]
    gap = float(of_days[side].min() - of_days[~side].max())
    lasts = max(float(np.ptp(of_days[of])) for of in (side, ~side)) >= gap
    return jumps(means[:, :-1], of_days, side, line=lasts and len(of_days) >= ENOUGH + LINE)


def _of_machine(parameter: ParameterPast, column: npt.NDArray[np.generic]) -> Array:
    """A column of the runs of a parameter as one of the runs of the machine (n,), NaN where it has none."""
    every = np.full(len(parameter.mask), np.nan)
    every[parameter.mask] = column
    return every


def _means(
    values: Array, after: npt.NDArray[np.bool_], labels: npt.NDArray[np.generic]
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """The means (m, p) of the runs of one label and side, and the mask (m,) of those after."""
    distinct, index, counts = np.unique(
        np.column_stack([after, labels]), axis=0, return_inverse=True, return_counts=True
    )
    sums = np.zeros((len(distinct), values.shape[1]))
    np.add.at(sums, index.ravel(), values - values[0])
    return values[0] + sums / counts[:, np.newaxis], distinct[:, 0] > 0
