"""How often the level of a right gain lies in its 95 % interval, where runs rest on one or two calibrations.

``python tests/benchmarks/trial_calibrations.py --histories 600``: each history is one gain that does not change,
measured on some days with three runs each. Every run is off by the scale of its laser (one number for each
certificate, drawn with the stated u), by its day and by itself. The histories are drawn here, with no code of the
package. Judged is what `monitor trend` states: the line at the last run and 60 days ahead with Student's interval, the
latest mean with 1.96 u (of the gain on that day), the slope with its interval. Without the search for changes
(``--no-search``) the line goes through all days. "scatter" is the same line where no run rests on a calibration: what
was stated before where two certificates were in a history.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.sources import CommonQuantity
from monitor.statistics import predict
from monitor.store import MachineHistory
from monitor.store.past.instruments import Calibrations
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.past import machine_past
from monitor.workflow.history.series import parameter_series
from monitor.workflow.trend.parameter import latest_mean

LASER = "laser"
#: What the truth is: the gain, um/m, the scatter of days and of runs.
GAIN, DAY, RUN, RUNS = 3.0, 0.4, 0.2, 3


@dataclass(frozen=True)
class Case:
    """``share`` of the days, the first ones, by certificate A, whose scale is known to ``u[0]`` um/m, the rest by B;
    ``mixed``: A and B take turns. The first ``old`` days are of identifications that do not say what they have.
    """

    days: int = 20
    share: float = 1.0
    u: tuple[float, float] = (1.0, 1.0)
    mixed: bool = False
    old: int = 0
    tails: float | None = None
    correlation: float = 0.0


CASES = {
    "one certificate": Case(),
    "two, half and half": Case(share=0.5),
    "two, 15 and 5 days": Case(share=0.75),
    "two, 5 and 15 days": Case(share=0.25),
    "two in turns": Case(share=0.5, mixed=True),
    "two, u = 0.3 and 1": Case(share=0.5, u=(0.3, 1.0)),
    "two, small beside the days": Case(share=0.5, u=(0.3, 0.3)),
    "8 days, half and half": Case(days=8, share=0.5),
    "one, 5 days of an old identification": Case(old=5),
    "two, 5 days of an old identification": Case(share=0.5, old=5),
    "two, tails of Student 3": Case(share=0.5, tails=3.0),
    "two, days correlated by 0.6": Case(share=0.5, correlation=0.6),
}


def history(case: Case, rng: np.random.Generator) -> tuple[MachineHistory, float]:
    """One gain over the days of a case, a campaign a day, ten days apart, and what it was on the last day."""
    number = np.arange(case.days)
    by_a = number % 2 == 0 if case.mixed else number < round(case.share * case.days)
    scales = rng.normal(0.0, case.u)
    noise = (
        rng.normal(size=case.days)
        if case.tails is None
        else rng.standard_t(case.tails, case.days) / np.sqrt(3.0)
    )
    of_day = np.empty(case.days)
    for day in number:
        before = 0.0 if day == 0 else case.correlation * of_day[day - 1]
        scale = 1.0 if day == 0 else np.sqrt(1.0 - case.correlation**2)
        of_day[day] = before + scale * noise[day]
    day_of = np.repeat(number, RUNS)
    off_by = np.where(by_a, scales[0], scales[1]) + DAY * of_day
    values = GAIN + off_by[day_of] + RUN * rng.normal(size=len(day_of))
    part = {
        name: np.where(mask, u, 0.0)[day_of]
        for name, mask, u in zip("AB", (by_a, ~by_a), case.u, strict=True)
    }
    u = np.sqrt(sum(each**2 for each in part.values()) + RUN**2)
    stated = day_of >= case.old
    campaign = np.array([f"day-{day:03d}" for day in day_of])
    start = datetime(2025, 1, 1, 8, tzinfo=UTC)
    certificate = {f"day-{day:03d}": "A" if by_a[day] else "B" for day in number}
    measured = MachineHistory(
        machine="M", campaigns=dict(enumerate(certificate)), campaign=campaign,
        method=np.full(len(day_of), "instruments"), measured_by=np.full(len(day_of), "instruments (laser)"),
        run=np.arange(len(day_of)),
        started_at=tuple(
            start + timedelta(days=10 * int(day), minutes=10 * int(run % RUNS)) for run, day in enumerate(day_of)
        ),
        day=np.ones(len(day_of), dtype=np.int64), warm_up=np.zeros(len(day_of), dtype=np.bool_),
        parameters=("EXX",), units=("µm/m",), values=values[:, None], u=u[:, None], conditions={}, tolerances={},
        unidentified=(),
        common_parts={
            CommonQuantity(LASER, name, "scale", 1e-6 * size): np.where(stated, part[name], 0.0)[:, None]
            for name, size in zip("AB", case.u, strict=True)
        },
        calibrations=Calibrations(
            {name: {LASER: of} for name, of in certificate.items()},
            {f"day-{day:03d}": ((LASER, certificate[f"day-{day:03d}"]),) for day in range(case.old)},
        ),
    )  # fmt: skip
    return measured, GAIN + DAY * float(of_day[-1])


def judged(measured: MachineHistory, on_last_day: float, *, search: bool) -> dict[str, bool | None]:
    """Whether the truth lies in each stated interval; None where none is stated."""
    if search:
        drift = machine_past(measured, ())["EXX"].drift
    else:
        drift = PieceDrift(parameter_series(measured)["EXX"][0].steady, -np.inf)
    line, last = drift.line, float(drift.whole.t[-1])
    mean = latest_mean(drift.whole)
    result: dict[str, bool | None] = {"latest": abs(mean.latest - on_last_day) <= 1.96 * mean.latest_u}
    if line is None:
        return result
    factor = -scipy.special.stdtrit(line.dof, 0.025)
    for name, each in (("line", line), ("scatter", replace(line, common=np.empty((0, 2))))):
        value, u, _ = predict(each, last)
        result[name] = bool(abs(value - GAIN) <= factor * u)
    ahead, u_ahead, _ = predict(line, last + 60.0)
    result["in 60 days"] = bool(abs(ahead - GAIN) <= factor * u_ahead)
    low, high = line.slope_interval
    result["slope"] = bool(low <= 0.0 <= high)
    return result


def exact(inside: int, of: int) -> str:
    """Clopper and Pearson's 95 % interval of a rate, in per cent."""
    low = 0.0 if inside == 0 else scipy.special.betaincinv(inside, of - inside + 1, 0.025)
    high = 1.0 if inside == of else scipy.special.betaincinv(inside + 1, of - inside, 0.975)
    return f"{inside} of {of} ({100 * low:.1f} to {100 * high:.1f} %)"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--histories", type=int, default=600)
    parser.add_argument("--seed", type=int, default=20261127)
    parser.add_argument("--only", nargs="*", default=list(CASES))
    parser.add_argument("--no-search", action="store_true")
    asked = parser.parse_args()
    for number, (name, case) in enumerate(CASES.items()):
        if name not in asked.only:
            continue
        rng = np.random.default_rng([asked.seed, number])
        results = [judged(*history(case, rng), search=not asked.no_search) for _ in range(asked.histories)]
        print(name)
        for what in ("latest", "line", "scatter", "in 60 days", "slope"):
            known = [each[what] for each in results if each.get(what) is not None]
            print(f"  {what}: {exact(sum(map(bool, known)), len(known))}", flush=True)


if __name__ == "__main__":
    main()
