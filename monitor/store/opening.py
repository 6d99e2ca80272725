"""Opens and makes database files by DuckDB, and says in words why a file cannot be opened."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import shlex
import stat
import tempfile
from contextlib import nullcontext
from pathlib import Path

import duckdb

from monitor.bounded import LARGEST_DOCUMENT, read_bounded
from monitor.exceptions import BusyError, StoreError, UnfinishedLogError
from monitor.store import migrations
from monitor.store.kept_blocks import (
    ENDING,
    has_foreign_log,
    has_torn_blocks,
    has_torn_log,
    keep_blocks,
    settle_blocks,
    settle_log,
)
from monitor.store.log import has_log
from monitor.store.turns import Holder, Patience, holder_in, ticket_to_read, turn_to_write, writer_at_work

#: Of a new file, in bytes. One machine's history lies in as many blocks as it has campaigns, and a block is read whole:
#: a quarter of DuckDB's own size reads a fleet's machine in half the time, and a small file is a third as large.
BLOCK_SIZE = 65536

#: Settings of DuckDB by name.
Config = dict[str, str | bool | int | float | list[str]]

#: What DuckDB says from 2.0 on of a log that was written for another file, or another state of it.
_OWN_FINDING = "This WAL was created for"

#: What a file is called while it is made: it gets its name when it is whole.
_UNFINISHED = ".new"
#: What manifests of backups are called, and how many are looked through for the newest.
_MANIFESTS, _MOST_MANIFESTS = "*.manifest.json", 2000
#: A new database is its owner's alone; whoever wants a group to use it changes the mode, and log and lock follow it.
_MODE = 0o600


def connect(
    path: str, read_only: bool, threads: int | None, patience: Patience | None = None
) -> duckdb.DuckDBPyConnection:
    """Open a file by DuckDB; as often as the patience lasts where another process has it.

    Raises BusyError naming that process, StoreError for a file that cannot be opened.
    """
    # Nothing is fetched from the network behind the user's back.
    config: Config = {
        "autoinstall_known_extensions": "false",
        "autoload_known_extensions": "false",
        "default_block_size": str(BLOCK_SIZE),
    }
    if threads is not None:
        config["threads"] = str(threads)
    _refuse_what_is_no_file(path, read_only)
    patience = patience or Patience()
    holder: Holder | None = None

    def last_holder() -> Holder | None:
        return holder

    with ticket_to_read(path) if read_only else nullcontext() as ticket:
        for _ in patience.tries(last_holder):
            holder = writer_at_work(path) if read_only and patience.seconds > 0 else None
            if holder is None:
                try:
                    return _opened(path, read_only, config)
                except (duckdb.Error, ValueError) as fault:
                    holder = _in_the_way(path, read_only, patience, fault)
            if ticket is not None:
                ticket.take()
    raise busy(path, holder, patience)


def _in_the_way(path: str, read_only: bool, patience: Patience, fault: Exception) -> Holder:
    """Return who has the file that could not be opened. Raises StoreError for what is no matter of waiting."""
    holder = holder_in(str(fault))
    if patience.seconds > 0 and _is_open_here(str(fault)):
        holder = Holder(os.getpid(), "another part of this process")
    if holder is None:
        if read_only and "replaying WAL" in str(fault) and _OWN_FINDING not in str(fault):
            raise UnfinishedLogError(_in_words(path, read_only, str(fault))) from fault
        raise StoreError(_in_words(path, read_only, str(fault))) from fault
    return holder


def _opened(path: str, read_only: bool, config: Config) -> duckdb.DuckDBPyConnection:
    """Open a file whose blocks are whole. Raises UnfinishedLogError, StoreError, duckdb.Error, ValueError."""
    if has_foreign_log(path):
        raise StoreError(_of_foreign_log(path))
    if not read_only:
        settle_blocks(path)
        settle_log(path)
    elif has_torn_blocks(path):
        raise UnfinishedLogError(
            f"{path} holds half a block of a write that was cut off; what was there before lies beside it, and is put "
            f"back by the next verb of somebody who may write: `monitor --db {path} verify`"
        )
    elif has_torn_log(path):
        raise UnfinishedLogError(
            f"{path}.wal ends in half a write that was cut off, which is removed by the next verb of somebody who may "
            f"write: `monitor --db {path} verify`"
        )
    connection = duckdb.connect(path, read_only=read_only, config=config)
    show_no_progress(connection)
    if not read_only and has_log(path):
        # What it replayed is written into the file when it is closed, whether or not anything is added.
        with contextlib.suppress(StoreError):
            keep_blocks(path)
    return connection


def _of_foreign_log(path: str) -> str:
    return (
        f"{path}.wal is the log of another state of {path}, which was put in its place meanwhile, as by a copy: "
        f"replaying it would mix the two. To keep the file as it lies here, move {path}.wal and {path}{ENDING} "
        "away; to keep what the log holds, put back the file that it was written for"
    )


def show_no_progress(connection: duckdb.DuckDBPyConnection) -> None:
    """Keep DuckDB from drawing a bar where a process looks interactive to it: between the lines of a JSON document."""
    # A notebook without ipywidgets has no bar, and DuckDB refuses to be told so.
    with contextlib.suppress(duckdb.InvalidInputException):
        connection.execute("SET enable_progress_bar = false")


def busy(path: str, holder: Holder | None, patience: Patience) -> BusyError:
    """Return the refusal of a file that another process has for longer than one would wait."""
    waited = f"waited {patience.seconds:g} s for it; " if patience.seconds else ""
    return BusyError(
        f"{path} is in use by another process, {holder or 'unknown'}; {waited}"
        "wait until it has finished, or stop it"
    )


def make(path: str, patience: Patience) -> None:
    """Make a database of the present schema where there is none, or an empty file.

    It gets its name when it is whole: a process that is killed or finds the disk full leaves no half of one. Raises
    StoreError, BusyError.
    """
    if not Path(path).absolute().parent.is_dir():
        raise StoreError(f"the folder of {path} does not exist; make it first")
    with turn_to_write(path, patience) as holder:
        if holder is not None:
            raise busy(path, holder, patience)
        if is_missing(path):
            refuse_log_left(path)
            _make(path, path + _UNFINISHED)


def refuse_log_left(path: str | Path) -> None:
    """Raise StoreError where a new file would get the name of one that is gone, and whose log is still there.

    DuckDB would replay that log onto the new file.
    """
    if has_log(str(path)):
        raise StoreError(
            f"{path}.wal holds what was stored last in a database of this name, which is gone, and would be added to "
            f"the new one: put the database back beside it, or move {path}.wal away first"
        )


def refuse_log_apart(partial: str | Path, target: str | Path) -> None:
    """Raise StoreError where part of a new file still lies in its log when it was closed, before it gets its name.

    DuckDB closes a file on a full disk without a word; the log does not follow the file to its name.
    """
    if has_log(str(partial)):
        raise StoreError(
            f"{target} could not be written: a part of it could not be moved from its log into the file, as on a full "
            "disk; nothing was kept"
        )


def itself(path: str) -> str:
    """Return the file that a name stands for: log and lock lie beside the file, not beside a link to it."""
    return os.path.realpath(path) if os.path.islink(path) else path


def is_missing(path: str) -> bool:
    """Whether there is no file, or one without a byte, as a full disk leaves."""
    try:
        status = os.stat(path)
    except OSError:
        return not os.path.lexists(path)
    except ValueError as fault:
        raise StoreError(f"{path!a} cannot be the name of a file: {fault}") from fault
    return stat.S_ISREG(status.st_mode) and status.st_size == 0


def _make(path: str, partial: str) -> None:
    _remove(partial)
    try:
        make_empty(partial)
        connection = connect(partial, False, None)
        try:
            migrations.migrate(connection, migrations.available())
        finally:
            connection.close()
        refuse_log_apart(partial, path)
        os.replace(partial, path)
        sync_folder(Path(path).absolute().parent)
    except (OSError, StoreError) as fault:
        said = str(fault).replace(partial, path)
        raise StoreError(
            said if isinstance(fault, StoreError) else f"{path} could not be made: {said}"
        ) from fault
    finally:
        _remove(partial)


def make_empty(path: str) -> None:
    """Make a database without a table that is its owner's alone from its first byte. Raises OSError, StoreError.

    DuckDB attaches no empty file, and makes its own with the mode that the process gives all its files: who opened one
    before its mode is changed could read on. So it makes it in a folder that nobody else may enter.
    """
    with tempfile.TemporaryDirectory() as folder:
        source = os.path.join(folder, "empty.duckdb")
        connect(source, False, None).close()
        with open(source, "rb") as empty:
            content = empty.read()
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _MODE), "wb") as file:
        file.write(content)


def prepare_commit(path: str) -> None:
    """Make what lies beside a file that is written: its log, and a copy of the blocks that half a write may damage.

    Called before each commit by whoever has the turn to write. Raises StoreError where the copy cannot be written.
    """
    make_log(path)
    keep_blocks(path)


def close_written(connection: duckdb.DuckDBPyConnection, path: str) -> None:
    """Close a connection that may write, and remove the copy of its blocks once its checkpoint is through."""
    connection.close()
    # What cannot be put back now stays beside the file for the next who opens it.
    with contextlib.suppress(StoreError):
        settle_blocks(path)


def make_log(path: str) -> None:
    """Make the log that DuckDB writes beside a file, so that those may read it who may read the file, and no others.

    DuckDB would make it with the mode that the process gives all its files; it opens the empty log as one that it made
    (1.5.5). One that is there already stays.
    """
    if path == ":memory:":
        return
    # What is there already was made so; a folder that cannot be written is DuckDB's to report.
    with contextlib.suppress(OSError, ValueError):
        mode = stat.S_IMODE(os.stat(path).st_mode) & 0o666
        name = path + ".wal"
        os.close(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode))
        os.chmod(name, mode)


def sync_folder(folder: Path) -> None:
    """Write the names of a folder to the disk, so that a file keeps the name that it was given when the power fails."""
    # A file system that cannot do so (some of networks) has its own way.
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _remove(partial: str) -> None:
    for name in (partial, partial + ".wal", partial + ENDING):
        # What cannot be removed cannot be made either, which is said in words.
        with contextlib.suppress(OSError):
            os.unlink(name)


def _refuse_what_is_no_file(path: str, read_only: bool) -> None:
    """Refuse a pipe or device, which would be waited for or read for ever, and writing a file of several names."""
    try:
        status = os.stat(path)
    except OSError:
        return
    except ValueError as fault:
        raise StoreError(f"{path!a} cannot be the name of a file: {fault}") from fault
    if stat.S_ISDIR(status.st_mode):
        raise StoreError(f"{path} is a folder; name a file")
    if not stat.S_ISREG(status.st_mode):
        raise StoreError(f"{path} is a pipe or device, not a file; name a file")
    if not read_only and status.st_nlink > 1:
        # The log has the name under which the file was opened: after a crash the other name would not see it.
        raise StoreError(
            f"{path} has {status.st_nlink} names (hard links), and each would have a log of its own: what is stored "
            "under one could be lost to the others. It can be read; to write, remove the other names or make a copy"
        )


def _is_open_here(message: str) -> bool:
    """Whether DuckDB says that this process has the file.

    The second message comes while another thread closes it (1.5.5: one in seventy of openings beside closings).
    """
    return "different configuration" in message or "Unique file handle conflict" in message


def _in_words(path: str, read_only: bool, message: str) -> str:
    if _is_open_here(message):
        return f"{path} is open in this process already, with other options; close it first"
    if "not a valid DuckDB database file" in message:
        return f"{path} is not a database of this software; name another file, or one that does not exist yet"
    if read_only and "does not exist" in message:
        return f"there is no database {path}; `monitor --db {shlex.quote(str(path))} import FOLDER` makes one"
    if "No such file or directory" in message:
        return f"the folder of {path} does not exist; make it first"
    if "Is a directory" in message:
        return f"{path} is a folder; name a file"
    if "Read-only file system" in message:
        return f"{path} lies on a file system that can only be read; nothing can be stored there"
    if _OWN_FINDING in message:
        return _of_foreign_log(path)
    if "Permission denied" in message:
        return (
            f"{path} may not be opened by this user{'' if read_only else ' for writing'}: permission denied"
        )
    return damaged(path, message)


def damaged(path: str, message: str) -> str:
    """Return the sentence about a file that DuckDB cannot read, or not write."""
    if "Could not write" in message or "No space left" in message:
        return f"{path} could not be written, nothing was kept: {message.splitlines()[0]}"
    newest = _newest_backup(path)
    backup = "BACKUP" if newest is None else shlex.quote(str(newest[1]))
    when = "" if newest is None else f" (the newest that lies near it was made at {newest[0][:19]} UTC)"
    restored = shlex.quote(str(Path(path).with_suffix("")) + "-restored.duckdb")
    return (
        f"{path} cannot be read, it may be damaged: {message.splitlines()[0]}; leave it where it is, and restore a "
        f"backup{when} under another name: `monitor --db {restored} restore {backup}`"
    )


def _newest_backup(path: str) -> tuple[str, Path] | None:
    """Return when the newest backup in the folder of a database, or one below it, was made, and its file."""
    folder = Path(path).absolute().parent
    backups = []
    manifests = itertools.chain(folder.glob(_MANIFESTS), folder.glob(f"*/{_MANIFESTS}"))
    for manifest in itertools.islice(manifests, _MOST_MANIFESTS):
        with contextlib.suppress(OSError, ValueError, TypeError, KeyError):
            file = manifest.with_name(manifest.name.removesuffix(_MANIFESTS[1:]))
            if file.is_file():
                backups.append((str(json.loads(read_bounded(manifest, LARGEST_DOCUMENT))["made_at"]), file))
    return max(backups, default=None)
