"""Blocks kept beside the file before a checkpoint: whatever half a write damaged is put back, and nothing else is.

A crash is made of the files as they lay: the file before and after the checkpoint, its log, and the copy of its blocks.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import duckdb
import pytest

from monitor.exceptions import StoreError
from monitor.records import Campaign
from monitor.store import Database, SharedDatabase, import_campaign, kept_blocks, record_event, verify_audit
from monitor.store.opening import BLOCK_SIZE

HEADER = 4096
HEADERS = 3 * HEADER


@pytest.fixture
def crash(tmp_path: Path, make_campaign: Callable[..., Campaign]) -> Crash:
    """A database with a campaign, to which an event is added."""
    path = tmp_path / "shop.duckdb"
    campaign = make_campaign("one")
    with Database(path) as db:
        import_campaign(db, campaign)
    return Crash(path, campaign.machine.id)


class Crash:
    """The files of a database as a crash leaves them in the checkpoint that follows an event."""

    def __init__(self, path: Path, machine: str) -> None:
        self.path, self.machine = path, machine
        self.before = path.read_bytes()
        with Database(path) as db:
            record_event(db, machine, datetime(2026, 1, 1, tzinfo=UTC), "crash", "x")
            # DuckDB's own means of a test: the header is written, the log with its mark not yet removed.
            db.execute("SET debug_checkpoint_abort = 'before_truncate'")
            with pytest.raises(StoreError, match="Checkpoint aborted"):
                db.execute("CHECKPOINT")
            for ending in (".wal", ".blocks"):
                shutil.copyfile(f"{path}{ending}", f"{path}{ending}-kept")
        self.after = path.read_bytes()

    def leave(self, content: bytes, endings: tuple[str, ...] = (".wal", ".blocks")) -> None:
        """Put the files back as a crash left them."""
        self.path.write_bytes(content)
        for ending in (".wal", ".blocks"):
            Path(f"{self.path}{ending}").unlink(missing_ok=True)
            if ending in endings:
                shutil.copyfile(f"{self.path}{ending}-kept", f"{self.path}{ending}")

    def torn(self, begin: int, share: float = 0.5) -> bytes:
        """The file with all blocks of the checkpoint but no header, and this part of one written only in part."""
        size = HEADER if begin < HEADERS else BLOCK_SIZE
        content = bytearray(self.before[:HEADERS] + self.after[HEADERS:])
        cut = begin + int(size * share)
        old = self.before[cut : begin + size]
        content[begin : begin + size] = self.after[begin:cut] + old + bytes(begin + size - cut - len(old))
        return bytes(content)

    def changed(self) -> Iterator[int]:
        """Where the parts begin that the checkpoint wrote."""
        for begin in (HEADER, 2 * HEADER, *range(HEADERS, len(self.after), BLOCK_SIZE)):
            size = HEADER if begin < HEADERS else BLOCK_SIZE
            if self.before[begin : begin + size] != self.after[begin : begin + size]:
                yield begin

    def check(self) -> None:
        """Everything that was committed is there, for a reader first, and nothing is left beside the file."""
        with SharedDatabase(self.path) as reader:
            assert reader.rows("SELECT count(*) FROM event") == [(1,)]
        with Database(self.path) as db:
            assert verify_audit(db).faults == ()
            record_event(db, self.machine, datetime(2026, 1, 2, tzinfo=UTC), "repair", "y")
        left = {path.name for path in self.path.parent.iterdir() if "-kept" not in path.name}
        assert left <= {"shop.duckdb", "shop.duckdb.lock"}


@pytest.mark.parametrize(
    "share", [0.99, *(pytest.param(share, marks=pytest.mark.all_seeds) for share in (0.01, 0.5))]
)
def test_every_part_of_a_checkpoint_may_be_cut_off_in_the_middle(crash: Crash, share: float) -> None:
    parts = list(crash.changed())
    assert len(parts) > 2
    for begin in parts:
        crash.leave(crash.torn(begin, share))
        crash.check()


def test_without_the_copy_such_a_file_is_refused(crash: Crash) -> None:
    for begin in crash.changed():
        crash.leave(crash.torn(begin))
        if kept_blocks.has_torn_blocks(str(crash.path)):
            break
    crash.leave(crash.torn(begin), (".wal",))
    # Where this fails the engine was mended, and the copies are of no use any more.
    with pytest.raises(StoreError, match="may be damaged"):
        crash.check()


def test_the_copy_of_a_finished_checkpoint_is_removed_and_nothing_put_back(crash: Crash) -> None:
    crash.leave(crash.after, (".blocks",))
    crash.check()


def test_a_copy_that_was_not_finished_is_removed(crash: Crash) -> None:
    crash.leave(crash.before)
    copy = Path(f"{crash.path}.blocks")
    copy.write_bytes(copy.read_bytes()[:-1])
    crash.check()


@pytest.mark.parametrize("length", [0, 6, 3 * 4096 + 6, 3 * 4096 + 8 + 5000])
def test_a_copy_of_another_form_is_none_although_its_sum_is_right(crash: Crash, length: int) -> None:
    """It ended in ``struct.error``."""
    copy = Path(f"{crash.path}.blocks")
    other = (crash.path.read_bytes()[: 3 * 4096] + bytes(6000))[:length]
    copy.write_bytes(kept_blocks._BEGIN + hashlib.sha256(other).digest() + other)
    assert not kept_blocks.has_torn_blocks(str(crash.path))
    assert kept_blocks.settle_blocks(str(crash.path)) == 0
    assert not copy.exists()


def test_a_copy_puts_nothing_into_a_file_that_is_whole(crash: Crash) -> None:
    whole = crash.before[:HEADERS] + crash.after[HEADERS:]
    crash.leave(whole)
    assert kept_blocks.settle_blocks(str(crash.path)) == 0
    assert crash.path.read_bytes() == whole


def test_who_may_only_read_a_torn_file_is_told_what_puts_it_right(crash: Crash) -> None:
    for begin in crash.changed():
        crash.leave(crash.torn(begin))
        if kept_blocks.has_torn_blocks(str(crash.path)):
            break
    torn = crash.path.read_bytes()
    with pytest.raises(StoreError, match=r"half a block of a write that was cut off.*monitor --db .* verify"):
        Database(crash.path, read_only=True)
    assert crash.path.read_bytes() == torn
    crash.check()


def test_the_blocks_of_the_metadata_are_those_that_duckdb_names(tmp_path: Path) -> None:
    path = tmp_path / "plain.duckdb"
    config: dict[str, str | bool | int | float | list[str]] = {"default_block_size": str(BLOCK_SIZE)}
    with duckdb.connect(path, config=config) as connection:
        for table in range(40):
            connection.execute(f"CREATE TABLE t{table} AS SELECT i, random() AS r FROM range(3000) AS r(i)")
    sizes = set()
    for number in range(6):
        with duckdb.connect(path, config=config) as connection:
            for table in range(number, 40, number + 1):
                connection.execute(f"INSERT INTO t{table} SELECT i, random() FROM range(30000) AS r(i)")
                connection.execute(f"DELETE FROM t{table} WHERE r < 0.3")
        with path.open("rb") as file:
            listed = kept_blocks.metadata_blocks(file.fileno())
        with duckdb.connect(path, read_only=True) as connection:
            named = connection.execute("SELECT block_id FROM pragma_metadata_info()").fetchall()
        assert sorted(listed) == sorted(block for (block,) in named)
        sizes.add(len(listed))
    assert max(sizes) > 2


def test_the_lock_of_the_file_holds_while_its_blocks_are_kept(crash: Crash) -> None:
    opening = (
        "import duckdb, sys\ntry: duckdb.connect(sys.argv[1], read_only=True)\n"
        "except duckdb.IOException as fault: sys.exit('Could not set lock' in str(fault) and 7)"
    )
    with Database(crash.path) as db:
        record_event(db, crash.machine, datetime(2026, 1, 3, tzinfo=UTC), "crash", "x")
        assert Path(f"{crash.path}.blocks").exists()
        ended = subprocess.run([sys.executable, "-c", opening, str(crash.path)], check=False)
        assert ended.returncode == 7
    assert subprocess.run([sys.executable, "-c", opening, str(crash.path)], check=False).returncode == 0


def test_the_copy_is_for_those_who_may_read_the_database_and_follows_no_link(crash: Crash) -> None:
    os.chmod(crash.path, 0o640)
    other = crash.path.with_name("other")
    other.write_text("not to be touched")
    copy = Path(f"{crash.path}.blocks")
    copy.symlink_to(other)
    with Database(crash.path) as db:
        record_event(db, crash.machine, datetime(2026, 1, 3, tzinfo=UTC), "crash", "x")
        assert not copy.is_symlink()
        assert stat.S_IMODE(copy.stat().st_mode) == 0o640
    assert other.read_text() == "not to be touched"
    assert not copy.exists()


def test_a_long_session_keeps_the_blocks_of_every_checkpoint(crash: Crash) -> None:
    with Database(crash.path) as db:
        copies = set()
        for number in range(3):
            record_event(db, crash.machine, datetime(2026, 2, 1 + number, tzinfo=UTC), "crash", "x")
            copies.add(Path(f"{crash.path}.blocks").read_bytes())
            db.execute("CHECKPOINT")
    assert len(copies) == 3
