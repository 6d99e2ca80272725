"""A word such as MAX begins a line of results below rows of numbers, and is a name among names."""

from __future__ import annotations

import pytest

from monitor.readers.export import Export, ExportFile
from monitor.readers.exports.table import TableSettings, read
from monitor.readers.faults import Faults

WORDS = ["MIN", "MAX", "MW", "Mean:"]


def _read(*firsts: str) -> tuple[Export | None, list[str]]:
    """What is read of rows that begin with ``firsts``, and what is refused."""
    rows = "".join(f"{first};{place}.0;0.{place}\n" for place, first in enumerate(firsts))
    faults = Faults(["t.csv"])
    export = read(ExportFile("t.csv", f"Target;X;Y\n{rows}".encode()), TableSettings(), faults)
    return export, [f"line {fault.line}: {fault.message}" for fault in faults.sorted()]


@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize("others", [("P1", "P2", "P3"), ("MIN", "MAX")])
def test_a_target_may_be_named_as_results_are(word: str, others: tuple[str, ...]) -> None:
    export, refused = _read(*others, word)
    assert refused == []
    assert export is not None
    assert export.columns["Target"] == (*others, word)
    assert any("is read as a row, since names begin the others" in note for note in export.notes)


@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize("others", [("1", "2", "-3.5"), ("2026-03-01", "2026-03-02"), ("08:00", "", "08:02")])
def test_a_result_below_rows_that_begin_with_numbers_is_refused(word: str, others: tuple[str, ...]) -> None:
    _, refused = _read(*others, word, "Range")
    (said,) = refused
    assert said.startswith(f"line {len(others) + 2}: '{word}' begins a line of results and no row")


def test_names_without_such_a_word_need_no_note() -> None:
    export, refused = _read("P1", "P2")
    assert refused == []
    assert export is not None
    assert export.notes == ()
