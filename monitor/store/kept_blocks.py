"""Keeps a copy of the blocks that DuckDB's next checkpoint may write over, and puts back what half a write damaged.

A checkpoint writes what is new beside what there is, synchronises it, and then writes the header that names it: stopped
anywhere before, the file is what it was, and the log still holds what was committed. DuckDB 1.5 makes one exception: it
fills up the blocks of its metadata where they stand. Cut off in the middle of such a write, as by a loss of power, the
block fits no checksum, and the file is refused although its state and its log are whole.

So these blocks are copied into ``NAME.blocks`` and synchronised before a commit, after which a checkpoint may begin
(as the rollback journal of SQLite does for every page). Whoever next opens the file for writing compares: if its
headers still name the state of the copy, torn blocks and a torn header are put back; otherwise the checkpoint was
finished. Either way the copy is removed. Blocks that are whole stay as they are, so a copy of another state can
damage nothing. Which blocks are metadata stands in the file's own list (``metadata_blocks``).

Files are read through the descriptor that DuckDB has: POSIX takes all locks of a process on a file away when any of its
descriptors is closed. Without such locks (Windows) nothing is kept.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import BinaryIO

from monitor.exceptions import StoreError
from monitor.store.log import LOG_ENDING, ends_in_zero, ends_with_mark, has_log, whole_length

try:
    import fcntl
except ImportError:  # Windows
    _LOCKS = False
else:
    _LOCKS = True

#: What the copy is called.
ENDING = ".blocks"

#: DuckDB's storage (1.5.5, src/storage/single_file_block_manager.cpp): three headers of 4096 bytes, then the blocks.
#: A header and a block begin with the checksum of their rest.
_HEADER, _CHECKSUM = 4096, 8
_HEADERS = 3 * _HEADER
#: Of the second and third header: iteration, first of the catalogue, list of free blocks, number and size of blocks.
_STATE = struct.Struct("<5Q")
#: A pointer into the metadata: the lower 56 bits are the block, the upper 8 its part of 64 (metadata_manager.cpp).
_PARTS, _BLOCK_BITS, _NOWHERE = 64, 56, 2**64 - 1
#: Multiplier and first value of the checksum over words of 8 bytes (src/common/checksum.cpp).
_MULTIPLIER, _FIRST = 0xBF58476D1CE4E5B9, 5381

#: The copy: this line, the SHA-256 of what follows, the headers, and for each block its number and its bytes.
_BEGIN = b"blocks before a checkpoint, 1\n"


@dataclass(frozen=True)
class _Copy:
    """Headers and blocks, by number, of a file before a checkpoint."""

    headers: bytes
    blocks: dict[int, bytes]


def keep_blocks(path: str) -> None:
    """Copy the blocks that a checkpoint may write over, unless the copy has them; this process has the file open.

    Raises StoreError where the copy cannot be written.
    """
    if path == ":memory:" or not _LOCKS:
        return
    file = own_descriptor(path)
    if file is None:
        return
    headers = os.pread(file, _HEADERS, 0)
    # One with these headers was made in this session: what an earlier one left was removed at its opening.
    if _kept_headers(path) == headers:
        return
    blocks = {number: _block(file, headers, number) for number in metadata_blocks(file)}
    content = headers + b"".join(struct.pack("<Q", number) + block for number, block in blocks.items())
    try:
        _write(path, _BEGIN + hashlib.sha256(content).digest() + content)
    except OSError as fault:
        _remove(path)
        raise StoreError(f"{path} could not be written, nothing was kept: {fault}") from fault


def settle_blocks(path: str) -> int:
    """Put torn blocks back and remove the copy; return how many were torn. Does nothing while somebody has the file.

    Raises StoreError where the file cannot be written.
    """
    if not os.path.lexists(path + ENDING):
        return 0
    with _alone(path, for_writing=True) as file:
        if file is None:
            return 0
        torn = _torn(path, file)
        try:
            for offset, whole in torn.items():
                os.pwrite(file, whole, offset)
            os.fsync(file)
        except OSError as fault:
            raise StoreError(
                f"{path}: a block that half a write damaged could not be put back: {fault}"
            ) from fault
        _remove(path)
    return len(torn)


def has_torn_blocks(path: str) -> bool:
    """Whether half a write damaged a file of which the copy is there; nobody writes it now."""
    if not os.path.lexists(path + ENDING):
        return False
    with _alone(path, for_writing=False) as file:
        return file is not None and len(_torn(path, file)) > 0


def settle_log(path: str) -> None:
    """Cut off what a loss of power left of a log as zeros (``whole_length``). Does nothing while somebody has the file.

    Raises StoreError where the log cannot be written.
    """
    if not ends_in_zero(path):
        return
    with _alone(path, for_writing=True) as file:
        length = None if file is None else whole_length(path)
        if length is None:
            return
        try:
            log = os.open(path + LOG_ENDING, os.O_WRONLY)
            try:
                os.ftruncate(log, length)
                os.fsync(log)
            finally:
                os.close(log)
        except OSError as fault:
            raise StoreError(
                f"{path}.wal ends in half a write, which could not be cut off: {fault}"
            ) from fault


def has_torn_log(path: str) -> bool:
    """Whether a log ends in zeros that a loss of power left; nobody writes it now."""
    if not ends_in_zero(path):
        return False
    with _alone(path, for_writing=False) as file:
        return file is not None and whole_length(path) is not None


def has_foreign_log(path: str) -> bool:
    """Whether the log beside a file was written for another state than the file has; nobody writes it now.

    DuckDB 1.5 replays a log onto whatever bears the name: onto a copy of last week, too. The copy of the blocks says
    for which state the log was begun. That state must be the file's, or the one before it, where the log ends with the
    mark of the checkpoint that brought the file on. Without a copy (other programs, Windows) nothing can be said.
    """
    if not os.path.lexists(path + ENDING) or not has_log(path):
        return False
    with _alone(path, for_writing=False) as file:
        copied = None if file is None else _read(path)
        if file is None or copied is None:
            return False
        headers, written_for = os.pread(file, _HEADERS, 0), _state(copied.headers)
        if _state(headers) == written_for:
            return False
        # A log that others began behind that checkpoint is younger than the file.
        is_older = os.stat(path + LOG_ENDING).st_mtime_ns < os.fstat(file).st_mtime_ns
        return written_for not in _states(headers) or (is_older and not ends_with_mark(path))


def metadata_blocks(file: int) -> tuple[int, ...]:
    """Return the numbers of the blocks of an open file that hold its metadata; empty where its list cannot be read.

    They stand behind the free blocks and those used several times, in the list that the header names.
    """
    headers = os.pread(file, _HEADERS, 0)
    *_, free_list, _, _ = _state(headers)
    try:
        numbers = _Numbers(file, headers, free_list)
        for _ in range(numbers.next("<Q")):
            numbers.next("<Q")
        for _ in range(numbers.next("<Q")):
            numbers.next("<QI")
        blocks = []
        for _ in range(numbers.next("<Q")):
            blocks.append(numbers.next("<Q"))
            numbers.next("<Q")  # which of its parts are free
    except (struct.error, OSError, OverflowError):
        return ()
    return tuple(blocks)


class _Numbers:
    """Numbers that follow one another in parts of metadata blocks, each of which names the next."""

    def __init__(self, file: int, headers: bytes, pointer: int) -> None:
        self._file, self._headers, self._pointer = file, headers, pointer
        self._rest = b""

    def next(self, form: str) -> int:
        """Return the first number of the next group of a form."""
        size = struct.calcsize(form)
        while len(self._rest) < size:
            self._read_part()
        (first, *_), self._rest = struct.unpack_from(form, self._rest), self._rest[size:]
        return int(first)

    def _read_part(self) -> None:
        if self._pointer == _NOWHERE:
            raise struct.error("the list ends before its end")
        number, part = self._pointer & ((1 << _BLOCK_BITS) - 1), self._pointer >> _BLOCK_BITS
        size = (_block_size(self._headers) - _CHECKSUM) // _PARTS // 8 * 8
        begin = _offset(self._headers, number) + _CHECKSUM + part * size
        content = os.pread(self._file, size, begin)
        (self._pointer,) = struct.unpack_from("<Q", content)
        self._rest += content[8:]


def _state(headers: bytes) -> tuple[int, ...]:
    """Return what the newer of the two headers that take turns names; one that is torn names nothing."""
    return max(_states(headers), default=(0,) * 5)


def _states(headers: bytes) -> list[tuple[int, ...]]:
    """Return what the two headers that take turns name, without one that is torn."""
    slots = [headers[begin : begin + _HEADER] for begin in (_HEADER, 2 * _HEADER)]
    return [_STATE.unpack_from(slot, _CHECKSUM) for slot in slots if len(slot) == _HEADER and _is_whole(slot)]


def _block_size(headers: bytes) -> int:
    return _state(headers)[-1]


def _offset(headers: bytes, number: int) -> int:
    return _HEADERS + number * _block_size(headers)


def _block(file: int, headers: bytes, number: int) -> bytes:
    return os.pread(file, _block_size(headers), _offset(headers, number))


def _is_whole(content: bytes) -> bool:
    """Whether a header or block fits the checksum that it begins with."""
    if len(content) <= _CHECKSUM or len(content) % 8:
        return False
    # Loaded where something is written: whoever only reads does not wait for it.
    import numpy as np

    integers = np.frombuffer(content, "<u8")
    products = integers[1:] * np.uint64(_MULTIPLIER)
    return bool(np.bitwise_xor.reduce(products) ^ np.uint64(_FIRST) == integers[0])


def _torn(path: str, file: int) -> dict[int, bytes]:
    """Return what half a write damaged: by position in the file, the bytes that were there before."""
    headers = os.pread(file, _HEADERS, 0)
    if _state(headers) != _state(_kept_headers(path)):
        return {}
    copied = _read(path)
    if copied is None:
        return {}
    before = {begin: copied.headers[begin : begin + _HEADER] for begin in (_HEADER, 2 * _HEADER)}
    before |= {_offset(headers, number): block for number, block in copied.blocks.items()}
    return {
        offset: whole
        for offset, whole in before.items()
        if _is_whole(whole) and not _is_whole(os.pread(file, len(whole), offset))
    }


def _read(path: str) -> _Copy | None:
    """Return the copy; None for one that was not finished, before which no checkpoint began."""
    try:
        with _opened_copy(path) as file:
            content = file.read()
    except OSError:
        return None
    begin = len(_BEGIN) + hashlib.sha256().digest_size
    digest, rest = content[len(_BEGIN) : begin], content[begin:]
    if not content.startswith(_BEGIN) or hashlib.sha256(rest).digest() != digest:
        return None
    headers, rest = rest[:_HEADERS], rest[_HEADERS:]
    step = 8 + _block_size(headers)
    if len(headers) < _HEADERS or len(rest) % step:  # none that was written here, whatever its sum
        return None
    pieces = [rest[begin : begin + step] for begin in range(0, len(rest), step)]
    return _Copy(headers, {struct.unpack_from("<Q", piece)[0]: piece[8:] for piece in pieces})


def _opened_copy(path: str) -> BinaryIO:
    """Open the copy; OSError where there is none, or something else has its name."""
    file = os.open(path + ENDING, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise OSError(f"{path}{ENDING} is no file")
    return open(file, "rb")


def _kept_headers(path: str) -> bytes:
    """Return the headers of the copy, unchecked; nothing where there is none."""
    with contextlib.suppress(OSError), _opened_copy(path) as file:
        file.seek(len(_BEGIN) + hashlib.sha256().digest_size)
        return file.read(_HEADERS)
    return b""


def _write(path: str, content: bytes) -> None:
    """Write the copy anew, for those who may read the database, onto the disk. Raises OSError."""
    mode = stat.S_IMODE(os.stat(path).st_mode) & 0o666
    _remove(path)
    with open(os.open(path + ENDING, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
        os.fchmod(file.fileno(), mode)
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    folder = os.open(os.path.dirname(os.path.abspath(path)), os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):
            os.fsync(folder)
    finally:
        os.close(folder)


def _remove(path: str) -> None:
    with contextlib.suppress(OSError):
        os.unlink(path + ENDING)


@contextmanager
def _alone(path: str, *, for_writing: bool) -> Iterator[int | None]:
    """Open a file that nobody writes, or has open at all; None where somebody does, or it may not be opened."""
    if not _LOCKS or own_descriptor(path) is not None:
        yield None
        return
    try:
        file = os.open(path, os.O_RDWR if for_writing else os.O_RDONLY)
    except OSError:
        yield None
        return
    try:
        try:
            fcntl.lockf(file, (fcntl.LOCK_EX if for_writing else fcntl.LOCK_SH) | fcntl.LOCK_NB)
        except OSError:
            yield None
        else:
            yield file
    finally:
        os.close(file)


def own_descriptor(path: str) -> int | None:
    """Return the descriptor under which this process has a file open; None where it has not."""
    try:
        wanted = os.stat(path)
        numbers = [int(name) for name in os.listdir("/dev/fd")]
    except (OSError, ValueError):
        return None
    for number in numbers:
        with contextlib.suppress(OSError):
            status = os.fstat(number)
            if (status.st_dev, status.st_ino) == (wanted.st_dev, wanted.st_ino):
                return number
    return None
