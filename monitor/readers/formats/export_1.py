"""Export folder, format 1: ``mapping.toml`` and the files of instruments as they came."""

from __future__ import annotations

from pathlib import Path

from monitor.readers.mapping.mapping_file import FILE
from monitor.readers.mapping.reading import read_exports
from monitor.readers.registry import Reader
from monitor.records import Campaign


def recognises(folder: Path) -> bool:
    """Return whether a folder holds a mapping instead of the files of a campaign."""
    return (folder / FILE).is_file() and not (folder / "campaign.toml").exists()


def files_in(folder: Path) -> list[Path]:
    """Return the files of a folder beside its mapping; README and hidden files are not looked at."""
    return sorted(
        path
        for path in folder.iterdir()
        if path.is_file() and path.name != FILE and not path.name.startswith((".", "README"))
    )


def read(folder: Path) -> Campaign:
    """Read the campaign of a folder. Raises CampaignError with all faults of the folder."""
    return read_exports(folder / FILE, files_in(folder)).campaign


READER = Reader("export folder, format 1", recognises, read)
