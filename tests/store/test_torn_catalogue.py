"""A lake's catalogue in a DuckDB file outlives half a write: its metadata blocks are kept, as those of a database."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

import pytest

pytest.importorskip("duckdb_extension_ducklake", reason="the extra [lake] is not installed")
import duckdb

from monitor.exceptions import StoreError
from monitor.records import Campaign
from monitor.store import Database, SharedDatabase, import_campaign, kept_blocks, record_event
from monitor.store.lake import publication
from monitor.store.lake.attaching import catalogue_file, connection_with_extensions
from monitor.store.lake.publication import publish
from monitor.store.lake.reading import LakeDatabase

HEADER = 4096
HEADERS = 3 * HEADER
#: Of a file that DuckDB makes by itself.
BLOCK_SIZE = 262144
BESIDE = (".wal", ".blocks")


def publish_from(path: Path, address: str) -> None:
    with SharedDatabase(path) as db:
        publish(db, address, files=path.parent / "files")


class Crash:
    """The catalogue of a lake as a crash leaves it in the checkpoint that follows a second publication."""

    def __init__(self, folder: Path, campaign: Campaign, patch: pytest.MonkeyPatch) -> None:
        self.plant, self.catalogue = folder / "Ulm.duckdb", folder / "shops.ducklake"
        self.address, self.machine = f"ducklake:{self.catalogue}", campaign.machine.id
        with Database(self.plant) as db:
            import_campaign(db, campaign)
        publish_from(self.plant, self.address)
        self.before = self.catalogue.read_bytes()
        with Database(self.plant) as db:
            record_event(db, self.machine, datetime(2026, 1, 1, tzinfo=UTC), "crash", "x")

        def aborting() -> duckdb.DuckDBPyConnection:
            # DuckDB's own means of a test: the header is written, the log with its mark not yet removed.
            connection = connection_with_extensions()
            connection.execute("SET debug_checkpoint_abort = 'before_truncate'")
            return connection

        with patch.context() as dying:
            dying.setattr(publication, "connection_with_extensions", aborting)
            dying.setattr(publication, "settle_blocks", lambda path: 0)
            with suppress(StoreError, duckdb.Error):
                publish_from(self.plant, self.address)
        for ending in BESIDE:
            shutil.copyfile(f"{self.catalogue}{ending}", f"{self.catalogue}{ending}-kept")
        self.after = self.catalogue.read_bytes()

    def changed(self) -> Iterator[int]:
        """Where the parts begin that the checkpoint wrote where something stood."""
        for begin in (HEADER, 2 * HEADER, *range(HEADERS, len(self.before), BLOCK_SIZE)):
            size = HEADER if begin < HEADERS else BLOCK_SIZE
            if self.before[begin : begin + size] != self.after[begin : begin + size]:
                yield begin

    def leave(self, begin: int, share: float, endings: tuple[str, ...] = BESIDE) -> None:
        """Put the files back with this part of the checkpoint written only in part, and the header not yet."""
        size = HEADER if begin < HEADERS else BLOCK_SIZE
        cut = begin + int(size * share)
        content = bytearray(self.before[:HEADERS] + self.after[HEADERS:])
        content[begin : begin + size] = self.after[begin:cut] + self.before[cut : begin + size]
        self.catalogue.write_bytes(content)
        for ending in BESIDE:
            Path(f"{self.catalogue}{ending}").unlink(missing_ok=True)
            if ending in endings:
                shutil.copyfile(f"{self.catalogue}{ending}-kept", f"{self.catalogue}{ending}")

    def check(self) -> None:
        """Everything that was published is there, for a reader first, and the next publication goes on behind it."""
        with LakeDatabase(self.address) as lake:
            assert lake.rows("SELECT count(*) FROM event") == [(1,)]
            assert lake.rows("SELECT count(*) FROM imported_campaign") == [(1,)]
        with SharedDatabase(self.plant) as db:
            assert publish(db, self.address).entries == 0
        assert not Path(f"{self.catalogue}.blocks").exists()


@pytest.fixture
def crash(tmp_path: Path, make_campaign: Callable[..., Campaign], monkeypatch: pytest.MonkeyPatch) -> Crash:
    return Crash(tmp_path, make_campaign("one"), monkeypatch)


@pytest.mark.slow
def test_every_part_of_a_catalogues_checkpoint_may_be_cut_off(crash: Crash) -> None:
    parts = list(crash.changed())
    assert len(parts) > 1
    for begin in parts:
        for share in (0.01, 0.3, 0.99):
            crash.leave(begin, share)
            crash.check()


def test_without_the_copy_such_a_catalogue_is_refused(crash: Crash) -> None:
    torn = []
    for begin in crash.changed():
        crash.leave(begin, 0.01)
        if kept_blocks.has_torn_blocks(str(crash.catalogue)):
            torn.append(begin)
    assert max(torn) >= HEADERS
    crash.leave(max(torn), 0.01, (".wal",))
    # Where this fails the engine was mended, and the copies are of no use any more.
    with pytest.raises(StoreError, match="cannot be opened"):
        crash.check()


def test_who_may_only_read_a_torn_catalogue_is_told_who_puts_it_right(
    crash: Crash, monkeypatch: pytest.MonkeyPatch
) -> None:
    for begin in crash.changed():
        crash.leave(begin, 0.01)
        if kept_blocks.has_torn_blocks(str(crash.catalogue)):
            break
    torn = crash.catalogue.read_bytes()
    with monkeypatch.context() as patch:
        # As for a user who may not write: the file is not opened, and nothing put back.
        patch.setattr(kept_blocks.os, "open", _read_only(os.open))
        with (
            pytest.raises(StoreError, match=r"half a block .* may write the file"),
            LakeDatabase(crash.address),
        ):
            pass
    assert crash.catalogue.read_bytes() == torn
    crash.check()


def _read_only(opened: Callable[..., int]) -> Callable[..., int]:
    def refuse(path: str, flags: int, *more: object) -> int:
        if flags & (os.O_WRONLY | os.O_RDWR):
            raise PermissionError(path)
        return opened(path, flags, *more)

    return refuse


def test_only_a_catalogue_in_a_file_has_blocks() -> None:
    assert catalogue_file("ducklake:postgres:dbname=lake host=db.example.org") is None
    assert catalogue_file("ducklake:mysql:db") is catalogue_file("ducklake:sqlite:lake.sqlite") is None
    assert catalogue_file("ducklake:/mnt/lake/shops.ducklake") == "/mnt/lake/shops.ducklake"
    assert catalogue_file("ducklake:duckdb:shops.ducklake") == "shops.ducklake"
