"""A backup equals its original, and what is put back is the backup, byte for byte, or nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from monitor.exceptions import InputError, StoreError
from monitor.records import Campaign
from monitor.store import (
    Database,
    export_tables,
    import_campaign,
    list_backups,
    load_campaign,
    restore,
    take_backup,
    verify_audit,
)
from monitor.workflow.keeping import ExportRequest, export


def test_restored_backup_is_the_database(filled: Database, campaign: Campaign, tmp_path: Path) -> None:
    made = take_backup(filled, tmp_path / "it's.duckdb")
    assert made.tables["probing"][0] == 6
    assert restore(tmp_path / "it's.duckdb", tmp_path / "back.duckdb").backup == made
    with Database(tmp_path / "back.duckdb") as db:
        assert verify_audit(db).ok
        assert verify_audit(db).last_sha256 == verify_audit(filled).last_sha256
        assert load_campaign(db, campaign.name).files == campaign.files
        for catalogue in ("duckdb_tables()", "duckdb_views()", "duckdb_columns()"):
            sql = f"SELECT comment FROM {catalogue} WHERE database_name = current_database() AND NOT internal"
            assert sorted(db.rows(sql)) == sorted(filled.rows(sql))


def test_database_is_in_use_as_before_after_a_backup(
    filled: Database, make_campaign: Callable[..., Campaign], tmp_path: Path
) -> None:
    take_backup(filled, tmp_path / "one.duckdb")
    import_campaign(filled, make_campaign("later"))
    assert take_backup(filled, tmp_path / "two.duckdb").tables["probing"][0] == 12
    assert sorted(path.name for path in tmp_path.glob("*.partial*")) == []


def test_backup_of_a_database_opened_for_reading(filled: Database, path: Path, tmp_path: Path) -> None:
    filled.close()
    with Database(path, read_only=True) as db:
        assert take_backup(db, tmp_path / "copy.duckdb").tables["run"][0] == 2


def test_backups_are_listed_in_the_order_of_their_making(filled: Database, tmp_path: Path) -> None:
    made = [take_backup(filled, tmp_path / f"{name}.duckdb") for name in ("second ü", "first")]
    assert list_backups(tmp_path) == tuple(made)


def test_backup_refuses_to_overwrite(filled: Database, tmp_path: Path) -> None:
    (tmp_path / "there.duckdb").write_text("mine")
    with pytest.raises(StoreError, match=r"there\.duckdb exists already"):
        take_backup(filled, tmp_path / "there.duckdb")
    with pytest.raises(StoreError, match="does not exist; make it first"):
        take_backup(filled, tmp_path / "nowhere" / "b.duckdb")


def test_restore_refuses_what_its_manifest_does_not_say(filled: Database, tmp_path: Path) -> None:
    backup = tmp_path / "b.duckdb"
    take_backup(filled, backup)
    with pytest.raises(StoreError, match=r"there is no backup .*none"):
        restore(tmp_path / "none", tmp_path / "back.duckdb")
    with pytest.raises(StoreError, match="exists already"):
        restore(backup, backup)
    content = bytearray(backup.read_bytes())
    content[len(content) // 2] ^= 1
    backup.write_bytes(content)
    with pytest.raises(StoreError, match="is not what its manifest says: its SHA-256 differs"):
        restore(backup, tmp_path / "back.duckdb")
    manifest = backup.with_name("b.duckdb.manifest.json")
    manifest.write_text("[]")
    with pytest.raises(StoreError, match="is not a manifest of a backup"):
        restore(backup, tmp_path / "back.duckdb")
    manifest.unlink()
    with pytest.raises(StoreError, match=r"has no manifest b\.duckdb\.manifest\.json"):
        restore(backup, tmp_path / "back.duckdb")
    assert sorted(path.name for path in tmp_path.glob("back*")) == []


def test_csv_export_has_every_table_view_and_file(
    filled: Database, campaign: Campaign, tmp_path: Path
) -> None:
    written = export_tables(filled, tmp_path / "it's")
    assert all(path.is_file() for path in written)
    parameters = pd.read_csv(tmp_path / "it's" / "v_parameters.csv")
    assert sorted(parameters["parameter"].unique()) == ["EA0B", "EX0C", "EX0C1"]
    columns = pd.read_csv(tmp_path / "it's" / "columns.csv")
    assert set(columns["table_name"]) == {path.stem for path in written if path.parent.name == "it's"} - {
        "columns"
    }
    for file in campaign.files:
        assert (tmp_path / "it's" / "source_files" / "1" / file.name).read_bytes() == file.content


def test_a_table_without_rows_is_named(filled: Database, tmp_path: Path) -> None:
    answer = export(filled, ExportRequest(tmp_path / "out", "csv", ("v_parameters", "events")))
    assert answer.notes == ("v_events: no row",)
    machine = filled.rows("SELECT machine FROM machine")[0][0]
    answer = export(filled, ExportRequest(tmp_path / "of", "csv", ("v_parameters", "events"), machine))
    assert answer.notes == (f"v_events: no row of {machine}",)


def test_parquet_export_has_every_row_and_byte(filled: Database, campaign: Campaign, tmp_path: Path) -> None:
    export_tables(filled, tmp_path / "out", "parquet")
    files = filled.rows(f"SELECT file, content FROM '{tmp_path}/out/source_file.parquet' ORDER BY file")
    assert files == [(file.name, file.content) for file in campaign.files]


def test_export_writes_only_inside_its_folder(
    db: Database, make_campaign: Callable[..., Campaign], tmp_path: Path
) -> None:
    import_campaign(db, make_campaign(files=(("../../escaped.csv", b"x"),)))
    export_tables(db, tmp_path / "a" / "b")
    assert [str(path.relative_to(tmp_path)) for path in tmp_path.rglob("escaped.csv")] == [
        "a/b/source_files/1/escaped.csv"
    ]


@pytest.mark.parametrize("killed_at", ["replace", "unlink"])
def test_an_export_that_was_killed_at_its_end_is_made_anew_or_whole(
    filled: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, killed_at: str
) -> None:
    """Before its folder had its name, and after (seed 3143 of the trial of kills)."""
    original = getattr(Path, killed_at)

    def die(path: Path, *arguments: object, **options: object) -> None:
        if path.exists() and path.name.startswith((".unfinished", "out.partial")):
            raise KeyboardInterrupt("killed here")
        original(path, *arguments, **options)

    with monkeypatch.context() as killing:
        killing.setattr(Path, killed_at, die)
        with pytest.raises(KeyboardInterrupt, match="killed here"):
            export_tables(filled, tmp_path / "out")
    if killed_at == "replace":
        export_tables(filled, tmp_path / "out")
    else:
        with pytest.raises(InputError, match="is not an empty folder"):
            export_tables(filled, tmp_path / "out")
    assert [path.name for path in tmp_path.glob("out*")] == ["out"]
    assert list((tmp_path / "out").glob(".*")) == []
    assert (tmp_path / "out" / "run.csv").is_file()


def test_export_refuses_other_forms_and_full_folders(filled: Database, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="exported as csv or parquet, not 'xlsx'"):
        export_tables(filled, tmp_path / "x", "xlsx")
    with pytest.raises(InputError, match="is not an empty folder"):
        export_tables(filled, tmp_path)
