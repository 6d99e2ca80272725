"""The weekly report of a fleet in processor time and memory: machines are copies of the example campaigns.

``python tests/benchmarks/test_report.py MACHINES`` reports so many machines twice, first with everything to compute,
then with everything stored, and prints processor time of all processes, time, peak memory (of the process that has the
database, and of its largest worker) and size; one machine in five lacks an effect, with ``all`` after the number every
one does, and ``workers=N`` asks for so many processes. As a test two machines are reported. No test asserts a time.
"""

from __future__ import annotations

import re
import resource
import shutil
import sys
import tempfile
import time
from pathlib import Path

from monitor.store import Database
from monitor.workflow.health.report import report
from monitor.workflow.health.request import ReportRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
QUIET = "nothing-hidden"
LACKING = ("hidden-reversal-x", "hidden-b-indexing", "hidden-spindle-growth")
#: The week that holds 16 of the 20 runs of these campaigns.
WEEK = "2026-W10"
#: This process, and its workers that have ended.
WHO = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)


def fill(db: Database, machines: int, folder: Path, *, all_lack: bool = False) -> None:
    """So many machines with one campaign each."""
    for place in range(machines):
        lacks = all_lack or place % 5 == 0
        example = LACKING[place % len(LACKING)] if lacks else QUIET
        name = f"M{place:04d}"
        own = folder / name
        shutil.copytree(EXAMPLES / example, own)
        text = (own / "campaign.toml").read_text(encoding="utf-8")
        text = re.sub('campaign = ".*?"', f'campaign = "{name}"', text, count=1).replace("HU40-T", name, 1)
        (own / "campaign.toml").write_text(text, encoding="utf-8")
        import_folders(db, ImportRequest([own]))
        shutil.rmtree(own)


def test_two_machines_are_reported(tmp_path: Path) -> None:
    with Database(tmp_path / "fleet.duckdb", threads=1) as db:
        fill(db, 2, tmp_path)
        found = report(db, ReportRequest(WEEK, out=tmp_path))
    assert [row.state for row in found.machines] == ["model fails", "no change seen"]


def main(machines: int, *, all_lack: bool, workers: int | None) -> None:
    """Print what a report costs, computed and stored."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with Database(folder / "fleet.duckdb", threads=1) as db:
            fill(db, machines, folder, all_lack=all_lack)
            for what in ("computed", "stored"):
                before, clock = _processor(), time.perf_counter()
                found = report(db, ReportRequest(WEEK, out=folder / what, workers=workers))
                peak, most = (resource.getrusage(who).ru_maxrss / 1e3 for who in WHO)
                size = sum(Path(file).stat().st_size for file in found.files) / 1e6
                print(
                    f"{machines} machines, {what}: {_processor() - before:.0f} s of processor time, "
                    f"{time.perf_counter() - clock:.0f} s, peak {peak:.0f} MB and {most:.0f} MB, files {size:.1f} MB",
                    flush=True,
                )


def _processor() -> float:
    used = [resource.getrusage(who) for who in WHO]
    return sum(one.ru_utime + one.ru_stime for one in used)


if __name__ == "__main__":
    asked = [int(word.removeprefix("workers=")) for word in sys.argv[2:] if word.startswith("workers=")]
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 100,
        all_lack="all" in sys.argv[2:],
        workers=asked[0] if asked else None,
    )
