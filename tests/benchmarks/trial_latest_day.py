"""Trial of a latest day that stands out: how often it does where nothing happened, and where the machine was hit.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_latest_day.py alone 1500
    OMP_NUM_THREADS=1 python tests/benchmarks/trial_latest_day.py machines 100

Days 12 days apart by two more or less. ``alone``: the means of days of one parameter of six, so many histories of each
kind and a fifth as many for each size of a crash before the latest day (in scatters of a day); false ones in % of
machines of six such parameters, in brackets without the condition that the day lies ``FAR`` times as far off as any
other. ``machines``: two runs a day of six parameters through the whole search, how many show any change by the search
``alone`` and with the latest day; of crashes how many are found on their day.
"""

from __future__ import annotations

import sys
from datetime import timedelta

import numpy as np

from monitor.statistics.days.latest_day import latest_day
from monitor.workflow.history import changes
from monitor.workflow.history.series import Series

DAYS = (10, 15, 20, 30, 52)
SIZES = (4.0, 8.0, 20.0)
PARAMETERS = 6
LEVEL = changes.FALSE_ALARM / PARAMETERS


def follows(rng: np.random.Generator, days: int, correlation: float) -> np.ndarray:
    """Days that resemble each other (days,)."""
    process = rng.normal(size=days)
    for day in range(1, days):
        process[day] = correlation * process[day - 1] + np.sqrt(1.0 - correlation**2) * process[day]
    return process


#: What the days of a kind are off by.
KINDS = {
    "independent": lambda rng, days: rng.normal(size=days),
    "r = 0.4": lambda rng, days: follows(rng, days, 0.4),
    "r = 0.8": lambda rng, days: follows(rng, days, 0.8),
    "walk": lambda rng, days: np.cumsum(rng.normal(size=days)),
    "season of 5": lambda rng, days: (
        rng.normal(size=days) + 5.0 * np.sin(2.0 * np.pi * (np.arange(days) * 12.0 / 365.0 + rng.random()))
    ),
    "Student 3": lambda rng, days: rng.standard_t(3, days) / np.sqrt(3.0),
    "Student 5": lambda rng, days: rng.standard_t(5, days) / np.sqrt(5.0 / 3.0),
    "one in 20 by five": lambda rng, days: (
        rng.normal(size=days) * np.where(rng.random(days) < 0.05, 5.0, 1.0)
    ),
}


def alone(histories: int) -> None:
    """Print the rates of the means of days by themselves."""
    for days in DAYS:
        for kind, make in KINDS.items():
            rng = np.random.default_rng([days, 7])
            found = sum(_called(rng, make(rng, days)) for _ in range(histories))
            far, any_far = (100.0 * PARAMETERS * found / histories).tolist()
            print(f"{days} days, {kind}: {far:.1f} ({any_far:.1f}) % of machines", flush=True)
        for size in SIZES:
            rng, crashes = np.random.default_rng([days, 8]), histories // 5
            found = sum(
                _called(rng, rng.normal(size=days) + size * (np.arange(days) == days - 1))
                for _ in range(crashes)
            )
            far, any_far = (100.0 * found / crashes).tolist()
            print(f"{days} days, crash of {size:g}: {far:.0f} ({any_far:.0f}) % found", flush=True)


def _called(rng: np.random.Generator, means: np.ndarray) -> np.ndarray:
    """Whether the latest day is called, and whether it would be however far off others are."""
    found = latest_day(np.arange(len(means)) * 12.0 + rng.uniform(-2.0, 2.0, len(means)), means)
    assert found is not None
    below = found.p_value < LEVEL
    return np.array([below and found.times_others >= changes.FAR, below], dtype=float)


def machines(count: int) -> None:
    """Print what the search finds with and without the latest day."""
    with_latest_day = changes._with_latest_day
    changes._with_latest_day = lambda series, search, events, level: search
    cases = [(kind, 0.0) for kind in ("independent", "r = 0.4", "r = 0.8", "Student 3", "Student 5")]
    for days in DAYS:
        for kind, size in cases + [("independent", size) for size in SIZES]:
            rng, before, since = np.random.default_rng([days, 9]), 0, 0
            for _ in range(count):
                every = [
                    _series(rng, f"E{number}", kind, days, size if number == 2 else 0.0)
                    for number in range(PARAMETERS)
                ]
                searched = changes.search_changes(every, [])
                latest = {each.name: with_latest_day(each, searched[each.name], [], LEVEL) for each in every}
                before += _found(searched, every, size)
                since += _found(latest, every, size)
            print(
                f"{days} days, {kind}, crash of {size:g}: {before} before, {since} since, of {count}",
                flush=True,
            )


def _found(searches: dict, every: list[Series], size: float) -> bool:
    """Whether there is any change; of a crash, whether its own parameter stepped before the latest day."""
    if not size:
        return any(search.changes for search in searches.values())
    hit = every[2]
    return any(hit.days_since(change.at) == 1 for change in searches[hit.name].changes)


def _series(rng: np.random.Generator, name: str, kind: str, days: int, size: float) -> Series:
    """Two runs a day; days differ by three times the scatter of a run."""
    mean = KINDS[kind](rng, days) + size * (np.arange(days) == days - 1)
    day = np.repeat(np.arange(days), 2)
    n = 2 * days
    values = np.repeat(mean, 2) + rng.normal(scale=1.0 / 3.0, size=n)
    return Series(
        name, "µrad", values, np.full(n, 1.0 / 3.0), 12.0 * day + np.tile([0.0, 0.05], days),
        day, np.zeros(n), np.zeros(n, bool), timedelta(0),
    )  # fmt: skip


if __name__ == "__main__":
    {"alone": alone, "machines": machines}[sys.argv[1]](int(sys.argv[2]))
