"""Sessions of one open file: each under its user's name, writing in turn, reading beside a writer; and confined."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import duckdb
import pytest

from monitor.exceptions import StoreError
from monitor.records import Campaign
from monitor.store import (
    Database,
    Recalled,
    import_campaign,
    record_event,
    restore,
    take_backup,
    take_increment,
)
from monitor.store.copies import backup, increment


def test_sessions_write_in_turn_and_lose_nothing(tmp_path: Path) -> None:
    with Database(tmp_path / "x.duckdb", threads=1) as db:
        db.execute("CREATE TABLE counted (n INTEGER PRIMARY KEY, actor TEXT)")

        def count(actor: str) -> None:
            session = db.session(actor)
            for _ in range(40):
                with session.transaction():
                    number = session.next_number("counted", "n")
                    session.execute("INSERT INTO counted VALUES (?, ?)", [number, session.actor])
            session.close()

        writers = [threading.Thread(target=count, args=(actor,)) for actor in ("ada", "bob", "eve")]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
        assert db.rows("SELECT actor, count(*), min(n) > 0 FROM counted GROUP BY ALL ORDER BY actor") == [
            ("ada", 40, True), ("bob", 40, True), ("eve", 40, True),
        ]  # fmt: skip
        assert db.rows("SELECT max(n) FROM counted") == [(120,)]


def test_a_session_reads_what_was_stored_while_another_writes(tmp_path: Path) -> None:
    with Database(tmp_path / "x.duckdb", threads=1) as db:
        db.execute("CREATE TABLE counted (n INTEGER)")
        reader = db.session("reader")
        with db.transaction():
            db.execute("INSERT INTO counted VALUES (1)")
            assert reader.rows("SELECT count(*) FROM counted") == [(0,)]
        assert reader.rows("SELECT count(*) FROM counted") == [(1,)]
        reader.close()


def test_a_block_that_reads_sees_one_moment_and_keeps_nobody_from_writing(tmp_path: Path) -> None:
    with Database(tmp_path / "x.duckdb", threads=1) as db, closing(db.session("reader")) as reader:
        db.execute("CREATE TABLE counted (n INTEGER)")
        db.recalled = reader.recalled = Recalled()
        count = "SELECT count(*) FROM counted"
        with reader.reading():
            before = reader.rows(count)
            with db.transaction():
                db.execute("INSERT INTO counted VALUES (1)")
            reader.execute("CREATE TEMP TABLE remembered AS FROM counted")
            with reader.reading():
                assert reader.rows(count) == before == [(0,)]
            # What may be past is not held for those who ask later.
            assert reader.recall("count", lambda: reader.rows(count)) == [(0,)]
            assert db.recall("count", lambda: db.rows(count)) == [(1,)]
        assert reader.rows(count) == [(1,)]
        assert reader.rows("SELECT count(*) FROM remembered") == [(0,)]
        with pytest.raises(StoreError, match="stores nothing"), reader.reading(), reader.transaction():
            pass
        with pytest.raises(duckdb.CatalogException, match="no_table"), reader.reading():
            reader.rows("FROM no_table")
        assert reader.rows(count) == [(1,)]


def last_entry(db: Database) -> tuple[int, datetime, str]:
    ((number, made_at, sha256),) = db.rows(
        "SELECT entry, made_at, entry_sha256 FROM audit ORDER BY entry DESC LIMIT 1"
    )
    return number, made_at, sha256


@pytest.mark.parametrize("incremental", [False, True])
def test_a_backup_of_a_session_shows_the_moment_that_it_states(
    tmp_path: Path, make_campaign: Callable[..., Campaign], monkeypatch: pytest.MonkeyPatch, incremental: bool
) -> None:
    """Another session stores while the rows are copied, counted and compared; the backup holds what was before."""
    campaign = make_campaign("one")
    with Database(tmp_path / "x.duckdb", threads=1) as db, closing(db.session("another")) as other:
        import_campaign(db, campaign)
        if incremental:
            take_backup(db, tmp_path / "full.duckdb")
            record_event(db, campaign.machine.id, datetime(2026, 1, 1, tzinfo=UTC), "note", "since then")
        before = last_entry(db)
        module = increment if incremental else backup
        stored: list[datetime] = []

        def storing(db: Database, catalog: str | None = None) -> Any:
            sums = checksums(db, catalog)
            record_event(
                other,
                campaign.machine.id,
                datetime(2026, 1, 1, tzinfo=UTC),
                "note",
                f"meanwhile {len(stored)}",
            )
            stored.append(last_entry(other)[1])
            return sums

        checksums = module.checksums
        monkeypatch.setattr(module, "checksums", storing)
        copy = (take_increment if incremental else take_backup)(db, tmp_path / "copy.duckdb")
        assert stored
        assert before[1] < datetime.fromisoformat(copy.made_at) < min(stored)
        assert copy.span is not None
        assert (copy.span.last_entry, copy.span.last_sha256) == (before[0], before[2])
        again = tmp_path / "again.duckdb"
        source = tmp_path if incremental else tmp_path / "copy.duckdb"
        assert restore(source, again).faults == ()
        with Database(again) as restored:
            assert last_entry(restored) == before
        monkeypatch.undo()
        following = take_increment(db, tmp_path / "next.duckdb").span
        assert following is not None
        assert following.first_entry == before[0] + 1


def test_a_confined_file_reaches_no_other(tmp_path: Path) -> None:
    secret, room = tmp_path / "secret.csv", tmp_path / "room"
    room.mkdir()
    secret.write_text("a\n1\n")
    with Database(tmp_path / "x.duckdb", threads=1) as db:
        db.confine(room)
        session = db.session("ada")
        for query in (
            f"SELECT * FROM '{secret}'",
            f"COPY (SELECT 1) TO '{secret}'",
            f"ATTACH '{tmp_path / 'y'}'",
        ):
            with pytest.raises(duckdb.PermissionException, match="file system operations are disabled"):
                session.execute(query)
        with pytest.raises(duckdb.Error, match=r"locked|Cannot"):
            session.execute("SET enable_external_access = true")
        session.execute(f"COPY (SELECT 1 AS a) TO '{room / 'out.csv'}'")
        session.close()
        db.execute("CREATE TABLE kept (n INTEGER)")  # its own file it may write
        db.execute("CHECKPOINT")
    assert (room / "out.csv").read_text() == "a\n1\n"
