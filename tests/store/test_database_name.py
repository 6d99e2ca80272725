"""Names that DuckDB takes for something else than a database: refused, and nothing is made or forgotten."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import duckdb
import pytest

from monitor.exceptions import StoreError
from monitor.store import Database, restore, take_backup

pytestmark = pytest.mark.usefixtures("made_anew")

REFUSED = {
    "x.csv": "x.csv ends in .csv, the name of a data file and not of a database; name a file such as x.duckdb",
    "x.CSV": "ends in .csv",
    "x.csv.gz": "ends in .csv.gz",
    "x.parquet": "ends in .parquet",
    "x.json": "ends in .json",
    "x.sqlite": "ends in .sqlite",
    "x.xlsx": "ends in .xlsx",
    "md:shop": "md:shop begins with 'md:', which names a service or another program's data",
    "sqlite:x.db": "begins with 'sqlite:'",
    "duckdb:x.db": "begins with 'duckdb:'",
    "http://example.org/x.duckdb": "begins with 'http:', which .* name a file such as x.duckdb",
    "s3://bucket/x.duckdb": "begins with 's3:'",
    "file:///x.duckdb": "begins with 'file:'",
}


@pytest.mark.parametrize(("name", "words"), REFUSED.items())
@pytest.mark.parametrize("read_only", [False, True])
def test_a_name_of_something_else_is_refused(
    name: str, words: str, read_only: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(StoreError, match=words):
        Database(name, read_only=read_only)
    assert list(tmp_path.iterdir()) == []


def test_an_existing_table_of_numbers_is_refused_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text("a,b\n1,2\n", encoding="utf-8")
    # What DuckDB itself makes of it: a database that is forgotten.
    with closing(duckdb.connect(str(path))) as connection:
        paths = connection.execute("SELECT path FROM duckdb_databases() WHERE NOT internal").fetchall()
    assert paths == [(None,)]
    with pytest.raises(StoreError, match=r"ends in \.csv"):
        Database(path)
    assert path.read_text(encoding="utf-8") == "a,b\n1,2\n"


def test_a_database_of_sqlite_is_named_as_one(tmp_path: Path) -> None:
    path = tmp_path / "shop.db"
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("CREATE TABLE t (a)")
    with pytest.raises(StoreError, match="is a database of SQLite, which this software does not read"):
        Database(path)


@pytest.mark.parametrize(
    "name", ["x.duckdb", "x.db", "noending", "C1.2026.duckdb", "x.csv.duckdb", "a b.mon"]
)
def test_names_of_files_of_its_own_serve(name: str, tmp_path: Path) -> None:
    with Database(tmp_path / name) as db:
        assert db.rows("SELECT count(*) FROM campaign") == [(0,)]
    assert (tmp_path / name).is_file()


def test_a_database_is_one_whatever_its_name_ends_in(tmp_path: Path) -> None:
    Database(tmp_path / "x.duckdb").close()
    (tmp_path / "x.duckdb").rename(tmp_path / "x.sqlite")
    with Database(tmp_path / "x.sqlite") as db:
        assert db.rows("SELECT count(*) FROM campaign") == [(0,)]


def test_a_backup_and_a_restored_database_have_names_of_databases(tmp_path: Path) -> None:
    with Database(tmp_path / "x.duckdb") as db:
        with pytest.raises(StoreError, match=r"ends in \.parquet"):
            take_backup(db, tmp_path / "b.parquet")
        take_backup(db, tmp_path / "b.duckdb")
    with pytest.raises(StoreError, match=r"ends in \.csv"):
        restore(tmp_path / "b.duckdb", tmp_path / "r.csv")
