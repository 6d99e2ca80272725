"""The fleet table against one bare GROUP BY over the same rows, in time and memory; the data are made by SQL.

``python tests/benchmarks/test_fleet.py MACHINES climate`` compares fleets without and with a recorded temperature,
``certificates`` instead of it fleets without and with a laser whose scale is certified anew every year.
``python tests/benchmarks/test_fleet.py MACHINES`` makes a file of so many machines (15 parameters, weekly campaigns of
4 runs over 5 years; 10 000 machines are 156 million values and 1.7 GB) and prints the times; a second argument
names the file, which is then kept, and used as it is where it exists. As a test a small copy is checked for its
numbers. No test asserts a time.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from monitor.store import Database, fleet_sums
from monitor.store.past.campaign_runs import gather_runs
from monitor.store.past.identified_values import gather_values
from monitor.workflow.fleet.ranking import CUT, cell_tests
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

WEEKS, RUNS = 260, 4
NAMES = [
    "EXX",
    "EYY",
    "EZZ",
    "EC0Y",
    "EA0Y",
    "EB0C",
    "EX0C",
    "EY0C",
    "EA0C",
    "EX0B",
    "EZ0B",
    "EA0B",
    "EC0B",
    "EA0Z",
    "EB0Z",
]
# The one bare query: of every campaign and parameter what the fleet table needs first. DuckDB must be made to compute
# it: by keeping its rows, or (which costs less) by adding them up.
BARE = (
    "SELECT identification_id, parameter, count(*) AS n, avg(value) AS m, var_samp(value) AS v "
    "FROM parameter_value GROUP BY ALL"
)
KEPT = f"CREATE OR REPLACE TEMP TABLE bare AS {BARE}"
ADDED = f"SELECT sum(n), sum(m), sum(v) FROM ({BARE})"


#: The temperature of a run, as a map of its conditions: a yearly wave of 4 K, and half a degree from run to run.
CLIMATE = (
    "MAP {'ambient_degC': 20.0 + 4.0 * sin(6.2831853 * (i // 4 // $m) / 52.18) + 0.5 * (hash(i + 4242) % 1000003 / "
    "1000003.0 - 0.5)}"
)


def generate(
    db: Database,
    machines: int,
    weeks: int = WEEKS,
    conditions: str = "MAP {}",
    *,
    first: int = 0,
    of: int = 0,
) -> None:
    """Machines with noise by campaign and by run, in the order in which they would be imported.

    A plant has ``machines`` from the ``first`` on, and of them the values that a file of all ``of`` machines has.
    """
    n = {"m": machines, "n": machines * weeks}
    name = f"'M' || lpad(CAST({first} + i % $m AS VARCHAR), 5, '0')"
    campaign = f"((i // 60 // $m) * {of or machines} + {first} + i // 60 % $m)"
    value = f"({campaign} * 60 + i % 60)"
    db.execute(
        f"INSERT INTO registered_machine SELECT i + 1, {name}, 'w C B X b Z Y (C1) t', TIMESTAMP '2021-01-04' "
        "FROM range($m) AS r(i)",
        {"m": machines},
    )
    db.execute(
        f"INSERT INTO imported_campaign SELECT i + 1, {name} || '-W' || (i // $m), {name}, 'samba', '{{}}', '{{}}', "
        "'{}', '', '0', TIMESTAMP '2021-01-04' FROM range($n) AS r(i)",
        n,
    )
    db.execute(
        "INSERT INTO run SELECT 1 + i // 4, 1 + i % 4, 1 + i % 4, TIMESTAMP '2021-01-04 08:00:00' "
        "+ to_days(CAST((i // 4) // $m * 7 AS INTEGER)) + to_hours(i % 4), 0, 1, false, "
        f"{conditions} FROM range($n * 4) AS r(i)",
        n,
    )
    db.execute(
        f"INSERT INTO identification SELECT i + 1, i + 1, 'samba', 1, 'samba', {NAMES}, {['µm'] * 15}, {[1e-3] * 15}, "
        "4, '0', TIMESTAMP '2021-01-04' FROM range($n) AS r(i)",
        {"n": n["n"]},
    )
    db.execute(
        f"INSERT INTO parameter_value SELECT CAST(1 + i // 60 AS INTEGER), 1 + (i // 15) % 4, {NAMES}[1 + i % 15], "
        f"1e-3 * (0.01 * (1 + i % 15) + hash({campaign} * 15 + i % 15) % 1000003 / 1000003.0 "
        f"+ 0.5 * (hash({value} + 999) % 1000003 / 1000003.0 + hash({value} + 77777777) % 1000003 / 1000003.0)), "
        "0.5e-3, 'µm', 1e-3 FROM range($n * 60) AS r(i)",
        n,
    )
    gather_values(db)
    gather_runs(db)


def test_a_small_copy_gives_the_numbers_of_the_bare_query(tmp_path: Path) -> None:
    with Database(tmp_path / "fleet.duckdb") as db:
        generate(db, 5, 12)
        sums = fleet_sums(db, cut=CUT)
        assert sums.runs.tolist() == [12.0 * RUNS] * 5 * len(NAMES)
        cells = cell_tests(sums)[0]
        rows = db.rows(
            "SELECT sqrt(avg(v)) * 1e3 FROM (SELECT machine, parameter, identification_id, var_samp(value) AS v "
            "FROM parameter_value JOIN identification USING (identification_id) JOIN campaign USING (campaign_id) "
            "GROUP BY ALL) GROUP BY machine, parameter ORDER BY machine, parameter"
        )
        assert np.allclose(cells.sd_pooled, [row[0] for row in rows], rtol=1e-10)


def test_p_values_of_a_small_copy_are_those_of_scipy(tmp_path: Path) -> None:
    with Database(tmp_path / "fleet.duckdb") as db:
        generate(db, 3, 10)
        sums = fleet_sums(db, cut=CUT)
        cells = cell_tests(sums)[0]
        for i, (machine, parameter) in enumerate(zip(sums.machine, sums.parameter, strict=True)):
            values = db.rows(
                "SELECT list(value) FROM parameter_value JOIN identification USING (identification_id) "
                "JOIN campaign USING (campaign_id) WHERE machine = ? AND parameter = ? GROUP BY campaign_id",
                [str(machine), str(parameter)],
            )
            groups = [np.array(value) / 1e-3 for (value,) in values]
            anova, bartlett = stats.f_oneway(*groups), stats.bartlett(*groups)
            assert len(groups) == sums.groups[i] == 10.0
            assert cells.anova_f[i] == pytest.approx(anova.statistic, rel=1e-10)
            assert cells.anova_p[i] == pytest.approx(anova.pvalue, rel=1e-9)
            assert cells.bartlett[i] == pytest.approx(bartlett.statistic, rel=1e-9)
            assert cells.bartlett_p[i] == pytest.approx(bartlett.pvalue, rel=1e-9)


def _cost(work: Callable[[Database], object], db: Database) -> tuple[float, float]:
    """Wall clock and processor seconds."""
    wall, own = time.perf_counter(), time.process_time()
    work(db)
    return time.perf_counter() - wall, time.process_time() - own


def _fleet_table(db: Database) -> None:
    cell_tests(fleet_sums(db, cut=CUT))


def _kept(db: Database) -> None:
    db.execute(KEPT)
    db.execute("DROP TABLE bare")


def _certify(db: Database) -> None:
    """Store what the parameters of every run have of a laser's scale, under one certificate a machine and year."""
    db.execute(
        "INSERT INTO common_part SELECT identification_id, run, 'laser', machine || '-' || year(started_at), 'scale', "
        "1e-6, [0.2e-3 * (1 + i % 3) FOR i IN range(15)] "
        "FROM identification JOIN campaign USING (campaign_id) JOIN run USING (campaign_id)"
    )


#: What a fleet may have beside its values: the conditions of its runs, and what is done to the file.
BESIDE: Mapping[str, tuple[str, Callable[[Database], None]]] = {
    "climate": (CLIMATE, lambda db: None),
    "certificates": ("MAP {}", _certify),
}


def beside(machines: int, name: str) -> None:
    """Print the time of the fleet table of machines without and with what ``BESIDE`` has by that name, in turns."""
    with tempfile.TemporaryDirectory() as folder:
        files = {"without": ("MAP {}", lambda db: None), "with": BESIDE[name]}
        for file, (conditions, prepare) in files.items():
            with Database(Path(folder) / f"{file}.duckdb") as db:
                generate(db, machines, conditions=conditions)
                prepare(db)
        least = {file: [np.inf, np.inf] for file in files}
        for _ in range(4):
            for file in files:
                with Database(Path(folder) / f"{file}.duckdb") as db:
                    db.execute("SET memory_limit = '3GB'")
                    _fleet_table(db)
                    least[file] = [
                        min(pair) for pair in zip(least[file], _cost(_fleet_table, db), strict=True)
                    ]
        for file, (wall, own) in least.items():
            print(f"{machines} machines, {file} {name}: {wall:.2f} s, processor {own:.2f} s", flush=True)
        wall, own = (least["with"][part] / least["without"][part] for part in (0, 1))
        print(f"ratio {wall:.2f}, processor {own:.2f}")


def main(machines: int, path: Path) -> None:
    """Print the times of the fleet table, the bare query and one machine's trends, and the memory.

    The works take turns, in both orders, because the clock of a shared machine wanders: compare what was taken side
    by side, and the least of each.
    """
    exists = path.exists()
    with Database(path) as db:
        if not exists:
            print(f"made in {_cost(lambda db: generate(db, machines), db)[0]:.0f} s")
        db.execute("SET memory_limit = '3GB'")
        works = {"fleet": _fleet_table, "bare, kept": _kept, "bare, added up": lambda db: db.rows(ADDED)}
        least = {name: [np.inf, np.inf] for name in works}
        for turn in range(4):
            costs = {}
            for name in list(works) if turn % 2 == 0 else reversed(works):
                costs[name] = _cost(works[name], db)
                least[name] = [min(pair) for pair in zip(least[name], costs[name], strict=True)]
            _print(costs)
        print("least of each:")
        _print(least)
        print(f"peak {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.1f} GB")
        for _ in range(5):
            wall, own = _cost(lambda db: trend(db, TrendRequest("M00003")), db)
            print(f"trends of one machine {wall:.2f} s, processor {own:.2f} s")


def _print(costs: Mapping[str, Sequence[float]]) -> None:
    wall, own = costs["fleet"]
    words = (
        f"{name} {a:.1f} s (ratio {wall / a:.2f}), processor {b:.1f} s ({own / b:.2f})"
        for name, (a, b) in costs.items()
    )
    print("; ".join(words), flush=True)


if __name__ == "__main__":
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    if len(sys.argv) > 2 and sys.argv[2] in BESIDE:
        beside(number, sys.argv[2])
    elif len(sys.argv) > 2:
        main(number, Path(sys.argv[2]))
    else:
        with tempfile.TemporaryDirectory() as folder:
            main(number, Path(folder) / "fleet.duckdb")
