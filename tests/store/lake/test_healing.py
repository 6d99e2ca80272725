"""A publication tries again what may pass, says at once what stays, and counts once what the lake took."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("duckdb_extension_ducklake", reason="the extra [lake] is not installed")
import duckdb

from monitor.exceptions import InputError, StoreError
from monitor.records import Campaign
from monitor.store import (
    Database,
    SharedDatabase,
    StoredIdentification,
    import_campaign,
    last_entries,
    save_identification,
)
from monitor.store.lake import publication
from monitor.store.lake.publication import Published, publish

Make = Callable[..., Campaign]
Identify = Callable[..., StoredIdentification]


@pytest.fixture
def lake(tmp_path: Path) -> str:
    return f"ducklake:{tmp_path}/shops.ducklake"


def published(path: Path, lake: str, **options: str) -> Published:
    with SharedDatabase(path) as db:
        return publish(db, lake, files=path.parent / "files", **options)


#: What PostgreSQL 15, its client and DuckLake say (2026-11-26), each behind "Unable to connect to Postgres at ...".
LASTING = (
    'connection to server at "h", port 5432 failed: FATAL: password authentication failed for user "pw"',
    'connection to server at "h", port 5432 failed: fe_sendauth: no password supplied',
    'connection to server at "h", port 5432 failed: FATAL: no pg_hba.conf entry for host "h", user "x", no encryption',
    'connection to server on socket "/s" failed: FATAL: role "nobody" does not exist',
    'connection to server at "h", port 5432 failed: FATAL: database "nolake" does not exist',
    'could not translate host name "nohost.invalid" to address: Name or service not known',
    'invalid connection option "foo"',
    'invalid integer value "abc" for connection option "port"',
    'connection to server at "h", port 5432 failed: server does not support SSL, but SSL was required',
    'Failed to commit: Failed to execute query "INSERT": ERROR: permission denied for table ducklake_snapshot',
    "Failed to commit DuckLake transaction: No space left on device",
)
#: Said by a standby until it is promoted, and for ever by a server that is only read.
STANDBY = 'Failed to commit: Failed to execute query "INSERT": ERROR: cannot execute INSERT in a read-only transaction'
#: What PostgreSQL 15 says with lc_messages = de_DE.UTF-8 to whom it does not let in, and while it starts (2026-11-26).
GERMAN = (
    'connection to server on socket "/s" failed: FATAL:  Passwort-Authentifizierung für Benutzer »pw« fehlgeschlagen',
    'connection to server on socket "/s" failed: FATAL:  kein pg_hba.conf-Eintrag für Host »[local]«, Benutzer »x«',
    'connection to server on socket "/s" failed: FATAL:  Datenbank »nolake« existiert nicht',
    'connection to server on socket "/s" failed: FATAL:  das Datenbanksystem startet',
)
#: What PgBouncer says, as its source has it, while all connections are in use or its server is away.
PGBOUNCER = (
    'connection to server at "h", port 6432 failed: FATAL:  query_wait_timeout',
    'Failed to execute query "BEGIN": FATAL:  query_wait_timeout',
    'connection to server at "h", port 6432 failed: FATAL:  client_login_timeout',
    'connection to server at "h", port 6432 failed: FATAL:  no more connections allowed (max_client_conn)',
    'connection to server at "h", port 6432 failed: FATAL:  server login has been failing, cached error: connect '
    "failed (server_login_retry)",
)
PASSING = (
    'connection to server at "h", port 5432 failed: Connection refused Is the server running on that host?',
    'connection to server on socket "/s/.s.PGSQL.5432" failed: No such file or directory Is the server running?',
    'connection to server at "h", port 5432 failed: FATAL: the database system is starting up',
    'connection to server at "h", port 5432 failed: FATAL: sorry, too many clients already',
    'could not translate host name "h" to address: Temporary failure in name resolution: connect to it later',
    'connection to server at "h", port 5432 failed: FATAL: the database system is not yet accepting connections',
    'connection to server at "h", port 5432 failed: FATAL:  canceling authentication due to timeout',
    *PGBOUNCER,
    "server closed the connection unexpectedly",
    'Failed to commit DuckLake transaction: Transaction conflict - attempting to insert into table "certificate"',
)


@pytest.fixture(scope="module")
def ulm(tmp_path_factory: pytest.TempPathFactory, make_campaign: Make) -> Path:
    """A database of one campaign, of which nothing is ever published."""
    path = tmp_path_factory.mktemp("ulm") / "Ulm.duckdb"
    with Database(path) as db:
        import_campaign(db, make_campaign("week 1"))
    return path


@pytest.mark.parametrize(
    ("message", "tries"),
    [
        *((message, 1) for message in LASTING),
        *((message, 3) for message in (STANDBY, *GERMAN)),
        *((message, 4) for message in PASSING),
    ],
    ids=lambda value: re.sub(r"[^a-z]+", "-", value[-40:].lower()) if isinstance(value, str) else None,
)
def test_what_can_not_heal_is_said_at_once(
    ulm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, message: str, tries: int
) -> None:
    """A wrong password was tried for 104 s."""
    calls: list[str] = []

    def attach(connection: object, address: str, *options: str) -> None:
        calls.append(address)
        raise StoreError(f"Unable to connect to Postgres at host=h: {message}")

    monkeypatch.setattr(publication, "attach", attach)
    # Loading the extensions takes longer than all the rest.
    monkeypatch.setattr(publication, "connection_with_extensions", duckdb.connect)
    monkeypatch.setattr(publication, "_TRIES", 4)
    monkeypatch.setattr(publication, "_TRIES_OF_UNSURE", 3)
    monkeypatch.setattr(publication.time, "sleep", lambda seconds: None)
    with SharedDatabase(ulm) as db, pytest.raises(StoreError, match="Unable to connect"):
        publish(db, f"ducklake:{tmp_path}/lake.ducklake", files=tmp_path / "files")
    assert len(calls) == tries


def test_a_commit_whose_answer_was_lost_is_counted_once(
    tmp_path: Path, make_campaign: Make, make_identification: Identify, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The lake has it: it was published by this call, although the network went away before it said so."""
    campaign = make_campaign("week 1")
    with Database(tmp_path / "Ulm.duckdb") as db:
        import_campaign(db, campaign)
        save_identification(db, make_identification(campaign))
        entries = last_entries(db, 1)[0].entry
    monkeypatch.setattr(publication, "PORTION", 2)
    monkeypatch.setattr(publication.time, "sleep", lambda seconds: None)
    whole = published(tmp_path / "Ulm.duckdb", f"ducklake:{tmp_path}/whole.ducklake")
    original = publication._Publisher._commit
    commits: list[int] = []

    def answer_is_lost(self: publication._Publisher) -> None:
        original(self)
        commits.append(1)
        if self._sent is not None and self._sent[1] in (2, entries):
            raise duckdb.IOException("server closed the connection unexpectedly")

    monkeypatch.setattr(publication._Publisher, "_commit", answer_is_lost)
    broken = published(tmp_path / "Ulm.duckdb", f"ducklake:{tmp_path}/broken.ducklake")
    assert (broken.entries, broken.rows, broken.last_entry) == (entries, whole.rows, entries)
    assert broken.tries > whole.tries


def test_a_plant_keeps_the_name_of_its_first_publication(
    tmp_path: Path, make_campaign: Make, lake: str
) -> None:
    """Another name was passed over without a word."""
    with Database(tmp_path / "Ulm.duckdb") as db:
        import_campaign(db, make_campaign("week 1"))
    published(tmp_path / "Ulm.duckdb", lake)
    with pytest.raises(InputError, match=r"Ulm\.duckdb as plant 'Ulm' since .* leave --plant 'Aalen' out"):
        published(tmp_path / "Ulm.duckdb", lake, plant="Aalen")
    assert published(tmp_path / "Ulm.duckdb", lake, plant="Ulm").entries == 0


def test_no_lake_is_made_whose_files_have_no_folder(tmp_path: Path, make_campaign: Make, lake: str) -> None:
    with Database(tmp_path / "Ulm.duckdb") as db:
        import_campaign(db, make_campaign("week 1"))
    with (
        SharedDatabase(tmp_path / "Ulm.duckdb") as db,
        pytest.raises(InputError, match=r"--files .*Ulm\.duckdb/x: nothing can be written to .*Ulm\.duckdb$"),
    ):
        publish(db, lake, files=tmp_path / "Ulm.duckdb" / "x")
    assert not Path(lake.removeprefix("ducklake:")).exists()
