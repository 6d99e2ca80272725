"""Files that were cut off within their last number: 15.79 that is there as 15 would be read as a reading.

A whole file may lack the end of its last line. What is refused ends within a number besides: all rows above print as
many decimals as each other, and the last line prints fewer.
"""

from __future__ import annotations

import re

__all__ = ["CUT", "is_cut"]

#: What is said of such a file.
CUT = (
    "the last number is shorter than those above it and its line has no end: the file is cut here; export it again, or "
    "end the line if it is whole"
)
#: A number at the end of a row; a comma is a decimal mark where something else separates the cells.
_LAST_NUMBER = re.compile(r"(?:^|[\s;,:A-Za-z])[+-]?[0-9]+(?:\.([0-9]+))?\Z")
_LAST_WITH_COMMA = re.compile(r"(?:^|[\s;:A-Za-z])[+-]?[0-9]+(?:,([0-9]+))?\Z")
#: A number with a power of ten at the end of a row, and what may be the beginning of one.
_POWER = re.compile(r"[0-9][eE][+-]?([0-9]+)\Z")
_BEGINNING = re.compile(r"[0-9][.,]?(?:[eE][+-]?([0-9]*))?\Z")
_SEPARATED = re.compile(r"[;\t ]")
#: So many rows that end in numbers of equal length are printed so; of one decimal, which a program may leave out as a
#: zero, more of them.
_ROWS, _ROWS_OF_ONE = 5, 20


def is_cut(text: str) -> bool:
    """Whether the last line has no end and its last number fewer decimals than all those above it have."""
    if text.endswith("\n"):
        return False
    *lines, last = text.replace("\r\n", "\n").split("\n")
    if _is_cut_in_exponent(lines, last):
        return True
    pattern = _LAST_WITH_COMMA if _SEPARATED.search(last) and "." not in last else _LAST_NUMBER
    end = pattern.search(last.rstrip(".,"))
    cells = len(_SEPARATED.findall(last)) + last.count(",")
    above = [
        match
        for line in lines[-_ROWS_OF_ONE:]
        if len(_SEPARATED.findall(line)) + line.count(",") in (cells, cells + 1)
        and (match := pattern.search(line)) is not None
    ]
    decimals = {len(match[1] or "") for match in above}
    if end is None or len(decimals) != 1:
        return False
    usual = decimals.pop()
    return len(end[1] or "") < usual and len(above) >= (_ROWS if usual > 1 else _ROWS_OF_ONE)


def _is_cut_in_exponent(lines: list[str], last: str) -> bool:
    """Whether all rows above end in powers of ten of equally many digits, and the last row in the beginning of one."""
    powers = [_POWER.search(line) for line in lines[-_ROWS_OF_ONE:] if line.count("E") + line.count("e")]
    digits = {len(power[1]) for power in powers if power is not None}
    end = _BEGINNING.search(last)
    if end is None or len(digits) != 1 or None in powers[-_ROWS:] or len(powers) < _ROWS:
        return False
    return len(end[1] or "") < digits.pop()
