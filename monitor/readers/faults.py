"""Collects the faults of a folder, and has the phrases that their messages share."""

from __future__ import annotations

from collections.abc import Iterable

from monitor.exceptions import Fault

#: Longest piece of a user's own text that a message repeats.
SHOWN = 40


class Faults:
    """Faults of one folder, collected so that all of them are reported together."""

    def __init__(self, files: Iterable[str]) -> None:
        self._order = {name: index for index, name in enumerate(files)}
        self._faults: list[Fault] = []

    def __len__(self) -> int:
        return len(self._faults)

    def add(self, file: str, line: int | None, column: str | None, message: str) -> Fault:
        """Note one fault, and return it."""
        fault = Fault(file, line, column, message)
        self._faults.append(fault)
        return fault

    def take_back(self, fault: Fault) -> None:
        """Forget a fault that another one explains."""
        self._faults.remove(fault)

    def extend(self, faults: Iterable[Fault]) -> None:
        """Note several faults."""
        self._faults.extend(faults)

    def sorted(self) -> list[Fault]:
        """Return all faults, by file and line."""
        return sorted(self._faults, key=lambda fault: (self._order.get(fault.file, -1), fault.line or 0))


def quoted(value: object) -> str:
    """Return a user's text for a message: printable, and shortened."""
    try:
        text = repr(value)
    except (
        ValueError,
        RecursionError,
    ):  # an integer of thousands of digits, or a list within a list within ...
        return "a value too long to repeat"
    text = text.encode("ascii", "backslashreplace").decode() if not text.isprintable() else text
    return text if len(text) <= SHOWN else text[:SHOWN] + "..."


def one_of(names: Iterable[str]) -> str:
    """Return names in a row, for the end of a message."""
    return ", ".join(names) or "none"


def and_of(names: Iterable[str]) -> str:
    """Return names with commas, the last two joined by ``and``."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
