"""Reads the names of campaign and machine from a folder that is refused otherwise."""

from __future__ import annotations

import tomllib
from pathlib import Path

from monitor.bounded import read_bounded
from monitor.readers.files import LARGEST_TOML

_FILES = ("campaign.toml", "mapping.toml")


def names_in(folder: Path) -> tuple[str | None, str | None]:
    """Return the names of campaign and machine in the file of a folder, or in a mapping; None if unreadable."""
    try:
        path = next((folder / name for name in _FILES if (folder / name).is_file()), folder)
        document = tomllib.loads(read_bounded(path, LARGEST_TOML).decode("utf-8-sig"))
    except (OSError, ValueError, RecursionError):  # not TOML and not UTF-8 are ValueErrors
        return None, None
    machine = document.get("machine")
    return _text(document.get("campaign")), _text(machine.get("id")) if isinstance(machine, dict) else None


def _text(value: object) -> str | None:
    return value if isinstance(value, str) and value.strip() else None
