"""Which questions can be asked over HTTP, who may ask them, and which of their files travel."""

from __future__ import annotations

import typing
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

from monitor.web.users import Role
from monitor.workflow.contract import QUESTIONS

#: The path under which everything of the HTTP interface is.
ROOT = "/api/v1"
#: What changes the history of machines, models or campaigns.
ENGINEERS = frozenset(
    {
        "add effect",
        "event",
        "identify all",
        "import",
        "remove effect",
        "select",
        "use model",
        "withdraw event",
    }
)
#: What the laboratory answers for, and what takes something away.
APPROVERS = frozenset(
    {"amend certificate", "issue certificate", "withdraw campaign", "withdraw certificate", "backup"}
)
#: Questions about files of the computer itself: they stay with the command line there.
NOT_OFFERED: Mapping[str, str] = {
    "archive files": "files are moved on the computer that has the database, by monitor archive",
    "compact": "the file is written anew by monitor compact, while no server has it",
    "publish": "a plant publishes beside the server, by monitor publish",
    "restore": "a backup is restored beside the server, by monitor restore: no second database is served",
    "simulate": "a rehearsal is written by monitor simulate; upload its folder",
    "simulate a machine": "a rehearsal is written by mm.simulate in Python; upload its folder",
    "simulate like a folder": "a rehearsal is written by monitor simulate; upload its folder",
    "watch": "a folder is watched by monitor watch on the computer that has it, while no server has the database",
}


@dataclass(frozen=True)
class FileFields:
    """How the files of a question travel: ``upload`` is filled from the body, ``download`` is sent back.

    ``file_name`` is that of the file to be made; None where a folder is filled, of which several files make a zip.
    ``uploads`` and ``downloads`` are further fields, which travel in a parcel alone (``parcel``).
    """

    upload: str | None = None
    download: str | None = None
    file_name: str | None = None
    uploads: tuple[str, ...] = ()
    downloads: tuple[str, ...] = ()

    @property
    def incoming(self) -> tuple[str, ...]:
        """Every field that names a file to be read."""
        return (*(() if self.upload is None else (self.upload,)), *self.uploads)

    @property
    def outgoing(self) -> tuple[str, ...]:
        """Every field that names a file or folder to be written."""
        return (*(() if self.download is None else (self.download,)), *self.downloads)


_FIGURES = FileFields(downloads=("figures",))
#: Questions that read an upload or make a file, by name; every other field that names a path is not taken over HTTP.
FILES: Mapping[str, FileFields] = {
    "amend certificate": FileFields(upload="laboratory", download="out", uploads=("fonts",)),
    "backup": FileFields(download="target", file_name="backup.duckdb"),
    "certificate template": FileFields(download="out", file_name="laboratory.toml"),
    "compare": _FIGURES,
    "digital certificate": FileFields(download="path"),
    "digital certificate page": FileFields(download="path"),
    "explain": _FIGURES,
    "export": FileFields(download="folder"),
    "import": FileFields(upload="folders", uploads=("mapping",)),
    "issue certificate": FileFields(upload="laboratory", download="out", uploads=("fonts",)),
    "issued certificate": FileFields(download="path"),
    "map": FileFields(download="out", downloads=("figures",)),
    "model history": _FIGURES,
    "plan": _FIGURES,
    "remake certificate": FileFields(download="path", uploads=("fonts",)),
    "report": FileFields(download="out"),
    "selections side by side": _FIGURES,
    "simulate like a campaign": FileFields(download="out", file_name="rehearsal"),
    "standards": FileFields(downloads=("figures", "csv")),
    "statistics": FileFields(downloads=("figures", "matrices")),
    "trend": _FIGURES,
    "verify": FileFields(uploads=("trusted",)),
    "verify certificate": FileFields(upload="file", uploads=("trusted",)),
}
#: Questions that make a file only where it is asked for, and else answer with a document.
ANSWERING_WITHOUT_FILE = frozenset({"map"})
#: Fields of files that travel nowhere, and why.
STAYING: Mapping[str, str] = {
    "key": "a key and what opens it stay where they are: sign beside the database, while no server has it",
    "long_term": "a server speaks to no authority: sign beside the database, while no server has it",
    "cluster": "the server computes on its own computer",
    "incremental": "an incremental backup lies beside those that it follows: take it where the database is",
    "folder": "a campaign folder that is not imported is looked at by the command line on its computer",
}
#: Fields that would spend processes of the server, make it speak to another address, or mean files that lie beside one.
NOT_TAKEN = frozenset({"cluster", "incremental", "workers"})
#: Questions judged by the tolerances by machine type of the configuration of whoever asks.
JUDGING = frozenset({"fleet", "report", "trend"})


def address_of(question: str) -> str:
    """Return the path of a question: ``add effect`` is ``/api/v1/add-effect``."""
    return f"{ROOT}/{question.replace(' ', '-')}"


def role_needed(question: str) -> Role:
    """Return the lowest role that may ask a question."""
    if question in APPROVERS:
        return Role.APPROVER
    return Role.ENGINEER if question in ENGINEERS else Role.VIEWER


def offered() -> tuple[str, ...]:
    """Return the questions that can be asked over HTTP, in the order of the contract."""
    return tuple(name for name in QUESTIONS if name not in NOT_OFFERED)


def writes(question: str) -> bool:
    """Whether a question changes what other answers are made of."""
    return role_needed(question) is not Role.VIEWER


def taken_fields(question: str) -> tuple[str, ...]:
    """Return the fields of a question's request that are taken over HTTP."""
    kind = QUESTIONS[question].request
    if kind is None:
        return ()
    left_out = path_fields(kind) | NOT_TAKEN
    return tuple(field.name for field in fields(kind) if field.init and field.name not in left_out)


def path_fields(kind: Any) -> frozenset[str]:
    """Return the fields of a request that name files of the computer it is answered on, or hold such fields."""
    if kind is None:
        return frozenset()
    hints = typing.get_type_hints(kind)
    return frozenset(field.name for field in fields(kind) if _names_path(hints[field.name]))


def _names_path(hint: Any) -> bool:
    if hint is Path:
        return True
    if is_dataclass(hint) and isinstance(hint, type):
        return bool(path_fields(hint))
    return any(_names_path(member) for member in typing.get_args(hint))
