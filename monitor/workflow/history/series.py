"""The history of a machine as a series for each parameter, in the order of time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import timedelta
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.sources import CommonQuantity
from monitor.store import FEWEST_STEADY, MachineHistory
from monitor.units import DEGREE_CELSIUS, column_unit
from monitor.workflow.history.calendar import SECONDS_PER_DAY
from monitor.workflow.history.in_common import with_unstored
from monitor.workflow.history.what_measured import what_measured

#: A run differs from others by this part of its u at least; less is rounding of what it has in common with them.
LEAST_OF_RUN = 1e-3
#: Instruments whose runs have so many times the u of the surest tell nothing beside it: their runs weigh a ninth.
UNSURE = 3.0


@dataclass(frozen=True, eq=False)
class Series:
    """One parameter of one machine in the order of time.

    ``values`` and ``u`` (n,) in ``unit``, ``t`` (n,) in days since 1970 (UTC), ``days`` (n,) numbers of the machine's
    days, ``hour`` (n,) of the shop's clock, ``warm_up`` (n,) whether the machine was warming up; ``offset`` of the
    shop's clock from UTC, that of the machine's last run. ``temperature`` (n,) is that of the machine or its shop in °C
    as far as recorded (NaN: not), under the name ``thermometer``. ``campaign`` (n,) numbers the campaigns of the runs;
    None where nobody says them. ``by`` (n,) numbers what measured them among ``instruments``: methods with instruments
    and the certificates that the parameter rests on (None: nobody says). ``common_parts`` (n,) are what values change
    by for one standard uncertainty of each calibrated quantity that outlasts a campaign; of the runs of the mask
    ``bounded`` (n,) only at most (None: none).
    """

    name: str
    unit: str
    values: Array
    u: Array
    t: Array
    days: npt.NDArray[np.int64]
    hour: Array
    warm_up: npt.NDArray[np.bool_]
    offset: timedelta
    temperature: Array | None = None
    thermometer: str | None = None
    campaign: npt.NDArray[np.intp] | None = None
    common_parts: Mapping[CommonQuantity, Array] = field(default_factory=dict)
    bounded: npt.NDArray[np.bool_] | None = None
    instruments: tuple[str, ...] = ()
    by: npt.NDArray[np.intp] | None = None

    def part(self, mask: npt.NDArray[np.bool_]) -> Series:
        """The runs of a mask (n,)."""
        if mask.all():
            return self
        return Series(
            self.name, self.unit, self.values[mask], self.u[mask], self.t[mask], self.days[mask], self.hour[mask],
            self.warm_up[mask], self.offset, None if self.temperature is None else self.temperature[mask],
            self.thermometer, None if self.campaign is None else self.campaign[mask],
            {quantity: part[mask] for quantity, part in self.common_parts.items()},
            None if self.bounded is None else self.bounded[mask],
            self.instruments, None if self.by is None else self.by[mask],
        )  # fmt: skip

    @cached_property
    def measured(self) -> npt.NDArray[np.intp]:
        """The numbers (n,) of what measured the runs."""
        return np.zeros(len(self.t), dtype=np.intp) if self.by is None else self.by

    @property
    def sure(self) -> Series:
        """The runs of the instruments that tell the parameter: of others, whose runs know it many times worse, a step
        or a drift would have the scatter."""
        weights = self.weights()
        if weights is None or not self.has_several_instruments:
            return self
        of_each = {by: float(np.median(weights[self.measured == by])) for by in set(self.measured.tolist())}
        surest = min(of_each.values())
        return self.part(np.isin(self.measured, [by for by, u in of_each.items() if u <= UNSURE * surest]))

    @property
    def has_several_instruments(self) -> bool:
        """Whether not all runs were measured by the same."""
        return bool((self.measured != self.measured[:1]).any())

    @cached_property
    def day_count(self) -> int:
        """Number of different days; their numbers mostly come in order."""
        rises = np.diff(self.days)
        if (rises < 0).any() or not len(self.days):
            return len(np.unique(self.days))
        return 1 + int((rises > 0).sum())

    def days_since(self, at: float) -> int:
        """Number of different days with runs from ``at`` on."""
        return self.part(self.t >= at).day_count

    @cached_property
    def steady(self) -> Series:
        """The runs that are not marked warm_up, where enough are not: a warming machine is another matter."""
        return self.part(_steady(self.warm_up))

    @property
    def of_last_day(self) -> npt.NDArray[np.bool_]:
        """Mask (n,) of the runs of the day of the last run, and of those days of other campaigns that overlap it.

        Of several days that end with the last run it is the one that began first: nothing depends on the order in
        which campaigns were stored.
        """
        _, day = np.unique(self.days, return_inverse=True)
        began, ended = np.full(day.max() + 1, np.inf), np.full(day.max() + 1, -np.inf)
        np.minimum.at(began, day, self.t)
        np.maximum.at(ended, day, self.t)
        mask: npt.NDArray[np.bool_] = (ended >= began[ended == ended.max()].min())[day]
        return mask

    @property
    def common(self) -> Array:
        """What values change by for one standard uncertainty of each quantity (n, q), in the order of
        ``common_parts``."""
        parts = list(self.common_parts.values())
        return np.column_stack(parts) if parts else np.empty((len(self.values), 0))

    @property
    def common_of_mean(self) -> Array:
        """What the mean of all runs is off by for one standard uncertainty of each quantity (q,): no number of runs of
        one calibration makes it smaller, and runs of another one have no part in it (JCGM 100:2008, 5.2.2)."""
        return np.asarray(self.common.mean(axis=0))

    def weights(self) -> Array | None:
        """The uncertainties of the runs without what they have of calibrated quantities, which scatter no run; None
        where a run has none (then all count alike)."""
        if not bool(np.isfinite(self.u).all() and (self.u > 0.0).all()):
            return None
        calibrated = (self.common**2).sum(axis=1)
        of_run = self.u**2 - (calibrated if self.bounded is None else np.where(self.bounded, 0.0, calibrated))
        return np.sqrt(np.maximum(of_run, (LEAST_OF_RUN * self.u) ** 2))


def _steady(warm_up: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Mask (n,) of the runs that count in the long view: not warming up, or all where few others remain."""
    return ~warm_up if (~warm_up).sum() >= FEWEST_STEADY else np.ones(len(warm_up), dtype=np.bool_)


def steady_runs(history: MachineHistory) -> npt.NDArray[np.bool_]:
    """Mask (n,) of the runs of a machine that are not marked warm_up, all where few others remain."""
    return _steady(history.warm_up)


def day_numbers(history: MachineHistory) -> npt.NDArray[np.int64]:
    """Number (n,) of each run's day of its campaign, from 0 in the order of time."""
    numbers: dict[tuple[str, int], int] = {}
    pairs = zip(history.campaign.tolist(), history.day.tolist(), strict=True)
    return np.array([numbers.setdefault(pair, len(numbers)) for pair in pairs], dtype=np.int64)


def _temperature(history: MachineHistory) -> tuple[str | None, Array | None]:
    """The recorded temperature that most runs have; None without one.

    Of several those recorded for the runs before channels of the touches, then the first in the order of names: what
    the queries of the fleet table ask, too.
    """
    recorded = {
        name: int(np.isfinite(values).sum())
        for name, values in history.conditions.items()
        if column_unit(name) == DEGREE_CELSIUS and np.isfinite(values).any()
    }
    if not recorded:
        return None, None
    name = min(recorded, key=lambda channel: (-recorded[channel], channel in history.channels, channel))
    return name, history.conditions[name]


def parameter_series(history: MachineHistory) -> dict[str, tuple[Series, npt.NDArray[np.bool_]]]:
    """Each parameter that a run has, with the mask (n,) of the runs that have it."""
    t = history.seconds / SECONDS_PER_DAY
    days = day_numbers(history)
    hour = np.array([at.hour + at.minute / 60.0 for at in history.started_at])
    offset = (history.started_at[-1].utcoffset() if history.started_at else None) or timedelta()
    thermometer, temperature = _temperature(history)
    campaign = np.unique(history.campaign, return_inverse=True)[1].ravel()
    common, bounded = with_unstored(history)
    series = {}
    for j, (name, unit) in enumerate(zip(history.parameters, history.units, strict=True)):
        mask = np.isfinite(history.values[:, j])
        whole = Series(
            name, unit, history.values[:, j], history.u[:, j], t, days, hour, history.warm_up, offset,
            temperature, thermometer, campaign,
            {quantity: part[:, j] for quantity, part in common.items() if part[:, j].any()},
            bounded if bounded.any() else None, *what_measured(history, j, common),
        )  # fmt: skip
        if mask.any():
            series[name] = (whole.part(mask), mask)
    return series
