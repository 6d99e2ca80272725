"""What every format of an instrument's own file is read into: columns of text with their units and lines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from monitor.readers.faults import Faults
from monitor.readers.toml_table import Table

#: Largest file of an instrument, in bytes: a day of a tracker at ten points a second has 40 MB.
LARGEST_EXPORT = 64 * 1024**2


@dataclass(frozen=True)
class ExportFile:
    """A file of an instrument by its ``name``, byte for byte."""

    name: str
    content: bytes


class Fact(NamedTuple):
    """What the head of a file says: ``key: value``, and the ``line`` on which it stands; None where nobody knows."""

    key: str
    value: str
    line: int | None = None


@dataclass(frozen=True)
class Export:
    """What a file holds: cells (n) by the name of their column, numbers with a decimal point.

    ``units`` has the columns whose unit the file states; ``lines`` (n) is the line that each row stands on. ``layout``
    says how the file is written, ``facts`` what its head says; ``started`` is a date as it stands there. ``invalid``
    has the rows (0 to n - 1) of which the file itself says that the cell of a column does not count, with its words.
    ``repeated`` are the lines that equal an earlier one in every cell.
    """

    columns: Mapping[str, Sequence[str]]
    units: Mapping[str, str]
    lines: Sequence[int]
    layout: str
    facts: tuple[Fact, ...] = ()
    started: str | None = None
    notes: tuple[str, ...] = ()
    repeated: tuple[int, ...] = ()
    invalid: Mapping[str, Mapping[int, str]] = field(default_factory=dict)


def no_settings(table: Table) -> None:
    """Read the keys of a format that has none of its own."""
    return


@dataclass(frozen=True)
class ExportFormat:
    """One format of files: ``settings`` reads its own keys of ``[[exports]]``, ``read`` the bytes of a file.

    ``read`` notes what is wrong by line and returns None where nothing can be read. ``suffixes`` are those by which a
    file is taken for this format where the mapping names none.
    """

    name: str
    summary: str
    read: Callable[[ExportFile, Any, Faults], Export | None]
    settings: Callable[[Table], Any] = no_settings
    suffixes: tuple[str, ...] = ()
    columns: Mapping[str, str] = field(default_factory=dict)
