"""What went wrong, as a status of HTTP and a plain sentence; the user's faults are never a server error."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException

from monitor.exceptions import CampaignError, InputError, MonitorError, NotFoundError
from monitor.stopping import StoppedError
from monitor.web.asking import ForbiddenError, ReplacedError

OUR_FAULT = "this is a fault of the software, please report it; nothing was stored by this request"

#: By whom work is taken back that is cut off because the server ends.
SERVER_END = "the end of the server"


class TooLargeError(Exception):
    """More came than was announced or is allowed; the message is a sentence."""


class TooSlowError(Exception):
    """The rest of a request did not come; the message is a sentence."""


class TakenBackError(Exception):
    """A question that was taken back before it was answered, ``by`` somebody or the end of the server."""

    def __init__(self, by: str, stopped: StoppedError) -> None:
        self.by = by
        super().__init__(f"this was taken back by {by} before it was answered: {_what_stays(stopped)}")


def _what_stays(stopped: StoppedError) -> str:
    # Loaded where it is met: whoever opens the first page waits for what is loaded before.
    from monitor.workflow.intake.importing import StoppedImportError

    if not isinstance(stopped, StoppedImportError) or not stopped.answer.imported:
        return "what was not finished is not stored"
    imported = ", ".join(folder.campaign for folder in stopped.answer.imported)
    rest = ", ".join(Path(folder).name for folder in stopped.not_imported)
    return f"{imported} went in and stays, {rest} did not"


@dataclass(frozen=True)
class Refusal:
    """A refusal: its ``status``, its sentence, and where a campaign was refused every fault with file and line.

    ``in_full`` is what the command line prints of such a campaign.
    """

    status: int
    error: str
    faults: tuple[str, ...] = ()
    in_full: str = ""


def relabelled(value: Any, labels: Mapping[str, str]) -> Any:
    """Return a text, or a document with texts, in which labels stand for the paths that only the server knows."""
    if isinstance(value, str):
        for path, label in sorted(labels.items(), reverse=True):
            value = value.replace(path, label)
        return value
    if isinstance(value, dict):
        return {key: relabelled(element, labels) for key, element in value.items()}
    return [relabelled(element, labels) for element in value] if isinstance(value, list | tuple) else value


def by_field(text: str, fields: Iterable[str]) -> str:
    """Return a text that names the fields of a document where it names options of the command line."""

    def named(option: re.Match[str]) -> str:
        name = option[1].replace("-", "_")
        # A field may have its unit behind it: --volumetric-limit is volumetric_limit_um.
        of_name = [field for field in fields if field == name or field.startswith(f"{name}_")]
        return f"'{of_name[0]}'" if len(of_name) == 1 else option[0]

    return re.sub(r"(?<![\w-])--([a-z][a-z-]*)", named, text)


def refusal_of(error: Exception, labels: Mapping[str, str] | None = None) -> Refusal:
    """Return the refusal for what a question raised, with ``labels`` for paths; 500 for what should not be raised."""
    refusal = _refusal_of(error)
    texts = relabelled((refusal.error, refusal.in_full, *refusal.faults), labels or {})
    return Refusal(refusal.status, texts[0], tuple(texts[2:]), texts[1])


def _refusal_of(error: Exception) -> Refusal:
    if isinstance(error, HTTPException):
        # A form that cannot be read, such as one without its boundary.
        return Refusal(error.status_code, f"the request cannot be read: {error.detail}")
    if isinstance(error, TooLargeError):
        return Refusal(413, str(error))
    if isinstance(error, TooSlowError):
        return Refusal(408, str(error))
    if isinstance(error, ForbiddenError):
        return Refusal(403, str(error))
    if isinstance(error, TakenBackError):
        return Refusal(503 if error.by == SERVER_END else 409, str(error))
    if isinstance(error, ReplacedError):
        return Refusal(503, str(error))
    if isinstance(error, NotFoundError):
        return Refusal(404, str(error))
    if isinstance(error, CampaignError):
        return Refusal(
            422, str(error).splitlines()[0], tuple(str(fault) for fault in error.faults), str(error)
        )
    if isinstance(error, InputError):
        return Refusal(400, str(error))
    if isinstance(error, MonitorError):
        return Refusal(422, str(error))
    return Refusal(500, OUR_FAULT)
