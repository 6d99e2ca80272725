"""One rule for what a spreadsheet would run, in Python and in the database, over all characters of Unicode."""

from __future__ import annotations

import re
import sys
import unicodedata

import duckdb
import pytest

from monitor.cli.output import csv_cell
from monitor.formula_cells import FORMULA


def unseen() -> list[str]:
    """The characters that are not seen, by the tables of Python."""
    kinds = ("Cc", "Cf", "Zs", "Zl", "Zp")
    return [chr(code) for code in range(sys.maxunicode + 1) if unicodedata.category(chr(code)) in kinds]


def is_formula_in_database(texts: list[str]) -> list[bool]:
    rows = duckdb.execute("SELECT regexp_matches(unnest(?), ?)", [texts, FORMULA]).fetchall()
    return [bool(row[0]) for row in rows]


def test_a_formula_behind_any_character_that_is_not_seen_begins_with_an_apostrophe() -> None:
    texts = [f"{character}{sign}1" for character in unseen() for sign in "=+-@"]
    assert len(texts) > 4 * 200
    missed = [text for text in texts if csv_cell(text) != f"'{text}"]
    assert missed == []
    assert all(is_formula_in_database(texts))


def test_what_is_seen_before_a_sign_is_no_formula() -> None:
    seen = set(map(chr, range(0x3000))) - set(unseen()) - set("=+-@")
    texts = sorted(f"{character}=1" for character in seen)
    assert [text for text in texts if re.match(FORMULA, text)] == []
    assert not any(is_formula_in_database(texts))


@pytest.mark.parametrize(
    "text", ["=1", " \ufeff\u200b=1", "\t1", "\r1", "\x0b=1", "\x85=1", "-5", " -5 µm", "1=1", "'=1", ""]
)
def test_the_answer_and_the_export_have_one_rule(text: str) -> None:
    assert (csv_cell(text) != text) == is_formula_in_database([text])[0]
