"""Opening, sharing and refusing a database file, in words; transactions that are all or nothing."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from monitor.exceptions import StoreError
from monitor.records import Campaign
from monitor.store import Database, SharedDatabase, import_campaign, list_campaigns, verify_audit

_HOLD = """
import sys, duckdb
connection = duckdb.connect(sys.argv[1])
print("open", flush=True)
sys.stdin.read()
"""

pytestmark = pytest.mark.usefixtures("made_anew")

_OPEN = """
import sys
from monitor.exceptions import StoreError
from monitor.store import Database
try:
    Database(sys.argv[1], read_only=sys.argv[2] == "read")
except StoreError as fault:
    print(fault)
    sys.exit(2)
"""


@pytest.mark.parametrize("read_only", [False, True])
def test_second_process_names_the_pid_of_the_first(path: Path, read_only: bool) -> None:
    Database(path).close()
    with subprocess.Popen(
        [sys.executable, "-c", _HOLD, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "open\n"
        with pytest.raises(StoreError, match=rf"is in use by another process, .*\(PID {holder.pid}\)"):
            Database(path, read_only=read_only)
        holder.communicate()
    with Database(path, read_only=read_only) as db:
        assert db.rows("SELECT count(*) FROM campaign") == [(0,)]


def test_other_process_is_told_while_this_one_works(db: Database, path: Path) -> None:
    told = subprocess.run(
        [sys.executable, "-c", _OPEN, str(path), "read"], capture_output=True, text=True, check=False
    )
    assert told.returncode == 2
    assert "in use by another process" in told.stdout
    assert told.stderr == ""


def test_same_process_with_other_options(db: Database, path: Path) -> None:
    with pytest.raises(StoreError, match="open in this process already, with other options"):
        Database(path, read_only=True)


def test_reading_what_is_not_there_says_how_to_make_it(tmp_path: Path) -> None:
    with pytest.raises(
        StoreError, match=r"there is no database .*none\.duckdb; `monitor --db .* import FOLDER`"
    ):
        Database(tmp_path / "none.duckdb", read_only=True)
    assert not (tmp_path / "none.duckdb").exists()


def test_file_that_is_no_database(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("Dear auditor, " * 1000)
    with pytest.raises(StoreError, match=r"letter\.txt is not a database of this software"):
        Database(tmp_path / "letter.txt")


def test_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"the folder of .*m\.duckdb does not exist"):
        Database(tmp_path / "nowhere" / "m.duckdb")


def test_folder_instead_of_a_file(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="is a folder; name a file"):
        Database(tmp_path)


def test_threads_one_is_one_thread(path: Path) -> None:
    with Database(path, threads=1) as db:
        assert db.rows("SELECT current_setting('threads')") == [(1,)]


def test_threads_below_one(path: Path) -> None:
    with pytest.raises(StoreError, match="threads must be at least 1, not 0"):
        Database(path, threads=0)


def test_database_in_memory_needs_no_file() -> None:
    with Database(":memory:") as db:
        assert db.rows("SELECT count(*) FROM schema_migration")[0][0] >= 3


def test_nothing_is_fetched_from_the_network(db: Database) -> None:
    names = ("autoinstall_known_extensions", "autoload_known_extensions")
    assert [db.rows("SELECT current_setting(?)", [name]) for name in names] == [[(False,)], [(False,)]]


def _insert_machine(db: Database, name: str) -> None:
    db.execute(
        "INSERT INTO registered_machine SELECT count(*) + 1, ?, 'w X b Y t', TIMESTAMP '2026-01-01' "
        "FROM registered_machine",
        [name],
    )


def _fail_inside(db: Database) -> None:
    with db.transaction():
        _insert_machine(db, "first")
        with db.transaction():
            _insert_machine(db, "second")
        raise RuntimeError("pulled the plug")


def test_transaction_keeps_nothing_of_a_failure_nor_of_what_joined_it(db: Database) -> None:
    with pytest.raises(RuntimeError, match="pulled the plug"):
        _fail_inside(db)
    assert db.rows("SELECT machine FROM registered_machine") == []
    with db.transaction():
        _insert_machine(db, "third")
    assert db.rows("SELECT machine FROM registered_machine") == [("third",)]


def test_read_only_refuses_changes(path: Path) -> None:
    Database(path).close()
    with (
        Database(path, read_only=True) as db,
        pytest.raises(StoreError, match="opened for reading only; nothing can be changed"),
        db.transaction(),
    ):
        _insert_machine(db, "any")


def test_threads_share_a_database_as_if_one_after_the_other(
    db: Database, make_campaign: Callable[..., Campaign]
) -> None:
    names = [f"campaign {number}" for number in range(12)]
    with ThreadPoolExecutor(4) as pool:
        states = list(pool.map(lambda name: import_campaign(db, make_campaign(name)).state, names * 2))
    assert (states.count("imported"), states.count("unchanged")) == (12, 12)
    assert sorted(row.campaign for row in list_campaigns(db)) == sorted(names)
    assert verify_audit(db).faults == ()


@pytest.mark.skipif(sys.platform == "win32", reason="the limit of a file's size is POSIX's")
@pytest.mark.parametrize("rows", [2_000, 200_000])
def test_a_disk_that_is_full_is_told_in_words_and_nothing_is_kept(tmp_path: Path, rows: int) -> None:
    """The log and, with more rows, the file itself find no room when the transaction ends."""
    code = f"""
import resource, sys
from monitor.exceptions import StoreError
from monitor.store import Database
with Database(sys.argv[1]) as db:
    resource.setrlimit(resource.RLIMIT_FSIZE, (65536, resource.RLIM_INFINITY))
    try:
        with db.transaction():
            db.execute("CREATE TABLE large AS SELECT md5(range::text) AS a FROM range({rows})")
    except StoreError as error:
        print(error)
"""
    path = tmp_path / "full.duckdb"
    said = subprocess.run([sys.executable, "-c", code, str(path)], check=True, capture_output=True, text=True)
    assert f"{path} could not be written, nothing was kept: " in said.stdout
    with Database(path) as db:
        assert db.rows("SELECT count(*) FROM information_schema.tables WHERE table_name = 'large'") == [(0,)]


def test_a_file_gets_its_name_when_it_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever is stopped, or finds the disk full, while a database is made leaves no half of one."""
    path = tmp_path / "new.duckdb"

    def no_room(*_: object) -> None:
        raise StoreError(f"{path}.new: no space left")

    with monkeypatch.context() as patch:
        patch.setattr("monitor.store.opening.migrations.migrate", no_room)
        with pytest.raises(StoreError, match=r"new\.duckdb: no space left"):
            Database(path)
    assert {entry.name for entry in tmp_path.iterdir()} <= {"new.duckdb.lock"}
    # What a killed process left is no hindrance.
    (tmp_path / "new.duckdb.new").write_bytes(b"half of one")
    with Database(path) as db:
        assert db.rows("SELECT count(*) FROM v_campaigns") == [(0,)]
    assert not (tmp_path / "new.duckdb.new").exists()


def test_an_empty_file_becomes_a_database_and_another_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.duckdb").touch()
    Database(tmp_path / "empty.duckdb").close()
    assert (tmp_path / "empty.duckdb").stat().st_size > 4096
    (tmp_path / "letter.duckdb").write_text("this never was a database")
    with pytest.raises(StoreError, match="is not a database of this software"):
        Database(tmp_path / "letter.duckdb")


def test_a_pipe_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.duckdb")
    for kind in (Database, SharedDatabase):
        with pytest.raises(StoreError, match="is a pipe or device, not a file"):
            kind(tmp_path / "pipe.duckdb")


def test_a_new_database_is_its_owners_alone_and_log_and_lock_follow_its_mode(tmp_path: Path) -> None:
    path = tmp_path / "mine.duckdb"
    code = (
        "import os, sys; from monitor.store import SharedDatabase\n"
        # Other threads of the program make files meanwhile, which is none of the database's affair.
        "os.umask(0); os.umask = None\n"
        "db = SharedDatabase(sys.argv[1])\n"
        "with db.transaction():\n"
        "    db.execute(\"INSERT INTO registered_machine VALUES (1, 'M', 'w X t', TIMESTAMP '2026-01-01')\")\n"
        "os._exit(9)"
    )
    for mode in (0o600, 0o660):
        if path.exists():
            path.chmod(mode)
            with SharedDatabase(path) as db, db.transaction():
                db.execute("DELETE FROM registered_machine")
        assert subprocess.run([sys.executable, "-c", code, str(path)], check=False).returncode == 9
        for ending in ("", ".wal", ".lock"):
            assert stat.S_IMODE(Path(str(path) + ending).stat().st_mode) == mode, ending
