"""Values of a TOML file, taken key by key; whatever is wrong is noted with its line, and nothing raises."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable
from typing import Any

from monitor.exceptions import Fault, closest
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.toml_lines import Path, line_of, lines_of_keys
from monitor.toml_text import toml_fault

#: Longest name or text that a key may hold.
LONGEST_TEXT = 200


class Table:
    """One table of a TOML file. Every getter notes a fault and returns None where the value is not right.

    The keys that were asked for are the known ones; ``finish`` refuses all others.
    """

    def __init__(
        self, file: str, faults: Faults, content: dict[str, Any], lines: dict[Path, int], path: Path = ()
    ) -> None:
        self.file = file
        self.faults = faults
        self.data = content
        self.path = path
        self._lines = lines
        self._asked_for: list[str] = []
        self._missing: dict[str, Fault] = {}

    def fault(self, key: str | None, message: str) -> Fault:
        """Note a fault of a key, or of the table itself, and return it."""
        path = self.path if key is None else (*self.path, key)
        return self.faults.add(self.file, line_of(path, self._lines), name_of(path) or None, message)

    def section(self, key: str) -> Table:
        """Return an empty table in the place of one that was read already: for faults of its keys."""
        return Table(self.file, self.faults, {}, self._lines, (*self.path, key))

    def raw(self, key: str, *, required: bool, example: str) -> Any:
        """Return the value as TOML has it, or None."""
        self._asked_for.append(key)
        if key not in self.data and required:
            message = f"this key is missing; write for example {key} = {example}"
            self._missing[key] = self.fault(key, message)
        return self.data.get(key)

    def text(self, key: str, *, required: bool = False, example: str = '"..."') -> str | None:
        """Return a text of one line."""
        value = self.raw(key, required=required, example=example)
        if value is None:
            return None
        if not isinstance(value, str):
            self.fault(key, f"{quoted(value)} is not a text; write it in quotes, such as {example}")
        elif not value.strip() or value != value.strip():
            self.fault(key, f"{quoted(value)} is empty or begins or ends with a space; write {example}")
        elif not value.isprintable() or len(value) > LONGEST_TEXT:
            self.fault(
                key, f"{quoted(value)} must be one line of at most {LONGEST_TEXT} printable characters"
            )
        else:
            return value
        return None

    def number(
        self,
        key: str,
        *,
        required: bool = False,
        positive: bool = False,
        largest: float | None = None,
        unit: str,
        example: str,
    ) -> float | None:
        """Return a finite number, positive and at most ``largest`` where that is asked for."""
        value = self.raw(key, required=required, example=example)
        return None if value is None else self._number(key, value, positive, largest, unit, example)

    def numbers(
        self, key: str, count: int, *, required: bool = False, largest: float, unit: str, example: str
    ) -> tuple[float, ...] | None:
        """Return exactly ``count`` finite numbers."""
        value = self.raw(key, required=required, example=example)
        if value is None:
            return None
        if not isinstance(value, list) or len(value) != count:
            self.fault(key, f"{quoted(value)} is not {count} numbers; write for example {key} = {example}")
            return None
        parsed = [self._number(key, element, False, largest, unit, example) for element in value]
        sound = tuple(number for number in parsed if number is not None)
        return sound if len(sound) == count else None

    def sign(self, key: str) -> int | None:
        """Return +1 or -1; None where the key is absent."""
        value = self.raw(key, required=False, example="1")
        if value is not None and (type(value) is not int or value not in (1, -1)):
            self.fault(key, f"{quoted(value)} is not a sign; write {key} = 1 or {key} = -1")
            return None
        return value

    def truth(self, key: str) -> bool:
        """Return true or false; false where the key is absent."""
        value = self.raw(key, required=False, example="true")
        if value is not None and not isinstance(value, bool):
            self.fault(key, f"{quoted(value)} is neither true nor false; write {key} = true, or leave it out")
        return value is True

    def table(self, key: str, *, required: bool = False) -> Table | None:
        """Return the table under a key."""
        self._asked_for.append(key)
        value = self.data.get(key)
        inner = (*self.path, key)
        if value is None:
            if required:
                message = f"the table [{name_of(inner)}] is missing"
                self._missing[key] = self.fault(None if self.path else key, message)
            return None
        if not isinstance(value, dict):
            self.fault(key, f"{quoted(value)} is not a table; write [{name_of(inner)}] and its keys below")
            return None
        return Table(self.file, self.faults, value, self._lines, inner)

    def tables(self, key: str) -> list[Table]:
        """Return the tables of an array of tables; none where the key is absent."""
        self._asked_for.append(key)
        value = self.data.get(key, [])
        inner = (*self.path, key)
        if not isinstance(value, list) or not all(isinstance(element, dict) for element in value):
            self.fault(key, f"this is not a list of tables; write [[{name_of(inner)}]] above each of them")
            return []
        return [
            Table(self.file, self.faults, element, self._lines, (*inner, index))
            for index, element in enumerate(value)
        ]

    def finish(self) -> None:
        """Refuse every key that was not asked for. One close to a missing key is that key, misspelt: one fault."""
        names = tuple(dict.fromkeys(self._asked_for))
        for key in self.data:
            if key in self._asked_for:
                continue
            meant = closest(key, self._missing) or closest(key, names)
            if meant in self._missing:
                self.faults.take_back(self._missing.pop(meant))
            hint = f"did you mean '{meant}'? " if meant else ""
            self.fault(key, f"this key is not known; {hint}the keys here are {one_of(names)}")

    def _number(
        self, key: str, value: Any, positive: bool, largest: float | None, unit: str, example: str
    ) -> float | None:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.fault(key, f"{quoted(value)} is not a number; write {key} = {example} (in {unit})")
            return None
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self.fault(key, f"{quoted(value)} is not a finite number; write {key} = {example} (in {unit})")
        elif positive and number <= 0.0:
            self.fault(key, f"{quoted(value)} must be greater than 0 (in {unit})")
        elif largest is not None and abs(number) > largest:
            self.fault(key, f"{quoted(value)} is beyond {largest:g} {unit}; is its unit {unit}?")
        else:
            return number
        return None


def parse_toml(file: str, text: str, faults: Faults) -> Table | None:
    """Parse a file; None with the syntax error noted."""
    try:
        content = tomllib.loads(text.replace("\r\n", "\n"))
    except RecursionError:
        faults.add(file, None, None, "the brackets are nested too deeply for a campaign file")
    except ValueError as error:
        line, reason = toml_fault(error, text)
        faults.add(file, line, None, reason)
    else:
        return Table(file, faults, content, lines_of_keys(text))
    return None


def name_of(path: Iterable[str | int]) -> str:
    """Return a path as a message has it; elements of an array of tables count from 1."""
    name = ""
    for part in path:
        if isinstance(part, int):
            name += f"[{part + 1}]"
        else:
            part = part if part.isprintable() else part.encode("ascii", "backslashreplace").decode()
            name += ("." if name else "") + part[:60]
    return name
