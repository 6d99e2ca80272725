"""The table of the fleet from a lake against that from one file, over a million values and more.

``python tests/soak/lake_sizes.py --values 1e6 1e7 --plants 1``: generated machines with weekly campaigns of four runs
and fifteen parameters (``tests/benchmarks/test_fleet.py``) are published, in one portion a plant, to a lake with a
PostgreSQL of its own; the table of the fleet is asked of both, each in a process of its own that opens it, twice in
turn. Answers are compared; seconds, processor time and the largest memory of each are printed.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import sys
import tempfile
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

CHECKOUT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(CHECKOUT / "tests" / "benchmarks"))
from lake import postgres  # noqa: E402
from test_fleet import generate  # noqa: E402

from monitor.store import Database, audit  # noqa: E402
from monitor.store.lake import publication  # noqa: E402
from monitor.store.lake.reading import LakeDatabase  # noqa: E402
from monitor.workflow.fleet.fleet import fleet  # noqa: E402
from monitor.workflow.fleet.request import FleetRequest  # noqa: E402

#: Values a campaign: four runs of fifteen parameters.
VALUES = 60
WEEKS = 100
#: An entry for each campaign and identification, chained as nobody checks here.
_ENTRIES = """
INSERT INTO audit SELECT row_number() OVER (ORDER BY number, subject), TIMESTAMP '2026-01-01', 'generated', 'import',
subject, key, '', '0', '', md5(concat(subject, key)) FROM (
SELECT campaign_id AS number, 'campaign' AS subject, campaign AS key FROM imported_campaign
UNION ALL SELECT identification_id, 'identification', CAST(identification_id AS VARCHAR) FROM identification)
"""


@dataclass(frozen=True)
class Answer:
    """The table of the fleet: machines, parameters and mean values by row, seconds, processor time, memory in GB."""

    names: list[tuple[str, str]]
    means: np.ndarray
    values: int
    seconds: float
    processor_s: float
    gigabytes: float


def make(path: Path, machines: int, first: int, of: int) -> None:
    """Write a file of so many machines, from the first on of all, with the entries that its publication follows."""
    with Database(path) as db:
        generate(db, machines, WEEKS, first=first, of=of)
        db.execute(_ENTRIES)
        assert audit.last_anchor(db).entry


def publish(path: Path, address: str, files: Path) -> None:
    """Publish a file at once: what is measured is reading."""
    publication.PORTION = 2**31 - 2
    with Database(path) as db:
        publication.publish(db, address, files=files)


def ask(address: str, answers: Connection) -> None:
    """Open a file or lake, ask for the table of the fleet, send the answer."""
    begin = time.perf_counter()
    kind = LakeDatabase if address.startswith("ducklake:") else Database
    with kind(address, read_only=True, threads=1) if kind is Database else kind(address, threads=1) as db:
        table = fleet(db, FleetRequest(None, 0, False))
    seconds = time.perf_counter() - begin
    used = resource.getrusage(resource.RUSAGE_SELF)
    names = [(row.machine, row.parameter) for row in table.table]
    means = np.array([row.mean for row in table.table])
    answers.send(
        Answer(names, means, table.values, seconds, used.ru_utime + used.ru_stime, used.ru_maxrss / 1e6)
    )


def asked(address: str) -> Answer:
    """The answer of a process of its own, so that memory is its own, too."""
    ours, theirs = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(target=ask, args=(address, theirs))
    process.start()
    theirs.close()
    answer: Answer = ours.recv()
    process.join()
    return answer


def apart(function: object, *arguments: object) -> None:
    """Run a function in a process of its own: a database engine that was open is not forked."""
    process = multiprocessing.get_context("fork").Process(target=function, args=arguments)
    process.start()
    process.join()
    assert process.exitcode == 0


def trial(values: float, plants: int, folder: Path) -> list[str]:
    """Compare the two for a number of values of so many plants; what differs, in sentences."""
    path, files = folder / "one.duckdb", folder / "files"
    each = max(round(values / VALUES / WEEKS / plants), 1)
    machines = each * plants
    begin = time.perf_counter()
    apart(make, path, machines, 0, machines)
    made = time.perf_counter() - begin
    published = 0.0
    (folder / "pg").mkdir()
    folder.chmod(0o755)
    with postgres(folder / "pg") as address:
        for plant in range(plants):
            own = path if plants == 1 else folder / f"plant{plant}.duckdb"
            if own != path:
                apart(make, own, each, plant * each, machines)
            begin = time.perf_counter()
            apart(publish, own, address, files)
            published += time.perf_counter() - begin
            if own != path:
                own.unlink()
        answers = [(asked(address), asked(str(path))) for _ in range(2)]
    size = sum(file.stat().st_size for file in files.rglob("*.parquet"))
    print(
        f"{values:.0e} values: one file {path.stat().st_size / 1e6:.0f} MB, made in {made:.0f} s; "
        f"lake of {plants}: {size / 1e6:.0f} MB of Parquet, published in {published:.0f} s"
    )
    wrong = []
    for lake, one in answers:
        for name, answer in (("lake", lake), ("one file", one)):
            print(
                f"  {name:<9} {answer.values} values, {len(answer.names)} rows: {answer.seconds:.2f} s, "
                f"{answer.processor_s:.2f} s of processor time, {answer.gigabytes:.2f} GB",
                flush=True,
            )
        if lake.names != one.names or lake.values != one.values:
            wrong.append(f"{values:.0e}: the tables have other rows")
        elif not np.allclose(lake.means, one.means, rtol=1e-12, atol=0.0):
            wrong.append(f"{values:.0e}: means differ by {np.abs(lake.means - one.means).max():g}")
    return wrong


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--values", type=float, nargs="+", default=[1e6, 1e7])
    options.add_argument("--plants", type=int, default=1, help="plants that publish, each its machines")
    chosen = options.parse_args()
    wrong = []
    for values in chosen.values:
        with tempfile.TemporaryDirectory() as folder:
            wrong += trial(values, chosen.plants, Path(folder))
    for fault in wrong:
        print(f"  {fault}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
