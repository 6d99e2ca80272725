"""Names with ``*`` or ``?`` that no shell wrote out: those of Windows never do, others not in quotes."""

from __future__ import annotations

import glob
from collections.abc import Sequence
from pathlib import Path

from monitor.exceptions import InputError


def in_full(named: Sequence[Path]) -> list[Path]:
    """Return the paths, with those that match in place of a pattern, in the order of their names.

    Raises InputError for a pattern that matches nothing, with what is there.
    """
    paths: list[Path] = []
    for path in named:
        if path.exists() or not glob.has_magic(str(path)):
            paths.append(path)
            continue
        matching = sorted(map(Path, glob.glob(str(path))))
        if not matching:
            raise InputError(f"nothing matches {path}: {_beside(path)}")
        paths += matching
    return paths


def _beside(pattern: Path) -> str:
    """What the folder of a pattern holds, in words."""
    folder = pattern.parent
    if not folder.is_dir():
        return f"there is no folder {folder}"
    names = sorted(entry.name for entry in folder.iterdir() if not entry.name.startswith("."))
    if not names:
        return f"the folder {folder} is empty"
    return f"the folder {folder} has {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}"
