"""Reads files that somebody named, within limits: a pipe, an endless device or 6 GB exhaust nothing."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

#: Largest file of settings or statements, in bytes; those of the examples have 2 kB.
LARGEST_SETTINGS = 1024**2
#: Largest document that is read whole, in bytes; a certificate with its attachments has 0.2 MB.
LARGEST_DOCUMENT = 256 * 1024**2
#: Windows has neither flag, but tells text from bytes.
_AT_ONCE = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)


def read_bounded(path: Path, largest: int) -> bytes:
    """Return the bytes of a regular file. Raises OSError for anything else, and for a file larger than ``largest``.

    What the file says of its size is not believed: no more than the limit is read.
    """
    try:
        # Without O_NONBLOCK to open a pipe waits for somebody who writes into it.
        descriptor = os.open(path, os.O_RDONLY | _AT_ONCE)
    except ValueError as error:
        raise OSError(errno.EINVAL, str(error), str(path)) from error
    with os.fdopen(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "it is not a regular file", str(path))
        content = file.read(largest + 1)
    if len(content) > largest:
        raise OSError(errno.EFBIG, f"it is larger than {largest // 1024**2} MiB", str(path))
    return content
