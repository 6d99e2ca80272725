"""When did the machine change? Steps and changes of slope with a stated false-alarm probability.

A step is preferred over a trend where it explains more; a history that recorded events split is searched
piece by piece; several parameters share one false-alarm probability. For a change that many parameters
share, none of which shows it alone, use ``common_change.joint_change``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_positive, as_vector, check_history
from monitor.statistics.days.day_evidence import shows_wide_days
from monitor.statistics.days.day_steps import day_step_p_value
from monitor.statistics.groups import eras, interleaved_columns
from monitor.statistics.plateaus import FEWEST_IN_ALL, MOST_IN_ALL, Plateau, PlateauScanner
from monitor.statistics.scan import Scan, Scanner
from monitor.statistics.scan_candidates import EDGE, SEASON_FROM, Base, Kind, base_columns
from monitor.statistics.sums import label_groups
from monitor.statistics.when_changed import when

#: A history of fewer runs is not searched.
FEWEST_RUNS = 2 * EDGE + 2


@dataclass(frozen=True)
class Change:
    """A change between run ``index - 1`` and run ``index`` (in the order of time).

    ``at`` is the time of run ``index``, ``interval`` the times between which the change lies; ``size`` is a
    step or a transient's amplitude in the unit of the values, or a (change of) slope per unit of time;
    ``p_value`` is that of the search. ``time_constant`` is that of a transient, in the unit of the times: the best of
    those that were tried (``scan_candidates.DECAYS``), else None.
    """

    parameter: str
    kind: Kind
    index: int
    at: float
    interval: tuple[float, float]
    size: float
    u: float
    p_value: float
    time_constant: float | None = None


@dataclass(frozen=True)
class History:
    """``changes`` in the order of time; ``trends`` of pieces with a slope or with a
    transient from their first run on (warm-up, running-in: fit it with ``warm_up``).

    ``false_alarm`` is the probability of any change or trend where there is none, over everything searched.
    """

    changes: tuple[Change, ...]
    trends: tuple[Change, ...]
    false_alarm: float
    trials: int


@dataclass(frozen=True)
class _Series:
    name: str
    y: Array
    t: Array
    u: Array | None
    day: npt.NDArray[np.intp] | None
    cycle: float | None = None
    group: npt.NDArray[np.intp] | None = None
    #: Part of the cycle from which on a change has to show beside its wave, too; None for that of the base
    #: (``base_columns``).
    fitted_from: float | None = None

    @cached_property
    def beside(self) -> Array | None:
        """What groups of runs that take turns may be off by (n, k); None without such."""
        columns = None if self.group is None else interleaved_columns(self.group)
        return columns if columns is not None and columns.size else None

    @property
    def plan(self) -> tuple[object, ...]:
        """What series that share a search have in common."""
        plan = (self.t, self.u, self.day, self.beside)
        return (self.fitted_from, *(None if column is None else column.tobytes() for column in plan))

    @property
    def may_return(self) -> bool:
        """Whether a change that was put right again is sought: of single runs, or means of days, and enough of them."""
        fitted = 0 if self.beside is None else self.beside.shape[1]
        return self.day is None and FEWEST_IN_ALL + fitted <= len(self.y) <= MOST_IN_ALL

    def fitted(self, base: Base) -> Array:
        """What is fitted (n, k) beside a change."""
        columns = base_columns(self.t, base, self.cycle, self.fitted_from)
        return np.column_stack([*columns, *([] if self.beside is None else [self.beside])])

    @property
    def searched(self) -> bool:
        """Whether there are runs enough, and any scatter, for a search."""
        fitted = 0 if self.beside is None else self.beside.shape[1]
        return len(self.y) - fitted >= FEWEST_RUNS and bool(np.ptp(self.y) > 0.0)

    def part(self, start: int, stop: int) -> _Series:
        part_u = None if self.u is None else self.u[start:stop]
        day = None if self.day is None else np.unique(self.day[start:stop], return_inverse=True)[1]
        group = None if self.group is None else self.group[start:stop]
        return _Series(
            self.name, self.y[start:stop], self.t[start:stop], part_u, _repeated(day), self.cycle, group,
            self.fitted_from,
        )  # fmt: skip


def _repeated(day: npt.NDArray[np.intp] | None) -> npt.NDArray[np.intp] | None:
    """Return the days where they have a component beside the scatter of runs: several days, one with two runs."""
    return None if day is None or not 0 < int(day.max()) < len(day) - 1 else day


def _size(series: _Series, best: Scan, base: Base) -> tuple[float, float]:
    """Generalised least squares: size of the change and its standard uncertainty, place and correlation as known."""
    t = series.t
    columns = list(series.fitted(base).T)
    after = (np.arange(len(t)) >= best.at).astype(np.float64)
    if best.kind == "step":
        columns.append(after)
    elif best.kind == "slope":
        columns.append(after * (t - t[best.at - 1]))
    elif best.kind == "transient":
        columns.append(best.column)
    else:
        columns.append(t - t.mean())
    both = np.column_stack([*columns, series.y - series.y.mean()])
    rows = best.shape.whiten(best.root[:, np.newaxis] * both)
    design, y = rows[:, :-1], rows[:, -1]
    norm = np.sqrt((design**2).sum(axis=0))
    solution = np.linalg.lstsq(design / norm, y, rcond=None)[0]
    residual = y - design / norm @ solution
    variance = float(residual @ residual) / max(len(t) - len(columns), 1)
    inverse = np.linalg.inv((design / norm).T @ (design / norm))
    return float(solution[-1] / norm[-1]), float(np.sqrt(variance * inverse[-1, -1]) / norm[-1])


def _change(series: _Series, best: Scan, base: Base, offset: int) -> Change:
    size, u = _size(series, best, base)
    if best.kind in ("trend", "transient"):
        between = (float(series.t[0]), float(series.t[-1]))
    else:
        same = np.array([kind == best.kind for kind in best.kinds])
        # The change has a size and a place.
        fitted = series.fitted(base).shape[1] + 2
        between = when(series.t, best.positions[same], best.deviance[same], fitted)
    return Change(
        series.name,
        best.kind,
        offset + best.at,
        float(series.t[best.at]),
        between,
        size,
        u,
        best.p_value,
        # The column of a decay is 1 at the first run and exp(-span / time constant) at the last.
        -float(np.ptp(series.t)) / float(np.log(best.column[-1])) if best.kind == "transient" else None,
    )


#: From so many days on days may differ by up to four times the scatter of a run, unless a series itself refutes that: a
#: step of eight is then seen in every history. With fewer only where other parameters show such days
#: (``day_evidence``):
#: of five days a step of eight would else be seen in a third of histories, now in all; the price are false alarms of a
#: parameter that alone has such days (docs/trials-statistics.md).
DAYS_THAT_SHOW = 8


#: Fewer parameters than this do not show among them how wide days are (``day_evidence``): with few days a step or a
#: trend then has to be one of the means of the days by themselves as well (``day_steps``).
PARAMETERS_THAT_SHOW = 4


def _with_beside(series: _Series, beside: Array) -> _Series:
    """Return the series with other columns (n, k) beside a change."""
    other = replace(series)
    other.__dict__["beside"] = beside
    return other


def _of_days(column: Array, day: npt.NDArray[np.intp]) -> bool:
    """Whether a column (n,) differs more from day to day than within its days, as no warm-up of a morning does."""
    mean = np.bincount(day, column) / np.bincount(day)
    return bool(np.var(mean[day]) > 0.5 * np.var(column))


def _beside_groups(best: Scan, series: _Series) -> Scan:
    """The drift, or the step from which on other groups of runs follow for good, where one explains a series nearly as
    well as the transient that was found: what the first instrument is off by does not pass again, and beside what all
    are off by few runs do not tell a curve from a line."""
    if best.kind != "transient" or series.group is None:
        return best
    exchanges = np.flatnonzero(np.diff(eras(series.group))) + 1
    kinds = np.array(best.kinds)
    rivals = np.flatnonzero((kinds == "trend") | (kinds == "step") & np.isin(best.positions, exchanges))
    rival = int(rivals[best.deviance[rivals].argmin()])
    # As of a bend: a time constant more must earn its keep (Schwarz's criterion).
    if best.deviance[rival] - best.deviance.min() > 3.0 * np.log(len(series.y)):
        return best
    at = int(best.positions[rival])
    return replace(
        best, kind=best.kinds[rival], at=at, column=(np.arange(len(series.y)) >= at).astype(np.float64)
    )


#: Part of the probability of a false alarm that is spent on plateaus, where they are sought, the rest on one change.
#: Ten percent less for it cost next to nothing, and a plateau that matters is far beyond its level
#: (docs/trials-statistics.md).
OF_PLATEAUS = 0.1


def _ends(series: _Series, plateau: Plateau, offset: int) -> list[Change]:
    """Both steps of the plateau, each beside the other, a line and a wave: what the search had beside them."""
    runs = np.arange(len(series.y))
    kind: Kind = "step"
    steps: list[Change] = []
    for edge, other in ((plateau.first, plateau.last), (plateau.last, plateau.first)):
        column = (runs >= other.at).astype(np.float64)[:, np.newaxis]
        beside = column if series.beside is None else np.column_stack([series.beside, column])
        step = Scan(
            kind, edge.at, plateau.p_value / OF_PLATEAUS, plateau.shape, plateau.root, column[:, 0],
            (kind,) * len(edge.places), edge.places, edge.deviance,
        )  # fmt: skip
        steps.append(_change(_with_beside(series, beside), step, "season", offset))
    return steps


class _Search:
    """One search that reuses its scanners: parameters with the same plan share the preparation.

    ``plateaus``: whether changes that were put right again are sought; ``apart`` draws for them, so that the search for
    one change draws what it draws without.
    """

    def __init__(self, rng: np.random.Generator, trials: int, plateaus: bool = False) -> None:
        self.rng, self.trials, self.plateaus = rng, trials, plateaus
        self.apart = rng.spawn(1)[0] if plateaus else rng
        self.wide: set[str] = set()
        self.by_means = False
        self._kept: dict[tuple[object, ...], Scanner] = {}
        self._kept_of_plateaus: dict[tuple[object, ...], PlateauScanner] = {}

    def scanner(self, series: _Series, base: Base) -> Scanner:
        key = (base, *series.plan)
        if key not in self._kept:
            self._kept[key] = Scanner(
                series.t, series.u, base, series.day, series.cycle, series.beside, series.fitted_from
            )
        return self._kept[key]

    def plateau_scanner(self, series: _Series) -> PlateauScanner:
        if series.plan not in self._kept_of_plateaus:
            self._kept_of_plateaus[series.plan] = PlateauScanner(
                series.t, series.u, series.cycle, series.beside
            )
        return self._kept_of_plateaus[series.plan]

    def look(self, every: Sequence[_Series]) -> None:
        """Prepare the first scan of pieces: those of one plan together."""
        together: dict[int, tuple[Scanner, list[Array]]] = {}
        for series in every:
            if series.searched:
                scanner = self.scanner(series, "constant")
                together.setdefault(id(scanner), (scanner, []))[1].append(series.y)
        for scanner, values in together.values():
            scanner.look(values)

    def wide_days(self, every: Sequence[_Series]) -> set[str]:
        """Names of the parameters for which wide day components are allowed for, by what all pieces of all show."""
        support: dict[str, Array] = {}
        for series in every:
            day_support = self.scanner(series, "constant").day_support(series.y) if series.searched else None
            if day_support is not None:
                support[series.name] = support.get(series.name, 0.0) + day_support
        if not support:
            return set()
        wide = shows_wide_days(np.array(list(support.values())))
        return {name for name, shown in zip(support, wide, strict=True) if shown}

    def scan(self, series: _Series, base: Base, level: float) -> Scan:
        if series.fitted_from is None:
            return self._scan(series, base, level)
        # What is found has to be so beside a wave of any size as well; what such a wave could hide is not sought.
        usual = self._scan(replace(series, fitted_from=None), base, level)
        if usual.p_value > level:
            return usual
        beside_wave = self._scan(series, base, level)
        return replace(beside_wave, p_value=max(usual.p_value, beside_wave.p_value))

    def _scan(self, series: _Series, base: Base, level: float) -> Scan:
        many = series.day is not None and int(series.day.max()) + 1 >= DAYS_THAT_SHOW
        wide = many or series.name in self.wide
        best = self.scanner(series, base).scan(series.y, self.rng, self.trials, level, wide)
        if many or series.day is None or not self.by_means or best.p_value > level:
            return best
        if best.kind == "transient" and not _of_days(best.column, series.day):
            return best
        return replace(
            best, p_value=max(best.p_value, day_step_p_value(series.y, series.day, self.rng, self.trials))
        )

    def pieces(self, parts: Sequence[tuple[_Series, int]], level: float) -> tuple[list[Change], list[Change]]:
        """Return changes and trends of all pieces, each with the index of its first run."""
        self.look([part for part, _ in parts])
        self.wide = self.wide_days([part for part, _ in parts])
        self.by_means = len({part.name for part, _ in parts}) < PARAMETERS_THAT_SHOW
        changes: list[Change] = []
        trends: list[Change] = []
        for part, start in parts:
            piece_changes, slopes = self.piece(part, start, level)
            changes += piece_changes
            trends += slopes
        return changes, trends

    def piece(self, series: _Series, offset: int, level: float) -> tuple[list[Change], list[Change]]:
        """Return changes and trends of one piece of history, split again at every step."""
        if not series.searched:
            return [], []
        whole, level = level, level * (1.0 - self.share_of_plateaus(series))
        best = self.scan(series, "constant", level)
        if best.p_value > level:
            return self.plateau(series, offset, whole)
        base: Base = "constant"
        trends: list[Change] = []
        best = _beside_groups(best, series)
        if best.kind == "transient":
            bent = self.scan(series, "line", level)
            # Two coefficients and a place more must earn their keep (Schwarz's criterion).
            gain = float(best.deviance.min() - bent.deviance.min())
            if bent.p_value > level or gain < 3.0 * np.log(len(series.y)):
                return [], [_change(series, best, base, offset)]
            best = replace(best, kind="trend", at=0)
        if best.kind == "trend":
            trends = [_change(series, best, base, offset)]
            base = "line"
            best = self.scan(series, base, level)
            if best.p_value > level:
                steps, slopes = self.plateau(series, offset, whole)
                return steps, trends + slopes
        change = _change(series, best, base, offset)
        if best.kind == "slope":
            return [change], trends
        inner, slopes = self.between(series, (best.at,), offset, whole)
        return [change, *inner], trends + slopes

    def share_of_plateaus(self, series: _Series) -> float:
        """Part of the probability of a false alarm that is spent on plateaus."""
        return OF_PLATEAUS if self.plateaus and series.may_return else 0.0

    def between(
        self, series: _Series, steps: Sequence[int], offset: int, level: float
    ) -> tuple[list[Change], list[Change]]:
        """Return changes and trends between ``steps``, runs of the piece."""
        changes: list[Change] = []
        trends: list[Change] = []
        for start, stop in pairwise((0, *steps, len(series.y))):
            inner, slopes = self.piece(series.part(start, stop), offset + start, level)
            changes += inner
            trends += slopes
        return changes, trends

    def plateau(self, series: _Series, offset: int, level: float) -> tuple[list[Change], list[Change]]:
        """Return the steps of a plateau, and what is found between them; nothing where a single step explains nearly as
        much."""
        level_here = level * self.share_of_plateaus(series)
        if level_here == 0.0:
            return [], []
        # A few more trials than the level needs at least: a plateau that matters is beyond them all.
        trials = max(self.trials, int(np.ceil(1.2 / level_here)))
        best = self.plateau_scanner(series).plateau(series.y, self.apart, trials, level_here)
        # A coefficient and a place more must earn their keep (Schwarz's criterion).
        if best.p_value > level_here or best.gain < 2.0 * np.log(len(series.y)):
            return [], []
        steps = _ends(series, best, offset)
        # The wave that stood beside the plateau may look like a trend of a piece that covers less of it.
        beside_wave = replace(series, fitted_from=SEASON_FROM)
        changes, trends = self.between(beside_wave, [step.index - offset for step in steps], offset, level)
        return steps + changes, trends


def find_changes(
    values: Mapping[str, npt.ArrayLike],
    times: npt.ArrayLike,
    *,
    rng: np.random.Generator,
    u: Mapping[str, npt.ArrayLike] | None = None,
    days: npt.ArrayLike | None = None,
    events: Sequence[float] = (),
    cycle: float | None = None,
    groups: Mapping[str, npt.NDArray[np.intp]] | None = None,
    false_alarm: float = 0.05,
    trials: int = 1999,
) -> History:
    """Steps and changes of slope of several parameters (name to (n,)) over ``times`` (n,), any unit, rising.

    ``events`` are times of recorded changes (crash, repair, compensation): the history is split there, and the
    change at an event is no finding. ``u`` (name to (n,)) weighs the runs; ``days`` (n,) are labels whose runs
    may share a component; ``cycle`` is the period of a wave (the year) that is no change where a piece covers it.
    ``groups`` (name to (n,)) number what measured a run: those that take turns may be off by any amount each
    (``interleaved_columns``); where others follow for good a step is preferred to a transient that explains as much.
    With a ``cycle`` changes that were put right again are sought, too, in pieces of at least twelve runs without
    ``days``: two steps of opposite signs, neither of which need show alone, beside a drift and a wave of any size, for
    a tenth of ``false_alarm``.
    ``false_alarm`` is shared equally among parameters and pieces (Bonferroni), so it
    holds for whatever dependence among them; inside a piece every detected step splits it again at the
    same level. It holds for runs whose neighbours correlate by up to 0.8 and for day components up to four
    times the scatter of a run; with fewer than eight days up to once, or where several parameters show such: whatever
    of these a series
    does not refute is allowed for (see ``scan`` and ``day_evidence``), so for independent runs the rate is
    below it. Measured rates and power: docs/trials-statistics.md. Pieces of fewer than 6 runs are not
    searched. Raises ``DataError`` for times that fall, unknown names in ``u``, trials that cannot reach the
    level, or non-finite values.
    """
    t = as_vector(times, "times", least=FEWEST_RUNS)
    check_history(values, t, u or {}, false_alarm)
    bounds = [
        0,
        *np.unique(np.searchsorted(t, np.sort(as_vector(events, "events", least=0)))).tolist(),
        len(t),
    ]
    pieces = [(a, b) for a, b in pairwise(bounds) if b > a]
    level = false_alarm / (len(pieces) * len(values))
    if (trials + 1) * (of_change := level if cycle is None else level * (1.0 - OF_PLATEAUS)) < 1.0:
        raise DataError(
            f"trials is {trials}; {len(values)} parameters in {len(pieces)} pieces at {false_alarm} need at least "
            f"{int(np.ceil(1.0 / of_change)) - 1}."
        )
    day = None if days is None else label_groups(days, len(t))[1]
    parts = []
    for name, recorded in values.items():
        y = as_vector(recorded, name, length=len(t))
        run_u = as_positive((u or {})[name], f"u of {name}", length=len(t)) if name in (u or {}) else None
        series = _Series(name, y, t, run_u, _repeated(day), cycle, (groups or {}).get(name))
        parts += [(series.part(start, stop), start) for start, stop in pieces]
    changes, trends = _Search(rng, trials, cycle is not None).pieces(parts, level)
    order = {name: i for i, name in enumerate(values)}
    changes.sort(key=lambda c: (c.index, order[c.parameter]))
    return History(tuple(changes), tuple(trends), false_alarm, trials)
