"""Reads the files of a campaign folder, within limits that keep memory bounded."""

from __future__ import annotations

import errno
import stat
from contextlib import suppress
from pathlib import Path

from monitor.bounded import read_bounded
from monitor.readers.faults import Faults

#: Largest CSV file, in bytes. A five-day campaign has 86 kB; a year of such days has 5 MB.
LARGEST_CSV = 256 * 1024**2
#: Largest campaign.toml, in bytes; the examples have 1 kB.
LARGEST_TOML = 1024**2


def read_bytes(folder: Path, name: str, largest: int, faults: Faults) -> bytes | None:
    """Read one file; None with a fault noted where it cannot be read."""
    path = folder / name
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            faults.add(name, None, None, "this is not a regular file; a text file is needed")
            return None
        if status.st_size <= largest:
            return read_bounded(path, largest)
    except FileNotFoundError:
        faults.add(name, None, None, f"the file is missing; the folder holds {_what_is_there(folder)}")
        return None
    except OSError as error:
        if error.errno == errno.EFBIG:
            faults.add(name, None, None, _too_large(largest))
            return None
        faults.add(name, None, None, f"the file cannot be read: {error.strerror or error}")
        return None
    faults.add(name, None, None, _too_large(largest))
    return None


def _too_large(largest: int) -> str:
    return f"the file is larger than {largest // 1024**2} MiB; split the campaign"


def decode(name: str, content: bytes, faults: Faults, *, of_spreadsheet: bool = False) -> str | None:
    """Decode UTF-8 without its byte-order mark; None with a fault that names the line of the bad byte.

    A table ``of_spreadsheet`` whose cells are separated by semicolons or tabs may be Windows-1252, as a German Excel
    saves "CSV".
    """
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        legacy = _windows_text(content) if of_spreadsheet else None
        if legacy is None:
            line = content.count(b"\n", 0, error.start) + 1
            faults.add(
                name,
                line,
                None,
                f"byte 0x{content[error.start]:02x} is not UTF-8; save the file as UTF-8 text",
            )
            return None
        text = legacy
    text = text.removeprefix("\ufeff")
    if not text.strip():
        faults.add(name, 1, None, "the file is empty")
        return None
    if "\x00" in text:
        line = text.count("\n", 0, text.index("\x00")) + 1
        faults.add(name, line, None, "a NUL character: this is not a text file; save it as UTF-8 text")
        return None
    return text


def _windows_text(content: bytes) -> str | None:
    """Return a table with semicolons or tabs as Windows-1252; None where it is no such table."""
    header = content.partition(b"\n")[0]
    if b"," in header or not (b";" in header or b"\t" in header):
        return None
    with suppress(UnicodeDecodeError):
        return content.decode("cp1252")
    return None


def _what_is_there(folder: Path) -> str:
    names = sorted(path.name for path in folder.iterdir())
    if not names:
        return "nothing"
    return ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
