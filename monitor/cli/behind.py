"""What `uncertainty` and `certificate` ask for alike: the time that an uncertainty holds for, and further sources."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from monitor.sources import Source


def add_behind(parser: ArgumentParser) -> None:
    """The options of what an uncertainty holds for and which further sources it has."""
    parser.add_argument(
        "--holds-for", metavar="TIME",
        help="time for which the uncertainty holds: run, day or campaign (default: as the repeated runs allow)",
    )  # fmt: skip
    parser.add_argument(
        "--sources", type=Path, metavar="FILE",
        help="Type B sources of uncertainty (TOML, [[sources]]), besides those of the campaign",
    )  # fmt: skip


def further_sources(path: Path | None) -> tuple[Source, ...] | None:
    """The sources of a file; None where no file is named. Raises InputError with all its faults."""
    if path is None:
        return None
    from monitor.readers import read_sources_file

    return read_sources_file(path)
