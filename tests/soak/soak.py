"""A shop for an hour: imports, identifications, certificates, reports, questions, pages, publishing and kills together.

``python tests/soak/soak.py --minutes 60``: three times, commands first share the file, ``--at-once`` of them, a third
of which is killed at a moment of processor time that the seed draws; then a server has it for four times as long, pages
are opened and the same commands ask the server, which is killed at the end. After each part everything that was
acknowledged has to be there once, ``verify`` to agree, and the lake to hold what was published. Memory of the server
and the size of the file are printed as they were on the way.
"""

from __future__ import annotations

import argparse
import http.client
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from concurrency import EXAMPLE, _folder
from dying import KILLED, Child, Death, forked, started
from kills import LABORATORY, compute_once, lake_faults, load_everything, typed

from monitor.store import Database, list_campaigns, verify_audit

#: How often each verb is typed beside the others, while commands share the file and while a server has it. What a
#: server refuses is not asked of it.
FILE = {"import": 6, "identify": 3, "event": 3, "certificate": 1, "report": 1, "publish": 2, "backup": 1, "trend": 3,
        "fleet": 3, "runs": 2, "compare": 1, "sql": 2, "audit": 1}  # fmt: skip
SERVED = {name: weight for name, weight in FILE.items() if name not in ("publish", "backup", "report")}
PAGES = ("/", "/campaigns", "/machine?name=HU40-T", "/machine?name=HU40-T&parameter=EB0C", "/certificates",
         "/audit", "/campaign?name=cold-cold")  # fmt: skip
#: Longest moment of a death, in s of processor time: most verbs take less.
_LONGEST_LIFE_S = 1.0
_LOOK_S = 0.1


@dataclass
class Shop:
    """Where everything lies, what was acknowledged, and what happened, by verb."""

    room: Path
    generator: random.Random
    campaigns: list[str] = field(default_factory=lambda: ["cold-cold"])
    tries: Counter[str] = field(default_factory=Counter)
    kills: Counter[str] = field(default_factory=Counter)
    pages: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    #: (seconds since the start, campaigns, MB of the file).
    sizes: list[tuple[float, int, float]] = field(default_factory=list)

    @property
    def database(self) -> Path:
        return self.room / "shop.duckdb"

    def words(self, name: str, number: int) -> list[str]:
        """What is typed for a verb; an import gets a folder of its own."""
        if name == "import":
            folder = self.room / "folders" / f"campaign-{number}"
            _folder(EXAMPLE, folder, folder.name)
            arguments = ["import", str(folder)]
        else:
            campaign = self.generator.choice(self.campaigns)
            out = str(self.room / "out")
            arguments = {
                "identify": ["identify", campaign],
                "event": ["event", "HU40-T", f"note {number}", "--at", "2026-03-05T07:00:00Z", "--kind", "note"],
                "certificate": [
                    "certificate", "issue", campaign, "--run", "1", "--laboratory", str(LABORATORY), "--out", out,
                ],
                "report": ["report", "--week", "2026-W08", "--out", str(self.room / "reports" / str(number))],
                "publish": [
                    "publish", "--to", f"ducklake:{self.room}/shops.ducklake", "--files", str(self.room / "files"),
                ],
                "backup": ["backup", str(self.room / "kept" / f"{number}.duckdb"), "--incremental"],
                "trend": ["trend", "HU40-T", "--parameter", "EB0C"],
                "fleet": ["fleet"],
                "runs": ["runs", campaign],
                "compare": ["compare", campaign],
                "sql": ["sql", "SELECT count(*) FROM v_parameters"],
                "audit": ["audit", "--check"],
            }[name]  # fmt: skip
        return ["--db", str(self.database), *arguments]


@dataclass(frozen=True)
class Verb:
    """A verb under way: which, and the campaign that it imports."""

    name: str
    number: int
    child: Child


def work(shop: Shop, weights: dict[str, int], seconds: float, at_once: int, kill_share: float) -> None:
    """Type verbs, some at once, for so long; what each said is judged when it ends."""
    end = time.monotonic() + seconds
    running: list[Verb] = []
    while running or time.monotonic() < end:
        while len(running) < at_once and time.monotonic() < end:
            name = shop.generator.choices(list(weights), list(weights.values()))[0]
            number = sum(shop.tries.values())
            shop.tries[name] += 1
            death = None
            if shop.generator.random() < kill_share:
                death = Death(processor_s=shop.generator.uniform(0.001, _LONGEST_LIFE_S))
            running.append(Verb(name, number, started(partial(typed, shop.words(name, number)), death)))
        for verb in running:
            if os.waitid(os.P_PID, verb.child.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None:
                _judge(shop, verb)
        running = [verb for verb in running if Path(f"/proc/{verb.child.pid}").exists()]
        time.sleep(_LOOK_S)


def _judge(shop: Shop, verb: Verb) -> None:
    status, said, _ = verb.child.ended()
    if status in KILLED:
        shop.kills[verb.name] += 1
    elif status not in (0, 1):
        # A backup that another one overtook, and a campaign without an identification, are refused in words.
        shop.wrong.append(f"{verb.name} {verb.number}: {status} {said.strip()[-300:]}")
    elif verb.name == "import":
        shop.campaigns.append(f"campaign-{verb.number}")


def look(port: int, seconds: float, pause_s: float) -> tuple[int, str]:
    """Open pages one after the other; how many there were of each status."""
    seen: Counter[str] = Counter()
    longest, end = 0.0, time.monotonic() + seconds
    while time.monotonic() < end:
        for path in PAGES:
            begin = time.monotonic()
            try:
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
                connection.request("GET", path)
                answer = connection.getresponse()
                answer.read()
                seen[str(answer.status) if answer.status == 200 else f"{answer.status} {path}"] += 1
                connection.close()
            except OSError as fault:
                seen[f"{type(fault).__name__} {path}"] += 1
            longest = max(longest, time.monotonic() - begin)
            time.sleep(pause_s)
    return 0, "\n".join(f"{count} {what}" for what, count in seen.items()) + f"\n0 longest {longest:.2f} s"


@contextmanager
def served(database: Path, *, killed: bool) -> Iterator[tuple[int, int]]:
    """A server in a process of its own; yields its port and number. It is killed at the end, or asked to stop."""
    command = [sys.executable, "-m", "monitor", "--db", str(database), "serve", "--port", "0"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    try:
        yield int(server.stdout.readline().split("/ ;")[0].rpartition(":")[2]), server.pid
    finally:
        server.send_signal(signal.SIGKILL if killed else signal.SIGTERM)
        server.communicate()


def remembering(pid: int, seconds: float) -> tuple[int, str]:
    """Note the memory of a process every few seconds: lines of seconds and MB."""
    lines, begin = [], time.monotonic()
    while time.monotonic() - begin < seconds:
        status = Path(f"/proc/{pid}/status").read_text()
        resident = re.search(r"VmRSS:\s+(\d+) kB", status)
        assert resident is not None
        lines.append(f"{time.monotonic() - begin:.0f} {int(resident[1]) / 1e3:.0f}")
        time.sleep(max(seconds / 60, 1.0))
    return 0, "\n".join(lines)


def check(shop: Shop) -> tuple[int, str]:
    """What is wrong with the database, in sentences; run in a process of its own."""
    faults = []
    with Database(shop.database, threads=1) as db:
        faults += verify_audit(db).faults
        present = Counter(row.campaign for row in list_campaigns(db))
        faults += [
            f"{name} was acknowledged and is there {present[name]} times"
            for name in shop.campaigns
            if present[name] != 1
        ]
        states = db.rows(
            "SELECT number, count(*) FROM certificate WHERE state = 'issued' GROUP BY ALL HAVING count(*) > 1"
        )
        faults += [f"certificate {number} was issued {count} times" for number, count in states]
    return 0, "\0".join([str(len(present)), *faults])


def trial(minutes: float, seed: int, at_once: int) -> Shop:
    """Let everything work for so long, three times in turn."""
    load_everything()
    with tempfile.TemporaryDirectory() as folder:
        compute_once(Path(folder) / "computed")
        shop = Shop(Path(folder), random.Random(seed))
        for name in ("folders", "out", "reports", "kept"):
            (shop.room / name).mkdir()
        base = ["--db", str(shop.database)]
        for words in (
            ["import", str(EXAMPLE)],
            ["identify"],
            ["backup", str(shop.room / "kept" / "full.duckdb")],
        ):
            status, said, _ = forked(partial(typed, [*base, *words]))
            assert status == 0, said
        begin, part_s = time.monotonic(), 60 * minutes / 15
        for turn in range(3):
            work(shop, FILE, part_s, at_once, 1 / 3)
            _after(shop, f"{turn + 1}: commands at the file", begin)
            with served(shop.database, killed=turn != 2) as (port, pid):
                beside = [
                    started(partial(look, port, 4 * part_s, 0.5)),
                    started(partial(look, port, 4 * part_s, 1.0)),
                ]
                memory = started(partial(remembering, pid, 4 * part_s))
                work(shop, SERVED, 4 * part_s, max(at_once // 2, 1), 0.1)
                for child in beside:
                    for line in child.ended()[1].splitlines():
                        count, _, what = line.partition(" ")
                        shop.pages[what] += int(count)
                lines = memory.ended()[1].splitlines()
            print(
                "  memory of the server, s and MB: " + ", ".join(lines[:: max(len(lines) // 12, 1)]),
                flush=True,
            )
            _after(shop, f"{turn + 1}: a server", begin)
        status, said, _ = forked(partial(typed, shop.words("publish", 0)))
        shop.wrong += [] if status == 0 else [f"the last publication: {status} {said}"]
        status, said, _ = forked(lambda: (0, "\0".join(lake_faults(shop.room))))
        shop.wrong += [fault for fault in said.split("\0") if fault]
        took = time.monotonic() - begin
        left = sorted(path.name for path in shop.room.glob("shop.duckdb*"))
        print(f"{took / 60:.1f} minutes; beside the database: {', '.join(left)}")
    return shop


def _after(shop: Shop, part: str, begin: float) -> None:
    _, said, _ = forked(partial(check, shop))
    count, *faults = said.split("\0")
    present = int(count)
    shop.wrong += [f"{part}: {fault}" for fault in faults]
    size = shop.database.stat().st_size / 1e6
    shop.sizes.append((time.monotonic() - begin, present, size))
    print(
        f"{part}: {shop.sizes[-1][0] / 60:.1f} min, {present} campaigns, {size:.1f} MB, "
        f"{sum(shop.tries.values())} verbs, {sum(shop.kills.values())} killed, {len(shop.wrong)} faults",
        flush=True,
    )


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--minutes", type=float, default=60)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--at-once", type=int, default=4, help="commands that share the file")
    chosen = options.parse_args()
    shop = trial(chosen.minutes, chosen.seed, chosen.at_once)
    for name, count in sorted(shop.tries.items()):
        print(f"{name:<12} {count:>6} typed, {shop.kills[name]} killed")
    print("pages: " + ", ".join(f"{count} {what}" if count else what for what, count in shop.pages.items()))
    (_, first, small), (_, last, large) = shop.sizes[0], shop.sizes[-1]
    print(f"{1e3 * (large - small) / max(last - first, 1):.0f} kB a campaign; {len(shop.wrong)} faults")
    for fault in shop.wrong[:20]:
        print(f"  {fault}")
    return 1 if shop.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
