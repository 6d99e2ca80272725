"""Rehearses a plan of one's own: monthly campaigns of virtual machines, like a campaign that was measured.

Each campaign has the poses, targets and times of day of the pattern, and the stated noise. Its machine has the errors
that the pattern shows, with what was asked for on top: drift, steps at events, a hidden effect. Days differ as those of
the pattern do: each gets the deviation of one of its days from their mean, drawn at random with a random sign.
"""

from __future__ import annotations

import calendar
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from datetime import date, datetime, timedelta
from pathlib import Path

import numpy as np

from monitor.documents import OMITTED
from monitor.exceptions import InputError, did_you_mean
from monitor.methods import campaign_method
from monitor.methods.chain.likeness import Likeness
from monitor.readers import read_campaign, write_campaign
from monitor.records import Array, Campaign, CurveCampaign
from monitor.reporting import rehearsal_words
from monitor.stopping import checkpoint
from monitor.store import Database, load_campaign
from monitor.units import MICROMETRE
from monitor.workflow.file_names import file_name
from monitor.workflow.sight import EffectSight, effect_sight
from monitor.workflow.simulation import PEAK_UM, as_virtual
from monitor.workflow.true_values import TRUTH, TrueValue, write_truth

#: The mean month of the Gregorian calendar, in days.
DAYS_A_MONTH = 365.2425 / 12.0
MOST_CAMPAIGNS, MOST_CHANGES = 1000, 1000
#: The most that a parameter changes by, in its display unit: a metre, a radian.
LARGEST_CHANGE = 1e6


@dataclass(frozen=True)
class Drift:
    """A parameter that grows by so much a month, in its display unit, on one ``machine`` or on all (None)."""

    parameter: str
    per_month: float
    machine: str | None = None

    def __post_init__(self) -> None:
        _check_size(self.parameter, self.per_month)


@dataclass(frozen=True)
class Step:
    """A parameter that steps by so much, in its display unit, on a day, on one ``machine`` or on all (None)."""

    on: date
    parameter: str
    size: float
    machine: str | None = None

    def __post_init__(self) -> None:
        _check_size(self.parameter, self.size)


def _check_size(parameter: str, size: float) -> None:
    if not abs(size) <= LARGEST_CHANGE:
        raise InputError(
            f"{parameter}: {size:g} is no change of a machine; {LARGEST_CHANGE:g} (µm, µrad, µm/m) is the most"
        )


@dataclass(frozen=True)
class LikeRequest:
    """Monthly campaigns of virtual machines like the campaign ``like``, a folder or a name in the database.

    Each campaign is a folder of ``out`` named after machine and month. ``effect`` is hidden in all of them, with the
    largest displacement ``peak_um``. ``steady``: the days do not differ. Raises InputError.
    """

    out: Path
    like: str
    machines: tuple[str, ...]
    start: date
    months: int = 12
    drifts: tuple[Drift, ...] = ()
    events: tuple[Step, ...] = ()
    effect: str | None = None
    peak_um: float | None = None
    steady: bool = False
    seed: int = 1

    def __post_init__(self) -> None:
        if not self.machines or any(not name.strip() or file_name(name) != name for name in self.machines):
            raise InputError(
                "--machine: name one machine or more; their campaigns are folders of that name, "
                r'so it has none of \ / : * ? " < > |'
            )
        if len({name.casefold() for name in self.machines}) < len(self.machines):
            raise InputError(
                "--machine: each machine is named once; names that differ in capital letters alone are one folder on "
                "Windows and macOS"
            )
        if self.months < 1 or self.months * len(self.machines) > MOST_CAMPAIGNS:
            raise InputError(
                f"--months {self.months}: 1 or more, and at most {MOST_CAMPAIGNS} campaigns together"
            )
        self._check_peak()
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: a seed is a whole number from 0 on")
        changes: tuple[Drift | Step, ...] = (*self.drifts, *self.events)
        if len(changes) > MOST_CHANGES:
            raise InputError(f"drifts and events: {MOST_CHANGES} at most together, not {len(changes)}")
        for machine in (change.machine for change in changes):
            if machine is not None and machine not in self.machines:
                raise InputError(
                    f"there is no machine '{machine}' among those asked for; "
                    f"{did_you_mean(machine, self.machines)}there are {', '.join(self.machines)}"
                )

    @property
    def hidden_um(self) -> float:
        """The peak of the hidden effect."""
        return PEAK_UM if self.peak_um is None else self.peak_um

    def _check_peak(self) -> None:
        if self.peak_um is None:
            return
        if not math.isfinite(self.peak_um) or self.peak_um <= 0:
            raise InputError(f"--peak {self.peak_um}: the peak must be a number of µm above 0")
        if self.effect is None:
            raise InputError(f"--peak {self.peak_um:g} needs --effect, the effect that has it")


@dataclass(frozen=True)
class LikeAnswer:
    """The folders that were written, and the file with the true value of every parameter in every run.

    ``sight`` says what the plan shows of the hidden effect, in each campaign alike.
    """

    folders: tuple[str, ...]
    truth: str
    seed: int
    message: str
    sight: EffectSight | None = field(default=None, metadata=OMITTED)


def simulate_like(request: LikeRequest, *, progress: Callable[[str], None] = lambda name: None) -> LikeAnswer:
    """Write campaigns like that of a folder. Raises CampaignError of the folder, InputError, EffectError, DataError."""
    pattern = read_campaign(Path(request.like))
    if isinstance(pattern, CurveCampaign):
        raise InputError(f"{request.like} is a curve, which has no machine; name a campaign of a machine")
    return _simulated(request, pattern, progress)


def simulate_like_stored(
    db: Database, request: LikeRequest, *, progress: Callable[[str], None] = lambda name: None
) -> LikeAnswer:
    """Write campaigns like one of the database. Raises NotFoundError, InputError, EffectError, DataError."""
    return _simulated(request, load_campaign(db, request.like), progress)


def _simulated(request: LikeRequest, pattern: Campaign, progress: Callable[[str], None]) -> LikeAnswer:
    if request.out.exists():
        raise InputError(f"{request.out} is there already; give a folder that does not exist yet")
    method = campaign_method(pattern)
    likeness = Likeness(pattern, method)
    units = dict(zip(likeness.problem.base_names, _units(likeness), strict=True))
    for parameter in [drift.parameter for drift in request.drifts] + [
        step.parameter for step in request.events
    ]:
        if parameter not in units:
            raise InputError(
                f"{pattern.name} has no parameter '{parameter}'; {did_you_mean(parameter, units)}"
                f"it has {', '.join(units)}"
            )
    _check_events(request, likeness.campaign)
    added = sight = None
    if request.effect is not None:
        peak = MICROMETRE.to_internal(request.hidden_um)
        added = likeness.hidden(request.effect, peak)
        sight = effect_sight(likeness.problem, request.effect, peak)
    rng = np.random.default_rng(request.seed)
    folders, truth = [], []
    for machine in request.machines:
        for month in range(request.months):
            checkpoint()
            name = f"{machine}-{_month(request.start, month):%Y-%m}"
            progress(name)
            dated = _dated(likeness.campaign, name, machine, _month(request.start, month))
            local = _errors(request, likeness, dated, units, rng)
            written = likeness.campaign_with(local, rng, added)
            folder = request.out / name
            write_campaign(as_virtual(replace(dated, probings=written.probings)), folder)
            folders.append(str(folder))
            truth += _true_values(dated, likeness, local, units)
            if request.effect is not None:
                truth += _hidden(dated, likeness, request.effect, request.hidden_um)
    file = request.out / TRUTH
    write_truth(file, truth)
    message = rehearsal_words.likenesses_written(
        request.out, len(folders), len(request.machines), (pattern.name, method.name), TRUTH
    )
    if request.effect is not None:
        message += rehearsal_words.hidden_in_all(request.effect, request.hidden_um)
    if sight is not None and request.effect is not None:
        message += sight.words(request.effect, request.hidden_um)
    return LikeAnswer(tuple(folders), str(file), request.seed, message, sight)


def _units(likeness: Likeness) -> Sequence[tuple[str, float]]:
    """Name and factor of the display unit of every base parameter."""
    fitted = likeness.method.identify(
        likeness.campaign, likeness.method.own_model, lambda problem: likeness.solution
    )
    return [(unit.name, unit.factor) for unit in fitted.units]


def _month(start: date, count: int) -> date:
    """The day so many months later, or the last one of a shorter month."""
    year, month = divmod(start.year * 12 + start.month - 1 + count, 12)
    return date(year, month + 1, min(start.day, calendar.monthrange(year, month + 1)[1]))


def _dated(pattern: Campaign, name: str, machine: str, day: date) -> Campaign:
    """The pattern under another name, of another machine, its first run on a day at the time of day that it had."""
    first = pattern.runs[0].started_at
    moved = datetime.combine(day, first.timetz()) - first
    runs = tuple(replace(run, started_at=run.started_at + moved) for run in pattern.runs)
    renamed = replace(pattern.machine, id=machine, serial_number=None)
    return replace(pattern, name=name, machine=renamed, runs=runs, files=())


def _errors(
    request: LikeRequest,
    likeness: Likeness,
    dated: Campaign,
    units: dict[str, tuple[str, float]],
    rng: np.random.Generator,
) -> Array:
    """The true unknowns (R, p) of every run of a campaign."""
    names = likeness.problem.base_names
    local = likeness.solution.local.copy()
    base = local[:, : len(names)]
    days, which = np.unique(likeness.days, return_inverse=True)
    of_day = np.stack([base[which == index].mean(axis=0) for index in range(len(days))])
    mean = of_day.mean(axis=0)
    drawn = rng.integers(len(days), size=len(days))
    signs = rng.choice((-1.0, 1.0), size=len(days))
    deviation = np.zeros_like(of_day) if request.steady else signs[:, None] * (of_day - mean)[drawn]
    true = mean + deviation[which]
    started = {run.run: run.started_at for run in dated.runs}
    machine = dated.machine.id
    for row, run in enumerate(likeness.problem.runs):
        at = started[int(run)]
        for drift in request.drifts:
            if drift.machine in (None, machine):
                months = (at.date() - request.start) / timedelta(days=DAYS_A_MONTH)
                true[row, names.index(drift.parameter)] += (
                    drift.per_month * months * units[drift.parameter][1]
                )
        for step in request.events:
            if step.machine in (None, machine) and at.date() >= step.on:
                true[row, names.index(step.parameter)] += step.size * units[step.parameter][1]
    local[:, : len(names)] = true
    return local


def _check_events(request: LikeRequest, pattern: Campaign) -> None:
    """Raise InputError for a step that no run is before, or none behind."""
    moments = [run.started_at for run in pattern.runs]
    last = _month(request.start, request.months - 1) + (max(moments).date() - moments[0].date())
    for step in request.events:
        if not request.start < step.on <= last:
            raise InputError(
                f"--event {step.on} {step.parameter}: the runs are of {request.start} to {last}, and none is "
                f"{'behind' if step.on > last else 'before'} it"
            )


def _hidden(dated: Campaign, likeness: Likeness, effect: str, peak_um: float) -> list[TrueValue]:
    """The peak of the hidden effect in every run."""
    started = {run.run: run.started_at.isoformat() for run in dated.runs}
    return [
        TrueValue(dated.machine.id, dated.name, int(run), started[int(run)], effect, peak_um, "µm (peak)")
        for run in likeness.problem.runs
    ]


def _true_values(
    dated: Campaign, likeness: Likeness, local: Array, units: dict[str, tuple[str, float]]
) -> list[TrueValue]:
    started = {run.run: run.started_at.isoformat() for run in dated.runs}
    return [
        TrueValue(
            dated.machine.id, dated.name, int(run), started[int(run)], name, local[row, column] / factor, unit
        )
        for row, run in enumerate(likeness.problem.runs)
        for column, (name, (unit, factor)) in enumerate(units.items())
    ]
