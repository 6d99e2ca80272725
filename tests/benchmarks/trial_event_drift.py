"""What is said of an event on machines that drift, wander, or stand still; results in ``docs/trials-statistics.md``.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_event_drift.py

The machines are drawn here, campaign by campaign: two days of two runs about every thirty days, in standard deviations
of a run and of a day (both 1). Half an hour and no test.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
from scipy import stats

from monitor.statistics.days.before_after import OtherDays, before_after
from monitor.statistics.days.beside_drift import Verdict, beside_drift
from monitor.statistics.days.stepped_line import campaigns_of
from monitor.store import MachineEvent
from monitor.workflow.history.changes import ChangeSearch, search_changes
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.event_steps import event_steps
from monitor.workflow.history.past import ParameterPast
from monitor.workflow.history.series import Series

DAYS, RUNS, SPACING = 2, 2, 30.0
#: Standard deviation of the mean of a campaign by its days and runs.
OF_MEAN = float(np.sqrt((1.0 + 1.0 / RUNS) / DAYS))
LAYOUTS = ((2, 1), (2, 2), (3, 2), (3, 3), (4, 4), (7, 1), (2, 6), (8, 8))
#: Where so many campaigns and more are measured they judge, and the days have no part in what is called: these take
#: nearly all of the time, and only say what is not decided.
CAMPAIGNS_JUDGE = 5
STEPS = (5.0, 10.0, 20.0)


@dataclass(frozen=True)
class Law:
    """What a machine does without an event, by campaign where it is not said otherwise.

    ``camp`` is how campaigns differ, ``follow`` how they resemble the one before, ``days_follow`` how the days of one
    do, ``walk`` and ``rate`` what it wanders and drifts by from one to the next; ``after`` its scatter after the event.
    """

    camp: float = 0.0
    follow: float = 0.0
    days_follow: float = 0.0
    walk: float = 0.0
    rate: float = 0.0
    after: float = 1.0
    tails: bool = False


LAWS = {
    "days differ": Law(),
    "campaigns too, by 1": Law(camp=1.0),
    "Student, 3": Law(tails=True),
    "days AR 0.6": Law(days_follow=0.6),
    "campaigns AR 0.6": Law(camp=2.0, follow=0.6),
    "3 times the scatter after": Law(after=3.0),
    "walk of 0.5": Law(walk=0.5),
    "walk of 1": Law(walk=1.0),
    "walk of 3": Law(walk=3.0),
    "walk of 10": Law(walk=10.0),
    "drift of 1": Law(rate=1.0),
    "drift of 3": Law(rate=3.0),
    "drift of 20": Law(rate=20.0),
    "drift of 3, campaigns by 1": Law(rate=3.0, camp=1.0),
    "drift of 3, walk of 1": Law(rate=3.0, walk=1.0),
}


def following(draws: np.ndarray, correlation: float) -> np.ndarray:
    """First-order series along the last axis from independent draws of unit variance."""
    series = draws.copy()
    for i in range(1, series.shape[-1]):
        series[..., i] = correlation * series[..., i - 1] + np.sqrt(1.0 - correlation**2) * draws[..., i]
    return series


def machine(
    rng: np.random.Generator, law: Law, layout: tuple[int, int], start: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Values (c, d, r) and times (c, d, r) in days, of campaigns that begin at ``start`` (c,); ``step`` in standard
    deviations of the mean of a campaign."""
    count = sum(layout)
    level = law.rate * start / SPACING + np.cumsum(law.walk * rng.normal(size=count))
    level = level + law.camp * following(rng.normal(size=count), law.follow)
    draws = rng.normal(size=(count, DAYS))
    if law.tails:
        draws = rng.standard_t(3, (count, DAYS)) / np.sqrt(3.0)
    scatter = following(draws, law.days_follow)[..., None] + rng.normal(size=(count, DAYS, RUNS))
    scatter[layout[0] :] *= law.after
    values = level[:, None, None] + scatter
    values[layout[0] :] += step * OF_MEAN
    t = start[:, None, None] + np.arange(DAYS)[:, None] + 0.1 * np.arange(RUNS)
    return values, np.broadcast_to(t, values.shape)


def of_campaigns(values: np.ndarray, t: np.ndarray, before: int) -> tuple[Verdict, Verdict]:
    """What the campaigns alone say of the pair, and of the step: all that counts where there are enough of them."""
    count = len(values)
    days = np.repeat(np.arange(count * DAYS), RUNS)
    campaign = np.repeat(np.arange(count), DAYS * RUNS)
    piece = (campaign >= before).astype(np.intp)
    campaigns = campaigns_of(values.ravel(), days, t.ravel(), piece, campaign)
    pair, step = (
        beside_drift(None, campaigns, before - 1, before, levels=levels) for levels in (False, True)
    )
    return pair.verdict(0.05), step.verdict(0.05)


def of_pair(values: np.ndarray, t: np.ndarray, before: int) -> Verdict:
    """What ``agreement`` says of the last campaign before the event and the first after it."""
    count = len(values)
    days = np.repeat(np.arange(count * DAYS), RUNS).reshape(values.shape)
    campaign = np.broadcast_to(np.arange(count)[:, None, None], values.shape)
    piece = (campaign >= before).astype(np.intp)
    rest = np.isin(np.arange(count), (before - 1, before), invert=True)
    others = OtherDays(*(column[rest].ravel() for column in (values, days, piece, campaign)))
    first, second = before - 1, before
    result = before_after(
        values[first].ravel(), values[second].ravel(), days[first].ravel(), days[second].ravel(), others
    )
    campaigns = campaigns_of(*(column.ravel() for column in (values, days, t, piece, campaign)))
    return beside_drift(result, campaigns, first, second, levels=False).verdict(0.05)


def of_event(values: np.ndarray, t: np.ndarray, before: int, *, searched: bool = False) -> Verdict:
    """What ``event_steps`` says of a machine of one parameter, with the search for changes before it or without."""
    first = datetime(2026, 1, 5, 8, tzinfo=UTC)
    times = t.ravel() + first.timestamp() / 86400.0
    at = first + timedelta(days=float((t[before - 1].max() + t[before].min()) / 2.0))
    count = len(times)
    series = Series(
        "E", "µrad", values.ravel(), np.ones(count), times, np.repeat(np.arange(count // RUNS), RUNS),
        np.zeros(count), np.zeros(count, dtype=np.bool_), timedelta(),
        campaign=np.repeat(np.arange(len(values)), DAYS * RUNS),
    )  # fmt: skip
    search = search_changes([series], [at.timestamp() / 86400.0])["E"] if searched else ChangeSearch()
    past = ParameterPast(series, np.ones(count, np.bool_), search, PieceDrift(series, -np.inf))
    steps = event_steps({"E": past}, [MachineEvent(at, "repair", "")])
    return Verdict.NOT_SEEN if not steps else Verdict.STEPPED if steps[0].decided else Verdict.DRIFT


def interval(calls: int, count: int) -> str:
    """A share in percent with its exact 95 % interval (Clopper and Pearson)."""
    low, high = stats.binomtest(calls, count).proportion_ci(0.95, "exact")
    return f"{100.0 * calls / count:.1f} ({100.0 * low:.1f} to {100.0 * high:.1f})"


def shares(verdicts: list[Verdict], whole: bool) -> str:
    """The share that is called and, where the days were asked too, that is not decided."""
    called = interval(verdicts.count(Verdict.STEPPED), len(verdicts))
    if not whole:
        return f"{called} | -"
    open_ = sum(verdict in (Verdict.DAYS, Verdict.DRIFT) for verdict in verdicts)
    return f"{called} | {100.0 * open_ / len(verdicts):.0f}"


def main() -> None:
    """Print the table: called with its interval, and not decided, of the pair and of the step."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--machines", type=int, default=400)
    parser.add_argument("--seed", type=int, default=14)
    parser.add_argument("--layouts", type=int, nargs="*", help="numbers of LAYOUTS, from 0; all without it")
    parser.add_argument("--whole", action="store_true", help="ask the days everywhere: ten times as long")
    options = parser.parse_args()
    print(
        "| campaigns before, after | machine | pair: called, % | not decided | step: called, % | not decided |"
    )
    print("| --- | --- | --- | --- | --- | --- |")
    cells = [(name, law, 0.0) for name, law in LAWS.items()]
    cells += [
        (f"{name}, stepped by {step:g}", LAWS[name], step)
        for name in ("days differ", "drift of 3", "walk of 1")
        for step in STEPS
    ]
    for number, layout in enumerate(LAYOUTS):
        if options.layouts and number not in options.layouts:
            continue
        for cell, (name, law, step) in enumerate(cells):
            rng = np.random.default_rng([options.seed, number, cell])
            kinds: tuple[list[Verdict], list[Verdict]] = ([], [])
            whole = options.whole or sum(layout) < CAMPAIGNS_JUDGE
            start = np.arange(sum(layout)) * SPACING + rng.uniform(-4.0, 4.0, sum(layout))
            for _ in range(options.machines):
                values, t = machine(rng, law, layout, start, step)
                verdicts = (
                    (of_pair(values, t, layout[0]), of_event(values, t, layout[0]))
                    if whole
                    else of_campaigns(values, t, layout[0])
                )
                for kind, verdict in zip(kinds, verdicts, strict=True):
                    kind.append(verdict)
            print(
                f"| {layout[0]}, {layout[1]} | {name} | {' | '.join(shares(kind, whole) for kind in kinds)} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
