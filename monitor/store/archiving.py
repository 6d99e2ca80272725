"""Imported files that are moved out of a database by a rule, and the proof of what was removed.

A campaign is stored twice: as the files that were imported, and as what was read from them, which every result rests
on. The files may go: they are written to a folder, read back, compared and then taken out of the database in one
transaction with a document that names each with its hash, size and the rule. The document has its entry in the audit:
who, when. The hashes of the files stay where they were, so campaigns and certificates verify as before.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from monitor.bounded import LARGEST_DOCUMENT, read_bounded
from monitor.exceptions import StoreError
from monitor.records import SourceFile
from monitor.store.analyses import save_analysis
from monitor.store.connection import Database
from monitor.store.opening import sync_folder

#: Kind of the document and action of the entry of the audit that say which files of a campaign were taken out.
KIND, ACTION = "archived files", "archive"
#: In the folder of each campaign, as `sha256sum --check` reads it.
_SUMS = "SHA256SUMS"
_NO_CONTENT = hashlib.sha256(b"").hexdigest()


@dataclass(frozen=True)
class Archived:
    """How many campaigns and files were taken out, and their size in bytes."""

    campaigns: int
    files: int
    bytes: int


def source_files(db: Database, campaign_id: int) -> tuple[SourceFile, ...]:
    """Return the files of a campaign as they were imported; of archived ones the hash alone."""
    rows = db.rows(
        "SELECT file, content, sha256 FROM source_file WHERE campaign_id = ? ORDER BY rowid", [campaign_id]
    )
    empty = any(not content and sha256 != _NO_CONTENT for _, content, sha256 in rows)
    hashes = archived_hashes(db) if empty else {}
    return tuple(
        SourceFile(
            file, content, sha256 if not content and hashes.get((campaign_id, file)) == sha256 else None
        )
        for file, content, sha256 in rows
    )


def source_hashes(db: Database, campaign_id: int) -> tuple[SourceFile, ...]:
    """Return the files of a campaign with their hashes as stored, without what is in them."""
    rows = db.rows("SELECT file, sha256 FROM source_file WHERE campaign_id = ? ORDER BY rowid", [campaign_id])
    return tuple(SourceFile(name, b"", sha256) for name, sha256 in rows)


def archive_files(
    db: Database,
    folder: str | Path,
    before: datetime,
    *,
    machine: str | None = None,
    progress: Callable[[int, int], None] = lambda number, count: None,
) -> Archived:
    """Move the files of the campaigns imported before a moment (UTC) to ``folder/NUMBER OF THE CAMPAIGN/``.

    Withdrawn campaigns are taken, too. Each campaign is whole here or there: broken off, the next call goes on. Raises
    StoreError where a file cannot be written, or another one has its name there.
    """
    folder = Path(folder)
    campaigns = db.rows(
        "SELECT campaign_id, campaign FROM imported_campaign WHERE imported_at < $before "
        "AND machine = coalesce($machine, machine) AND campaign_id IN ("
        "SELECT campaign_id FROM source_file WHERE octet_length(content) > 0) ORDER BY campaign_id",
        {"before": before, "machine": machine},
    )
    rule = f"imported before {before:%Y-%m-%d %H:%M:%S} UTC" + ("" if machine is None else f", of {machine}")
    files = size = 0
    for number, (campaign_id, campaign) in enumerate(campaigns, start=1):
        taken = [file for file in source_files(db, campaign_id) if file.content]
        target = folder / str(campaign_id)
        try:
            _write(target, taken)
        except OSError as fault:
            raise StoreError(f"{target} could not be written, its campaign stays whole: {fault}") from fault
        listed = [{"file": file.name, "sha256": file.sha256, "bytes": len(file.content)} for file in taken]
        document = {"campaign_id": campaign_id, "campaign": campaign, "rule": rule, "files": listed}
        with db.transaction():
            names = [file.name for file in taken]
            db.execute(
                "UPDATE source_file SET content = ''::BLOB WHERE campaign_id = ? AND list_contains(?::VARCHAR[], file)",
                [campaign_id, names],
            )
            save_analysis(db, KIND, document, method=rule, action=ACTION)
        files, size = files + len(taken), size + sum(len(file.content) for file in taken)
        progress(number, len(campaigns))
    return Archived(len(campaigns), files, size)


def archive_faults(db: Database, folder: str | Path) -> Iterator[str]:
    """Yield a sentence for every archived file that is not in a folder as it was taken out of the database."""
    for document in _documents(db):
        for listed in document["files"]:
            path = Path(folder) / str(document["campaign_id"]) / Path(listed["file"]).name
            try:
                sha256 = hashlib.sha256(
                    read_bounded(path, max(listed["bytes"], LARGEST_DOCUMENT))
                ).hexdigest()
            except OSError as fault:
                yield f"{path}, of campaign {document['campaign']}, cannot be read: {fault.strerror or fault}"
                continue
            if sha256 != listed["sha256"]:
                yield f"{path}, of campaign {document['campaign']}, is not what was taken out of the database"


def archived_count(db: Database) -> int:
    """Return how many files were taken out of a database."""
    return sum(len(document["files"]) for document in _documents(db))


def archived_hashes(db: Database) -> dict[tuple[int, str], str]:
    """Return the hash of every file that was taken out, by number of its campaign and name."""
    return {
        (document["campaign_id"], listed["file"]): listed["sha256"]
        for document in _documents(db)
        for listed in document["files"]
    }


def _documents(db: Database) -> list[dict[str, Any]]:
    rows = db.rows("SELECT document FROM analysis WHERE kind = ? ORDER BY analysis_id", [KIND])
    return [json.loads(document) for (document,) in rows]


def _write(target: Path, files: list[SourceFile]) -> None:
    """Write files and the list of their hashes, to the disk, and read each back."""
    # Only the last part of a stored name: nothing is written outside the folder.
    names = [Path(file.name).name for file in files]
    if len({*names, _SUMS}) != len(names) + 1:
        raise StoreError(
            f"files of the campaign {target.name} would have one name in {target}: {', '.join(names)}"
        )
    target.mkdir(parents=True, exist_ok=True)
    for name, file in zip(names, files, strict=True):
        path = target / name
        if path.exists() and path.read_bytes() == file.content:
            continue
        _write_new(path, file.content)
    sums = "".join(f"{file.sha256}  {name}\n" for name, file in zip(names, files, strict=True))
    if not (target / _SUMS).exists() or (target / _SUMS).read_text("utf-8") != sums:
        _write_new(target / _SUMS, sums.encode())
    for folder in (target, target.parent):
        sync_folder(folder)
    for name, file in zip(names, files, strict=True):
        if hashlib.sha256((target / name).read_bytes()).hexdigest() != file.sha256:
            raise StoreError(
                f"{target / name} does not read back as it was written; its campaign stays whole"
            )


def _write_new(path: Path, content: bytes) -> None:
    """Write a file that is not there yet, to the disk; its name it gets when it is whole."""
    if path.exists():
        raise StoreError(f"{path} is there already with other content; name another folder")
    partial = path.with_name(path.name + ".part")
    partial.unlink(missing_ok=True)
    with open(os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(partial, path)
