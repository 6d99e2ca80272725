"""Packs a question with its files, and an answer with its files, into one zip: what commands send and servers answer.

The document of a question is that of the typed request, with its paths as the command line has them: they are labels to
the server, which puts files of its own in their place and the labels back into the texts of the answer. So an
answer reads as if it had been given where the files are.

A question holds ``request.json`` (``{"document": ..., "tolerances": ...}``) and its files as ``FIELD/INDEX/NAME``; an
answer ``answer.json`` and its files as ``FIELD/NAME...``, where NAME is the last part of the label.
"""

from __future__ import annotations

import json
import stat
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any

from monitor.exceptions import InputError
from monitor.web.access import FILES, FileFields

MEDIA_TYPE = "application/zip"
QUESTION_FILE, ANSWER_FILE = "request.json", "answer.json"
#: The label of a folder that is "here": its name in a parcel.
_HERE = "here"


def last_part(label: str) -> str:
    """Return the name under which the file or folder of a label travels."""
    name = label.replace("\\", "/").rstrip("/").rpartition("/")[2]
    return name if name not in ("", ".", "..") and ":" not in name and name.isprintable() else _HERE


def travelling(question: str) -> FileFields:
    """Return the fields of a question whose files travel."""
    return FILES.get(question, FileFields())


def packed(files: Iterable[Path], folder: Path, target: IO[bytes], answer: Any = None) -> None:
    """Write files by their names below ``folder`` as a zip, and before them an answer where there is one."""
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        if answer is not None:
            archive.writestr(ANSWER_FILE, json.dumps(answer, ensure_ascii=False, allow_nan=False))
        for path in files:
            archive.write(path, path.relative_to(folder).as_posix())


def packed_question(question: str, content: Mapping[str, Any], target: IO[bytes], limit: int) -> None:
    """Write a question with the files that its document names as a zip of at most ``limit`` bytes. Raises InputError.

    A file that is not there is left out: the server says so as the command would.
    """
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(QUESTION_FILE, json.dumps(content, ensure_ascii=False, allow_nan=False))
        for name in travelling(question).incoming:
            value = content["document"].get(name)
            labels = value if isinstance(value, list) else [] if value is None else [value]
            for index, label in enumerate(labels):
                for path, below in _readable(Path(label)):
                    member = "/".join([name, str(index), last_part(label), *below])
                    _add(archive, path, member, limit)
                    if archive.fp is not None and archive.fp.tell() > limit:
                        raise InputError(
                            f"{label} is too large to be sent: a server takes {limit // 2**20} MiB at a time, packed; "
                            "send less of it, or import it where the database is while no server has it"
                        )


def _add(archive: zipfile.ZipFile, path: Path, member: str, limit: int) -> None:
    """Add a file, of which no more is read than the server would unpack."""
    try:
        entry = zipfile.ZipInfo(member)
        entry.compress_type = zipfile.ZIP_DEFLATED
        with path.open("rb") as content, archive.open(entry, "w") as out:
            size = 0
            for chunk in iter(lambda: content.read(2**20), b""):
                size += len(chunk)
                if size > 8 * limit:
                    raise InputError(f"{path} is too large to be sent to a server")
                out.write(chunk)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}") from error


def _readable(path: Path) -> Iterator[tuple[Path, tuple[str, ...]]]:
    """Yield the regular files of a path, or directly in its folder, with their names below it."""
    try:
        if path.is_dir():
            for child in sorted(path.iterdir()):
                if stat.S_ISREG(child.stat().st_mode):
                    yield child, (child.name,)
        elif stat.S_ISREG(path.stat().st_mode):
            yield path, ()
    except (OSError, ValueError):
        return


def unpacked_answer(question: str, parcel: IO[bytes], document: Mapping[str, Any]) -> tuple[Any, list[Path]]:
    """Return an answer, having written its files where the question's document says, and the files.

    Raises InputError for a parcel that is none, and where a file cannot be written.
    """
    try:
        with zipfile.ZipFile(parcel) as archive:
            answer = json.loads(archive.read(ANSWER_FILE))
            written = []
            for member in archive.infolist():
                if member.filename != ANSWER_FILE:
                    target = _target(question, member.filename, document)
                    _write(archive, member, target, question)
                    written.append(target)
            return answer, written
    except (zipfile.BadZipFile, ValueError, KeyError, NotImplementedError, EOFError) as error:
        raise InputError(f"the answer of the server cannot be unpacked: {error}") from error


def _target(question: str, member: str, document: Mapping[str, Any]) -> Path:
    """Return where a file of the answer is written: below the path of its field, and nowhere else."""
    name, _, rest = member.partition("/")
    label = document.get(name)
    if name not in travelling(question).outgoing or not isinstance(label, str):
        raise InputError(f"the server sent {member!r}, which nobody asked for")
    first, *below = rest.split("/")
    usual = last_part(label)
    # A backup has its manifest beside it, under its name with an ending.
    beside = not below and first.startswith(f"{usual}.")
    if not (first == usual or beside) or any(
        part in ("", ".", "..") or "\\" in part or ":" in part for part in below
    ):
        raise InputError(f"the server sent {member!r}, which is no file of {label}")
    return Path(label).with_name(first) if beside else Path(label, *below)


#: Fields and questions whose files take the place of those that they wrote before, here as beside the database.
_REPLACING = frozenset({"figures", "matrices"})
_REPLACING_QUESTIONS = frozenset({"map", "report"})
#: Questions that fill a folder which is new or empty.
_FILLING = frozenset({"export", "simulate like a campaign"})


def _replaces(question: str, name: str) -> bool:
    return name in _REPLACING or question in _REPLACING_QUESTIONS


def check_targets(question: str, document: Mapping[str, Any]) -> None:
    """Raise InputError where a file of the answer would be written over another, before the question is asked."""
    for name in travelling(question).outgoing:
        label = document.get(name)
        if not isinstance(label, str) or _replaces(question, name):
            continue
        path = Path(label)
        if path.is_file() or (question in _FILLING and path.is_dir() and any(path.iterdir())):
            raise InputError(f"{label} is there already and is not written over; name another")


def _write(archive: zipfile.ZipFile, member: zipfile.ZipInfo, target: Path, question: str) -> None:
    """Write a file whole or not at all; one that is there already is replaced where the command itself would."""
    part = target.with_name(f"{target.name}.part")
    mode = (member.external_attr >> 16) & 0o666 or 0o644
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if not _replaces(question, member.filename.partition("/")[0]) and target.exists():
            with archive.open(member) as content:
                if target.is_file() and target.read_bytes() == content.read():
                    return
            raise InputError(
                f"{target} is there already and is not written over. The server has answered, and what it stored "
                "stays: ask again with another name for the file"
            )
        part.unlink(missing_ok=True)
        with archive.open(member) as content, part.open("xb") as out:
            part.chmod(mode)
            for chunk in iter(lambda: content.read(2**20), b""):
                out.write(chunk)
        part.replace(target)
    except OSError as error:
        raise InputError(
            f"{target} cannot be written: {error.strerror or error}. The server has answered, and what it stored stays"
        ) from error
