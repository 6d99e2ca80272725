"""Incremental backups are put together to the database row by row; what a moment had, and no more, is put back."""

from __future__ import annotations

import gzip
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import duckdb
import pytest

from monitor.exceptions import InputError, StoreError
from monitor.records import Campaign
from monitor.store import (
    Database,
    StoredIdentification,
    import_campaign,
    list_backups,
    mark_certificate,
    record_event,
    restore,
    save_analysis,
    save_certificate,
    save_identification,
    save_model,
    take_backup,
    take_increment,
    verify_audit,
    withdraw_campaign,
)
from monitor.store.copies.manifest import file_sha256

ARCHIVES = Path(__file__).parents[1] / "archives"


def tables(db: Database) -> dict[str, list[tuple[object, ...]]]:
    """Every row of every table as text, by plain SQL."""
    names = [name for (name,) in db.rows("SELECT table_name FROM duckdb_tables() ORDER BY ALL")]
    return {name: sorted(db.rows(f"SELECT CAST(t AS VARCHAR) FROM {name} AS t")) for name in names}


def live(
    db: Database,
    make_campaign: Callable[..., Campaign],
    make_identification: Callable[..., StoredIdentification],
    number: int,
) -> None:
    """Something of everything that is stored in a week: the campaign before is withdrawn, its certificate too."""
    campaign = make_campaign(f"week {number}", machine_id=f"MILL {number // 2}")
    import_campaign(db, campaign, notes=("a run is short",))
    save_model(db, "samba", ["EA0B"])
    save_identification(db, make_identification(campaign))
    save_analysis(db, "statistics", {"mean": 0.1 * number}, method="by day", campaign=campaign.name)
    save_certificate(db, f"C-{number}", "issued", campaign.name, [1], {"a": number}, b"pdf")
    record_event(db, campaign.machine.id, datetime(2026, 1, 1 + number, tzinfo=UTC), "crash", "x")
    if number:
        withdraw_campaign(db, f"week {number - 1}", "wrong balls")
        mark_certificate(db, f"C-{number - 1}", "withdrawn", "wrong balls")


State = tuple[datetime, dict[str, list[tuple[object, ...]]]]


@pytest.fixture(scope="module")
def weeks_once(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[State]]:
    """A folder that the first test fills and all copy, and its states."""
    return tmp_path_factory.mktemp("weeks"), []


@pytest.fixture
def weeks(
    path: Path,
    tmp_path: Path,
    weeks_once: tuple[Path, list[State]],
    make_campaign: Callable[..., Campaign],
    make_identification: Callable[..., StoredIdentification],
) -> tuple[Path, list[State]]:
    """A folder with a full backup and two incremental ones; moment and tables after each week."""
    once, states = weeks_once
    for number in range(0 if states else 3):
        # Opened anew, as a verb does.
        with Database(once / "live.duckdb", actor="the test") as db:
            live(db, make_campaign, make_identification, number)
            states.append((datetime.now(UTC), tables(db)))
            (take_increment if number else take_backup)(db, once / f"{number}.duckdb")
    folder = tmp_path / "backups"
    shutil.copytree(once, folder, ignore=shutil.ignore_patterns("live*"))
    shutil.copyfile(once / "live.duckdb", path)
    return folder, states


@pytest.mark.slow
def test_every_backup_of_a_chain_is_the_database_of_its_moment(
    weeks: tuple[Path, list[State]], tmp_path: Path
) -> None:
    folder, states = weeks
    assert [backup.span.previous is not None for backup in list_backups(folder)] == [False, True, True]
    for number, (moment, expected) in enumerate(states):
        for name, source, at in (
            ("file", folder / f"{number}.duckdb", None),
            ("moment", folder, moment),
            ("early", folder / "2.duckdb", moment),
        ):
            back = tmp_path / f"{name}{number}.duckdb"
            restored = restore(source, back, at)
            assert restored.faults == ()
            with Database(back) as db:
                assert tables(db) == expected
                assert verify_audit(db).faults == ()
    # The newest where nothing else is asked for; and it goes on from there.
    restore(folder, tmp_path / "newest.duckdb")
    with Database(tmp_path / "newest.duckdb") as db:
        assert tables(db) == states[2][1]
        record_event(db, "MILL 0", datetime(2026, 6, 1, tzinfo=UTC), "crash", "x")
        assert take_increment(db, folder / "3.duckdb").tables["audit"][0] == 1
    assert sorted(path.name for path in tmp_path.glob("*.partial*")) == []


def test_the_middle_of_a_chain_is_the_database_of_its_moment(
    weeks: tuple[Path, list[State]], tmp_path: Path
) -> None:
    """All of them, by file and by moment: the slow test above."""
    folder, states = weeks
    moment, expected = states[1]
    assert restore(folder, tmp_path / "back.duckdb", moment).faults == ()
    with Database(tmp_path / "back.duckdb") as db:
        assert tables(db) == expected


def test_an_incremental_backup_holds_only_what_is_new(
    weeks: tuple[Path, list[State]],
) -> None:
    folder, states = weeks
    before, after = (len(states[number][1]["audit"]) for number in (0, 1))
    backup = list_backups(folder)[1]
    assert backup.span is not None
    assert (backup.span.first_entry, backup.span.last_entry, backup.span.previous) == (
        before + 1,
        after,
        "0.duckdb",
    )
    assert backup.tables["audit"][0] == after - before
    assert {table: rows for table, (rows, _) in backup.span.totals.items()} == {
        table: len(rows) for table, rows in states[1][1].items()
    }


def test_where_nothing_is_new_no_file_is_made_and_the_newest_backup_says_so(
    weeks: tuple[Path, list[State]], path: Path, tmp_path: Path
) -> None:
    folder, states = weeks
    before = list_backups(folder)
    files = sorted(file.name for file in folder.iterdir())
    with Database(path) as db:
        backup = take_increment(db, folder / "3.duckdb")
    moment = datetime.now(UTC)
    assert sorted(file.name for file in folder.iterdir()) == files
    assert replace(backup, current_at=None) == before[-1]
    # What was so at that moment is known now, and still refused of a later one.
    assert backup.current_at is not None
    known = datetime.fromisoformat(backup.current_at).replace(tzinfo=UTC)
    restored = restore(folder, tmp_path / "back.duckdb", known)
    assert restored.faults == ()
    with Database(tmp_path / "back.duckdb") as db:
        assert tables(db) == states[2][1]
    with pytest.raises(InputError, match=r"is later than the newest backup in .*, which holds all until"):
        restore(folder, tmp_path / "later.duckdb", moment + timedelta(seconds=1))
    # And it goes on from there.
    with Database(path) as db:
        record_event(db, "MILL 0", datetime(2026, 6, 1, tzinfo=UTC), "crash", "x")
        assert take_increment(db, folder / "3.duckdb").tables["audit"][0] == 1


def test_what_a_killed_backup_left_is_none(
    weeks: tuple[Path, list[State]], path: Path, tmp_path: Path
) -> None:
    """A manifest that was cut off before it had its name (seed 2118 of the trial of kills)."""
    folder, _ = weeks
    before = list_backups(folder)
    (folder / "3.duckdb.partial").write_bytes(b"half")
    (folder / "3.duckdb.partial.manifest.json").write_text("")
    assert list_backups(folder) == before
    assert restore(folder, tmp_path / "back.duckdb").faults == ()
    with Database(path) as db:
        record_event(db, "MILL 0", datetime(2026, 6, 1, tzinfo=UTC), "crash", "x")
        take_increment(db, folder / "3.duckdb")
    assert [backup.path for backup in list_backups(folder)][-1] == "3.duckdb"
    assert not list(folder.glob("*.partial*"))


def test_a_chain_that_is_not_whole_is_refused(weeks: tuple[Path, list[State]], tmp_path: Path) -> None:
    folder, states = weeks
    back = tmp_path / "back.duckdb"
    damaged = bytearray((folder / "1.duckdb").read_bytes())
    whole = bytes(damaged)
    damaged[len(damaged) // 2] ^= 1
    (folder / "1.duckdb").write_bytes(damaged)
    with pytest.raises(StoreError, match=r"1\.duckdb is not what its manifest says: its SHA-256 differs"):
        restore(folder / "2.duckdb", back)
    (folder / "1.duckdb").write_bytes(whole)
    manifest = folder / "1.duckdb.manifest.json"
    text = manifest.read_text("utf-8")
    manifest.write_text(text.replace(list_backups(folder)[1].sha256, "0" * 64))
    with pytest.raises(StoreError, match=r"1\.duckdb is not the backup that 2\.duckdb follows"):
        restore(folder / "2.duckdb", back)
    # Who changes file and manifest alike still has to meet the rows that the last manifest counts.
    document = json.loads(text)
    document["tables"].pop("event")
    manifest.write_text(json.dumps(document))
    with pytest.raises(StoreError, match=r"2\.duckdb is not what its manifest says: its tables differ"):
        restore(folder / "2.duckdb", back)
    manifest.write_text(text)
    (folder / "1.duckdb").rename(tmp_path / "elsewhere")
    with pytest.raises(StoreError, match=r"there is no backup .*1\.duckdb, which 2\.duckdb follows"):
        restore(folder / "2.duckdb", back)
    with pytest.raises(InputError, match="is later than the newest backup in"):
        restore(folder, back, datetime.now(UTC) + timedelta(days=1))
    with pytest.raises(InputError, match=r"is before the first entry of the audit, of 20\d\d-"):
        restore(folder, back, states[0][0] - timedelta(days=1))
    assert sorted(path.name for path in tmp_path.glob("back.*")) == []


def test_an_incremental_backup_needs_one_that_this_database_followed(
    weeks: tuple[Path, list[State]], path: Path, tmp_path: Path
) -> None:
    folder, _ = weeks
    nothing = pytest.raises(StoreError, match=r"has no backup of .* that an incremental one could follow")
    with Database(path) as db, nothing:
        take_increment(db, tmp_path / "3.duckdb")
    # Put back to the first week: it no longer follows the newest backup.
    shutil.copyfile(folder / "0.duckdb", tmp_path / "early.duckdb")
    another = pytest.raises(StoreError, match=r"has another past than its newest backup 2\.duckdb")
    with Database(tmp_path / "early.duckdb") as db, another:
        take_increment(db, folder / "3.duckdb")
    # A row that no entry of the audit names.
    with Database(path) as db:
        db.execute("INSERT INTO event SELECT * REPLACE (event_id + 1000 AS event_id) FROM event LIMIT 1")
        with pytest.raises(
            StoreError, match=r"the table event has 4 rows; 2\.duckdb and what the audit names .* are 3"
        ):
            take_increment(db, folder / "3.duckdb")
    assert sorted(name.name for name in folder.glob("3.*")) == []


def test_what_an_altered_database_gives_back_is_said(
    weeks: tuple[Path, list[State]], path: Path, tmp_path: Path
) -> None:
    folder, states = weeks
    with Database(path) as db:
        db.execute("UPDATE event SET description = 'y' WHERE event_id = 1")
        take_backup(db, folder / "3.duckdb")
    restored = restore(folder / "3.duckdb", tmp_path / "back.duckdb", states[1][0])
    assert restored.faults == ("event 1 was altered after it was stored",)


@pytest.mark.parametrize("version", ["0.1.0", "0.2.0"])
def test_a_backup_of_every_release_is_put_back(version: str, tmp_path: Path) -> None:
    """It was refused: what was opened for reading only could not be brought to the present schema."""
    old = tmp_path / "old.duckdb"
    old.write_bytes(gzip.decompress((ARCHIVES / f"monitor-{version}.duckdb.gz").read_bytes()))
    with duckdb.connect(str(old), read_only=True) as connection:
        names = [name for (name,) in connection.execute("SELECT table_name FROM duckdb_tables()").fetchall()]
        sums = {
            name: connection.execute(
                f"SELECT count(*), CAST(coalesce(sum(CAST(hash(t) AS HUGEINT)), 0) AS VARCHAR) FROM {name} AS t"
            ).fetchone()
            for name in names
        }
    manifest = {
        "path": old.name, "sha256": file_sha256(old), "made_at": "2026-01-01T00:00:00", "software_version": version,
        "duckdb_version": duckdb.__version__, "tables": sums,
    }  # fmt: skip
    (tmp_path / "old.duckdb.manifest.json").write_text(json.dumps(manifest))
    restore(old, tmp_path / "back.duckdb")
    assert (tmp_path / "back.duckdb").read_bytes() == old.read_bytes()
    with Database(tmp_path / "back.duckdb") as db:
        assert verify_audit(db).faults == ()


def test_a_clock_that_was_set_back_hides_no_backup_and_takes_no_machine_away(
    tmp_path: Path, make_campaign: Callable[..., Campaign], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten days back behind the first backup, and right again later: the newest is the last of the chain."""
    moment = datetime(2026, 3, 1, 12, tzinfo=UTC)

    def set_clock(days: float) -> None:
        now = (moment + timedelta(days=days)).replace(tzinfo=None)
        for module in ("connection", "audit", "campaigns", "events"):
            monkeypatch.setattr(f"monitor.store.{module}.utc_now", lambda: now)

    folder = tmp_path / "backups"
    folder.mkdir()
    with Database(tmp_path / "shop.duckdb") as db:
        set_clock(0)
        import_campaign(db, make_campaign("first"))
        take_backup(db, folder / "0.duckdb")
        set_clock(-10)
        import_campaign(db, make_campaign("second"))
        take_increment(db, folder / "1.duckdb")
        set_clock(1)
        import_campaign(db, make_campaign("third"))
        take_increment(db, folder / "2.duckdb")
        set_clock(-9)
        record_event(db, make_campaign("first").machine.id, moment, "crash", "x")
        take_increment(db, folder / "3.duckdb")
    assert [backup.path for backup in list_backups(folder)] == [f"{number}.duckdb" for number in range(4)]

    newest = restore(folder, tmp_path / "newest.duckdb")
    assert newest.backup.path == "3.duckdb"
    assert newest.last_entry == 4
    assert newest.faults == ()
    between = restore(folder, tmp_path / "between.duckdb", moment + timedelta(days=0.5))
    assert between.last_entry == 2
    assert between.faults == ()
