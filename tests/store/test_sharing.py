"""A database that many use at once: held for a moment, waited for, and said for whom."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import duckdb
import pytest

from monitor.exceptions import BusyError, DataError, StoreError
from monitor.records import Campaign
from monitor.store import (
    Database,
    Holder,
    Patience,
    SharedDatabase,
    StoredIdentification,
    import_campaign,
    list_campaigns,
    save_identification,
    sharing,
    verify_audit,
    withdraw_campaign,
)

CONCURRENCY = Path(__file__).parents[1] / "soak" / "concurrency.py"


@pytest.mark.slow
def test_two_importers_and_four_readers_at_once_lose_nothing_and_refuse_nobody() -> None:
    options = ["--importers", "2", "--readers", "4", "--seconds", "0", "--least", "1", "--pause", "0"]
    said = subprocess.run(
        [sys.executable, str(CONCURRENCY), *options], capture_output=True, text=True, check=False
    )
    assert said.returncode == 0, said.stdout + said.stderr
    assert "0 faults" in said.stdout


def test_readers_are_in_together_and_a_writer_waits_until_they_leave(path: Path) -> None:
    Database(path).close()
    with (
        SharedDatabase(path, patience=Patience(30)) as first,
        SharedDatabase(path, patience=Patience(30)) as second,
    ):
        with first.reading():
            assert second.rows("SELECT count(*) FROM campaign") == [(0,)]
        with second.transaction():
            second.execute("INSERT INTO registered_machine VALUES (1, 'M', 'w X t', TIMESTAMP '2026-01-01')")
        assert first.rows("SELECT machine FROM registered_machine") == [("M",)]


_HOLD = """
import sys
from monitor.store import SharedDatabase
with SharedDatabase(sys.argv[1]) as db, (db.transaction() if sys.argv[2] == "write" else db.reading()):
    print("open", flush=True)
    sys.stdin.read()
"""


@pytest.mark.parametrize("held", ["read", "write"])
def test_who_waits_says_for_whom_and_gives_up_after_the_stated_time(path: Path, held: str) -> None:
    Database(path).close()
    reports: list[Holder] = []
    with subprocess.Popen(
        [sys.executable, "-c", _HOLD, str(path), held],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "open\n"
        patience = Patience(2.5, lambda who, seconds: reports.append(who))
        if held == "read":
            with SharedDatabase(path, patience=patience) as db:
                assert list_campaigns(db) == ()
                with pytest.raises(
                    BusyError, match=rf"in use by another process, .*PID {holder.pid}.*waited 2.5 s"
                ):
                    save(db)
        else:
            with pytest.raises(
                BusyError, match=rf"in use by another process, .*PID {holder.pid}.*waited 2.5 s"
            ):
                SharedDatabase(path, patience=patience)
        assert [who.pid for who in reports] == [holder.pid]
        assert patience.longest_s < 10
        holder.communicate()
    with SharedDatabase(path) as db:
        save(db)


def save(db: Database) -> None:
    with db.transaction():
        db.execute("DELETE FROM registered_machine")


def test_the_file_is_let_go_while_nothing_is_asked(path: Path) -> None:
    """A fit between two questions keeps nobody waiting."""
    with SharedDatabase(path) as db:
        save(db)
        deadline = time.monotonic() + 60
        # Between its last two steps the file is closed and looked at once more.
        while time.monotonic() < deadline and (db._connection is not None or _is_open(path)):
            time.sleep(0.01)
        assert not _is_open(path)
        assert list_campaigns(db) == ()


@pytest.mark.parametrize(("computed_s", "turns"), [(0.0, 1), (10.0, 2)])
def test_who_is_not_given_the_processor_between_two_transactions_keeps_the_turn(
    path: Path, monkeypatch: pytest.MonkeyPatch, computed_s: float, turns: int
) -> None:
    """An import and the note on it wait once, also on a busy machine; a fit between two transactions lets others in."""
    clocks = {"monotonic": 0.0, "process_time": 0.0}
    Database(path).close()
    monkeypatch.setattr(SharedDatabase, "_watch", lambda self, opening: None)
    with SharedDatabase(path) as db:
        stopped = {name: lambda name=name: clocks[name] for name in clocks}
        monkeypatch.setattr("monitor.store.sharing.time", SimpleNamespace(**stopped))
        taken = 0
        for _ in range(2):
            taken += not db._writes
            save(db)
            clocks["monotonic"] += 0.1
            clocks["process_time"] += computed_s
            if db._is_idle():
                db._let_go()
        assert taken == turns
        clocks["monotonic"] += 10.0
        assert db._connection is None or db._is_idle()


def _is_open(path: Path) -> bool:
    links = Path("/proc/self/fd")
    if not links.is_dir():
        return False
    return any(os.path.realpath(link) == str(path.resolve()) for link in links.iterdir())


def test_who_stood_still_while_it_began_to_write_writes(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Overdue before the first statement, it let go of the file and opened it to read: the statement was a fault."""
    Database(path).close()
    monkeypatch.setattr(sharing, "_LONGEST_S", -1.0)
    with SharedDatabase(path) as db:
        for number in (1, 2):
            with db.transaction():
                db.execute(
                    f"INSERT INTO registered_machine VALUES ({number}, 'M{number}', 'w X t', TIMESTAMP '2026-01-01')"
                )
        assert db.rows("SELECT count(*) FROM registered_machine") == [(2,)]


def test_a_file_that_another_part_of_the_process_is_closing_is_waited_for_and_not_called_damaged(
    path: Path,
) -> None:
    Database(path).close()
    other = duckdb.connect()
    literal = str(path).replace("'", "''")
    other.execute(f"ATTACH '{literal}' AS other (READ_ONLY)")
    with pytest.raises(StoreError, match="is open in this process already"):
        Database(path)
    reports: list[Holder] = []
    patience = Patience(60, lambda who, seconds: (reports.append(who), other.close()))
    with SharedDatabase(path, patience=patience) as db:
        save(db)
    assert [who.pid for who in reports] == [os.getpid()]


#: Ends while another thread writes the log into the file, which takes long enough to be met.
_END_WHILE_LETTING_GO = """
import sys, time
from monitor.store import SharedDatabase
db = SharedDatabase(sys.argv[1])
with db.transaction():
    db.execute("CREATE TABLE large AS SELECT range AS i, md5(range::text) AS a FROM range(300000)")
while db._lock.acquire(blocking=False):
    db._lock.release()
    if db._connection is None:
        break
    time.sleep(0.001)
"""


def test_a_process_that_ends_without_closing_lets_go_of_the_file_first(path: Path) -> None:
    said = subprocess.run(
        [sys.executable, "-c", _END_WHILE_LETTING_GO, str(path)], capture_output=True, text=True, check=False
    )
    assert (said.returncode, said.stderr) == (0, "")
    with SharedDatabase(path) as db:
        assert db.rows("SELECT count(*) FROM large") == [(300000,)]


def test_a_campaign_that_was_exchanged_meanwhile_takes_no_result_of_the_one_before(
    path: Path,
    make_campaign: Callable[..., Campaign],
    make_identification: Callable[..., StoredIdentification],
) -> None:
    before = make_campaign("bars")
    with (
        SharedDatabase(path, patience=Patience(30)) as mine,
        SharedDatabase(path, patience=Patience(30)) as theirs,
    ):
        import_campaign(mine, before)
        computed = make_identification(before)
        save_identification(mine, computed)
        withdraw_campaign(theirs, "bars", "wrong balls")
        import_campaign(theirs, make_campaign("bars", location="hall 4"))
        with pytest.raises(DataError, match="was withdrawn and imported again by somebody else meanwhile"):
            save_identification(mine, computed)
        mine.forget_campaigns()
        save_identification(mine, computed)
        assert verify_audit(theirs).faults == ()


def test_an_unprivileged_reader_needs_neither_a_writable_file_nor_folder(
    path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Mode 444 in a folder of mode 555, by a user who is not the owner."""
    if os.geteuid() != 0:
        pytest.skip("only root can become another user")
    Database(path).close()
    path.chmod(0o444)
    shut = [folder for folder in path.parents if folder.stat().st_mode & 0o005 != 0o005]
    if any(folder != path.parent and not str(folder).startswith(str(path.parents[2])) for folder in shut):
        pytest.skip("the temporary folder is closed to other users")
    for folder in shut:
        folder.chmod(0o755)
    path.parent.chmod(0o555)
    code = (
        "import os, sys; from monitor.exceptions import StoreError\n"
        "from monitor.store import Database, SharedDatabase, take_backup, verify_audit\n"
        "from monitor.workflow.model.show import list_all_models\n"
        "with Database(':memory:') as db: verify_audit(db), list_all_models(db)\n"
        "take_backup(Database(':memory:'), sys.argv[2] + '0'); os.setuid(65534)\n"
        "with SharedDatabase(sys.argv[1]) as db:\n"
        "    print(verify_audit(db).ok)\n"
        "    try:\n"
        "        with db.transaction(): pass\n"
        "    except StoreError as fault: print(fault)\n"
        "    print(len(list_all_models(db).models), take_backup(db, sys.argv[2]).path)"
    )
    copies = tmp_path_factory.mktemp("copies")
    copies.chmod(0o777)
    said = subprocess.run(
        [sys.executable, "-c", code, str(path), str(copies / "copy")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert said.stdout.startswith("True\n"), said.stderr
    assert "may not be opened by this user for writing" in said.stdout
    assert said.stdout.endswith("0 copy\n"), said.stderr


def test_an_old_database_is_brought_up_by_the_first_who_may_write(tmp_path: Path) -> None:
    path = tmp_path / "old.duckdb"
    Database(path).close()
    with Database(path) as db:
        db.execute("DROP VIEW v_machine_models")
        db.execute("DROP TABLE parameter_frame")
        db.execute("DROP VIEW v_lack_of_fit")
        db.execute("DROP TABLE lack_of_fit")
        db.execute("DROP VIEW v_common_parts")
        db.execute("DROP TABLE common_part")
        db.execute("DROP TABLE machine_model")
        db.execute("DELETE FROM schema_migration WHERE number >= 12")
    with pytest.raises(
        StoreError, match="is older than this software and has to be brought to the present schema"
    ):
        SharedDatabase(path, read_only=True)
    with SharedDatabase(path) as db:
        assert db.rows("SELECT count(*) FROM machine_model") == [(0,)]
        assert verify_audit(db).faults == ()
