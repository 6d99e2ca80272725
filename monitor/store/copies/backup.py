"""Backups and snapshots: a second file, compared with the first table by table, and a manifest beside it.

A backup can be made while the database is in use by this process; it shows one moment. ``restore`` puts it
back only where it is, byte for byte, what the manifest says.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import stat
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import duckdb

from monitor import __version__
from monitor.exceptions import StoreError
from monitor.store.connection import Database, utc_now
from monitor.store.database_name import check_database_name
from monitor.store.opening import make_log, sync_folder

_MANIFEST_END = ".manifest.json"


@dataclass(frozen=True)
class Backup:
    """A backup: its file and hash, when it was made (UTC), and rows and checksum of every table.

    The checksum is DuckDB's own hash, summed over the rows; it compares tables within ``duckdb_version`` only.
    """

    path: str
    sha256: str
    made_at: str
    software_version: str
    duckdb_version: str
    tables: Mapping[str, tuple[int, str]]


def take_backup(db: Database, target: str | Path) -> Backup:
    """Copy the database into the new file ``target`` and write ``target.manifest.json``.

    Raises StoreError where the target exists or cannot be written, or the copy differs from the original.
    """
    target = Path(target)
    check_database_name(str(target))
    _refuse_existing(target)
    partial = target.with_name(target.name + ".partial")
    _remove(partial)
    try:
        tables = _copy(db, partial)
        os.chmod(partial, _mode(db.path))
        backup = Backup(
            target.name, _file_sha256(partial), utc_now().isoformat(), __version__, duckdb.__version__, tables
        )
        # Both are on the disk before either has its name; the file has it last: without a manifest it is no backup.
        manifest = _manifest(partial)
        manifest.write_text(json.dumps(asdict(backup), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        for path in (partial, manifest):
            _sync(path)
        os.replace(manifest, _manifest(target))
        os.replace(partial, target)
        sync_folder(target.absolute().parent)
    except (OSError, duckdb.Error) as fault:
        raise StoreError(f"the backup {target} could not be written: {fault}") from fault
    finally:
        _remove(partial)
    return backup


def snapshot(db: Database, folder: str | Path) -> Backup:
    """A backup in ``folder``, named after the database and the present moment. Raises StoreError."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return take_backup(db, folder / f"{Path(db.path).stem}-{utc_now():%Y%m%dT%H%M%S%fZ}.duckdb")


def list_backups(folder: str | Path) -> tuple[Backup, ...]:
    """The backups and snapshots in a folder that have a manifest, the oldest first."""
    backups = [_read_manifest(path) for path in Path(folder).glob(f"*{_MANIFEST_END}")]
    return tuple(sorted(backups, key=lambda backup: (backup.made_at, backup.path)))


def restore(source: str | Path, target: str | Path) -> Backup:
    """Put a backup back as the new database ``target``, which must not exist yet.

    Raises StoreError without a manifest, where a byte differs from it, or where this software cannot open it.
    """
    source, target = Path(source), Path(target)
    check_database_name(str(target))
    if not source.is_file():
        raise StoreError(f"there is no backup {source}")
    if not _manifest(source).is_file():
        raise StoreError(
            f"{source} has no manifest {_manifest(source).name} beside it, so it cannot be checked"
        )
    _refuse_existing(target)
    manifest = _read_manifest(_manifest(source))
    partial = target.with_name(target.name + ".partial")
    _remove(partial)
    try:
        shutil.copyfile(source, partial)
        if _file_sha256(partial) != manifest.sha256:
            raise StoreError(
                f"{source} is not what its manifest says: its SHA-256 differs; use another backup"
            )
        with Database(partial, read_only=True) as db:
            if manifest.duckdb_version == duckdb.__version__ and _tables(db) != manifest.tables:
                raise StoreError(
                    f"{source} is not what its manifest says: its tables differ; use another backup"
                )
        os.chmod(partial, 0o600)
        _sync(partial)
        os.replace(partial, target)
        sync_folder(target.absolute().parent)
    except OSError as fault:
        raise StoreError(f"{target} could not be written: {fault}") from fault
    finally:
        _remove(partial)
    return manifest


def _copy(db: Database, partial: Path) -> dict[str, tuple[int, str]]:
    with db.attached(partial, "backup_copy"):
        # Before anything is in it.
        os.chmod(partial, _mode(db.path))
        make_log(str(partial))
        ((database,),) = db.rows("SELECT current_database()")
        db.execute(f"COPY FROM DATABASE {_quoted(database)} TO backup_copy")
        tables = _tables(db)
        copied = _tables(db, "backup_copy")
    if copied != tables:
        different = ", ".join(name for name in tables if copied.get(name) != tables[name])
        raise StoreError(f"the copy differs from the database in {different}; nothing was kept of it")
    return tables


def _tables(db: Database, catalog: str | None = None) -> dict[str, tuple[int, str]]:
    """Rows and checksum of every table."""
    names = db.rows(
        "SELECT database_name, table_name FROM duckdb_tables() "
        "WHERE database_name = coalesce($catalog, current_database()) ORDER BY table_name",
        {"catalog": catalog},
    )
    checksums = {}
    for database, table in names:
        ((rows, checksum),) = db.rows(
            "SELECT count(*), CAST(coalesce(sum(CAST(hash(t) AS HUGEINT)), 0) AS VARCHAR) "
            f"FROM {_quoted(database)}.main.{_quoted(table)} AS t"
        )
        checksums[str(table)] = (int(rows), str(checksum))
    return checksums


def _manifest(path: Path) -> Path:
    return path.with_name(path.name + _MANIFEST_END)


def _read_manifest(path: Path) -> Backup:
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
        tables = {
            name: (int(rows), str(checksum)) for name, (rows, checksum) in manifest.pop("tables").items()
        }
        return Backup(**manifest, tables=tables)
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as fault:
        raise StoreError(f"{path} is not a manifest of a backup: {fault}") from fault


def _refuse_existing(target: Path) -> None:
    if target.exists():
        raise StoreError(f"{target} exists already; name a new file, or move that one away first")
    if not target.absolute().parent.is_dir():
        raise StoreError(f"the folder of {target} does not exist; make it first")


def _remove(partial: Path) -> None:
    for path in (partial, partial.with_name(partial.name + ".wal"), _manifest(partial)):
        path.unlink(missing_ok=True)


def _mode(path: str) -> int:
    """Who may read the database may read its backup; that of one in memory is its owner's."""
    return 0o600 if path == ":memory:" else stat.S_IMODE(os.stat(path).st_mode) & 0o666


def _sync(path: Path) -> None:
    with path.open("rb") as file:
        os.fsync(file.fileno())


def _file_sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'
