"""Sessions of one open file: each under its user's name, writing in turn, reading beside a writer; and confined."""

from __future__ import annotations

import threading
from pathlib import Path

import duckdb
import pytest

from monitor.store import Database


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
