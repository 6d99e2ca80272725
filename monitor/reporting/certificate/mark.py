"""Reads a laboratory's mark, the picture at the head of its certificates, as a data address.

A drawing (SVG) is not taken: it may refer to other files, and its fonts to those of a machine.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from pathlib import Path

from monitor.bounded import LARGEST_DOCUMENT, read_bounded

#: Pictures that a laboratory's mark may be, and the largest that is printed.
MARK_KINDS: Mapping[str, str] = {".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg"}
MARK_BYTES = 512 * 1024
#: How the content of each kind begins.
_MARK_BEGINS: Mapping[str, Callable[[bytes], bool]] = {
    "image/png": lambda content: content.startswith(b"\x89PNG\r\n\x1a\n"),
    "image/jpeg": lambda content: content.startswith(b"\xff\xd8\xff"),
}


def read_mark(file: Path, name: str | None, faults: list[str]) -> str | None:
    """Return the picture ``name`` beside a laboratory's ``file`` as a data address; None, with a fault, if none."""
    if name is None:
        return None
    path = file.parent / name
    kind = MARK_KINDS.get(path.suffix.lower())
    if kind is None:
        faults.append(f"laboratory.mark is a picture ({', '.join(MARK_KINDS)}), but is {name!r}")
        return None
    try:
        content = read_bounded(path, LARGEST_DOCUMENT)
    except OSError as error:
        faults.append(f"laboratory.mark: {path} cannot be read: {error.strerror or error}")
        return None
    if not content or len(content) > MARK_BYTES or not _MARK_BEGINS[kind](content):
        faults.append(
            f"laboratory.mark: {path} is no {path.suffix[1:]} picture of at most {MARK_BYTES // 1024} kB"
        )
        return None
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
