"""Verbs killed at random moments: afterwards everything is whole or absent, and the same verb goes through.

``python tests/soak/kills.py --kills 500``: every kill has a seed of its own, from which its verb, its moment and
nothing else follow (``dying.py``). A verb runs in a process forked from one that has loaded everything and keeps what
was computed and laid out before, so that the moments fall on what it stores.
"""

from __future__ import annotations

import argparse
import gzip
import importlib
import io
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from datetime import date
from functools import cache, partial
from pathlib import Path

from dying import KILLED, Effort, drawn, forked, loaded

import monitor.workflow.certificate.issue as issuing
from monitor.cli import main as verb
from monitor.store import Database, list_backups, schema, verify_audit
from monitor.store.entries import SOURCES
from monitor.store.lake.reading import LakeDatabase
from monitor.workflow.contract import QUESTIONS

CHECKOUT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(CHECKOUT / "tests"))
from computed_once import COMPUTED_ONCE, FOLDER, computed_once  # noqa: E402

EXAMPLES = CHECKOUT / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"
#: What a reader says of a campaign that was withdrawn, and of the fleet of which it was the only one.
WITHDRAWN = ("it was withdrawn on", "no campaign was identified yet")
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
        "publish": [*database, *_publishing(room, NEW_LAKE)],
        "publish again": [*database, *_publishing(room, KNOWN_LAKE)],
    }[name]


VERBS = (
    "import", "identify", "uncertainty", "issue", "amend", "withdraw certificate", "withdraw", "report", "migration",
    "backup", "incremental backup", "restore", "restore at", "archive", "compact", "export", "publish", "publish again",
)  # fmt: skip

#: Of a lake that is not there yet, and of one that holds what was published before.
NEW_LAKE, KNOWN_LAKE = "shops.ducklake", "known.ducklake"
#: The lakes that verbs publish to.
LAKES = {"publish": NEW_LAKE, "publish again": KNOWN_LAKE}


def _publishing(room: Path, lake: str) -> list[str]:
    return ["publish", "--to", f"ducklake:{room}/{lake}", "--files", str(room / f"files of {lake}")]


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


def faults_after(name: str, room: Path, reader: list[str]) -> list[str]:
    """What is wrong after a kill, in sentences; run in a process of its own, since it opens the database.

    ``reader`` is the verb that comes first: what DuckDB recovers, it recovers in that session.
    """
    faults = []
    if name == "publish again":
        # A reader of the lake is the first to open its catalogue.
        first, said = typed(["--db", f"ducklake:{room}/{KNOWN_LAKE}", "campaigns"])
        faults += [] if first == 0 else [f"campaigns of the lake: {first} {said}"]
    databases = [room / "shop.duckdb", *(path for path in (room / "again.duckdb",) if path.exists())]
    for path in [*databases, *([room / "old.duckdb"] if name == "migration" else [])]:
        # A reader comes first, as it may: what it sees is whole, too.
        first, said = typed(["--db", str(path), *reader])
        # The copy of the first release has other campaigns, and the only one may be withdrawn by now: status 2.
        gone = path.name == "old.duckdb" or (name == "withdraw" and any(words in said for words in WITHDRAWN))
        if first not in (0, 1) and not (gone and first == 2):
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
    if name in LAKES and again == 0:
        faults += lake_faults(room, LAKES[name])
    if again != 0 and not (again == 2 and name in DONE_BEFORE and _was_done(name, room, said)):
        faults.append(f"the same verb again: {again} {said}")
    left = sorted(
        path.name
        for path in room.rglob("*")
        if path.name.endswith((".part", ".partial", ".new", ".blocks"))
        # A transaction that changed nothing leaves an empty log, which is none.
        or (path.name.endswith(".wal") and path.stat().st_size)
    )
    if left and name not in ("amend", "report"):
        faults.append(f"left behind: {', '.join(left)}")
    return faults


def lake_faults(room: Path, name: str = NEW_LAKE) -> list[str]:
    """What a lake holds more or less of than the database that was published."""
    with (
        LakeDatabase(f"ducklake:{room}/{name}") as lake,
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


def prepare(room: Path) -> tuple[int, str]:
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
        [*base, *_publishing(room, KNOWN_LAKE)],
        [*base, "event", "HU40-T", "a crash", "--at", "2026-03-05T07:00:00Z"],
        [*base, "backup", str(room / "kept" / "second.duckdb"), "--incremental"],
        [*base, "event", "HU40-T", "a repair", "--at", "2026-03-06T07:00:00Z"],
    )
    for words in steps:
        status, said = typed(words)
        if status:
            return status, said
    archive = CHECKOUT / "tests" / "archives" / "monitor-0.1.0.duckdb.gz"
    (room / "old.duckdb").write_bytes(gzip.decompress(archive.read_bytes()))
    return 0, ""


def load_everything() -> None:
    """Load and warm up, once and before any fork, what verbs need: the moments of the kills are to fall on the work."""
    # Certificates of a fixed day; the moment it is computed on is nobody's concern here.
    issuing.today = lambda: date(2027, 6, 1)
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


def compute_once(folder: Path) -> None:
    """Compute and lay out once what equal questions ask again: what is tried is the store, not the solver."""
    FOLDER.append(folder)
    folder.mkdir()
    for names in COMPUTED_ONCE:
        module, _, attribute = names[0].rpartition(".")
        function = computed_once(names[0], getattr(importlib.import_module(module), attribute))
        for name in names:
            module, _, attribute = name.rpartition(".")
            setattr(importlib.import_module(module), attribute, function)
    # What each look at a database compares its schema with.
    expected = computed_once("monitor.store.schema._expected", schema._expected.__wrapped__)
    schema._expected = cache(expected)


@dataclass
class Result:
    """How often each verb was tried and hit before its end, by which kind of death, and what was wrong afterwards."""

    tries: Counter[str] = field(default_factory=Counter)
    hits: Counter[str] = field(default_factory=Counter)
    deaths: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)


def trial(kills: int, first_seed: int = 0, verbs: tuple[str, ...] = VERBS, minutes: float = 1e9) -> Result:
    """Kill so many verbs, in turn, for so many minutes at most."""
    end = time.monotonic() + 60 * minutes
    load_everything()
    result = Result()
    efforts: dict[str, Effort] = {}
    with tempfile.TemporaryDirectory() as folder:
        compute_once(Path(folder) / "computed")
        prepared, room = Path(folder) / "prepared", Path(folder) / "room"
        # Made where each trial has its copy: a lake keeps the address of its files.
        status, said, _ = forked(lambda: prepare(room))
        assert status == 0, said
        shutil.move(room, prepared)
        for seed in range(first_seed, first_seed + kills):
            if time.monotonic() > end:
                break
            name = verbs[seed % len(verbs)]
            # The readers go on by one with every round of the verbs, so that each meets each.
            reader = READERS[(seed + seed // len(verbs)) % len(READERS)]
            if name not in efforts:
                # The first time computes what is kept; the second is the effort of those that follow.
                for _ in range(2):
                    shutil.copytree(prepared, room)
                    status, said, efforts[name] = forked(partial(typed, arguments(name, room)))
                    assert status == 0, (name, said)
                    shutil.rmtree(room)
            shutil.copytree(prepared, room)
            death = drawn(efforts[name], random.Random(seed))
            status, said, _ = forked(partial(typed, arguments(name, room)), death)
            result.tries[name] += 1
            result.hits[name] += status in KILLED
            if status in KILLED:
                result.deaths["torn" if death.torn else "call" if death.call else "time"] += 1
            print(
                f"seed {seed}, {name}, {death} of {efforts[name]}: {status}, then {reader[0]}",
                file=sys.stderr,
                flush=True,
            )
            faults = [] if status in (0, *KILLED) else [f"killed, it said: {said}"]
            status, said, _ = forked(partial(_faults_as_text, name, room, reader))
            faults += said.split("\0") if said else []
            faults += [f"the look at it ended with {status}"] if status and not said else []
            for fault in faults:
                result.wrong.append(f"seed {seed}, {name}: {fault}")
                print(f"  {result.wrong[-1]}", file=sys.stderr, flush=True)
            shutil.rmtree(room)
    return result


def _faults_as_text(name: str, room: Path, reader: list[str]) -> tuple[int, str]:
    faults = faults_after(name, room, reader)
    return len(faults) > 0, "\0".join(faults)


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--kills", type=int, default=500)
    options.add_argument("--first-seed", type=int, default=0)
    options.add_argument("--verbs", default=",".join(VERBS), help="which, with commas between them")
    options.add_argument("--minutes", type=float, default=1e9, help="end earlier, after so many minutes")
    chosen = options.parse_args()
    verbs = tuple(chosen.verbs.split(","))
    if not loaded():
        print("no C compiler: all kills at a moment of processor time", file=sys.stderr)
    result = trial(chosen.kills, chosen.first_seed, verbs, chosen.minutes)
    for name in verbs:
        print(f"{name:<22} {result.hits[name]} of {result.tries[name]} killed before its end")
    print(
        f"{sum(result.hits.values())} of {sum(result.tries.values())} killed, from seed {chosen.first_seed}: "
        f"{result.deaths['call']} before a change of a file, {result.deaths['torn']} in the middle of one, "
        f"{result.deaths['time']} at a time; {len(result.wrong)} faults"
    )
    for fault in result.wrong:
        print(f"  {fault}")
    return 1 if result.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
