"""Files that were archived leave a proof, a database that was written anew is the same; both after a kill, too."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import duckdb
import pytest

from monitor.exceptions import InputError, StoreError
from monitor.records import Campaign
from monitor.store import (
    Database,
    SharedDatabase,
    StoredIdentification,
    archive_faults,
    archive_files,
    compact,
    export_tables,
    import_campaign,
    last_entries,
    load_campaign,
    restore,
    save_certificate,
    save_identification,
    take_backup,
    take_increment,
    verify_audit,
    withdraw_campaign,
)

#: Much larger than all else in the small database.
LARGE = os.urandom(400_000)


@pytest.fixture
def measured(
    path: Path,
    make_campaign: Callable[..., Campaign],
    make_identification: Callable[..., StoredIdentification],
) -> Path:
    """A database with three campaigns, one of them withdrawn, and a certificate."""
    with Database(path, actor="the test") as db:
        for number in range(3):
            campaign = make_campaign(
                f"week {number}",
                machine_id="TWO" if number == 2 else "ONE",
                files=(
                    ("campaign.toml", b"x"),
                    ("probings.csv", LARGE + bytes([number])),
                    ("empty.csv", b""),
                ),
            )
            import_campaign(db, campaign)
            save_identification(db, make_identification(campaign))
        save_certificate(db, "C-1", "issued", "week 0", [1], {"a": 1}, b"pdf")
        withdraw_campaign(db, "week 1", "wrong balls")
    return path


def soon() -> datetime:
    """A moment after everything that was imported."""
    return datetime.now(UTC).replace(tzinfo=None) + timedelta(seconds=1)


def test_archived_files_are_proved_by_hash_rule_and_audit(measured: Path, tmp_path: Path) -> None:
    archive = tmp_path / "archive"
    with Database(measured, actor="ada") as db:
        before = load_campaign(db, "week 0")
        assert archive_files(db, archive, soon(), machine="ONE").campaigns == 2
        moved = archive_files(db, archive, soon())
        assert (moved.campaigns, moved.files, moved.bytes) == (1, 2, 400_002)
        assert archive_files(db, archive, soon()).campaigns == 0
        assert verify_audit(db).faults == ()
        entry = last_entries(db, 1)[0]
        assert (entry.actor, entry.action, entry.subject) == ("ada", "archive", "analysis")
        # What an import compares, and certificates name, is what it was.
        after = load_campaign(db, "week 0")
        assert [(file.name, file.sha256) for file in after.files] == [
            (f.name, f.sha256) for f in before.files
        ]
        assert import_campaign(db, before).state == "unchanged"
        assert list(archive_faults(db, archive)) == []
        written = export_tables(db, tmp_path / "out")
        assert {path.name for path in written if "source_files" in path.parts} == {"empty.csv"}
    for file in before.files:
        if file.content:
            assert (archive / "1" / file.name).read_bytes() == file.content
    sums = subprocess.run(["sha256sum", "--check", "--quiet", "SHA256SUMS"], cwd=archive / "1", check=False)
    assert sums.returncode == 0


def test_an_archive_that_is_not_what_was_taken_out_is_told(measured: Path, tmp_path: Path) -> None:
    archive = tmp_path / "archive"
    with Database(measured) as db:
        archive_files(db, archive, soon())
        (archive / "1" / "probings.csv").write_bytes(LARGE)
        (archive / "2" / "campaign.toml").unlink()
        assert list(archive_faults(db, archive)) == [
            f"{archive}/1/probings.csv, of campaign week 0, is not what was taken out of the database",
            f"{archive}/2/campaign.toml, of campaign week 1, cannot be read: No such file or directory",
        ]
        # Content that is gone without a word of it, and a hash that was changed after its file was archived.
        db.execute("UPDATE source_file SET sha256 = 'ab' WHERE campaign_id = 1 AND file = 'probings.csv'")
        assert (
            "the file probings.csv of campaign week 0 was altered after it was imported"
            in verify_audit(db).faults
        )


def test_content_that_is_gone_without_an_entry_is_a_fault(measured: Path) -> None:
    with Database(measured) as db:
        db.execute("UPDATE source_file SET content = ''::BLOB WHERE campaign_id = 1")
        assert (
            "the file probings.csv of campaign week 0 was altered after it was imported"
            in verify_audit(db).faults
        )


def test_nothing_is_taken_out_that_could_not_be_written(measured: Path, tmp_path: Path) -> None:
    archive = tmp_path / "archive"
    (archive / "1").mkdir(parents=True)
    (archive / "1" / "probings.csv").write_bytes(b"mine")
    with Database(measured) as db:
        with pytest.raises(
            StoreError, match=r"probings\.csv is there already with other content; name another folder"
        ):
            archive_files(db, archive, soon())
        assert db.rows("SELECT count(*) FROM source_file WHERE octet_length(content) > 0") == [(6,)]
        assert verify_audit(db).faults == ()
    assert (archive / "1" / "probings.csv").read_bytes() == b"mine"


def test_a_backup_chain_begins_anew_behind_an_archive(measured: Path, tmp_path: Path) -> None:
    folder = tmp_path / "backups"
    folder.mkdir()
    with Database(measured) as db:
        take_backup(db, folder / "0.duckdb")
        moment = datetime.now(UTC)
        archive_files(db, tmp_path / "archive", soon())
        with pytest.raises(StoreError, match=r"files of campaigns were archived since 0\.duckdb was made"):
            take_increment(db, folder / "1.duckdb")
        take_backup(db, folder / "1.duckdb")
    with pytest.raises(InputError, match=r"files were archived at .* and this backup no longer has them"):
        restore(folder / "1.duckdb", tmp_path / "back.duckdb", moment)
    assert restore(folder / "0.duckdb", tmp_path / "early.duckdb").faults == ()


def test_compaction_gives_the_room_back_and_changes_no_row(measured: Path, tmp_path: Path) -> None:
    os.chmod(measured, 0o640)
    with SharedDatabase(measured) as db:
        archive_files(db, tmp_path / "archive", soon())
        names = [name for (name,) in db.rows("SELECT table_name FROM duckdb_tables()")]
        rows = {table: sorted(map(str, db.rows(f"FROM {table}"))) for table in names}
        done = compact(db)
        assert done.bytes_before - done.bytes_after > 3 * 400_000 * 0.9
        assert rows == {table: sorted(map(str, db.rows(f"FROM {table}"))) for table in rows}
        assert verify_audit(db).faults == ()
    assert stat.S_IMODE(measured.stat().st_mode) == 0o640
    assert measured.stat().st_size == done.bytes_after
    assert sorted(path.name for path in measured.parent.glob("*.partial*")) == []


#: Another client in a process of its own: DuckDB's lock belongs to processes.
_READ = """
import duckdb, sys
connection = duckdb.connect(sys.argv[1], read_only=True)
print(1, flush=True)
sys.stdin.read()
"""


def test_compaction_leaves_a_file_alone_that_somebody_has(measured: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", _READ, str(measured)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"1\n"
        before = measured.read_bytes()
        with (
            SharedDatabase(measured, read_only=True) as db,
            pytest.raises(StoreError, match="is in use by another"),
        ):
            compact(db)
        assert measured.read_bytes() == before
        other.communicate()


_COMPACT_AND_DIE = """
import os, signal, sys
from pathlib import Path
from monitor.store import SharedDatabase, compact
from monitor.store.copies import compaction
name = sys.argv[2]
def die(*arguments, **further):
    os.kill(os.getpid(), signal.SIGKILL)
setattr(compaction.os if name == "replace" else compaction, name, die)
with SharedDatabase(sys.argv[1]) as db:
    compact(db)
"""


@pytest.mark.parametrize(
    "killed_at",
    [
        pytest.param("copy_all", marks=pytest.mark.slow),
        pytest.param("sync", marks=pytest.mark.slow),
        pytest.param("replace", marks=pytest.mark.slow),
        "sync_folder",
    ],
)
def test_a_compaction_that_is_killed_leaves_the_old_file_or_the_new(measured: Path, killed_at: str) -> None:
    ended = subprocess.run([sys.executable, "-c", _COMPACT_AND_DIE, str(measured), killed_at], check=False)
    assert ended.returncode == -signal.SIGKILL
    for path in (measured, measured):
        with SharedDatabase(path) as db:
            assert verify_audit(db).faults == ()
            assert db.rows("SELECT count(*) FROM imported_campaign") == [(3,)]
            compact(db)
    assert sorted(path.name for path in measured.parent.glob("*.partial*")) == []
    with duckdb.connect(str(measured), read_only=True) as connection:
        assert connection.execute("SELECT count(*) FROM run").fetchall() == [(6,)]
