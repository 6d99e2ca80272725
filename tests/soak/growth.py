# ruff: noqa: E501
"""How a database grows: campaigns of a machine that measures week after week, with all that is usually stored of each.

``python tests/soak/growth.py --campaigns 100`` imports campaigns like the example of twenty runs, every reading with
noise of its own, identifies each, stores an uncertainty, a trend and every tenth time a certificate; it prints the
size of the file on the way, what the tables take, what backups take, and what is left after archiving and compaction.
"""

from __future__ import annotations

import argparse
import dataclasses
import shutil
import sys
import tempfile
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from monitor.cli import main as verb
from monitor.readers import read_campaign
from monitor.records import Campaign, SourceFile
from monitor.store import Database, archive_files, compact, import_campaign, take_backup, take_increment

CHECKOUT = Path(__file__).resolve().parents[2]
EXAMPLE = CHECKOUT / "examples" / "five-days"
LABORATORY = CHECKOUT / "examples" / "laboratory.toml"
WEEKS_OF_TEN_YEARS = 520


def measured(campaign: Campaign, number: int, generator: np.random.Generator) -> Campaign:
    """A campaign of another week of ten years that ended with the example: half a micrometre of noise in each reading, and files of the same size with it."""
    touches = campaign.probings
    readings = {
        axis: values + (generator.normal(0.0, 5e-4, len(values)) if axis in "XYZ" else 0.0)
        for axis, values in touches.readings.items()
    }
    week = timedelta(days=7 * (number - WEEKS_OF_TEN_YEARS))
    runs = tuple(dataclasses.replace(run, started_at=run.started_at + week) for run in campaign.runs)
    # Digits change in the files as in the readings; nothing else does.
    files = tuple(
        SourceFile(
            file.name, _other_digits(file.content, generator) if file.name == "probings.csv" else file.content
        )
        for file in campaign.files
    )
    return dataclasses.replace(
        campaign,
        name=f"week {number:04d}",
        runs=runs,
        probings=dataclasses.replace(touches, readings=readings),
        files=files,
    )


def _other_digits(content: bytes, generator: np.random.Generator) -> bytes:
    """Draw the last two of six decimals anew, so that no two files hold the same bytes."""
    array = np.frombuffer(content, dtype=np.uint8).copy()
    digit = (array >= 48) & (array <= 57)
    ends = np.flatnonzero(digit[:-1] & ~digit[1:])
    for back in (0, 1):
        at = ends[ends > back] - back
        at = at[digit[at] & digit[at - 1]]
        array[at] = generator.integers(48, 58, len(at))
    return array.tobytes()


def megabytes(path: Path) -> float:
    return path.stat().st_size / 1e6


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--campaigns", type=int, default=100)
    options.add_argument(
        "--full", type=int, default=10, help="verbs beyond identify for every so many campaigns"
    )
    chosen = options.parse_args()
    folder = Path(tempfile.mkdtemp())
    path, generator = folder / "shop.duckdb", np.random.default_rng(1)
    example = read_campaign(EXAMPLE)
    sizes, begin = {}, time.monotonic()
    base = ["--db", str(path)]
    for number in range(chosen.campaigns):
        with Database(path) as db:
            import_campaign(db, measured(example, number, generator))
        name = f"week {number:04d}"
        steps = [["identify", name, "--quiet"]]
        if number % chosen.full == 0:
            steps += [
                ["uncertainty", name, "--method", "guf", "--quiet"],
                ["compare", name, "--quiet"],
                ["trend", example.machine.id, "--quiet"],
                ["certificate", "issue", name, "--run", "1", "--laboratory", str(LABORATORY), "--out", str(folder), "--quiet"],
            ]  # fmt: skip
        for words in steps:
            if verb([*base, *words]) not in (0, 1):
                return 1
        sizes[number + 1] = megabytes(path)
        if number + 1 in (1, 2, 5, 10, 20, 50, 100, 200, 300, 400, 520, chosen.campaigns):
            print(
                f"{number + 1:4d} campaigns {sizes[number + 1]:8.2f} MB  {time.monotonic() - begin:6.0f} s",
                flush=True,
            )
        if number + 2 == chosen.campaigns:
            with Database(path) as db:
                take_backup(db, folder / "full.duckdb")
    last = sizes[chosen.campaigns]
    half = chosen.campaigns // 2
    each = (last - sizes[half]) / (chosen.campaigns - half)
    print(
        f"{each * 1e3:.0f} kB a campaign in the second half; ten years of weeks {last + each * (WEEKS_OF_TEN_YEARS - chosen.campaigns):.0f} MB"
    )
    with Database(path) as db:
        take_increment(db, folder / "next.duckdb")
        print(
            f"full backup {megabytes(folder / 'full.duckdb'):.2f} MB, incremental of one campaign {megabytes(folder / 'next.duckdb'):.2f} MB"
        )
        raw = db.rows("SELECT sum(octet_length(content)) FROM source_file")[0][0]
        pdf = db.rows("SELECT coalesce(sum(octet_length(pdf)), 0), count(*) FROM certificate")[0]
        print(f"imported files {raw / 1e6:.2f} MB, {pdf[1]} certificates {pdf[0] / 1e6:.2f} MB")
    print(f"before anything was removed: {megabytes(path):.2f} MB")
    with Database(path) as db:
        done = compact(db)
    print(f"compacted: {done.bytes_before / 1e6:.2f} -> {done.bytes_after / 1e6:.2f} MB")
    with Database(path) as db:
        archive_files(db, folder / "archive", datetime.now(UTC).replace(tzinfo=None))
    print(f"archived: {megabytes(path):.2f} MB")
    with Database(path) as db:
        done = compact(db)
    print(f"archived and compacted: {done.bytes_before / 1e6:.2f} -> {done.bytes_after / 1e6:.2f} MB")
    shutil.rmtree(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
