"""Writes the file that a laboratory fills in once: every key of its certificates, no answer yet."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from monitor.exceptions import InputError
from monitor.reporting.certificate.laboratory import template
from monitor.workflow.certificate.files import write_file


@dataclass(frozen=True)
class TemplateRequest:
    """The new file, and the language of its comments and of the certificates made with it (ISO 639-1)."""

    out: Path
    language: str = "en"

    def __post_init__(self) -> None:
        if self.out.exists():
            raise InputError(
                f"{self.out} is there already and is not written over; name another file with --out"
            )


@dataclass(frozen=True)
class TemplateAnswer:
    """The file that was written, and its language."""

    file: Path
    language: str


def write_template(request: TemplateRequest) -> TemplateAnswer:
    """Write a laboratory's file without answers. Raises InputError where it exists or cannot be written."""
    write_file(request.out, template(request.language).encode())
    return TemplateAnswer(request.out, request.language)
