"""Verbs killed at random moments: afterwards everything is whole or absent, and the same verb goes through.

``python tests/soak/kills.py --kills 500``: every kill has a seed of its own, from which its verb, its moment and
nothing else follow. A verb runs in a forked process, so that the moments fall on its work and not on the start of
Python.
"""

from __future__ import annotations

import argparse
import gzip
import importlib
import io
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from datetime import date
from pathlib import Path

import monitor.workflow.certificate.issue as issuing
from monitor.cli import main as verb
from monitor.store import Database, list_backups, verify_audit
from monitor.store.entries import SOURCES
from monitor.store.lake.reading import LakeDatabase
from monitor.workflow.contract import QUESTIONS

CHECKOUT = Path(__file__).resolve().parents[2]
EXAMPLES = CHECKOUT / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"
#: Of what follows each kill: a verb that was killed late may have done its work, and says so with status 2.
DONE_BEFORE = (
    "withdraw", "restore", "restore at", "backup", "incremental backup", "export", "amend", "withdraw certificate",
)  # fmt: skip


def arguments(name: str, room: Path) -> list[str]:
    """What is typed for a verb, on the files of a folder."""
    database, out = ["--db", str(room / "shop.duckdb"), "--wait", "30"], str(room / "out")
    issued = ["--laboratory", str(LABORATORY), "--out", out]
    return {
        "import": [*database, "import", str(EXAMPLES / "five-days"), str(EXAMPLES / "hot-cold")],
        "identify": [*database, "identify", "cold-cold"],
        "uncertainty": [*database, "uncertainty", "cold-cold", "--run", "2", "--method", "guf"],
        "issue": [*database, "certificate", "issue", "cold-cold", "--run", "2", *issued],
        "amend": [*database, "certificate", "amend", "2027-0001", "--reason", "wrong customer", *issued],
        "withdraw certificate": [*database, "certificate", "withdraw", "2027-0001", "--reason", "the bar"],
        "withdraw": [*database, "withdraw", "cold-cold", "--reason", "wrong balls"],
        "report": [*database, "report", "--week", "2026-W08", "--out", out],
        "migration": ["--db", str(room / "old.duckdb"), "campaigns"],
        "backup": [*database, "backup", str(room / "copy.duckdb")],
        "incremental backup": [*database, "backup", str(room / "kept" / "next.duckdb"), "--incremental"],
        "restore": ["--db", str(room / "again.duckdb"), "restore", str(room / "kept" / "full.duckdb")],
        "restore at": [
            "--db",
            str(room / "again.duckdb"),
            "restore",
            str(room / "kept"),
            "--at",
            _moment(room),
        ],
        "archive": [*database, "archive", str(room / "archive"), "--before", "2999-01-01"],
        "compact": [*database, "compact"],
        "export": [*database, "export", str(room / "exported")],
        "publish": [
            *database,
            "publish",
            "--to",
            f"ducklake:{room}/shops.ducklake",
            "--files",
            str(room / "files"),
        ],
    }[name]


VERBS = (
    "import", "identify", "uncertainty", "issue", "amend", "withdraw certificate", "withdraw", "report", "migration",
    "backup", "incremental backup", "restore", "restore at", "archive", "compact", "export", "publish",
)  # fmt: skip


#: The verbs of which one comes first after each kill, in turn.
READERS = (
    ["campaigns"], ["verify"], ["runs", "cold-cold"], ["audit", "--check"], ["trend", "HU40-T"], ["fleet"],
    ["stats", "cold-cold"], ["model", "list"], ["certificate", "show"], ["event", "HU40-T"], ["select", "cold-cold"],
    ["sql", "SELECT count(*) FROM v_parameters"], ["compare", "cold-cold"],
)  # fmt: skip


def _moment(room: Path) -> str:
    """The moment of the full backup, before what followed it."""
    return str(list_backups(room / "kept")[0].made_at)[:19] + "Z"


def typed(words: list[str]) -> tuple[int, str]:
    """Run a verb in this process; its status and what it said."""
    said = io.StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        try:
            status = verb(words)
        except SystemExit as ended:
            status = int(ended.code or 0)
    return status, said.getvalue()


def forked(words: list[str], after_s: float | None = None) -> tuple[int, str, float]:
    """Run a verb in a process of its own, killed after so long; status (-9 where it was killed), words, duration."""
    reader, writer = os.pipe()
    begin = time.monotonic()
    pid = os.fork()
    if pid == 0:
        os.close(reader)
        status, said = typed(words)
        os.write(writer, said.encode()[-4000:])
        os._exit(status)
    os.close(writer)
    if after_s is not None:
        time.sleep(after_s)
        os.kill(pid, signal.SIGKILL)
    with os.fdopen(reader, "rb") as words_of_child:
        said = words_of_child.read().decode(errors="replace")
    _, ended = os.waitpid(pid, 0)
    return os.waitstatus_to_exitcode(ended), said, time.monotonic() - begin


def faults_after(name: str, room: Path, reader: list[str]) -> list[str]:
    """What is wrong after a kill, in sentences; run in a process of its own, since it opens the database.

    ``reader`` is the verb that comes first: what DuckDB recovers, it recovers in that session.
    """
    faults = []
    databases = [room / "shop.duckdb", *(path for path in (room / "again.duckdb",) if path.exists())]
    for path in [*databases, *([room / "old.duckdb"] if name == "migration" else [])]:
        # A reader comes first, as it may: what it sees is whole, too.
        first, said = typed(["--db", str(path), *reader])
        # The copy of the first release has other campaigns: what is not there is said with status 2.
        if first not in (0, 1) and not (path.name == "old.duckdb" and first == 2):
            faults.append(f"{reader[0]}: {first} {said}")
        with Database(path) as db:
            faults += verify_audit(db).faults
            states = db.rows("SELECT number, count(*) FROM certificate WHERE state = 'issued' GROUP BY ALL")
            faults += [
                f"certificate {number} was issued {count} times" for number, count in states if count != 1
            ]
            known = {str(number) for (number,) in db.rows("SELECT DISTINCT number FROM certificate")}
        for file in (room / "out").glob("certificate-*.pdf"):
            if path.name == "shop.duckdb" and file.stem.removeprefix("certificate-") not in known:
                faults.append(f"{file.name} is no certificate of the database")
            if not file.read_bytes().rstrip().endswith(b"%%EOF"):
                faults.append(f"{file.name} is half a file")
    again, said = typed(arguments(name, room))
    if name == "publish" and again == 0:
        faults += lake_faults(room)
    if again != 0 and not (again == 2 and name in DONE_BEFORE and _was_done(name, room, said)):
        faults.append(f"the same verb again: {again} {said}")
    left = sorted(
        path.name
        for path in room.rglob("*")
        if path.name.endswith((".part", ".partial", ".new"))
        # A transaction that changed nothing leaves an empty log, which is none.
        or (path.name.endswith(".wal") and path.stat().st_size)
    )
    if left and name not in ("amend", "report"):
        faults.append(f"left behind: {', '.join(left)}")
    return faults


def lake_faults(room: Path) -> list[str]:
    """What a lake holds more or less of than the database that was published."""
    with (
        LakeDatabase(f"ducklake:{room}/shops.ducklake") as lake,
        Database(room / "shop.duckdb", read_only=True) as db,
    ):
        return [
            f"the lake has {lake.rows(count)} rows of {table}, the database {db.rows(count)}"
            for table in SOURCES
            if lake.rows(count := f"SELECT count(*) FROM {table}") != db.rows(count)
        ]


def _was_done(name: str, room: Path, said: str) -> bool:
    made = {
        "restore": "again.duckdb",
        "restore at": "again.duckdb",
        "backup": "copy.duckdb",
        "incremental backup": "kept/next.duckdb",
        "export": "exported",
    }.get(name)
    if made is not None:
        return (room / made).exists()
    return "withdrawn" in said or "amended" in said


def prepare(room: Path) -> None:
    """A database with a campaign, an identification, two certificates; a backup of it, and one of the first release."""
    (room / "kept").mkdir(parents=True)
    base = ["--db", str(room / "shop.duckdb")]
    issue = [
        *base,
        "certificate",
        "issue",
        "cold-cold",
        "--laboratory",
        str(LABORATORY),
        "--out",
        str(room / "out"),
    ]
    steps = (
        [*base, "import", str(EXAMPLES / "cold-cold")],
        [*base, "identify"],
        [*issue, "--run", "1"],
        [*base, "backup", str(room / "kept" / "full.duckdb")],
        [*base, "event", "HU40-T", "a crash", "--at", "2026-03-05T07:00:00Z"],
        [*base, "backup", str(room / "kept" / "second.duckdb"), "--incremental"],
        [*base, "event", "HU40-T", "a repair", "--at", "2026-03-06T07:00:00Z"],
    )
    for words in steps:
        status, said = typed(words)
        assert status == 0, said
    archive = CHECKOUT / "tests" / "archives" / "monitor-0.1.0.duckdb.gz"
    (room / "old.duckdb").write_bytes(gzip.decompress(archive.read_bytes()))


def trial(
    kills: int, first_seed: int = 0, verbs: tuple[str, ...] = VERBS, minutes: float = 1e9
) -> tuple[Counter[str], Counter[str], list[str]]:
    """Kill so many verbs, in turn, for so many minutes at most.

    Returns how often each was tried, how often it was hit before its end, and what was wrong afterwards.
    """
    end = time.monotonic() + 60 * minutes
    # Certificates of a fixed day; the moment it is computed on is nobody's concern here.
    issuing.today = lambda: date(2027, 6, 1)
    # Loaded once, here: the moments of the kills are to fall on the work.
    for question in QUESTIONS.values():
        question.load()
    for name in (
        "weasyprint",
        "matplotlib.backends.backend_svg",
        "jinja2",
        "scipy.optimize",
        "scipy.stats",
        "pandas",
    ):
        importlib.import_module(name)
    tries: Counter[str] = Counter()
    hits: Counter[str] = Counter()
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        prepared = Path(folder) / "prepared"
        pid = os.fork()
        if pid == 0:
            prepare(prepared)
            os._exit(0)
        assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
        durations: dict[str, float] = {}
        for seed in range(first_seed, first_seed + kills):
            if time.monotonic() > end:
                break
            name = verbs[seed % len(verbs)]
            # The readers go on by one with every round of the verbs, so that each meets each.
            reader = READERS[(seed + seed // len(verbs)) % len(READERS)]
            room = Path(folder) / f"room-{seed}"
            shutil.copytree(prepared, room)
            if name not in durations:
                status, said, durations[name] = forked(arguments(name, room))
                assert status == 0, (name, said)
                shutil.rmtree(room)
                shutil.copytree(prepared, room)
            place = random.Random(seed)
            # Half of them towards the end, where it is written.
            share = place.uniform(0.0, 1.0) if place.random() < 0.5 else place.uniform(0.6, 1.1)
            status, _, lasted = forked(arguments(name, room), share * durations[name])
            tries[name] += 1
            hits[name] += status == -signal.SIGKILL
            print(
                f"seed {seed}, {name}, {share:.2f} of {durations[name]:.2f} s: {status}, then {reader[0]}",
                file=sys.stderr,
                flush=True,
            )
            if status != -signal.SIGKILL:
                # It ended earlier than when the machine was busier: the next moments fall within the shorter time.
                durations[name] = min(durations[name], lasted)
            for fault in _in_own_process(name, room, reader):
                wrong.append(f"seed {seed}, {name}: {fault}")
                print(f"  {wrong[-1]}", file=sys.stderr, flush=True)
            shutil.rmtree(room)
    return tries, hits, wrong


def _in_own_process(name: str, room: Path, first: list[str]) -> list[str]:
    reader, writer = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(reader)
        try:
            faults = faults_after(name, room, first)
        except BaseException as error:
            faults = [f"{type(error).__name__}: {error}"]
        os.write(writer, "\0".join(faults).encode()[:60000])
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as stream:
        text = stream.read().decode(errors="replace")
    os.waitpid(pid, 0)
    return text.split("\0") if text else []


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--kills", type=int, default=500)
    options.add_argument("--first-seed", type=int, default=0)
    options.add_argument("--verbs", default=",".join(VERBS), help="which, with commas between them")
    options.add_argument("--minutes", type=float, default=1e9, help="end earlier, after so many minutes")
    chosen = options.parse_args()
    verbs = tuple(chosen.verbs.split(","))
    tries, hits, wrong = trial(chosen.kills, chosen.first_seed, verbs, chosen.minutes)
    for name in verbs:
        print(f"{name:<22} {hits[name]} of {tries[name]} killed before its end")
    print(
        f"{sum(hits.values())} of {sum(tries.values())} killed, from seed {chosen.first_seed}; {len(wrong)} faults"
    )
    for fault in wrong:
        print(f"  {fault}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
