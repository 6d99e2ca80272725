"""A log is replayed onto the file that it was written for, and onto no other that has its name.

DuckDB 1.5 replays whatever lies beside a file. A crash is made of the files as they lay while the database was open.
"""

from __future__ import annotations

import fcntl
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import duckdb
import pytest

from monitor.exceptions import StoreError
from monitor.records import Campaign
from monitor.store import Database, SharedDatabase, import_campaign, record_event, restore, take_backup
from monitor.store.copies.increment import take_increment
from monitor.store.kept_blocks import has_foreign_log, has_torn_log
from monitor.store.log import _LOG_BEGIN
from monitor.store.opening import connect
from monitor.store.verification import verify_audit

_ENDINGS = ("", ".wal", ".blocks")


class Shop:
    """A database with a campaign, killed behind its second event; ``before`` has none, ``after_two`` both."""

    def __init__(self, folder: Path, campaign: Campaign) -> None:
        self.path, self.machine = folder / "shop.duckdb", campaign.machine.id
        with Database(self.path) as db:
            import_campaign(db, campaign)
        self.before = self.path.read_bytes()
        self.record(1)
        kept = folder / "kept"
        kept.mkdir()
        with Database(self.path) as db:
            self._record(db, 2)
            for ending in _ENDINGS:
                shutil.copyfile(f"{self.path}{ending}", kept / f"shop{ending}")
        self.after_two = self.path.read_bytes()
        for ending in _ENDINGS:
            shutil.copyfile(kept / f"shop{ending}", f"{self.path}{ending}")

    def _record(self, db: Database, day: int) -> None:
        record_event(db, self.machine, datetime(2026, 1, day, tzinfo=UTC), "crash", "x")

    def record(self, day: int) -> None:
        with Database(self.path) as db:
            self._record(db, day)

    def put(self, content: bytes) -> None:
        """Put another content under the name, now, as somebody does who copies a file over."""
        self.path.write_bytes(content)
        later = os.stat(f"{self.path}.wal").st_mtime_ns + 10**9
        os.utime(self.path, ns=(later, later))

    def refuse(self) -> None:
        """Reader and writer refuse the files as they lie, and leave all of them."""
        present = {ending: Path(f"{self.path}{ending}").read_bytes() for ending in _ENDINGS}
        for kind in (SharedDatabase, Database):
            with pytest.raises(StoreError, match="is the log of another state of"), kind(self.path):
                pass
        assert present == {ending: Path(f"{self.path}{ending}").read_bytes() for ending in _ENDINGS}


@pytest.fixture
def shop(tmp_path: Path, make_campaign: Callable[..., Campaign]) -> Shop:
    return Shop(tmp_path, make_campaign("one"))


def test_the_log_of_the_file_itself_is_replayed(shop: Shop) -> None:
    with SharedDatabase(shop.path) as reader:
        assert reader.rows("SELECT count(*) FROM event") == [(2,)]
    with Database(shop.path) as db:
        assert verify_audit(db).faults == ()
    assert not Path(f"{shop.path}.wal").exists()


def test_an_earlier_copy_put_in_its_place_is_not_mixed_with_the_log(shop: Shop) -> None:
    shop.put(shop.before)
    shop.refuse()
    # What the refusal says to do: the copy is what it was.
    for ending in _ENDINGS[1:]:
        os.unlink(f"{shop.path}{ending}")
    with Database(shop.path) as db:
        assert verify_audit(db).faults == ()
        assert db.rows("SELECT count(*) FROM event") == [(0,)]


def test_duckdb_itself_mixes_them(shop: Shop) -> None:
    # Where this fails the engine was mended, and the comparison is of no use any more.
    shop.put(shop.before)
    with duckdb.connect(str(shop.path)) as plain:
        assert plain.sql("SELECT list(entry ORDER BY entry) FROM audit").fetchone() == ([1, 3],)


def test_a_file_that_went_on_without_its_log_is_not_mixed_with_it(shop: Shop) -> None:
    """As under another name, a hard link: one checkpoint further, of which the log knows nothing."""
    shop.put(shop.after_two)
    shop.refuse()


#: How a log begins: as DuckDB 1.5.5 writes it, as 2.0.1 (with the file's name in 16 numbers, of which those from 128 on
#: take two bytes, and the checkpoint that it follows), and as some later one may.
_BEGIN_1_5 = b"d\0be\0\x02\xff\xff"
_BEGIN_2_0 = (
    b"d\0be\0\x02f\0\x10"
    + b"\xe6\x01-6\xec\x01\x89\x01Q\xef\x01\x16\xc5\x01\xec\x01v\x01\xbc\x01Wb)"
    + b"g\0\x81\x02\xff\xff"
)
_BEGIN_OF_ANOTHER = b"d\0be\0\x03\xff\xff"


def begin_log(shop: Shop, begin: bytes) -> None:
    """Let the log begin in another form."""
    log = Path(f"{shop.path}.wal")
    log.write_bytes(re.sub(rb"\Ad\0be\0.*?\xff\xff", lambda _: begin, log.read_bytes(), flags=re.DOTALL))


@pytest.mark.parametrize("begin", [_BEGIN_2_0, _BEGIN_OF_ANOTHER], ids=["2.0", "another"])
def test_a_log_of_a_later_form_is_not_mixed_with_a_file_that_went_on(shop: Shop, begin: bytes) -> None:
    """What a log of an unknown form ends with cannot be told, so that it is refused."""
    begin_log(shop, begin)
    shop.put(shop.after_two)
    shop.refuse()


@pytest.mark.parametrize("kind", [SharedDatabase, Database])
def test_what_duckdb_2_0_says_of_a_foreign_log_is_said_in_our_words(
    shop: Shop, monkeypatch: pytest.MonkeyPatch, kind: type[Database]
) -> None:
    """It finds one itself, and was taken for a damaged file."""
    said = f'Failure while replaying WAL file "{shop.path}.wal": This WAL was created for this database file, but the'

    def refused(path: str, *options: object, **config: object) -> None:
        raise duckdb.IOException(said)

    monkeypatch.setattr(duckdb, "connect", refused)
    with pytest.raises(StoreError, match="is the log of another state of"), kind(shop.path):
        pass


def mark(shop: Shop) -> None:
    """Leave a log with the mark of a checkpoint that was finished behind it, as a crash does."""
    with Database(shop.path) as db:
        shop._record(db, 3)
        # DuckDB's own means of a test: the header is written, the log with its mark not yet removed.
        db.execute("SET debug_checkpoint_abort = 'before_truncate'")
        with pytest.raises(StoreError, match="Checkpoint aborted"):
            db.execute("CHECKPOINT")
        left = {ending: Path(f"{shop.path}{ending}").read_bytes() for ending in _ENDINGS}
    for ending, content in left.items():
        Path(f"{shop.path}{ending}").write_bytes(content)
    os.utime(shop.path)


def test_the_mark_is_read_in_a_log_of_duckdb_2_0(shop: Shop) -> None:
    mark(shop)
    for begin, foreign in ((_BEGIN_1_5, False), (_BEGIN_2_0, False), (_BEGIN_OF_ANOTHER, True)):
        begin_log(shop, begin)
        os.utime(f"{shop.path}.wal", (0, 0))
        assert has_foreign_log(str(shop.path)) is foreign


def test_the_log_of_a_checkpoint_that_was_finished_is_no_foreign_one(shop: Shop) -> None:
    mark(shop)
    with SharedDatabase(shop.path) as reader:
        assert reader.rows("SELECT count(*) FROM event") == [(3,)]


def test_no_new_file_gets_the_name_of_one_that_left_its_log(shop: Shop, tmp_path: Path) -> None:
    with Database(tmp_path / "other.duckdb") as other:
        take_backup(other, tmp_path / "backup.duckdb")
        os.unlink(shop.path)
        log = Path(f"{shop.path}.wal").read_bytes()
        with pytest.raises(StoreError, match=r"shop\.duckdb\.wal holds what was stored last"):
            take_backup(other, shop.path)
    with pytest.raises(StoreError, match=r"shop\.duckdb\.wal holds what was stored last"):
        restore(tmp_path / "backup.duckdb", shop.path)
    for kind in (SharedDatabase, Database):
        with (
            pytest.raises(StoreError, match=r"shop\.duckdb\.wal holds what was stored last"),
            kind(shop.path),
        ):
            pass
    assert Path(f"{shop.path}.wal").read_bytes() == log
    assert not shop.path.exists()


def test_a_file_of_two_names_is_read_and_not_written(shop: Shop, tmp_path: Path) -> None:
    with Database(shop.path):
        pass
    other = tmp_path / "other.duckdb"
    os.link(shop.path, other)
    with SharedDatabase(other) as db:
        assert db.rows("SELECT count(*) FROM event") == [(2,)]
        with pytest.raises(StoreError, match="has 2 names"):
            shop._record(db, 3)
    os.unlink(other)
    shop.record(3)


def test_what_lies_beside_the_file_lies_there_when_a_link_is_named(shop: Shop, tmp_path: Path) -> None:
    """Else whoever names the file itself would take other turns, and miss the copy of the blocks."""
    links = tmp_path / "links"
    links.mkdir()
    link = links / "linked.duckdb"
    link.symlink_to(Path("..") / shop.path.name)
    with SharedDatabase(link) as db:
        shop._record(db, 3)
        beside = {path.name for path in shop.path.parent.iterdir() if path.is_file()}
        assert beside == {f"shop.duckdb{ending}" for ending in (*_ENDINGS, ".lock")}
    assert [path.name for path in links.iterdir()] == ["linked.duckdb"]


def test_a_link_to_a_file_that_is_not_there_yet_makes_it_there(tmp_path: Path) -> None:
    link = tmp_path / "link.duckdb"
    link.symlink_to(tmp_path / "new.duckdb")
    with SharedDatabase(link):
        pass
    assert link.is_symlink()
    assert (tmp_path / "new.duckdb").stat().st_size > 0


@pytest.mark.parametrize("dated", [False, True])
def test_a_restored_file_whose_log_could_not_be_moved_into_it_gets_no_name(
    tmp_path: Path, make_campaign: Callable[..., Campaign], monkeypatch: pytest.MonkeyPatch, dated: bool
) -> None:
    """As on a full disk: DuckDB closes the file without a word, and the rows of the increment lie in the log alone."""
    folder = tmp_path / "backups"
    folder.mkdir()
    with Database(tmp_path / "shop.duckdb") as db:
        import_campaign(db, make_campaign("one"))
        take_backup(db, folder / "0.duckdb")
        import_campaign(db, make_campaign("two"))
        increment = take_increment(db, folder / "1.duckdb")

    def connect_and_keep_log(*arguments: Any) -> duckdb.DuckDBPyConnection:
        connection = connect(*arguments)
        connection.execute("PRAGMA disable_checkpoint_on_shutdown")
        return connection

    moment = datetime.fromisoformat(increment.made_at).replace(tzinfo=UTC) if dated else None
    for module in ("monitor.store.connection", "monitor.store.copies.restoring"):
        monkeypatch.setattr(f"{module}.connect", connect_and_keep_log)
    with pytest.raises(StoreError, match="could not be moved from its log"):
        restore(folder, tmp_path / "again.duckdb", moment)
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith("again")] == []


def test_a_new_database_whose_log_could_not_be_moved_into_it_gets_no_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, made_anew: None
) -> None:
    def connect_and_keep_log(*arguments: Any) -> duckdb.DuckDBPyConnection:
        connection = connect(*arguments)
        connection.execute("PRAGMA disable_checkpoint_on_shutdown")
        return connection

    monkeypatch.setattr("monitor.store.opening.connect", connect_and_keep_log)
    with pytest.raises(StoreError, match="could not be moved from its log"):
        Database(tmp_path / "new.duckdb")
    assert list(tmp_path.glob("new.duckdb*")) in ([], [tmp_path / "new.duckdb.lock"])


@pytest.mark.parametrize("kind", [SharedDatabase, Database])
@pytest.mark.parametrize(
    "place", ["in the last entry", "behind one", "in the head of one", "all", "behind the head"]
)
def test_a_log_that_ends_in_zeros_is_replayed_as_one_that_is_cut_off(
    shop: Shop, kind: type[Database], place: str
) -> None:
    """As a loss of power leaves it: DuckDB calls it damaged, and nothing that was stored is missing."""
    log = Path(f"{shop.path}.wal")
    content = log.read_bytes()
    begins = [found.start() for found in re.finditer(re.escape(b"d\0\x19"), content)]
    head = _LOG_BEGIN.match(content)
    assert head is not None
    kept = {
        "in the last entry": len(content) - 3, "behind one": begins[-1] - 16, "in the head of one": begins[-1] - 5,
        "all": 0, "behind the head": head.end(),
    }[place]  # fmt: skip
    assert len(begins) > 1
    log.write_bytes(content[:kept] + bytes(len(content) - kept + 5000))
    with pytest.raises(duckdb.Error, match="WAL") if kept else nullcontext():
        duckdb.connect(str(shop.path), read_only=True).close()
    with pytest.raises(StoreError, match="ends in half a write that was cut off"):
        Database(shop.path, read_only=True)
    with kind(shop.path) as db:
        assert verify_audit(db).faults == ()
        # The first event lies in the file.
        assert db.rows("SELECT count(*) FROM event") == [(1,)]
        shop._record(db, 5)
    with Database(shop.path) as db:
        assert verify_audit(db).faults == ()
        assert db.rows("SELECT count(*) FROM event") == [(2,)]


def test_zeros_behind_whole_transactions_take_none_of_them(shop: Shop) -> None:
    with Path(f"{shop.path}.wal").open("ab") as log:
        log.write(bytes(2**20 + 77))
    with SharedDatabase(shop.path) as db:
        assert db.rows("SELECT count(*) FROM event") == [(2,)]


@pytest.mark.parametrize("damage", ["a bit", "another form"])
def test_a_log_that_is_damaged_otherwise_stays_as_it_is(shop: Shop, damage: str) -> None:
    log = Path(f"{shop.path}.wal")
    content = bytearray(log.read_bytes())
    if damage == "a bit":
        content[len(content) // 2] ^= 4
    else:
        content[: len(_BEGIN_1_5)] = _BEGIN_OF_ANOTHER
        content += bytes(100)
    log.write_bytes(content)
    for kind in (SharedDatabase, Database):
        with pytest.raises(StoreError, match="cannot be read, it may be damaged"), kind(shop.path):
            pass
    assert log.read_bytes() == content


def test_a_log_that_somebody_is_writing_is_no_torn_one(shop: Shop) -> None:
    """Half of an entry may be seen that ends in a zero; whoever has the file is waited for."""
    with Path(f"{shop.path}.wal").open("ab") as log:
        log.write(bytes(3))
    assert has_torn_log(str(shop.path))
    look = "import sys; from monitor.store.kept_blocks import has_torn_log; print(has_torn_log(sys.argv[1]))"
    with shop.path.open("r+b") as file:
        fcntl.lockf(file, fcntl.LOCK_EX)  # as DuckDB locks what it writes
        said = subprocess.run(
            [sys.executable, "-c", look, str(shop.path)], capture_output=True, text=True, check=False
        )
    assert said.stdout == "False\n", said.stderr
