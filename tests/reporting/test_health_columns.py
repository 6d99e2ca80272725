"""Columns of a machine's table: each is as wide as its longest text, and the whole table as wide as the page."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from monitor.reporting.health.columns import CELL_PT, HEAD_PT, column_widths
from monitor.reporting.svg.letter_widths import MILLIMETRES_A_POINT, in_mm

EM_MM = HEAD_PT * MILLIMETRES_A_POINT
#: A4 less its margins, the pictures of the history, and what the words of a parameter need at least.
ROOM_MM, PICTURES_MM, WORDS_MM = 176.0, 55.0, 22.0


@dataclass(frozen=True)
class Line:
    name: str = "EC0B"
    estimate: str = "−12.2"
    expanded: str = "6.7"
    tolerance: str = ""
    unit: str = "µrad"
    out: str = ""


LONG = Line(
    "EZC1:harmonic12@lagged_spindle_front_degC.cos", "−123 456.7", "12 345.6", "100 000", "µm/m²", "> 99.9 %"
)


@pytest.mark.parametrize("lines", [(), (Line(),), (Line(), LONG), (LONG,) * 51])
def test_every_number_has_the_room_of_its_letters(lines: tuple[Line, ...]) -> None:
    symbol, *numbers = (em * EM_MM for em in column_widths(lines))
    for line in lines:
        texts = (line.estimate, line.expanded, line.tolerance, line.unit, line.out)
        assert all(in_mm(text, CELL_PT) <= width for text, width in zip(texts, numbers, strict=True))
    assert symbol + sum(numbers) + PICTURES_MM + WORDS_MM < ROOM_MM


def test_a_symbol_of_usual_length_stands_on_a_line() -> None:
    assert column_widths([Line("EXX:reversal@warmup")])[0] * EM_MM > in_mm("EXX:reversal@warmup", CELL_PT)
