"""The log that DuckDB writes beside a file: entries behind one another, each with its size and checksum.

Every entry ends with two bytes that are no zeros, and so does the log. A loss of power may leave its end as zeros: the
file had its length on the disk before its content. DuckDB 1.5 replays a log that is cut off up to the last whole
transaction, and calls one that ends in zeros damaged. No commit is acknowledged before its log is synchronised, so what
is missing there was never stored.
"""

from __future__ import annotations

import contextlib
import os
import re
import struct
from collections.abc import Iterator
from typing import BinaryIO

#: What the log is called; how version 2 of it begins, in DuckDB 2.0 with the 16 bytes that name the file and the number
#: of the checkpoint behind which it was begun; the size and checksum before each further entry; and how the entries of
#: a checkpoint and of the end of a transaction begin (src/include/duckdb/common/enums/wal_type.hpp: 98 the version, 99
#: a checkpoint, 100 the end).
LOG_ENDING = ".wal"
_LOG_BEGIN = re.compile(
    rb"d\0be\0\x02(f\0\x10([\0-\x7f]|[\x80-\xff]\x01){16})?(g\0[\x80-\xff]*[\0-\x7f])?\xff\xff", re.DOTALL
)
_LONGEST_BEGIN, _FRAME, _MARK, _END = 64, struct.Struct("<QQ"), b"d\x00c", b"d\x00d"

#: With what an entry ends, and how much is read at once, in bytes.
_LAST, _PIECE = b"\xff\xff", 2**20


def has_log(path: str) -> bool:
    """Whether a log with anything in it lies beside a file."""
    with contextlib.suppress(OSError, ValueError):
        return os.stat(path + LOG_ENDING).st_size > 0
    return False


def ends_with_mark(path: str) -> bool:
    """Whether a checkpoint is the last that a log tells; False where it is of a form not known here."""
    last = b""
    with open(path + LOG_ENDING, "rb") as file:
        for begin, _ in _entries(file):
            file.seek(begin)
            kind = file.read(len(_MARK))
            last = last if kind == _END else kind
    return last == _MARK


def ends_in_zero(path: str) -> bool:
    """Whether a log ends in a zero, as none does that was written to its end."""
    if not has_log(path):
        return False
    with contextlib.suppress(OSError), open(path + LOG_ENDING, "rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\0"
    return False


def whole_length(path: str) -> int | None:
    """Return how long a log is without the zeros at its end and the entry that they cut off, in bytes.

    None where it does not end in zeros, or is of a form not known here.
    """
    with open(path + LOG_ENDING, "rb") as file:
        end = _end_of_content(file)
        whole = _begin(file) if end else 0
        if end == os.fstat(file.fileno()).st_size or whole is None:
            return None
        for begin, size in _entries(file):
            file.seek(begin + size - len(_LAST))
            if begin + size > end or file.read(len(_LAST)) != _LAST:
                break
            whole = begin + size
    return whole


def _begin(file: BinaryIO) -> int | None:
    """Return where the first entry begins; None in a log of a form not known here."""
    file.seek(0)
    begin = _LOG_BEGIN.match(file.read(_LONGEST_BEGIN))
    return None if begin is None else begin.end()


def _entries(file: BinaryIO) -> Iterator[tuple[int, int]]:
    """Yield where the content of each entry begins, and its size, up to the first that is not whole."""
    position, end = _begin(file), os.fstat(file.fileno()).st_size
    while position is not None:
        file.seek(position)
        frame = file.read(_FRAME.size)
        if len(frame) < _FRAME.size:
            return
        size, _ = _FRAME.unpack(frame)
        position += _FRAME.size
        if size < len(_MARK) or size > end - position:
            return
        yield position, size
        position += size


def _end_of_content(file: BinaryIO) -> int:
    """Return where the zeros at the end of a file begin."""
    end = os.fstat(file.fileno()).st_size
    while end > 0:
        begin = max(0, end - _PIECE)
        file.seek(begin)
        content = file.read(end - begin).rstrip(b"\0")
        if content:
            return begin + len(content)
        end = begin
    return 0
