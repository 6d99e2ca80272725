"""Puts a backup back: a full one byte for byte, an incremental one with all that it follows, or the state of a moment.

The state of a moment is the backup made next after it, without the rows of the entries that the audit has from later.
"""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import duckdb

from monitor.exceptions import InputError, StoreError
from monitor.store import migrations
from monitor.store.archiving import ACTION as ARCHIVE
from monitor.store.connection import Database
from monitor.store.copies.backup import checksums, quoted
from monitor.store.copies.manifest import (
    Backup,
    Checksums,
    file_sha256,
    list_backups,
    manifest_of,
    read_manifest,
    refuse_existing,
    remove_partial,
    sync,
)
from monitor.store.database_name import check_database_name
from monitor.store.entries import rows_recorded, select_portion
from monitor.store.opening import connect, make_log, refuse_log_apart, sync_folder
from monitor.store.verification import verify_audit


@dataclass(frozen=True)
class Restored:
    """A database that was put back: from which backup, its full one first where several were put together.

    ``last_entry`` is the last entry of its audit; None where a full backup was put back as it is. ``faults`` are those
    of its verification, made where it is no copy of a file byte for byte.
    """

    backup: Backup
    files: tuple[str, ...]
    last_entry: int | None = None
    faults: tuple[str, ...] = ()


def restore(source: str | Path, target: str | Path, at: datetime | None = None) -> Restored:
    """Put a backup back as the new database ``target``, which must not exist yet.

    ``source`` is a backup, or a folder of them: its newest. ``at`` is the moment whose state is wanted. Raises
    StoreError without a manifest, where a byte or a row differs from it, where a backup is missing among those that
    an incremental one follows, or where this software cannot open it; InputError for a moment that none covers.
    """
    source, target = Path(source), Path(target)
    check_database_name(str(target))
    moment = None if at is None else at.astimezone(UTC).replace(tzinfo=None)
    if source.is_dir():
        source = _backup_in(source, moment)
    chain = _chain(source)
    refuse_existing(target)
    if moment is not None and moment > datetime.fromisoformat(chain[-1].holds_until):
        raise InputError(
            f"--at {moment:%Y-%m-%d %H:%M:%S} UTC is later than {source.name}, which holds all until "
            f"{chain[-1].holds_until[:19]} UTC: "
            "what was stored after that is in none; name an earlier moment, or a later backup"
        )
    partial = target.with_name(target.name + ".partial")
    remove_partial(partial)
    try:
        _put_together(source.parent, chain, partial)
        last_entry, faults = None, tuple[str, ...]()
        if len(chain) > 1 or moment is not None:
            last_entry, faults = _cut_and_verified(partial, moment)
        refuse_log_apart(partial, target)
        sync(partial)
        os.replace(partial, target)
        sync_folder(target.absolute().parent)
    except (OSError, duckdb.Error) as fault:
        raise StoreError(f"{target} could not be written: {fault}") from fault
    finally:
        remove_partial(partial)
    return Restored(chain[-1], tuple(backup.path for backup in chain), last_entry, faults)


def _backup_in(folder: Path, moment: datetime | None) -> Path:
    """Return the newest backup in a folder, or that made next after a moment."""
    backups = [backup for backup in list_backups(folder) if (folder / backup.path).is_file()]
    if not backups:
        raise StoreError(f"{folder} has no backup with a manifest")
    if len({backup.span.database for backup in backups if backup.span is not None}) > 1:
        names = ", ".join(backup.path for backup in backups[-5:])
        raise InputError(f"{folder} has backups of several databases; name one of them: {names}")
    later = [
        backup for backup in backups if moment is None or moment <= datetime.fromisoformat(backup.holds_until)
    ]
    if not later:
        raise InputError(
            f"--at {moment:%Y-%m-%d %H:%M:%S} UTC is later than the newest backup in {folder}, which holds all "
            f"until {backups[-1].holds_until[:19]} UTC: what was stored after that is in none"
        )
    return folder / (later[-1] if moment is None else later[0]).path


def _chain(source: Path) -> tuple[Backup, ...]:
    """Return a backup with all that it follows, the full one first, each by its manifest."""
    chain: list[Backup] = []
    path, expected = source, None
    while True:
        if not path.is_file():
            how = "; `monitor backup FILE` makes one, to be put back later"
            follows = f", which {chain[0].path} follows" if chain else how
            raise StoreError(f"there is no backup {path}{follows}")
        if not manifest_of(path).is_file():
            raise StoreError(
                f"{path} has no manifest {manifest_of(path).name} beside it, so it cannot be checked; "
                "`monitor backup FILE` writes both"
            )
        backup = read_manifest(manifest_of(path))
        if expected not in (None, backup.sha256):
            raise StoreError(f"{path} is not the backup that {chain[0].path} follows: its SHA-256 differs")
        if any(backup.path == later.path for later in chain):
            raise StoreError(f"{manifest_of(source)} is not a manifest of a backup: it follows itself")
        chain.insert(0, backup)
        if backup.span is None or backup.span.previous is None:
            return tuple(chain)
        path, expected = path.with_name(Path(backup.span.previous).name), backup.span.previous_sha256


def _put_together(folder: Path, chain: tuple[Backup, ...], partial: Path) -> None:
    """Copy the full backup, add the rows of those that follow, and compare all rows with the last manifest."""
    names = [Path(backup.path).name for backup in chain]
    for name, backup in zip(names, chain, strict=True):
        if file_sha256(folder / name) != backup.sha256:
            raise _differs(folder / name, "its SHA-256 differs")
    # Its owner's alone before anything is in it.
    os.close(os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
    shutil.copyfile(folder / names[0], partial)
    if file_sha256(partial) != chain[0].sha256:
        raise _differs(folder / names[0], "its SHA-256 differs")
    # Neither brought to the present schema nor to another file format: the next verb that may write does that.
    with _Unfitted(partial, read_only=len(chain) == 1) as db:
        for name, backup in zip(names[1:], chain[1:], strict=True):
            _add_rows(db, folder / name, backup)
        span = chain[-1].span
        expected = chain[0].tables if span is None or len(chain) == 1 else span.totals
        comparable = chain[-1].duckdb_version == duckdb.__version__
        if not _agree(checksums(db), expected, comparable):
            raise _differs(folder / names[-1], "its tables differ")


def _add_rows(db: Database, file: Path, backup: Backup) -> None:
    literal = str(file).replace("'", "''")
    db.execute(f"ATTACH '{literal}' AS increment (READ_ONLY)")
    with db.transaction():
        for table in backup.tables:
            db.execute(
                f"INSERT INTO {quoted(table)} SELECT * FROM increment.main.{quoted(table)} AS t ORDER BY t.rowid"
            )
    db.execute("DETACH increment")


def _agree(present: Checksums, expected: Checksums, comparable: bool) -> bool:
    """Whether tables have the rows that they should have, by their checksums where the same DuckDB made them."""
    return present.keys() == expected.keys() and all(
        rows == present[table][0] and (not comparable or checksum in ("", present[table][1]))
        for table, (rows, checksum) in expected.items()
    )


def _cut_and_verified(partial: Path, moment: datetime | None) -> tuple[int, tuple[str, ...]]:
    """Take the rows of later entries away; return the last entry that stays and what a verification finds."""
    with Database(partial) as db:
        if moment is not None:
            _cut(db, moment)
        verification = verify_audit(db)
    return verification.entries, verification.faults


def _cut(db: Database, moment: datetime) -> None:
    ((first, end, begin),) = db.rows(
        "SELECT min(entry) FILTER (made_at > $moment), max(entry), min(made_at) FROM audit",
        {"moment": moment},
    )
    if first is None:
        return
    if first == 1:
        raise InputError(
            f"--at {moment:%Y-%m-%d %H:%M:%S} UTC is before the first entry of the audit, of "
            f"{begin:%Y-%m-%d %H:%M:%S} UTC"
        )
    ((archived_at,),) = db.rows(
        "SELECT min(made_at) FROM audit WHERE entry >= ? AND action = ?", [first, ARCHIVE]
    )
    if archived_at is not None:
        raise InputError(
            f"--at {moment:%Y-%m-%d %H:%M:%S} UTC: files were archived at {archived_at:%Y-%m-%d %H:%M:%S} UTC, and "
            "this backup no longer has them; name a backup that was made before that"
        )
    # The latest, not that of the last entry: a clock may have been set back in between.
    ((last_made_at,),) = db.rows("SELECT max(made_at) FROM audit WHERE entry < ?", [first])
    ((catalog,),) = db.rows("SELECT current_database()")
    with db.connected() as connection:
        select_portion(connection, quoted(catalog), first, end)
        recorded = rows_recorded(connection)
    if "imported_campaign" in recorded:
        recorded["run_fingerprint"] = recorded["imported_campaign"]
    with db.transaction():
        for table, where in recorded.items():
            db.execute(f"DELETE FROM {quoted(table)} AS t WHERE {where}")
        # A machine is registered in the transaction of a campaign, before its entry.
        db.execute("DELETE FROM registered_machine WHERE registered_at > ?", [last_made_at])


def _differs(path: Path, how: str) -> StoreError:
    return StoreError(f"{path} is not what its manifest says: {how}; use another backup")


class _Unfitted(Database):
    """A database file as it is, whatever its schema."""

    def _open(self) -> None:
        if not self.read_only:
            make_log(self.path)
        self._connection = connect(self.path, self.read_only, self._threads)
        try:
            # Refuses what is newer than this software, and what is no database of ours.
            migrations.pending(self._connection, self._available)
        except StoreError as fault:
            self.close()
            raise StoreError(f"{self.path}: {fault}") from fault
