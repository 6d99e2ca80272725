"""False alarms and power where days and runs are not alike and not independent, as tables of Markdown.

``python tests/benchmarks/trial_dependence.py``; last results in docs/trials-statistics.md. Ten minutes and no test.
Names choose some of the tables, a number the seed: ``trial_dependence.py events changes 8``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from scipy import signal, stats

from monitor.statistics import (
    anova,
    backtest,
    brown_forsythe,
    correlated_reference,
    cusum_chart,
    dependence,
    ewma_chart,
    individuals_chart,
    mewma_chart,
    reference_period,
    robust_p_value,
    t_squared_chart,
    welch_anova,
)
from monitor.statistics.changes import _repeated, _Search, _Series
from monitor.statistics.days.before_after import OtherDays, before_after
from monitor.statistics.days.block_lines import Blocks, block_count, block_lines, block_of
from monitor.statistics.days.seasonal_slopes import beside_season
from monitor.statistics.forecasts.forecast import predict
from monitor.statistics.trend import trend

SEED = 20261122
YEAR = 365.25


def table(title: str, head: list[str], rows: list[list[object]]) -> None:
    """Print one table in Markdown."""
    print(f"\n## {title}\n")
    print("| " + " | ".join(head) + " |\n|" + " --- |" * len(head))
    for row in rows:
        print(
            "| " + " | ".join(f"{x:.3f}" if isinstance(x, float) else str(x) for x in row) + " |", flush=True
        )


def interval(calls: int, count: int) -> str:
    """A share in percent with its exact 95 % interval (Clopper and Pearson)."""
    low, high = stats.binomtest(calls, count).proportion_ci(0.95, "exact")
    return f"{100.0 * calls / count:.1f} ({100.0 * low:.1f} to {100.0 * high:.1f})"


def first_order(rng: np.random.Generator, count: int, n: int, r: float) -> np.ndarray:
    """Return stationary first-order series (count, n) of unit variance."""
    steps = rng.normal(size=(count, n))
    steps[:, 1:] *= np.sqrt(1.0 - r * r)
    return np.asarray(signal.lfilter([1.0], [1.0, -r], steps, axis=1))


def slope_rate(
    values: np.ndarray, t: np.ndarray, cycle: float | None = YEAR, beside: np.ndarray | None = None
) -> float:
    """Share of series (c, n) of day means whose slope is called a drift at 5 %; ``beside`` (c, n) is fitted beside it.

    Without a ``cycle``: whose slope is said to move, by either word.
    """
    place = np.unique(block_of(t, int(block_count(len(t))), t[0], t[-1]), return_inverse=True)[1]
    counts = np.bincount(place).astype(float)
    sums = np.zeros((len(values), len(counts)))
    np.add.at(sums.T, place, values.T)
    shape = (len(values), 1)
    times = np.bincount(place, t) / counts
    days = np.full(len(values), float(len(t)))
    column = None
    if beside is not None:
        column = np.zeros((len(values), len(counts)))
        np.add.at(column.T, place, beside.T)
        column = (column / counts)[:, :, np.newaxis]
    lines = block_lines(
        Blocks(np.tile(counts, shape), np.tile(times, shape), sums / counts, days, column), cycle=cycle
    )
    _, p_value, season_p = beside_season(lines.slope, lines.u_slope, lines.dof, lines.seasonal)
    return float((np.where(np.isnan(season_p), p_value, season_p) < 0.05).mean())


def plain_rate(values: np.ndarray, t: np.ndarray) -> float:
    """The same of a line through independent days."""
    away = t - t.mean()
    slope = values @ away / (away @ away)
    residual = values - values.mean(axis=1, keepdims=True) - slope[:, np.newaxis] * away
    u = np.sqrt((residual**2).sum(axis=1) / (len(t) - 2) / (away @ away))
    return float((2.0 * stats.t.sf(np.abs(slope / u), len(t) - 2) < 0.05).mean())


def slopes(rng: np.random.Generator) -> None:
    """Slopes of weekly days of four runs."""
    rows: list[list[object]] = []
    for n in (3, 4, 5, 8, 12, 20, 40, 100, 250):
        t = 7.0 * np.arange(n)
        u = np.sqrt(1.25 / ((t - t.mean()) ** 2).sum())
        for r in (0.0, 0.3, 0.6, 0.8):
            row: list[object] = [n, r]
            for component in (0.0, 0.5, 1.0, 2.0):
                values = component * first_order(rng, 4000, n, r) + rng.normal(size=(4000, n, 4)).mean(axis=2)
                row.append(slope_rate(values, t, None))
            row.append(plain_rate(values, t))
            if r == 0.0:
                values = rng.normal(size=(4000, n)) + rng.normal(size=(4000, n, 4)).mean(axis=2)
                row += [
                    rate(values + 4.0 * u * t, t)
                    for rate in (lambda y, t: slope_rate(y, t, None), plain_rate)
                ]
                row.append(slope_rate(values + 8.0 * u * t, t, None))
            else:
                row += ["", "", ""]
            rows.append(row)
    table(
        "Slopes called at 5 %, by the number of days, their correlation, and the day component in scatters of a run",
        [
            "days",
            "r",
            "0",
            "0.5",
            "1",
            "2",
            "independent days, 2",
            "drift of 4 u",
            "the same, independent",
            "8 u",
        ],
        rows,
    )
    rows = []
    for n, gap in ((12, 30.0), (24, 30.0), (52, 7.0), (104, 7.0), (260, 7.0), (365, 1.0)):
        t = gap * np.arange(n)
        for r in (0.0, 0.6):
            noise = r * first_order(rng, 2000, n, r) + rng.normal(size=(2000, n, 4)).mean(axis=2)
            wave = np.cos(2.0 * np.pi * (t + rng.uniform(0.0, YEAR, (2000, 1))) / YEAR)
            # A temperature that nobody recorded: the year, and weather of a correlation of 0.7 from day to day.
            warmth = wave + 0.5 * first_order(rng, 2000, n, 0.7)
            tails = rng.standard_t(3, (2000, n)) / np.sqrt(3.0)
            cases = (noise + 0.5 * wave, noise + wave, noise + 2.0 * wave, noise + warmth, noise + tails)
            u = np.sqrt(1.25 / ((t - t.mean()) ** 2).sum())
            rows.append([
                n, gap, r, *(slope_rate(case, t) for case in cases), slope_rate(noise + wave, t, None),
                slope_rate(noise + 2.0 * warmth, t, beside=warmth),
                slope_rate(noise + 2.0 * warmth + 8.0 * u * t, t, beside=warmth),
            ])  # fmt: skip
    table(
        "Slopes called at 5 % with a yearly cycle, in scatters of a run",
        [
            "days",
            "every (days)",
            "r",
            "0.5",
            "1",
            "2",
            "temperature",
            "Student, 3",
            "1, no cycle in the null",
            "2, temperature recorded",
            "the same, drift of 8 u",
        ],
        rows,
    )
    rows = []
    for campaigns, gap in ((3, 180.0), (4, 180.0), (6, 120.0), (10, 90.0)):
        t = (gap * np.arange(campaigns)[:, np.newaxis] + np.arange(5.0)).ravel()
        for component in (0.0, 0.5, 1.0, 2.0):
            values = (
                component * rng.normal(size=(2000, campaigns, 1))
                + 0.7 * rng.normal(size=(2000, campaigns, 5))
            ).reshape(2000, -1)
            rows.append([campaigns, component, slope_rate(values, t, None), plain_rate(values, t)])
    table(
        "Slopes called at 5 % where campaigns of five days differ, in scatters of a run",
        ["campaigns", "differ by", "slope", "independent days"],
        rows,
    )


#: Series of a cell of the parts of a year, and histories of their forecasts.
PARTS, FORETOLD = 4000, 2000


def parts_of_a_year(rng: np.random.Generator) -> None:
    """Slopes and forecasts of histories that show a part of a yearly season, and no temperature."""
    rows: list[list[object]] = []
    for n, gap in (
        (5, 7.0), (8, 7.0), (12, 7.0), (20, 7.0), (30, 7.0), (38, 7.0), (42, 7.0), (44, 7.0), (6, 30.0), (9, 30.0),
        (10, 30.0), (5, 60.0), (5, 90.0), (90, 1.0), (250, 1.0),
    ):  # fmt: skip
        t = gap * np.arange(n)
        for r in (0.0, 0.6):
            shape = (PARTS, n)
            mean = rng.normal(size=(*shape, 4)).mean(axis=2)
            wave = np.cos(2.0 * np.pi * (t + rng.uniform(0.0, YEAR, (PARTS, 1))) / YEAR)
            warmth = wave + 0.5 * first_order(rng, PARTS, n, 0.7)
            noise = r * first_order(rng, PARTS, n, r) + mean
            u = np.sqrt(1.25 / ((t - t.mean()) ** 2).sum())
            cases = (
                noise, noise + wave, noise + 2.0 * wave, noise + 2.0 * warmth,
                0.5 * (rng.standard_t(3, shape) / np.sqrt(3.0)) + 2.0 * wave,
                0.5 * (rng.exponential(size=shape) - 1.0) + 2.0 * wave,
                # A season that is no wave: a half of it, as in a shop that is heated but not cooled.
                noise + 4.0 * np.maximum(wave, 0.0),
            )  # fmt: skip
            rows.append([
                f"{n} every {gap:g}", r,
                *(f"{100 * slope_rate(case, t):.1f} ({100 * slope_rate(case, t, None):.0f})" for case in cases),
                *(
                    f"{100 * slope_rate(drift, t):.0f} ({100 * slope_rate(drift, t, None):.0f})"
                    for drift in (noise + size * u * t for size in (4.0, 8.0, 16.0))
                ),
            ])  # fmt: skip
    head = ["season 0", "1", "2", "2 and weather", "2, Student 3", "2, exponential", "half a wave of 4"]
    table(
        "Slopes called a drift at 5 % over a part of a year, in % (said to move by either word; before all a drift)",
        ["days", "r", *head, "drift of 4 u", "8 u", "16 u"],
        rows,
    )
    rows = []
    for n in (8, 12, 20, 30, 38):
        for size in (0.0, 1.0, 2.0):
            inside = np.zeros((2, 3), dtype=int)
            day = np.repeat(np.arange(n + 8), 4)
            t = 7.0 * day + np.tile([0.0, 0.05, 0.1, 0.15], n + 8)
            past = day < n
            for _ in range(FORETOLD):
                y = size * np.cos(2.0 * np.pi * (t + rng.uniform(0.0, YEAR)) / YEAR)
                y += rng.normal(size=len(t)) + 0.5 * rng.normal(size=n + 8)[day]
                for row, cycle in enumerate((YEAR, None)):
                    line = trend(y[past], t[past], days=day[past], cycle=cycle, robust=False)
                    later = np.array([np.flatnonzero(day == n - 1 + weeks)[0] for weeks in (4, 8)])
                    value, _, u_run = predict(line, t[later])
                    inside[row, :2] += np.abs(y[later] - value) <= stats.t.isf(0.025, line.dof) * u_run
                    inside[row, 2] += line.slope_interval[0] <= 0.0 <= line.slope_interval[1]
            texts = (
                f"{interval(after, FORETOLD)}; {100 * before / FORETOLD:.0f}"
                for after, before in zip(*inside, strict=True)
            )
            rows.append([n, size, *texts])
    table(
        "Weekly days of four runs with a season: runs 4 and 8 weeks later in their 95 % interval, and no drift in that "
        "of the slope, in %; before",
        ["days", "season", "4 weeks later", "8 weeks later", "slope"],
        rows,
    )


def forecasts(rng: np.random.Generator) -> None:
    """Held-out runs in their interval."""
    rows: list[list[object]] = []
    for n, ahead in ((10, 1), (16, 8), (40, 1), (40, 8)):
        day = np.repeat(np.arange(n), 3)
        t = 7.0 * day + np.tile([0.0, 0.05, 0.1], n)
        for r in (0.0, 0.6, 0.8):
            for component in (0.0, 1.0, 2.0):
                made = inside = 0
                for _ in range(80):
                    y = component * first_order(rng, 1, n, r)[0][day] + rng.normal(size=len(day))
                    result = backtest(y, t, days=day, first=5, ahead=ahead)
                    made, inside = made + result.forecasts, inside + result.covered
                rows.append([n, ahead, r, component, made, inside / made])
    table(
        "Forecasts of a run in their 95 % interval, every day foretold by the days before it",
        ["days", "days ahead", "r", "day component", "forecasts", "inside"],
        rows,
    )


def charts(rng: np.random.Generator) -> None:
    """Histories with an alarm within 100 points."""
    rows: list[list[object]] = []
    kinds = (individuals_chart, ewma_chart, cusum_chart)
    for m in (8, 15, 30):
        for r in (0.0, 0.3, 0.5, 0.8):
            hits = np.zeros(9)
            for series in first_order(rng, 300, m + 100, r):
                reference, plain = correlated_reference(series[:m]), reference_period(series[:m])
                hits[:3] += [len(chart(series[m:], reference, arl=370.0).alarms) > 0 for chart in kinds]
                hits[3:6] += [len(chart(series[m:], plain, arl=370.0).alarms) > 0 for chart in kinds]
                hits[6:] += [
                    len(chart(series[m : m + 30] + 3.0, reference, arl=370.0).alarms) > 0 for chart in kinds
                ]
            rows.append([m, r, *(hits / 300.0).tolist()])
    head = ["Shewhart", "EWMA", "CUSUM"]
    seen = [f"{name}: 3 sd in 30 points" for name in head]
    table(
        "Charts with an alarm within 100 points, nominal 0.24",
        ["reference", "r", *head, *(f"{name}, independent" for name in head), *seen],
        rows,
    )
    rows = []
    for p in (2, 5, 10, 15):
        for r in (0.0, 0.3, 0.5, 0.8):
            hits = np.zeros(5)
            for _ in range(200):
                series = first_order(rng, p, 130, r).T
                before, after = series[:30], series[30:]
                for place, correlated in ((0, True), (2, False)):
                    single = t_squared_chart(after, before, arl=370.0, correlated=correlated)
                    path = mewma_chart(after, before, rng=rng, arl=200.0, correlated=correlated)
                    hits[place : place + 2] += [len(single.alarms) > 0, len(path.alarms) > 0]
                shifted = after[:30] + 3.0 * np.eye(p)[0]
                hits[4] += len(t_squared_chart(shifted, before, arl=370.0, correlated=True).alarms) > 0
            rows.append([p, r, *(hits / 200.0).tolist()])
    table(
        "Charts of several parameters with an alarm within 100 points, nominal 0.24 and 0.39",
        [
            "parameters",
            "r",
            "T²",
            "MEWMA",
            "T², independent",
            "MEWMA, independent",
            "T²: 3 sd of one in 30 points",
        ],
        rows,
    )


#: Histories of a cell.
HISTORIES = 1200


def changes(rng: np.random.Generator) -> None:
    """Histories with any change at 1 %, of one parameter and of one of 13."""
    rows: list[list[object]] = []
    for n, count in ((20, HISTORIES), (52, HISTORIES), (104, HISTORIES)):
        t = 7.0 * np.arange(n)
        wave = np.cos(2.0 * np.pi * (t + rng.uniform(0.0, YEAR, (count, 1))) / YEAR)
        step = 1.0 * (np.arange(n) >= 0.6 * n)
        cases = {
            "independent": rng.normal(size=(count, n)),
            "r = 0.6": first_order(rng, count, n, 0.6),
            "r = 0.8": first_order(rng, count, n, 0.8),
            "yearly cycle of one scatter": rng.normal(size=(count, n)) + wave,
            "the same, r = 0.6": first_order(rng, count, n, 0.6) + wave,
            "Student, 4 degrees of freedom": rng.standard_t(4, (count, n)),
            "Student, 3": rng.standard_t(3, (count, n)),
            "exponential": rng.exponential(size=(count, n)),
            "step of 3": rng.normal(size=(count, n)) + 3.0 * step,
            "step of 5": rng.normal(size=(count, n)) + 5.0 * step,
            "Student, 3, step of 5": rng.standard_t(3, (count, n)) / np.sqrt(3.0) + 5.0 * step,
        }
        for name, series in cases.items():
            rows.append(
                [
                    f"{n} day means, {name}",
                    *(_called(series, t, None, level, rng) for level in (0.01, 0.01 / 13)),
                ]
            )
    for days, runs in ((5, 4), (10, 4)):
        day = np.repeat(np.arange(days), runs)
        for component in (0.0, 1.0, 2.0):
            series = rng.normal(size=(HISTORIES, len(day)))
            series += component * rng.normal(size=(HISTORIES, days))[:, day]
            t = day + np.tile(np.arange(runs) / 24.0, days)
            rates = [_called(series, t, day, level, rng) for level in (0.01, 0.01 / 13)]
            rows.append([f"{days} days of {runs}, day component {component:g}", *rates])
    table("Changes called at 1 %, in %", ["history", "one parameter", "one of 13 (nominal 0.08)"], rows)


def _called(
    series: np.ndarray, t: np.ndarray, days: np.ndarray | None, level: float, rng: np.random.Generator
) -> str:
    """Share of histories with any change or trend, in percent; they share the simulated series."""
    search = _Search(rng, 9999 if level > 0.005 else 29999)
    calls = 0
    for y in series:
        steps, trends = search.pieces([(_Series("a", y, t, None, _repeated(days), YEAR), 0)], level)
        calls += bool(steps or trends)
    return interval(calls, len(series))


#: Machines of a cell of that table.
MACHINES = 400
#: Days of runs before and after, and those of the machine's other campaigns.
EVENTS = (
    ((4,), (4,), ()),
    ((10,), (10,), ()),
    ((4,), (4,), ((4,) * 3,)),
    ((4,), (4,), ((4,) * 5,) * 2),
    ((4,), (4,), ((4,),) * 6),
    ((10,), (2,), ((4,) * 8,)),
    ((4,) * 2, (4,), ()),
    ((4,) * 2, (4,), ((4,) * 6,)),
    ((4,) * 5, (4,) * 5, ()),
    ((4,) * 5, (4,) * 5, ((4,) * 5,) * 4),
    ((4,) * 5, (4,) * 5, ((4,) * 5,) * 10),
    ((4,) * 5, (4,) * 2, ()),
    ((4,) * 10, (4,) * 2, ()),
    ((1,) * 3, (1,) * 3, ()),
    ((2, 6, 4), (8, 3), ()),
)


def _campaign(
    rng: np.random.Generator, runs: tuple[int, ...], days: np.ndarray, scatter: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    index = np.repeat(np.arange(len(runs)), runs)
    return scatter * (days[index] + rng.normal(size=len(index))), index


def _differences(
    days_of: Callable[[int], np.ndarray],
    case: tuple,
    rng: np.random.Generator,
    shift: float,
    after_scatter: float = 1.0,
) -> str:  # type: ignore[type-arg]
    """Shares in percent of machines whose difference is called, with its interval, and called or not decided."""
    before, after, rest = case
    called = undecided = 0
    for _ in range(MACHINES):
        x, of_x = _campaign(rng, before, days_of(len(before)))
        y, of_y = _campaign(rng, after, days_of(len(after)), after_scatter)
        columns = [_campaign(rng, runs, days_of(len(runs))) for runs in rest]
        others = None
        if rest:
            others = OtherDays(
                np.concatenate([values for values, _ in columns]),
                np.concatenate([100 * i + of_day for i, (_, of_day) in enumerate(columns)]),
                np.zeros(sum(len(values) for values, _ in columns)),
                np.concatenate([np.full(len(values), i) for i, (values, _) in enumerate(columns)]),
            )
        agree = before_after(x, y + shift, of_x, of_y, others).agree
        called, undecided = called + (agree is False), undecided + (agree is None)
    if undecided == MACHINES:
        return "not decided"
    return f"{interval(called, MACHINES)} / {100.0 * (called + undecided) / MACHINES:.0f}"


def events(rng: np.random.Generator) -> None:
    """Changes called between two campaigns."""
    rows: list[list[object]] = []

    def text(runs: tuple[int, ...]) -> str:
        same = len(set(runs)) == 1
        return f"{len(runs)} of {runs[0]}" if same else f"{len(runs)} of {', '.join(map(str, runs))}"

    for case in EVENTS:
        before, after, rest = case
        row: list[object] = [
            text(before),
            text(after),
            f"{len(rest)} campaigns: {text(rest[0])}" if rest else "none",
        ]
        for component in (0.0, 0.5, 1.0, 2.0, 3.0):
            row.append(_differences(lambda n, c=component: c * rng.normal(size=n), case, rng, 0.0))  # type: ignore[misc]
        u = np.sqrt(sum((1.0 + np.mean(1.0 / np.array(runs))) / len(runs) for runs in (before, after)))
        row += [_differences(lambda n: rng.normal(size=n), case, rng, factor * u) for factor in (3.5, 7.0)]
        row.append(_differences(lambda n: first_order(rng, 1, n, 0.6)[0], case, rng, 0.0))
        row.append(_differences(lambda n: rng.standard_t(3, n) / np.sqrt(3.0), case, rng, 0.0))
        row.append(_differences(lambda n: 0.7 * rng.normal(size=n) + 0.7 * rng.normal(), case, rng, 0.0))
        row.append(_differences(lambda n: rng.normal(size=n), case, rng, 0.0, 3.0))
        rows.append(row)
    table(
        "Before and after an event: called / called or not decided, in %; changed by standard deviations of the "
        "difference",
        [
            "days of runs before",
            "after",
            "the machine's other days",
            *(f"days differ by {c:g}" for c in (0.0, 0.5, 1.0, 2.0, 3.0)),
            "days 1, changed by 3.5",
            "changed by 7",
            "days AR 0.6",
            "days Student, 3",
            "campaigns differ by 0.7 too",
            "3 times the scatter after",
        ],
        rows,
    )


#: Histories of a cell.
DEPENDENCES = 150


def conditions(rng: np.random.Generator) -> None:
    """Dependences called on a temperature that has nothing to do with the values, and on one that has."""
    rows: list[list[object]] = []
    for n, gap in ((6, 1.0), (10, 7.0), (20, 7.0), (52, 7.0), (104, 7.0)):
        day = np.repeat(np.arange(n), 3)
        t = gap * day + np.tile([0.0, 0.1, 0.2], n)
        for r in (0.0, 0.6, 0.8):
            called = np.zeros(4)
            for _ in range(DEPENDENCES):
                season = np.cos(2.0 * np.pi * (gap * np.arange(n) + rng.uniform(0.0, YEAR)) / YEAR)
                degrees = (2.0 * season + first_order(rng, 1, n, 0.7)[0])[day] + np.tile([-0.3, 0.0, 0.3], n)
                y = first_order(rng, 1, n, r)[0][day] + rng.normal(size=3 * n)
                within = rng.normal(size=3 * n)
                for place, (values, channel) in enumerate(
                    ((y, degrees), (y, within), (y + 0.6 * degrees, degrees))
                ):
                    fit = dependence(values, t, {"degC": channel}, days=day)
                    called[place] += fit.coefficients[0].p_value < 0.05
                if n * gap >= 300.0:
                    wave = dependence(y, t, {}, cycles={"year": YEAR}, days=day).cycles[0]
                    called[3] += wave.p_value < 0.05
            rates = (called / DEPENDENCES).tolist()
            rows.append([n, gap, r, *rates[:3], rates[3] if n * gap >= 300.0 else ""])
    table(
        "Dependences and yearly cycles called at 5 % where there are none, day component 1",
        [
            "days",
            "every (days)",
            "r",
            "on weather",
            "on what varies within days",
            "0.6 a kelvin",
            "yearly cycle",
        ],
        rows,
    )


def means(rng: np.random.Generator) -> None:
    """Equal means called where the groups scatter differently."""
    rows: list[list[object]] = []
    tests = (anova, welch_anova, brown_forsythe)
    for k in (3, 5, 10, 20):
        for n in (2, 3, 4, 6, 12):
            groups = np.repeat(np.arange(k), n)
            for text, scale in (("alike", np.ones(k)), ("one 4 times", np.r_[4.0, np.ones(k - 1)])):
                y = scale[groups, np.newaxis] * rng.normal(size=(k * n, 10_000))
                tails = scale[groups, np.newaxis] * rng.standard_t(4, (k * n, 10_000))
                rates = [float((test(y, groups).p_value < 0.05).mean()) for test in tests]
                both = robust_p_value(y, groups)
                rows.append([
                    k, n, text, *rates, float((both < 0.05).mean()), float((both < 0.005).mean()),
                    float((robust_p_value(tails, groups) < 0.05).mean()),
                ])  # fmt: skip
    table(
        "Equal means called at 5 % where one day scatters differently",
        [
            "days",
            "runs",
            "scatter",
            "ANOVA",
            "Welch",
            "Brown-Forsythe",
            "larger p",
            "larger p, at 0.5 %",
            "Student, 4",
        ],
        rows,
    )


if __name__ == "__main__":
    every = (slopes, parts_of_a_year, means, events, conditions, charts, forecasts, changes)
    seed = next((int(text) for text in sys.argv[1:] if text.isdecimal()), SEED)
    for trial in [trial for trial in every if trial.__name__ in sys.argv[1:]] or every:
        trial(np.random.default_rng(seed))
