"""The files of certificates: their names, never written over an issued one, never seen half."""

from __future__ import annotations

import hashlib
from pathlib import Path

from monitor.exceptions import InputError
from monitor.store import Database, find_certificate, load_certificate


def path_of(out: Path | None, number: str) -> Path:
    name = f"certificate-{number}.pdf".replace("/", "-").replace("\\", "-")
    if out is None:
        return Path(name)
    return out if out.suffix.lower() == ".pdf" else out / name


def keep_issued(db: Database, path: Path) -> None:
    """Refuse to write over the file of an issued certificate."""
    there = (
        None if not path.is_file() else find_certificate(db, hashlib.sha256(path.read_bytes()).hexdigest())
    )
    if there is not None and load_certificate(db, there).state != "draft":
        raise InputError(f"{path} is certificate {there}; name another file")


def write_file(path: Path, pdf: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Written beside and moved, so that no half of a certificate is ever seen.
        part = path.with_name(path.name + ".part")
        part.write_bytes(pdf)
        part.replace(path)
    except OSError as error:
        raise InputError(f"the certificate cannot be written to {path}: {error.strerror or error}") from error
