"""A process is killed after its commit; whichever verb comes next, no campaign is lost, then or later.

DuckDB 1.5 loses rows of a secondary index when it replays its log in a session that does not use the index. The verb
after the kill is that session, so every reading verb has its turn.
"""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import pytest

from monitor.store import Database, verify_audit
from monitor.store.migrations import available, migrate

Typed = Callable[..., Any]

#: Import and identify a folder, both committed, and die before the file is closed and its log written into it.
_DIE_AFTER_COMMIT = """
import os, signal, sys
from pathlib import Path
from monitor.store import Database
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
db = Database(sys.argv[1])
import_folders(db, ImportRequest([Path(sys.argv[2])]))
identify(db, IdentifyRequest(Path(sys.argv[2]).name))
os.kill(os.getpid(), signal.SIGKILL)
"""

#: Every verb that reads, with what it is typed with. None of them may be the one that loses a campaign.
READING = [
    ["campaigns"],
    ["runs", "cold-cold"],
    ["stats", "cold-cold"],
    ["trend", "HU40-T", "--parameter", "EB0C"],
    ["fleet"],
    ["select", "cold-cold"],
    ["compare", "cold-cold"],
    ["model", "list"],
    ["effects", "spindle", "--campaign", "cold-cold"],
    ["event", "HU40-T"],
    ["certificate", "show"],
    ["audit"],
    ["verify"],
    ["export", "tables"],
    ["backup", "second.duckdb"],
]


@pytest.fixture(scope="session")
def killed(tmp_path_factory: pytest.TempPathFactory, examples: Path, environment: dict[str, str]) -> Path:
    """A database in which hot-cold was imported before, and cold-cold by a process that was killed; with its log."""
    path = tmp_path_factory.mktemp("killed") / "killed.duckdb"
    _import(path, examples / "hot-cold")
    _die_after_commit(path, examples / "cold-cold", environment)
    return path


def _import(path: Path, folder: Path) -> None:
    from monitor.cli import main

    assert main(["--db", str(path), "import", str(folder)]) == 0
    assert main(["--db", str(path), "identify", folder.name]) == 0


def _die_after_commit(path: Path, folder: Path, environment: dict[str, str]) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", _DIE_AFTER_COMMIT, str(path), str(folder)], env=environment, check=False
    )
    assert ended.returncode == -signal.SIGKILL
    assert Path(f"{path}.wal").stat().st_size > 0


def _copied(killed: Path, folder: Path) -> Path:
    path = folder / "own.duckdb"
    shutil.copyfile(killed, path)
    shutil.copyfile(f"{killed}.wal", f"{path}.wal")
    return path


#: Those that read the tables, views and files in ways of their own; some have their turn in ``make slow``, the others,
#: which read as one of these does, in ``make trials``.
QUICK, SLOW = ("campaigns", "verify"), ("trend", "backup", "runs", "fleet", "certificate", "export")


def _turn(verb: str) -> tuple[pytest.MarkDecorator, ...]:
    if verb in QUICK:
        return ()
    return (pytest.mark.slow if verb in SLOW else pytest.mark.all_seeds,)


@pytest.mark.parametrize(
    "verb",
    [pytest.param(verb, marks=_turn(verb[0])) for verb in READING],
    ids=lambda verb: " ".join(verb[:2]),
)
def test_no_campaign_is_lost_whichever_verb_comes_first_after_a_kill(
    killed: Path, tmp_path: Path, typed: Typed, examples: Path, verb: list[str]
) -> None:
    path = _copied(killed, tmp_path)
    assert typed(*verb, db=path).status in (0, 1)
    assert typed("import", examples / "hidden-reversal-x", db=path).status == 0
    assert typed("identify", "hidden-reversal-x", db=path).status == 0
    with Database(path) as db:
        for table in ("run", "identification"):
            counts = db.rows(f"SELECT campaign_id, count(*) FROM {table} GROUP BY ALL ORDER BY ALL")
            assert [number for number, _ in counts] == [1, 2, 3]
            for number, count in counts:
                assert db.rows(f"SELECT count(*) FROM {table} WHERE campaign_id = ?", [number]) == [(count,)]
        assert db.rows("SELECT count(*) FROM imported_campaign WHERE machine = 'HU40-T'") == [(3,)]
        assert verify_audit(db).faults == ()
    trend = json.loads(typed("trend", "HU40-T", "--parameter", "EB0C", "--json", db=path).out)
    assert (trend["runs"], len(trend["campaigns"])) == (108, 3)


def _broken_by_an_earlier_version(path: Path, folder: Path, environment: dict[str, str]) -> None:
    """A file with the indexes of the first version, killed, opened and closed once without using them."""
    shutil.copyfile(folder / "before.duckdb", path)
    with duckdb.connect(str(path)) as connection:
        connection.execute("DELETE FROM schema_migration WHERE number >= 10")
        connection.execute("DROP TABLE campaign_runs")
        connection.execute("DROP VIEW v_machine_models")
        connection.execute("DROP TABLE machine_model")
        connection.execute("DROP TABLE parameter_frame")
        connection.execute("DROP VIEW v_lack_of_fit")
        connection.execute("DROP TABLE lack_of_fit")
        connection.execute("DROP VIEW v_common_parts")
        connection.execute("DROP TABLE common_part")
        for name, table, column in (
            ("run_of_campaign", "run", "campaign_id"),
            ("identification_of_campaign", "identification", "campaign_id"),
            ("imported_campaign_of_machine", "imported_campaign", "machine"),
        ):
            connection.execute(f"CREATE INDEX {name} ON {table} ({column})")
    _kill_a_copying_process(path, environment)
    with duckdb.connect(str(path)) as connection:
        connection.execute("SELECT 1")


#: Another campaign under a new name, committed in plain SQL, as the first version did; then the process dies.
_COPY_AND_DIE = """
import os, signal, sys
import duckdb
connection = duckdb.connect(sys.argv[1])
connection.execute("INSERT INTO run SELECT * REPLACE (campaign_id + 1000 AS campaign_id) FROM run")
os.kill(os.getpid(), signal.SIGKILL)
"""


def _kill_a_copying_process(path: Path, environment: dict[str, str]) -> None:
    ended = subprocess.run([sys.executable, "-c", _COPY_AND_DIE, str(path)], env=environment, check=False)
    assert ended.returncode == -signal.SIGKILL


def test_a_file_that_lost_rows_from_an_index_is_repaired_when_it_is_opened(
    tmp_path: Path, examples: Path, environment: dict[str, str]
) -> None:
    _import(tmp_path / "before.duckdb", examples / "hot-cold")
    path = tmp_path / "broken.duckdb"
    _broken_by_an_earlier_version(path, tmp_path, environment)
    with duckdb.connect(str(path)) as connection:
        # The reference that the fault is there: an equality that the index answers, and a scan.
        (by_index,) = connection.execute("SELECT count(*) FROM run WHERE campaign_id = 1001").fetchone() or (
            0,
        )
        counts = dict(connection.execute("SELECT campaign_id, count(*) FROM run GROUP BY ALL").fetchall())
        assert by_index < counts[1001]
    with Database(path) as db:
        assert db.rows("SELECT count(*) FROM run WHERE campaign_id = 1001") == [(counts[1001],)]
        assert db.rows("SELECT index_name FROM duckdb_indexes()") == []


def test_verify_names_an_index_that_lost_rows(
    killed: Path, tmp_path: Path, typed: Typed, environment: dict[str, str]
) -> None:
    path = _copied(killed, tmp_path)
    with duckdb.connect(str(path)) as connection:
        connection.execute("CREATE INDEX of_somebody ON run (campaign_id)")
    _kill_a_copying_process(path, environment)
    with duckdb.connect(str(path)) as connection:
        connection.execute("SELECT 1")
    answer = typed("verify", db=path)
    assert answer.status == 1
    assert (
        "the index of_somebody over rows of run was not made by this software and does not find" in answer.out
    )
    assert "DROP INDEX of_somebody" in answer.out


def test_the_schema_has_no_secondary_index() -> None:
    with duckdb.connect() as connection:
        migrate(connection, available())
        assert connection.execute("SELECT index_name FROM duckdb_indexes()").fetchall() == []
