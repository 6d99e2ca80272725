"""Many plants publish to one lake at once, some killed in the middle; then everything is there, and nothing twice.

``python tests/soak/lake.py --plants 20 --campaigns 20 --kills 40``: a PostgreSQL of its own (Debian's, or another whose
``initdb`` is on the path) is the catalogue, the Parquet files lie beside it. Every plant is a database file, every
publication a process. What the lake holds afterwards is compared with the plants, table by table, and the table of the
fleet with that of one file that has all campaigns, in answers and in time.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from monitor.readers import read_campaign
from monitor.records import Campaign, SourceFile
from monitor.store import (
    Database,
    StoredIdentification,
    import_campaign,
    load_identification,
    save_identification,
)
from monitor.store.entries import OTHERWISE, SOURCES
from monitor.store.lake.reading import LakeDatabase
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest

CHECKOUT = Path(__file__).resolve().parents[2]
#: Tables with a key of one column, which a lake does not enforce.
_KEYS = (("imported_campaign", "campaign_id"), ("audit", "entry"), ("identification", "identification_id"))


@contextmanager
def postgres(folder: Path) -> Iterator[str]:
    """Run a PostgreSQL that listens on a socket in the folder alone; the address of a lake in it."""
    known = sorted(Path("/usr/lib/postgresql").glob("*/bin"))
    programs = Path(shutil.which("initdb") or (known[-1] / "initdb" if known else "initdb")).resolve().parent
    # PostgreSQL does not run as root.
    user = ["setpriv", "--reuid=postgres", "--regid=postgres", "--clear-groups"] if os.geteuid() == 0 else []
    if user:
        shutil.chown(folder, "postgres", "postgres")
    data = folder / "data"
    quiet = {"check": True, "stdout": subprocess.DEVNULL, "cwd": folder}
    subprocess.run([*user, programs / "initdb", "-D", data, "-A", "trust", "-U", "lake"], **quiet)
    options = f"-k {folder} -c listen_addresses='' -c max_connections=200"
    control = [*user, programs / "pg_ctl", "-D", data, "-w", "-l", folder / "log"]
    subprocess.run([*control, "-o", options, "start"], **quiet)
    try:
        subprocess.run([*user, programs / "createdb", "-h", folder, "-U", "lake", "lake"], **quiet)
        yield f"ducklake:postgres:host={folder} user=lake dbname=lake"
    finally:
        subprocess.run([*control, "-m", "fast", "stop"], **quiet)


def source() -> tuple[Campaign, StoredIdentification]:
    """A campaign and its identification, of which all others are copies under other names."""
    campaign = read_campaign(CHECKOUT / "examples" / "cold-cold")
    with Database(":memory:", threads=1) as db:
        import_campaign(db, campaign)
        identify(db, IdentifyRequest(campaign.name))
        return campaign, load_identification(db, campaign.name)


def fill(paths: list[Path], names: list[str], campaign: Campaign, identified: StoredIdentification) -> None:
    """Store campaigns of these names, each of a machine named by what stands before the blank, in every file."""
    for path in paths:
        with Database(path) as db:
            for number, name in enumerate(names):
                machine = replace(campaign.machine, id=name.partition(" ")[0])
                runs = tuple(
                    replace(run, started_at=run.started_at.replace(year=2016 + number % 10))
                    for run in campaign.runs
                )
                files = (SourceFile("campaign.toml", name.encode()),)
                import_campaign(db, replace(campaign, name=name, machine=machine, runs=runs, files=files))
                save_identification(db, replace(identified, campaign=name))


def publishing(path: Path, address: str, files: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "monitor", "--db", path, "publish", "--to", address, "--files", files],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


def counted(db: Database) -> dict[str, int]:
    return {
        table: int(db.rows(f'SELECT count(*) FROM "{table}"')[0][0])
        for table in sorted({*SOURCES, *OTHERWISE} - {"model", "schema_migration"})
    }


def trial(plants: int, campaigns: int, kills: int, seed: int, folder: Path) -> list[str]:
    """Publish all plants at once, killing some processes; what is wrong afterwards, in sentences."""
    rng = random.Random(seed)
    campaign, identified = source()
    paths = [folder / f"plant-{number:02d}.duckdb" for number in range(plants)]
    for number, path in enumerate(paths):
        names = [f"M{number}-{index % 4} week {index}" for index in range(campaigns)]
        fill([path, folder / "one.duckdb"], names, campaign, identified)
    (folder / "pg").mkdir()
    folder.chmod(0o755)
    wrong: list[str] = []
    with postgres(folder / "pg") as address:
        files = folder / "files"
        begin = time.monotonic()
        assert publishing(paths[0], address, files).wait() == 0
        alone = time.monotonic() - begin
        left = kills
        killed = 0
        waiting = {path: publishing(path, address, files) for path in paths}
        while left:
            time.sleep(rng.uniform(0, 2 * alone / max(len(waiting), 1)))
            path = rng.choice(sorted(waiting))
            process = waiting[path]
            if process.poll() is None:
                process.send_signal(signal.SIGKILL)
                process.wait()
                killed += 1
            left -= 1
            # A second process of the same plant beside the first, now and then.
            waiting[path] = publishing(path, address, files)
        for path, process in waiting.items():
            said, _ = process.communicate()
            if process.returncode:
                wrong.append(f"{path.name}: {process.returncode} {said}")
        took = time.monotonic() - begin
        for path in paths:
            process = publishing(path, address, files)
            said, _ = process.communicate()
            if "nothing new" not in said:
                wrong.append(f"{path.name} again: {process.returncode} {said}")
        with LakeDatabase(address) as lake, Database(folder / "one.duckdb", read_only=True) as one:
            expected = dict.fromkeys(counted(one), 0)
            for path in paths:
                with Database(path, read_only=True) as db:
                    for table, count in counted(db).items():
                        expected[table] += count
            present = counted(lake)
            wrong += [
                f"{table}: {present[table]} rows, not {count}"
                for table, count in expected.items()
                if present[table] != count
            ]
            for table, key in _KEYS:
                ((rows, distinct),) = lake.rows(f"SELECT count(*), count(DISTINCT {key}) FROM {table}")
                if rows != distinct:
                    wrong.append(f"{table}: {rows} rows of {distinct} keys")
            timed = {}
            for name, db in (("lake", lake), ("one file", one)):
                begin = time.monotonic()
                timed[name] = (fleet(db, FleetRequest(None, 0, False)), time.monotonic() - begin)
            ours, theirs = timed["lake"][0], timed["one file"][0]
            if [(row.machine, row.parameter, row.attention) for row in ours.table] != [
                (row.machine, row.parameter, row.attention) for row in theirs.table
            ]:
                wrong.append("the table of the fleet differs from that of one file")
            size = sum(path.stat().st_size for path in files.rglob("*.parquet"))
            count = sum(1 for _ in files.rglob("*.parquet"))
        print(
            f"{plants} plants of {campaigns} campaigns, {killed} of {kills} publications killed, seed {seed}: "
            f"one plant alone {alone:.1f} s, all {took:.0f} s; {sum(expected.values())} rows, {ours.values} values; "
            f"{count} files, {size / 1e6:.1f} MB (one file {(folder / 'one.duckdb').stat().st_size / 1e6:.1f} MB); "
            f"fleet {timed['lake'][1]:.2f} s, of one file {timed['one file'][1]:.2f} s; {len(wrong)} faults"
        )
    return wrong


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--plants", type=int, default=20)
    options.add_argument("--campaigns", type=int, default=20)
    options.add_argument("--kills", type=int, default=40)
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        wrong = trial(chosen.plants, chosen.campaigns, chosen.kills, chosen.seed, Path(folder))
    for fault in wrong:
        print(f"  {fault}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
