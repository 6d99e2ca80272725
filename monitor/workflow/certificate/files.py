"""The files of certificates: their names, never written over an issued one, never seen half."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from monitor.bounded import LARGEST_DOCUMENT, read_bounded
from monitor.exceptions import InputError
from monitor.store import Database, find_certificate, load_certificate
from monitor.workflow.file_names import file_name

#: What stands behind the name of a file until its certificate is stored.
_PART = ".part"


@dataclass(frozen=True)
class HashedFile:
    """A file that a certificate was made from or with."""

    name: str
    sha256: str


def path_of(out: Path | None, number: str) -> Path:
    """The file of a certificate: ``out`` itself, or a file in the folder ``out``, or here without."""
    name = file_name(f"certificate-{number}.pdf")
    if out is None:
        return Path(name)
    if out.suffix and out.suffix.lower() != ".pdf" and not out.is_dir():
        raise InputError(f"--out {out}: a certificate is a PDF; name a file ending in .pdf, or a folder")
    return out if out.suffix.lower() == ".pdf" else out / name


def dcc_path_of(out: Path, number: str) -> Path:
    """The file of a digital certificate: ``out`` itself, or a file in the folder ``out``."""
    name = file_name(f"certificate-{number}.dcc.xml")
    return out if out.suffix.lower() == ".xml" else out / name


def dcc_page_path_of(out: Path, number: str) -> Path:
    """The file of a digital certificate as a page: ``out`` itself, or a file in the folder ``out``."""
    name = f"certificate-{number}.dcc.html".replace("/", "-").replace("\\", "-")
    return out if out.suffix.lower() in (".html", ".htm") else out / name


def font_hashes(fonts: Sequence[Path]) -> tuple[HashedFile, ...]:
    """Name and SHA-256 of fonts that are not ours: they are too large to be kept with every certificate."""
    try:
        return tuple(HashedFile(font.name, hashlib.sha256(font.read_bytes()).hexdigest()) for font in fonts)
    except OSError as error:
        raise InputError(f"the font {error.filename} cannot be read: {error.strerror or error}") from error


def keep_issued(db: Database, path: Path) -> None:
    """Refuse to write over the file of an issued certificate, of this database or of another, or over anything else.

    What may be written over: a draft of this database, and an empty file.
    """
    if not path.is_file():
        return
    content = read_bounded(path, LARGEST_DOCUMENT)
    number = find_certificate(db, hashlib.sha256(content).hexdigest())
    if number is None and content:
        raise InputError(
            f"{path} is there already, and no draft of this database: name another file, or remove it"
        )
    if number is not None and load_certificate(db, number).state != "draft":
        raise InputError(f"{path} is certificate {number}; name another file")


def why_not(folder: Path, error: OSError) -> str:
    """Why nothing can be written into a folder, in words: the system calls a file in its place "File exists"."""
    existing = next((path for path in (folder, *folder.parents) if path.exists()), None)
    if existing is not None and existing.is_file():
        return f"{existing} is a file, not a folder"
    return error.strerror or str(error)


def prepared(path: Path, content: bytes) -> Path:
    """The content, whole on the disk, beside ``path`` under a name that is no certificate's.

    Raises InputError where it cannot be written, or ``path`` is a folder.
    """
    part = path.with_name(path.name + _PART)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        # A link that somebody planted under this name is removed, not followed; so is what a killed process left.
        part.unlink(missing_ok=True)
        with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666), "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)  # half a file where the disk is full
        raise InputError(
            f"the certificate cannot be written to {path}: {why_not(path.parent, error)}"
        ) from error
    return part


def finish_left(db: Database, folder: Path) -> None:
    """Give their names to files in a folder whose certificates are stored, and whose process died before it did so.

    One that is not stored may be another process's, which is about to store it.
    """
    for part in folder.glob(f"*.pdf{_PART}"):
        path = part.with_name(part.name.removesuffix(_PART))
        # What cannot be read or renamed stays for whoever looks into the folder.
        with contextlib.suppress(OSError, InputError):
            if part.is_symlink() or os.path.lexists(path):
                continue
            content = read_bounded(part, LARGEST_DOCUMENT)
            if find_certificate(db, hashlib.sha256(content).hexdigest()) is not None:
                part.rename(path)


def publish(part: Path, path: Path, number: str) -> None:
    """Give a prepared file its name. Raises InputError, saying where the certificate is, where that fails."""
    try:
        part.replace(path)
    except OSError as error:
        if isinstance(error, FileNotFoundError) and path.is_file():
            return  # ``finish_left`` of another process was quicker
        raise InputError(
            f"certificate {number} is in the database, but its file cannot be written to {path}: "
            f"{error.strerror or error}; `monitor certificate show {number} --pdf PATH` writes it"
        ) from error


def write_file(path: Path, content: bytes) -> None:
    """Write a new file that is never seen half. Raises InputError where that fails, or another file is there."""
    try:
        if path.is_file() and read_bounded(path, LARGEST_DOCUMENT) not in (b"", content):
            raise InputError(f"{path} is there already, with other content: name another file, or remove it")
    except OSError as error:
        raise InputError(f"{path} is there already and cannot be read: {error.strerror or error}") from error
    part = prepared(path, content)
    try:
        part.replace(path)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror or error}") from error
