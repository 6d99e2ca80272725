"""How often steps that are the exchange of a laser's calibration are denied where they are judged at once, and how
often one of the machine is seen beside them.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_exchange.py --histories 1000

Each history is drawn here, with no code of the package: p gains of one laser on some days before and after another
certificate, its scale known to 1 µm/m each time, days that scatter by 0.3 with a correlation between the gains, one day
a campaign, 14 days apart. The first gains are told as steps, with the size and u that their days say. ``drift``: the
last gain drifts by so much a year; ``other``: the first gain stepped besides, by so much.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.sources import CommonQuantity
from monitor.statistics import Change
from monitor.store import MachineHistory
from monitor.store.past.instruments import Calibrations
from monitor.workflow.history.changes import ChangeSearch
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.other_instruments import between_instruments
from monitor.workflow.history.past import ParameterPast
from monitor.workflow.history.series import parameter_series
from tests.benchmarks.trial_calibrations import exact

LASER, SCATTER, APART = "laser", 0.3, 14


@dataclass(frozen=True)
class Case:
    """So many ``days`` a side, ``gains`` of which ``stepped`` are told as steps."""

    days: int
    gains: int = 3
    stepped: int = 2
    correlation: float = 0.0
    drift: float = 0.0
    tails: float | None = None
    other: float = 0.0

    def __str__(self) -> str:
        words = [f"{self.days} + {self.days} days, {self.gains} gains"]
        words += [f"correlation {self.correlation:g}"] if self.correlation else []
        words += [f"drift {self.drift:g}"] if self.drift else []
        words += [f"tails of Student {self.tails:g}"] if self.tails else []
        words += [f"one steps by {self.other:g}"] if self.other else []
        return ", ".join(words)


RIGHT = (
    *(Case(days, correlation=rho) for days in (3, 6, 20) for rho in (0.0, 0.5, 0.9)),
    *(Case(days, 12, 3, rho) for days in (3, 6, 20) for rho in (0.0, 0.5, 0.9)),
    *(Case(days, drift=drift) for days in (6, 12, 20) for drift in (0.5, 1.0, 2.0)),
    *(Case(days, gains, tails=3.0) for days in (3, 6, 20) for gains in (3, 12)),
)
WRONG = tuple(
    Case(days, gains, other=other) for days in (3, 6, 20) for gains in (3, 12) for other in (1.0, 2.0)
)


def history(case: Case, rng: np.random.Generator) -> MachineHistory:
    """The gains of a case, um/m."""
    count = 2 * case.days
    after = np.arange(count) >= case.days
    size = (count, case.gains)
    draw = rng.normal if case.tails is None else lambda size: rng.standard_t(case.tails, size) / np.sqrt(3.0)
    common, own = draw(size=(count, 1)), draw(size=size)
    values = SCATTER * (np.sqrt(case.correlation) * common + np.sqrt(1.0 - case.correlation) * own)
    scales = rng.normal(size=2)
    values += np.where(after, scales[1], scales[0])[:, None]
    values[:, -1] += case.drift * APART / 365.25 * np.arange(count)
    values[after, 0] += case.other
    names = [f"c{day}" for day in range(count)]
    certificate = np.where(after, "B", "A")
    start = datetime(2025, 1, 1, 8, tzinfo=UTC)
    return MachineHistory(
        machine="M", campaigns=dict(enumerate(names)), campaign=np.array(names),
        method=np.full(count, "instruments"), measured_by=np.full(count, "instruments (laser)"),
        run=np.arange(count), started_at=tuple(start + timedelta(days=APART * day) for day in range(count)),
        day=np.ones(count, dtype=np.int64), warm_up=np.zeros(count, dtype=np.bool_),
        parameters=tuple(f"P{j}" for j in range(case.gains)), units=("µm/m",) * case.gains, values=values,
        u=np.full(size, np.hypot(1.0, SCATTER)), conditions={}, tolerances={}, unidentified=(),
        common_parts={
            CommonQuantity(LASER, of, "scale", 1e-6): np.repeat(np.where(certificate == of, 1.0, 0.0), case.gains)
            .reshape(size)
            for of in "AB"
        },
        calibrations=Calibrations(
            {name: {LASER: str(of)} for name, of in zip(names, certificate, strict=True)}, {}
        ),
    )  # fmt: skip


def stepped(measured: MachineHistory, case: Case) -> dict[str, ParameterPast]:
    """The past of the gains, with the steps that are told."""
    past, days = {}, case.days
    for number, (name, (series, mask)) in enumerate(parameter_series(measured).items()):
        before, after = series.values[:days], series.values[days:]
        size = float(after.mean() - before.mean())
        u = float(np.sqrt((before.var(ddof=1) + after.var(ddof=1)) / days))
        step = Change(name, "step", days, series.t[days], (series.t[days - 1], series.t[days]), size, u, 1e-4)
        search = ChangeSearch((step,) if number < case.stepped else ())
        past[name] = ParameterPast(series, mask, search, PieceDrift(series, -np.inf))
    return past


def denied(case: Case, rng: np.random.Generator) -> bool:
    """Whether the steps of one history are said to be more than the calibrations."""
    measured = history(case, rng)
    judged = between_instruments(measured, stepped(measured, case)).values()
    return not all(each.may_be_all for each in judged)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    arguments.add_argument("--histories", type=int, default=1000)
    arguments.add_argument("--seed", type=int, default=20261127)
    options = arguments.parse_args()
    for what, cases in (("denied, where nothing but the laser stepped", RIGHT), ("seen", WRONG)):
        print(what)
        for number, case in enumerate(cases):
            rng = np.random.default_rng([options.seed, number])
            found = sum(denied(case, rng) for _ in range(options.histories))
            print(f"{case}: {exact(found, options.histories)}", flush=True)


if __name__ == "__main__":
    main()
