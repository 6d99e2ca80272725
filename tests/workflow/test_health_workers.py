"""The report by several processes: the same to the last byte as by one, and Ctrl-C ends them all."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest
from by_path import TESTS, load

from monitor.exceptions import InputError
from monitor.readers import read_campaign
from monitor.records import AuditAnchor
from monitor.store import Database, import_campaign, verify_audit

answers = load("answers", TESTS / "answers.py")
first_runs = load("first_runs", TESTS / "first_runs.py").first_runs
report = answers.report

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MADE = datetime.fromisoformat("2026-03-09T06:00:00+00:00")
STOPPED = "monitor: stopped; what was not finished was not stored\n"


@pytest.fixture
def fleet(tmp_path: Path, thorough: bool) -> Path:
    """Three machines of eight runs: one lacks an effect, one was measured only in February, one has nothing to report.

    In ``make test`` the second and another of its kind, for which nothing is searched.
    """
    path = tmp_path / "fleet.duckdb"
    examples = ("hidden-b-indexing", "cold-cold", "nothing-hidden") if thorough else ("cold-cold", "hot-cold")
    with Database(path, threads=1) as db:
        for example in examples:
            campaign = first_runs(read_campaign(EXAMPLES / example), 8)
            machine = replace(campaign.machine, id=f"on {example}")
            import_campaign(db, replace(campaign, name=example, machine=machine))
    return path


@pytest.mark.slow
def test_one_process_and_two_write_the_same_bytes_and_store_the_same(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, thorough: bool, laid_out_anew: None
) -> None:
    # The entries of the two audits bear the times of their making; printed in the report, they would differ.
    monkeypatch.setattr("monitor.workflow.health.report.last_anchor", lambda db: AuditAnchor(7, "ab" * 32))
    # Two parts, so that the PDF is spread too.
    monkeypatch.setattr("monitor.workflow.health.report.MACHINES_A_PART", 2 if thorough else 1)
    files, stored = [], []
    for workers in (1, 2):
        path, out = tmp_path / f"{workers}.duckdb", tmp_path / f"by-{workers}"
        shutil.copy(fleet, path)
        with Database(path, threads=1) as db:
            found = report(db, "2026-W10", out=out, made_at=MADE, workers=workers)
            stored.append(
                db.rows(
                    "SELECT kind, machine, campaign, run, method, document FROM v_analyses ORDER BY analysis_id"
                )
                + db.rows("SELECT * FROM v_parameters ORDER BY ALL")
            )
            assert verify_audit(db).ok
        assert len(found["files"]) == 3
        files.append({Path(name).name: Path(name).read_bytes() for name in found["files"]})
    assert stored[0] == stored[1]
    assert files[0] == files[1]
    assert {row[0] for row in stored[0] if row[1] is not None} >= {"health"}


def test_no_worker_is_too_few(fleet: Path, tmp_path: Path) -> None:
    with (
        Database(fleet, threads=1) as db,
        pytest.raises(InputError, match=r"^--workers 0: at least one worker is needed$"),
    ):
        report(db, "2026-W10", out=tmp_path, workers=0)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="looks for the workers in /proc")
def test_ctrl_c_ends_the_workers_without_a_word_of_theirs(fleet: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "monitor", "--db", str(fleet), "report", "--week", "2026-W10"]
    # On a busy machine the report may be made before the signal comes: it is made again then.
    for attempt in range(5):
        status, out, err, workers = interrupted(
            [*command, "--workers", "2", "--out", str(tmp_path / f"out-{attempt}")]
        )
        if status != 0:
            break
    # Started with -m, Python ends itself by the signal where Ctrl-C went through an exec; a shell calls either 130.
    assert status in (130, -signal.SIGINT)
    assert (out, err) == ("", STOPPED)
    assert len(workers) == 3
    deadline = time.monotonic() + 120
    while any(Path(f"/proc/{one}").exists() for one in workers) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not [one for one in workers if Path(f"/proc/{one}").exists()]
    with Database(fleet) as db:
        assert verify_audit(db).ok


def interrupted(command: list[str]) -> tuple[int, str, str, list[str]]:
    """Status and output of a report whose processes all got Ctrl-C once there were two workers, and its children."""
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        deadline = time.monotonic() + 300
        workers: list[str] = []
        # The two workers, and Python's tracker of resources.
        while len(workers) < 3 and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.05)
            workers = children.read_text().split()
        if process.poll() is None:
            # As a terminal does: to all processes of the group, while the workers still import.
            os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=300)
    return process.returncode, out, err, workers
