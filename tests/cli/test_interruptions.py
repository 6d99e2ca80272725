"""Stopped in the middle, killed in the middle, two at once: what is in the database is whole, and nothing else is."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from monitor.store import Database, verify_audit

RUNS = {"five-days": 20, "cold-cold": 44, "hidden-reversal-x": 20, "nothing-hidden": 20}


def whole(path: Path) -> set[str]:
    """The campaigns in a database, after checking that everything in it is complete."""
    if not path.exists():
        return set()
    with Database(path) as db:
        assert verify_audit(db).faults == ()
        found = {str(name) for (name,) in db.rows("SELECT campaign FROM campaign")}
        for name in found:
            ((runs,),) = db.rows("SELECT count(*) FROM v_runs WHERE campaign = ?", [name])
            assert runs == RUNS[name]
            ((files,),) = db.rows(
                "SELECT count(*) FROM source_file JOIN campaign USING (campaign_id) WHERE campaign = ?",
                [name],
            )
            assert files == 3
        # An identification has all its runs.
        assert db.rows(
            "SELECT count(*) FROM identified_run WHERE identification_id NOT IN "
            "(SELECT identification_id FROM identification)"
        ) == [(0,)]
        for held, stored in db.rows(
            "SELECT run_count, (SELECT count(*) FROM identified_run AS r "
            "WHERE r.identification_id = i.identification_id) FROM v_identifications AS i"
        ):
            assert held == stored
    return found


def killed(process: subprocess.Popen[str], after: float, sign: signal.Signals) -> int:
    try:
        process.wait(after)
    except subprocess.TimeoutExpired:
        process.send_signal(sign)
    process.communicate(timeout=250)
    return process.returncode


# Around when the work is done, whatever the machine's speed: fractions of the time that a whole call takes. The first
# two in make slow, all in make trials.
FRACTIONS = (0.6, 0.97, 0.9, 0.35, 0.75)


def duration(start: Any) -> float:
    begun = time.monotonic()
    process = start()
    process.communicate(timeout=250)
    assert process.returncode == 0
    return time.monotonic() - begun


@pytest.mark.slow
def test_sigkill_in_the_middle_of_import(
    started: Any, typed: Any, examples: Path, tmp_path: Path, seeds: Any
) -> None:
    folders = [examples / name for name in RUNS]
    whole_time = duration(lambda: started("--db", tmp_path / "first.duckdb", "import", *folders))
    seen = []
    for place in seeds(len(FRACTIONS), 1):
        path = tmp_path / f"{place}.duckdb"
        start = started("--db", path, "import", *folders)
        status = killed(start, FRACTIONS[place] * whole_time, signal.SIGKILL)
        assert status in (0, -signal.SIGKILL)
        seen.append(len(whole(path)))
        # The database goes on as if nothing had been.
        assert typed("import", *folders, db=path).status == 0
        assert whole(path) == set(RUNS)
    assert all(count in range(5) for count in seen)


@pytest.mark.slow
def test_sigkill_in_the_middle_of_identify(started: Any, db: Path, seeds: Any) -> None:
    count = "SELECT campaign, count(*) FROM v_identifications GROUP BY campaign"
    with Database(db) as opened:
        before = dict(opened.rows(count))
    whole_time = duration(lambda: started("--db", db, "identify"))
    for place in seeds(len(FRACTIONS), 1):
        status = killed(started("--db", db, "identify"), FRACTIONS[place] * whole_time, signal.SIGKILL)
        assert status in (0, -signal.SIGKILL)
        assert len(whole(db)) == 3
    with Database(db) as opened:
        # Campaigns are identified one after the other, each whole or not at all.
        added = {campaign: held - before.get(campaign, 0) for campaign, held in opened.rows(count)}
        assert len(added) == 3


@pytest.mark.slow
def test_sigkill_in_the_middle_of_a_certificate(
    started: Any, db: Path, laboratory: Path, tmp_path: Path, seeds: Any
) -> None:
    out = tmp_path / "out"
    issue = [
        "--db",
        db,
        "certificate",
        "issue",
        "cold-cold",
        "--run",
        1,
        "--laboratory",
        laboratory,
        "--out",
        out,
    ]
    whole_time = duration(lambda: started(*issue))
    random_places = random.Random(7)
    for _ in seeds(3, 1):
        status = killed(started(*issue), random_places.uniform(0.5, 1.0) * whole_time, signal.SIGKILL)
        assert status in (0, -signal.SIGKILL)
        assert len(whole(db)) == 3
        with Database(db) as opened:
            numbers = {str(number) for (number,) in opened.rows("SELECT DISTINCT number FROM certificate")}
        # No file bears the name of a certificate that the database does not know, and every file is a whole PDF.
        files = {path.name for path in out.glob("*.pdf")}
        assert files <= {f"certificate-{number}.pdf" for number in numbers}
        for path in out.glob("*.pdf"):
            assert path.read_bytes()[:5] == b"%PDF-"
            assert path.read_bytes().rstrip().endswith(b"%%EOF")


def test_ctrl_c_ends_with_one_line_and_nothing_stored(started: Any, db: Path) -> None:
    with Database(db) as opened:
        before = opened.rows("SELECT count(*) FROM analysis")
    process = started("--db", db, "uncertainty", "five-days", "--method", "mcm", "--digits", 4)
    # Once the compiler of its kernel is loaded, its other modules are, and four digits take many seconds: it is
    # interrupted while it computes, a second of its processor time later.
    deadline = time.monotonic() + 200
    while time.monotonic() < deadline and process.poll() is None and not has_loaded(process, "llvmlite"):
        time.sleep(0.02)
    loaded_at = processor_time_s(process)
    while (
        time.monotonic() < deadline and process.poll() is None and processor_time_s(process) < loaded_at + 1.0
    ):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    # A block of trials, or the compilation of the kernel on a busy machine, is finished first.
    out, err = process.communicate(timeout=350)
    # Started with -m, Python ends itself by the signal where Ctrl-C went through an exec; a shell calls either 130.
    assert process.returncode in (130, -signal.SIGINT)
    assert out == ""
    assert err == "monitor: stopped; what was not finished was not stored\n"
    with Database(db) as opened:
        assert opened.rows("SELECT count(*) FROM analysis") == before
        assert verify_audit(opened).ok


def has_loaded(process: Any, library: str) -> bool:
    """Whether a process has a library in its memory; where there is no /proc, two seconds later."""
    maps = Path(f"/proc/{process.pid}/maps")
    if not maps.exists():
        time.sleep(2.0)
        return True
    return library in maps.read_text(errors="replace")


def processor_time_s(process: Any) -> float:
    """Processor time of a process so far (proc(5), fields 14 and 15); where there is no /proc, two seconds later."""
    stat = Path(f"/proc/{process.pid}/stat")
    if not stat.exists():
        time.sleep(2.0)
        return 2.0
    fields = stat.read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.fixture
def holder(db: Path, environment: dict[str, str]) -> Any:
    """Another process that has the database open."""
    code = (
        "import sys; from monitor.store import Database\n"
        "with Database(sys.argv[1]):\n print('open', flush=True); sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(db)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == "open\n"
        yield process
        process.communicate()


@pytest.mark.parametrize(
    "arguments",
    [["campaigns"], ["verify", "--json"], ["identify", "cold-cold"], ["event", "HU40-T"]],
    ids=" ".join,
)
def test_a_database_in_use_is_told_with_the_process(
    typed: Any, db: Path, holder: Any, arguments: list[str]
) -> None:
    answer = typed(*arguments, "--wait", 0, db=db)
    assert (answer.status, answer.out) == (2, "")
    assert f"{db} is in use by another process" in answer.err
    assert f"(PID {holder.pid})" in answer.err
    assert answer.err.count("\n") == 1


def test_two_imports_at_once_wait_for_each_other(started: Any, examples: Path, tmp_path: Path) -> None:
    path = tmp_path / "both.duckdb"
    both = [started("--db", path, "import", examples / name) for name in ("five-days", "cold-cold")]
    for process in both:
        out, err = process.communicate(timeout=250)
        assert (process.returncode, ": imported, " in out) == (0, True), err
    assert whole(path) == {"five-days", "cold-cold"}
