"""Writes figures into a folder: every one as a vector graphic and as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from monitor.exceptions import InputError
from monitor.workflow.file_names import file_name

if TYPE_CHECKING:
    from monitor.reporting.figures.style import Figure

ENDINGS = (".svg", ".png")


def make_folder(folder: Path) -> Path:
    """Make the folder of the figures where it does not exist. Raises InputError where it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made: {error.strerror or error}") from error
    return folder


def save_figure(figure: Figure, folder: Path, name: str) -> list[str]:
    """Write a figure under a name, which may come from people, with every ending; return the names of the files."""
    # Loaded where a figure is drawn: the drawing library takes longer to load than most verbs to answer.
    from monitor.reporting.figures.style import save

    return [str(save(figure, folder / f"{file_name(name)}{ending}")) for ending in ENDINGS]
