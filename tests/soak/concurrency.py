"""Importers and readers at one database at once: nothing lost, nobody refused, the longest wait printed.

``python tests/soak/concurrency.py --seconds 600``: eight importers and twenty readers, each a process that types one
verb after the other as a user would, for so long; then every acknowledged campaign has to be there, and ``verify`` to
agree.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import random
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from monitor.store import Database, Holder, Patience, SharedDatabase, list_campaigns, verify_audit
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.campaigns import RunsRequest, campaigns, runs
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.keeping import AuditRequest, audit
from monitor.workflow.query import SqlRequest, sql

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "cold-cold"
#: No verb of the trial may wait for longer, in s; as the verbs of the command line wait.
PATIENCE_S = 300.0


@dataclass
class Tally:
    """What a process did: questions answered, campaigns acknowledged, refusals, its longest wait and question in s.

    ``holds_s`` are the times for which it held the file to write.
    """

    kind: str
    answered: int
    acknowledged: list[str]
    refused: list[str]
    longest_wait_s: float
    longest_question_s: float
    waits_s: list[float] = field(default_factory=list)
    holds_s: list[float] = field(default_factory=list)


class TimedDatabase(SharedDatabase):
    """Notes how long it held the file to write, from when it was open until it is let go, in s."""

    holds_s: list[float]

    def _let_go(self) -> None:
        wrote = self._writes
        super()._let_go()
        if wrote:
            self.holds_s.append(time.monotonic() - self._opened_at)


@dataclass(frozen=True)
class Load:
    """How long each works in s, at least how often it asks, and how long it pauses on average in between, in s."""

    seconds: float
    least: int
    pause_s: float


def _folder(example: Path, folder: Path, name: str) -> Path:
    shutil.copytree(example, folder)
    path = folder / "campaign.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(f'campaign = "{example.name}"', f'campaign = "{name}"'), encoding="utf-8")
    return folder


def work(kind: str, number: int, database: Path, example: Path, load: Load) -> Tally:
    """Import, or ask, again and again with the database opened anew each time."""
    tally = Tally(kind, 0, [], [], 0.0, 0.0)
    pauses = random.Random(f"{kind} {number}")
    time.sleep(pauses.uniform(0.0, load.pause_s))
    end = time.monotonic() + load.seconds
    with tempfile.TemporaryDirectory() as room:
        while time.monotonic() < end or tally.answered < load.least:
            patience = Patience(PATIENCE_S, _nothing)
            begin = time.monotonic()
            try:
                with TimedDatabase(database, threads=1, actor=kind, patience=patience) as db:
                    db.holds_s = tally.holds_s
                    if kind == "importer":
                        name = f"campaign-{number}-{tally.answered}"
                        import_folders(db, ImportRequest([_folder(example, Path(room) / name, name)]))
                        tally.acknowledged.append(name)
                        if tally.answered % 10 == 0:
                            identify(db, IdentifyRequest(name))
                        shutil.rmtree(Path(room) / name)
                    else:
                        _ask(db, tally.answered + number)
            except Exception as error:
                tally.refused.append(f"{type(error).__name__}: {error}")
            tally.answered += 1
            tally.waits_s.append(patience.longest_s)
            tally.longest_wait_s = max(tally.longest_wait_s, patience.longest_s)
            tally.longest_question_s = max(tally.longest_question_s, time.monotonic() - begin)
            time.sleep(pauses.uniform(0.0, 2 * load.pause_s))
    return tally


def _nothing(holder: Holder, seconds: float) -> None:
    return


def _ask(db: Database, turn: int) -> None:
    names = [row.campaign for row in campaigns(db).campaigns]
    if turn % 4 == 0:
        audit(db, AuditRequest(20))
    elif turn % 4 == 1:
        runs(db, RunsRequest(names[-1]))
    elif turn % 4 == 2:
        fleet(db, FleetRequest())
    else:
        sql(db, SqlRequest("SELECT count(*) FROM v_parameters", None))


def trial(database: Path, importers: int, readers: int, load: Load, example: Path) -> list[Tally]:
    """Let them all work at once; what each did."""
    jobs = [("importer", number) for number in range(importers)] + [
        ("reader", number) for number in range(readers)
    ]
    # Forked: whatever has to be loaded is loaded, and what is measured is the work at the database.
    with multiprocessing.get_context("fork").Pool(len(jobs)) as pool:
        return pool.starmap(work, [(*job, database, example, load) for job in jobs], chunksize=1)


def _begin(database: Path) -> None:
    with SharedDatabase(database, patience=Patience(PATIENCE_S)) as db:
        import_folders(db, ImportRequest([EXAMPLE]))
        identify(db, IdentifyRequest(EXAMPLE.name))


def lost(database: Path, tallies: list[Tally]) -> list[str]:
    """What is wrong afterwards, in sentences; empty where nothing is."""
    faults = [f"{tally.kind} was refused: {fault}" for tally in tallies for fault in tally.refused]
    with Database(database, read_only=True) as db:
        present = [row.campaign for row in list_campaigns(db)]
        faults += verify_audit(db).faults
    faults += [f"{name} is there twice" for name in {name for name in present if present.count(name) > 1}]
    acknowledged = {name for tally in tallies for name in tally.acknowledged}
    faults += [f"{name} was acknowledged and is lost" for name in acknowledged - set(present)]
    return faults


def _spread(seconds: list[float]) -> dict[str, float]:
    """Return median, 95 % point and the longest of some times, in s; nothing of none."""
    if not seconds:
        return {}
    ordered = sorted(seconds)
    return {
        "median": round(ordered[len(ordered) // 2], 3),
        "95 %": round(ordered[int(0.95 * len(ordered))], 3),
        "longest": round(ordered[-1], 3),
    }


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seconds", type=float, default=600)
    options.add_argument("--importers", type=int, default=8)
    options.add_argument("--readers", type=int, default=20)
    options.add_argument(
        "--pause", type=float, default=1.0, help="seconds between two questions of one, on average"
    )
    options.add_argument(
        "--least", type=int, default=1, help="questions of each at least, whatever the seconds"
    )
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory() as room:
        database = Path(room) / "shop.duckdb"
        # In a process of its own: a database engine that was open is not forked.
        first = multiprocessing.get_context("fork").Process(target=_begin, args=(database,))
        first.start()
        first.join()
        load = Load(chosen.seconds, chosen.least, chosen.pause)
        tallies = trial(database, chosen.importers, chosen.readers, load, EXAMPLE)
        faults = lost(database, tallies)
        size_mb = database.stat().st_size / 1e6
    for kind in ("importer", "reader"):
        those = [tally for tally in tallies if tally.kind == kind]
        print(
            json.dumps(
                {
                    "kind": kind,
                    "processes": len(those),
                    "answered": sum(tally.answered for tally in those),
                    "refused": sum(len(tally.refused) for tally in those),
                    "waits_s": _spread([wait for tally in those for wait in tally.waits_s]),
                    "held_to_write_s": _spread([hold for tally in those for hold in tally.holds_s]),
                    "longest_wait_s": round(max((tally.longest_wait_s for tally in those), default=0.0), 2),
                    "longest_question_s": round(
                        max((tally.longest_question_s for tally in those), default=0.0), 2
                    ),
                }
            )
        )
    print(f"{len(faults)} faults; the database has {size_mb:.1f} MB")
    for fault in faults[:20]:
        print(f"  {fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
