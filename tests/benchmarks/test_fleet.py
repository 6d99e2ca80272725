"""The fleet table against one bare GROUP BY over the same rows, in time and memory; the data are made by SQL.

``python tests/benchmarks/test_fleet.py MACHINES`` makes a file of so many machines (15 parameters, weekly campaigns of
4 runs over 5 years; 10 000 machines are 156 million values and 1.7 GB) and prints the times; as a test a small copy
is checked for its numbers. No test asserts a time.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from monitor.store import Database, fleet_sums
from monitor.workflow.fleet import cell_tests
from monitor.workflow.trends import trends

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
BARE = (
    "CREATE OR REPLACE TEMP TABLE bare AS SELECT identification_id, parameter, count(*) AS n, avg(value) AS m, "
    "var_samp(value) AS v FROM parameter_value GROUP BY ALL"
)


def generate(db: Database, machines: int, weeks: int = WEEKS) -> None:
    """Machines with noise by campaign and by run, in the order in which they would be imported."""
    n = {"m": machines, "n": machines * weeks}
    name = "'M' || lpad(CAST(i % $m AS VARCHAR), 5, '0')"
    db.execute(
        f"INSERT INTO machine SELECT {name}, 'w C B X b Z Y (C1) t', TIMESTAMP '2021-01-04' FROM range($m) AS r(i)",
        {"m": machines},
    )
    db.execute(
        f"INSERT INTO campaign SELECT i + 1, {name} || '-W' || (i // $m), {name}, 'samba', '{{}}', '{{}}', '{{}}', "
        "'', '0', TIMESTAMP '2021-01-04' FROM range($n) AS r(i)",
        n,
    )
    db.execute(
        "INSERT INTO run SELECT 1 + i // 4, 1 + i % 4, 1 + i % 4, TIMESTAMP '2021-01-04 08:00:00' "
        "+ to_days(CAST((i // 4) // $m * 7 AS INTEGER)) + to_hours(i % 4), 0, 1, false, MAP {} "
        "FROM range($n * 4) AS r(i)",
        n,
    )
    db.execute(
        f"INSERT INTO identification SELECT i + 1, i + 1, 'samba', 1, 'samba', {NAMES}, [], [], 4, '0', "
        "TIMESTAMP '2021-01-04' FROM range($n) AS r(i)",
        {"n": n["n"]},
    )
    db.execute(
        f"INSERT INTO parameter_value SELECT CAST(1 + i // 60 AS INTEGER), 1 + (i // 15) % 4, {NAMES}[1 + i % 15], "
        "1e-3 * (0.01 * (1 + i % 15) + hash(i // 60 * 15 + i % 15) % 1000003 / 1000003.0 "
        "+ 0.5 * (hash(i + 999) % 1000003 / 1000003.0 + hash(i + 77777777) % 1000003 / 1000003.0)), "
        "0.5e-3, 'µm', 1e-3 FROM range($n * 60) AS r(i)",
        {"n": n["n"]},
    )


def test_a_small_copy_gives_the_numbers_of_the_bare_query(tmp_path: Path) -> None:
    with Database(tmp_path / "fleet.duckdb") as db:
        generate(db, 5, 12)
        sums = fleet_sums(db)
        assert sums.runs.tolist() == [12.0 * RUNS] * 5 * len(NAMES)
        cells = cell_tests(sums)[0]
        rows = db.rows(
            "SELECT sqrt(avg(v)) * 1e3 FROM (SELECT machine, parameter, identification_id, var_samp(value) AS v "
            "FROM parameter_value JOIN identification USING (identification_id) JOIN campaign USING (campaign_id) "
            "GROUP BY ALL) GROUP BY machine, parameter ORDER BY machine, parameter"
        )
        assert np.allclose(cells.sd_pooled, [row[0] for row in rows], rtol=1e-10)


def main(machines: int) -> None:
    """Print the times of the fleet table, the bare query and one machine's trends, and the memory."""
    with tempfile.TemporaryDirectory() as folder, Database(Path(folder) / "fleet.duckdb") as db:
        generate(db, machines)
        db.execute("SET memory_limit = '3GB'")
        for _ in range(3):
            clock = time.perf_counter()
            cell_tests(fleet_sums(db))
            own = time.perf_counter() - clock
            clock = time.perf_counter()
            db.execute(BARE)
            bare = time.perf_counter() - clock
            db.execute("DROP TABLE bare")
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
            print(f"fleet {own:.2f} s, bare {bare:.2f} s, ratio {own / bare:.2f}, {peak:.1f} GB")
        for _ in range(3):
            clock = time.perf_counter()
            trends(db, "M00003")
            print(f"trends of one machine {time.perf_counter() - clock:.2f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
