"""Unpacks uploads and zips into a folder of their own: no path out of it, no link, no bomb, no more than needed.

A campaign comes as a zip of its folder, or as its files one by one; a zip may hold several folders.
"""

from __future__ import annotations

import stat
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO

from monitor.exceptions import InputError

#: Unpacked, all files together; text packs to a tenth, and what unpacks to a thousand times its size is an attack.
UNPACKED_BYTES = 512 * 2**20
MOST_FILES = 2000
LONGEST_NAME = 200
_CHUNK = 2**20
#: The files that make a folder a campaign: its own, or the mapping of what instruments wrote.
CAMPAIGN_FILES = ("campaign.toml", "mapping.toml")
#: How the names of workbooks end.
WORKBOOK = ".xlsx"


@dataclass(frozen=True)
class UploadedFile:
    """A file as a form sends it: its ``name``, with the folder where the browser says it, and its content."""

    name: str
    content: IO[bytes]


def unpack(files: Sequence[UploadedFile], folder: Path) -> tuple[Path, ...]:
    """Write uploaded files below ``folder`` and return the campaign folders among them, in the order of their names.

    Raises InputError for a zip that cannot be trusted or read, and where no folder holds a campaign.
    """
    if not files:
        raise InputError("choose the folder of a campaign, its files, or a zip of it")
    unpack_files(files, folder)
    campaigns = tuple(sorted({path.parent for name in CAMPAIGN_FILES for path in folder.rglob(name)}))
    if not campaigns:
        if any(file.name.lower().endswith(WORKBOOK) for file in files):
            raise InputError(
                f"a workbook of Excel holds the tables of a campaign, and {CAMPAIGN_FILES[0]} says of which machine "
                "and method they are: choose both files together; the manual says what stands in them, in its chapter "
                "on the campaign format (docs/campaign-format.md)"
            )
        raise InputError(
            f"no folder of the upload has a {CAMPAIGN_FILES[0]} or a {CAMPAIGN_FILES[1]}; choose the folder of a "
            "campaign or a zip of it. The manual says which files it has, in its chapter on the campaign format "
            "(docs/campaign-format.md)"
        )
    return campaigns


def unpack_files(files: Sequence[UploadedFile], folder: Path) -> tuple[Path, ...]:
    """Write uploaded files, and what zips among them hold, below ``folder`` and return them by their names.

    Raises InputError for a zip that cannot be trusted or read.
    """
    room = _Room(folder)
    for file in files:
        # A workbook of Excel is a zip too, of files that are nothing by themselves.
        if zipfile.is_zipfile(file.content) and not file.name.lower().endswith(WORKBOOK):
            file.content.seek(0)
            _unpack_zip(file, room)
        else:
            file.content.seek(0)
            if file.name.lower().endswith(".zip"):
                raise InputError(f"{file.name} is no zip that can be read; pack the folder again")
            room.write(_safe_path(file.name), file.content)
    return tuple(sorted(path for path in folder.rglob("*") if path.is_file()))


def unpack_zip(name: str, content: IO[bytes], folder: Path) -> None:
    """Write what a zip holds below ``folder``. Raises InputError for one that cannot be trusted or read."""
    _unpack_zip(UploadedFile(name, content), _Room(folder))


class _Room:
    """A folder that takes so many files and bytes and no more."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._bytes = self._files = 0

    def write(self, path: PurePosixPath, content: IO[bytes]) -> None:
        """Write a file; what it says of its own size is not believed."""
        self._files += 1
        if self._files > MOST_FILES:
            raise InputError(f"the upload has more than {MOST_FILES} files; upload fewer campaigns at a time")
        target = self._folder.joinpath(*path.parts)
        if target.exists():
            raise InputError(f"the upload has {path} twice; upload each file once")
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with target.open("xb") as out:
                for chunk in iter(lambda: content.read(_CHUNK), b""):
                    self._bytes += len(chunk)
                    if self._bytes > UNPACKED_BYTES:
                        raise InputError(
                            f"the upload holds more than {UNPACKED_BYTES // 2**20} MiB; upload fewer at a time"
                        )
                    out.write(chunk)
        except OSError as error:
            raise InputError(
                f"{path} of the upload cannot be written under this name: {error.strerror}"
            ) from error


def _unpack_zip(file: UploadedFile, room: _Room) -> None:
    try:
        with zipfile.ZipFile(file.content) as archive:
            members = archive.infolist()
            if len(members) > MOST_FILES:
                raise InputError(
                    f"{file.name} holds more than {MOST_FILES} files; upload fewer campaigns at a time"
                )
            if sum(member.file_size for member in members) > UNPACKED_BYTES:
                raise InputError(
                    f"{file.name} unpacks to more than {UNPACKED_BYTES // 2**20} MiB; that is no campaign"
                )
            for member, path in _regular(archive, file.name):
                with archive.open(member) as content:
                    room.write(path, content)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, ValueError) as error:
        raise InputError(f"{file.name} cannot be unpacked: {error}; pack the folder again") from error


def _regular(archive: zipfile.ZipFile, name: str) -> Iterator[tuple[zipfile.ZipInfo, PurePosixPath]]:
    for member in archive.infolist():
        if member.is_dir():
            continue
        kind = stat.S_IFMT(member.external_attr >> 16)
        if kind not in (0, stat.S_IFREG):
            raise InputError(
                f"{name} holds {member.filename}, which is a link or a device; pack the files themselves"
            )
        yield member, _safe_path(member.filename)


def _safe_path(name: str) -> PurePosixPath:
    """Return a path that stays in its folder. Raises InputError for any other."""
    path = PurePosixPath(name.replace("\\", "/"))
    harmless = path.parts and all(part not in ("", ".", "..") and ":" not in part for part in path.parts)
    if not harmless or path.is_absolute() or not name.isprintable() or len(name) > LONGEST_NAME:
        raise InputError(
            f"the upload names a file {name[:LONGEST_NAME]!r}; names must stay inside their folder"
        )
    return path
