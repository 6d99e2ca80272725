"""What lies in a watched folder, whether it still changes, and by what it is recognised again."""

from __future__ import annotations

import hashlib
import os
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from monitor.bounded import LARGEST_DOCUMENT
from monitor.exceptions import InputError
from monitor.readers.archive import CAMPAIGN_FILES, UploadedFile, unpack
from monitor.workflow.true_values import TRUTH

#: Files of an arrival that are looked at; a campaign has three to a dozen.
MOST_FILES = 2000
#: Endings of names under which browsers and copying programs write what is not whole yet.
_UNFINISHED = (".part", ".partial", ".tmp", ".crdownload", ".filepart", ".new")
_WORKBOOKS = (".xlsx", ".xlsm")
_ALONE = (*_WORKBOOKS, ".csv")


@dataclass(frozen=True)
class Arrival:
    """A folder, zip, workbook or table directly in the watched folder.

    ``fingerprint`` changes with the name, size or time of any of its files; ``changed_at`` is when the last of them was
    written or came here (seconds since 1970). ``lacks`` says what a folder still lacks to be a campaign.
    """

    path: Path
    fingerprint: str
    changed_at: float
    lacks: str | None


def arrivals(folder: Path) -> tuple[Arrival, ...]:
    """Return what lies in a folder, by name. Raises InputError where it is no folder or cannot be listed."""
    try:
        entries = sorted(folder.iterdir())
    except OSError as error:
        raise InputError(f"{folder} cannot be watched: {error.strerror or error}") from error
    return tuple(arrival for entry in entries if (arrival := _arrival(entry)) is not None)


def _arrival(path: Path) -> Arrival | None:
    """Return an entry as an arrival; None for what can be no campaign, hidden and unfinished files among them."""
    if path.name.startswith((".", "~")) or path.name.casefold().endswith(_UNFINISHED):
        return None
    try:
        if path.is_dir():
            has_one = any((path / name).is_file() for name in CAMPAIGN_FILES)
            lacks = None if has_one else f"it has no {CAMPAIGN_FILES[0]}"
            return _observed(path, _files_below(path), lacks)
        if path.suffix.casefold() in (".zip", *_ALONE) and path.name != TRUTH:
            return _observed(path, [path], None)
    except OSError:
        return None  # it went away, or is not readable yet
    return None


def _files_below(folder: Path) -> list[Path]:
    paths = [folder]
    for directory, folders, files in os.walk(folder):
        folders.sort()
        paths += [Path(directory) / name for name in (*folders, *sorted(files))]
        if len(paths) > MOST_FILES:
            break
    return paths


def _observed(path: Path, files: Sequence[Path], lacks: str | None) -> Arrival:
    digest, changed_at = hashlib.sha256(), 0.0
    for file in files:
        status = file.stat()
        # A folder's size and time say nothing that its files do not.
        size = 0 if file.is_dir() else status.st_size
        moment = 0 if file.is_dir() else status.st_mtime_ns
        digest.update(f"{file.relative_to(path)}\0{size}\0{moment}\n".encode("utf-8", "surrogateescape"))
        # Copies may keep the time of their original; the time of their entry is that of the copy.
        changed_at = max(changed_at, status.st_ctime)
    return Arrival(path, digest.hexdigest(), changed_at, lacks)


@contextmanager
def campaign_folders(path: Path) -> Iterator[tuple[Path, ...]]:
    """Yield the campaign folders of an arrival: itself, or those that a zip holds, unpacked for the block.

    Raises InputError for a zip that cannot be trusted or read, and for a workbook or table that lies alone.
    """
    if path.is_dir():
        yield (path,)
        return
    if path.suffix.casefold() in _ALONE:
        if path.suffix.casefold() not in _WORKBOOKS:
            raise InputError(
                f"{path}: a table alone is no campaign; put it into a folder of its own, beside {CAMPAIGN_FILES[0]} "
                "(docs/campaign-format.md); files of an instrument are imported with a mapping "
                "(docs/files-as-they-come.md)"
            )
        raise InputError(
            f"{path}: a workbook alone is no campaign; put it into a folder of its own as campaign.xlsx, "
            f"beside {CAMPAIGN_FILES[0]} (docs/campaign-format.md)"
        )
    if not zipfile.is_zipfile(path):
        raise InputError(f"{path} is no zip, or was cut off; copy it again")
    if path.stat().st_size > LARGEST_DOCUMENT:
        raise InputError(f"{path} is larger than {LARGEST_DOCUMENT // 2**20} MiB; that is no campaign")
    with TemporaryDirectory(prefix="monitor-watch-") as room, path.open("rb") as content:
        yield unpack([UploadedFile(path.name, content)], Path(room))
