"""Text of foreign programs: its encoding recognised, binary content and endless lines refused by line."""

from __future__ import annotations

import codecs
import re

from monitor.readers.faults import Faults
from monitor.readers.tables.csv_table import LONGEST_LINE, MOST_LINES
from monitor.readers.tables.cut_files import CUT, is_cut

#: Control characters that no text has; tab, line ends, form feed, the end-of-file mark of DOS and the separators 0x0F
#: and 0x14 of Q-DAS are let through.
_CONTROL = re.compile("[\x00-\x08\x0b\x0e\x10-\x13\x15-\x19\x1b-\x1f\x7f]")


#: How files of other kinds begin, and what is said of them.
_OTHERS = {
    b"pk\x03\x04": "a workbook or another archive; name a workbook of Excel .xlsx, or save it as CSV",
    b"\xd0\xcf\x11\xe0": "a workbook of an old Excel (.xls); save it as .xlsx or as CSV",
    b"<html": "a web page; export the measurement as text or CSV",
    b"<!doctype html": "a web page; export the measurement as text or CSV",
    b"%pdf": "a PDF; export the measurement as text or CSV",
}
#: Bytes at the head that are looked at, characters that say something, and the part of them that is plain letters.
_HEAD, _LEAST, _MOSTLY = 400, 8, 0.9


def decode_foreign(name: str, content: bytes, faults: Faults) -> tuple[str, str] | None:
    """Return the text with LF line ends and the name of its encoding; None with the fault noted.

    UTF-8 with or without byte-order mark, UTF-16 with one, and else Windows-1252, as older Windows programs write it.
    """
    if not content.strip():
        faults.add(name, 1, None, "the file is empty; export the measurement again")
        return None
    for begin, what in _OTHERS.items():
        if content.lstrip()[: len(begin)].lower() == begin:
            faults.add(name, 1, None, f"this is {what}, whatever its name says")
            return None
    decoded = _decoded(name, content, faults)
    if decoded is None:
        return None
    text, encoding = decoded
    text = text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a")
    if binary := _CONTROL.search(text):
        line = text.count("\n", 0, binary.start()) + 1
        faults.add(
            name, line, None,
            f"character 0x{ord(binary[0]):02x}: this is no text file; export the measurement as text or CSV",
        )  # fmt: skip
        return None
    if is_cut(text):
        faults.add(name, text.count("\n") + 1, None, CUT)
        return None
    if text.count("\n") > MOST_LINES:
        faults.add(name, None, None, f"the file has more than {MOST_LINES} lines; split it")
        return None
    lines = text.split("\n")
    longest = max(range(len(lines)), key=lambda index: len(lines[index]))
    if len(lines[longest]) > LONGEST_LINE:
        faults.add(
            name, longest + 1, None, f"the line is longer than {LONGEST_LINE} characters; end each row's line"
        )
        return None
    return text, encoding


def _unmarked(content: bytes) -> str | None:
    """Return the UTF-16 of a text without a mark, whose every other byte at the head is zero; None for any other."""
    even, odd = content[:_HEAD:2], content[1:_HEAD:2]
    for zero, other, encoding in ((odd, even, "utf-16-le"), (even, odd, "utf-16-be")):
        if len(zero) >= _LEAST and zero.count(0) >= _MOSTLY * len(zero) and not other.count(0):
            return encoding
    return None


def _decoded(name: str, content: bytes, faults: Faults) -> tuple[str, str] | None:
    for mark, encoding, label in (
        (codecs.BOM_UTF8, "utf-8-sig", "UTF-8 with byte-order mark"),
        (codecs.BOM_UTF16_LE, "utf-16", "UTF-16"),
        (codecs.BOM_UTF16_BE, "utf-16", "UTF-16"),
    ):
        if content.startswith(mark):
            try:
                return content.decode(encoding), label
            except UnicodeDecodeError as error:
                line = content.count(b"\n", 0, error.start) + 1
                is_cut_within = error.end >= len(content) - 1
                faults.add(
                    name, line, None,
                    f"the file is {label} and ends within a character: it is cut; export it again"
                    if is_cut_within
                    else f"the file begins as {label} and is not; save it as UTF-8 text",
                )  # fmt: skip
                return None
    if (unmarked := _unmarked(content)) is not None:
        try:
            return content.decode(unmarked), "UTF-16 without byte-order mark"
        except UnicodeDecodeError:
            pass
    try:
        return content.decode("utf-8"), "ASCII" if content.isascii() else "UTF-8"
    except UnicodeDecodeError:
        pass
    try:
        return content.decode("cp1252"), "Windows-1252"
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        faults.add(
            name, line, None,
            f"byte 0x{content[error.start]:02x} is neither UTF-8 nor Windows-1252; save the file as UTF-8 text",
        )  # fmt: skip
        return None
