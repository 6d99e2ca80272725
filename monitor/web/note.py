"""The note beside a served database: where its server listens, so that commands ask it instead of waiting for the file.

It bears the name of the database with ``.server`` behind it, is for the account of the server alone, and says the
address, a secret of this run that lets that account in, and which certificate the server shows. While the server lives
it has a lock on the note: what a killed server left behind is known by that, and no other process is believed to be the
server because it happens to listen at the same port.
"""

from __future__ import annotations

import contextlib
import json
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows has no such locks: whether the server answers decides
    _LOCKS = False
else:
    _LOCKS = True

ENDING = ".server"


@dataclass(frozen=True)
class Note:
    """Where a server listens; ``certificate_sha256`` is that of its certificate (DER), None without TLS."""

    address: str
    secret: str
    pid: int
    certificate_sha256: str | None = None


def note_path(database: str | Path) -> Path:
    """Return where the note of a database lies: beside the file itself, also where a link names it."""
    return Path(os.path.realpath(database) + ENDING)


@contextmanager
def posted(database: str | Path, note: Note) -> Iterator[bool]:
    """Keep the note beside the database for this block; yield False where the folder cannot be written."""
    path = note_path(database)
    try:
        # What a killed server left is removed; a link that somebody planted is not followed.
        path.unlink(missing_ok=True)
        file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0), 0o600)
    except OSError:
        yield False
        return
    try:
        if _LOCKS:
            with contextlib.suppress(OSError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.write(file, json.dumps(asdict(note)).encode())
        yield True
    finally:
        if not _LOCKS:
            os.close(file)  # Windows removes no file that is open
        with contextlib.suppress(OSError):
            path.unlink()
        if _LOCKS:
            os.close(file)


def read_note(database: str | Path) -> Note | None:
    """Return the note of the server that has a database now; None where there is none of this account."""
    path = note_path(database)
    try:
        file = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    except (OSError, ValueError):
        return None
    try:
        if not _is_ours(file) or not _is_held(file):
            return None
        return Note(**json.loads(os.read(file, 2**16)))
    except (OSError, ValueError, TypeError):
        return None
    finally:
        os.close(file)


def _is_ours(file: int) -> bool:
    """Whether nobody else can have written it: another account could send our questions to a server of its own."""
    status = os.fstat(file)
    if not stat.S_ISREG(status.st_mode):
        return False
    return not hasattr(os, "geteuid") or (status.st_uid == os.geteuid() and not status.st_mode & 0o077)


def _is_held(file: int) -> bool:
    if not _LOCKS:
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return True  # a file system without locks: whether the server answers decides
    return False
