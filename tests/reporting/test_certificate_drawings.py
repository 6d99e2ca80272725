"""The pictures and the matrix of a certificate: what a reader must find is drawn, at the place that the numbers say."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable

import numpy as np
import pytest

from monitor.reporting.certificate.drawings import TALLEST_MM, interval_drawings, residual_drawing
from monitor.reporting.certificate.matrix import ROWS, correlation_blocks
from monitor.reporting.certificate.results import ResidualSummary, ResultSet
from monitor.reporting.numbers import written_correlation
from monitor.reporting.svg.letter_widths import BOLD, in_mm, in_units
from monitor.reporting.svg.map_slices import map_drawing, slices_of
from monitor.reporting.texts import texts_of

Make = Callable[..., ResultSet]
GRID = np.array([[x, y, z] for x in (0.0, 50.0, 100.0) for y in (-20.0, 0.0, 20.0) for z in (0.0, 200.0)])
VECTORS = np.column_stack([0.1 * GRID[:, 0], 0.0 * GRID[:, 0], -0.02 * GRID[:, 2]])
UNCERTAINTY = np.full(len(GRID), 1.5)


def names_in(drawing: str) -> list[str]:
    return re.findall(r'text-anchor="end"[^>]*>([^<]*)</text>', drawing)


@pytest.mark.parametrize("count", [1, 13, 30, 60, 154])
def test_every_parameter_is_drawn_once_and_no_figure_is_taller_than_a_page(
    make_result: Make, count: int
) -> None:
    result = make_result(count)
    drawings = interval_drawings(result, texts_of(), 176.0)
    assert all(on.height_mm <= TALLEST_MM for on in drawings)
    found = [name for on in drawings for name in names_in(on.svg())]
    assert sorted(found) == sorted(result.names)


def test_an_interval_is_as_long_as_its_uncertainty_and_brackets_stand_at_the_limits(
    make_result: Make,
) -> None:
    one = make_result(1)
    result = dataclasses.replace(one, tolerances=3.0 * one.expanded + abs(one.estimate))
    (on,) = interval_drawings(result, texts_of(), 88.0)
    paths = re.findall(r'<path d="([^"]*)" stroke="#([0-9a-f]{6})" stroke-width="([0-9.]+)"', on.svg())
    (bar,) = [d for d, _, width in paths if width == "4.6"]
    (bracket,) = [d for d, _, width in paths if width == "5"]
    first, last = (float(x) for x in re.findall(r"[MH](-?[0-9.]+)", bar))
    left, right = (float(x) for x in re.findall(r"M(-?[0-9.]+)", bracket))
    assert result.tolerances is not None
    ratio = float(result.expanded[0] / result.tolerances[0])
    assert (last - first) / (right - left) == pytest.approx(ratio, abs=0.002)
    middle = ((first + last) - (left + right)) / (right - left)
    assert middle == pytest.approx(float(result.estimate[0] / result.tolerances[0]), abs=0.002)


def test_residuals_have_a_bar_each_and_only_those_beyond_twice_the_probe_are_striped() -> None:
    residuals = ResidualSummary(
        "target", tuple(f"P{place}" for place in range(92)), (0.5,) * 91 + (2.5,), 1.0
    )
    drawn = residual_drawing(residuals, texts_of("de"), 176.0, 56.0, "T").svg()
    (bars,) = re.findall(r'<path d="([^"]*)" stroke="none" stroke-width="0" fill="#1d4e7c"/>', drawn)
    assert bars.count("z") == 92
    (stripes,) = re.findall(r'<path d="([^"]*)" stroke="white"', drawn)
    assert len({float(x) for x in re.findall(r"M([0-9.]+)", stripes)}) == 1
    assert ">0,5</text>" in drawn  # the decimal sign of the language
    none = dataclasses.replace(residuals, rms_um=(0.5,) * 92)
    assert 'stroke="white"' not in residual_drawing(none, texts_of(), 176.0, 56.0, "T").svg()


@pytest.mark.parametrize(("count", "language"), [(13, "en"), (30, "de"), (154, "en")])
def test_every_coefficient_stands_in_its_row_and_below_its_column(
    make_result: Make, count: int, language: str
) -> None:
    result = make_result(count, language=language)
    texts = texts_of(language)
    blocks = correlation_blocks(result.names, result.correlation, texts, "T")
    found: dict[tuple[int, int], str] = {}
    for block in blocks:
        assert len(block.lines) <= ROWS
        heads = block.head.split()
        columns = (
            [int(one) - 1 for one in heads] if count > 13 else [result.names.index(one) for one in heads]
        )
        # The middle of every column's name; digits have one width.
        ends = [in_units(block.head[1 : match.end()]) for match in re.finditer(r"\S+", block.head)]
        middles = [end - in_units(name) / 2 for end, name in zip(ends, heads, strict=True)]
        for line in block.lines:
            side, values = line.split("\t")
            row = int(side.rpartition("(")[2][:-1]) - 1 if count > 13 else result.names.index(side)
            for column, middle, match in zip(columns, middles, re.finditer(r"\S+", values), strict=False):
                found[row, column] = match.group()
                begin = in_units(values[: match.start()])
                assert begin - 900 < middle < begin + in_units(match.group()) + 900
    assert found == {
        (row, column): written_correlation(float(result.correlation[row, column]), texts.decimal_sign)
        for row in range(count)
        for column in range(row + 1)
    }


def test_a_coefficient_of_more_decimals_moves_no_other(make_result: Make) -> None:
    result = make_result(3)
    matrix = np.array([[1.0, 0.99962, -0.5], [0.99962, 1.0, -0.5], [-0.5, -0.5, 1.0]])
    (block,) = correlation_blocks(result.names, matrix, texts_of(), "T")
    values = [line.split("\t")[1] for line in block.lines]
    assert "0.9996" in values[1]
    ends = [in_units(line[: line.rindex("1")]) for line in (values[0], values[1], values[2])]
    pitch = ends[2] / 2 - ends[0] / 2
    assert abs(ends[1] - ends[0] - pitch) < 420  # a fifth of an em


def test_a_name_too_long_for_the_page_is_cut_and_keeps_its_number(make_result: Make) -> None:
    result = make_result(2)
    names = (f"{'EYX:poly3@spindle_temperature_degC' * 3}", "EZZ")
    blocks = correlation_blocks(names, result.correlation, texts_of(), "T")
    assert blocks[0].left_mm < 90.0
    assert blocks[0].lines[0].split("\t")[0].endswith("… (1)")


def test_bold_letters_are_not_wider_than_counted() -> None:
    """Against the bold font itself, letter by letter, those of symbols and heads."""
    from io import BytesIO

    from fontTools.ttLib import TTFont

    from monitor.reporting.resources import font_bytes

    font = TTFont(BytesIO(font_bytes("DejaVuSans-Bold.ttf")), lazy=True)
    letters = font.getBestCmap()
    for words in (
        "EA0B",
        "EXX:poly2@x_axis_degC",
        "Schätzwert",
        "Parameter",
        "U = 2.95 u",
        "shape[P12.3]",
        "0123",
    ):
        bold = sum(font["hmtx"][letters[ord(letter)]][0] for letter in words) / font["head"].unitsPerEm
        assert bold * 8.0 * 25.4 / 72.0 <= BOLD * in_mm(words, 8.0) * 1.04 + 0.3


def test_the_middle_slices_are_taken_whatever_the_order_of_the_points() -> None:
    slices = slices_of(GRID, VECTORS, UNCERTAINTY, ("X", "Y", "Z"))
    assert [(one.across, one.at_mm, one.along) for one in slices] == [
        ("Z", 200.0, ("X", "Y")), ("Y", 0.0, ("X", "Z")), ("X", 50.0, ("Y", "Z")),
    ]  # fmt: skip
    assert (slices[0].first_um[2][1], slices[0].second_um[2][1]) == (10.0, 0.0)
    assert slices[1].lengths_um[2][1] == pytest.approx(np.hypot(10.0, 4.0), abs=1e-4)
    shuffled = np.random.default_rng(1).permutation(len(GRID))
    again = slices_of(GRID[shuffled], VECTORS[shuffled], UNCERTAINTY, ("X", "Y", "Z"))
    drawn = [map_drawing(one, title="T", scale_words="length").svg() for one in (slices, again)]
    assert drawn[0] == drawn[1]
    # Of 9 + 6 + 6 numbers six would stand on others in the narrow slices.
    assert drawn[0].count("±1.5") == 15


def test_a_map_without_errors_can_be_drawn() -> None:
    slices = slices_of(GRID, 0.0 * VECTORS, UNCERTAINTY, ("X", "Y", "Z"))
    assert "Z = 200 mm" in map_drawing(slices, title="T", scale_words="length").svg()


def test_the_map_is_drawn_in_greys_the_darker_the_larger() -> None:
    drawn = map_drawing(slices_of(GRID, VECTORS, UNCERTAINTY, "XYZ"), title="T", scale_words="l").svg()
    fills = re.findall(r'stroke="none" stroke-width="0" fill="#(\w{2})(\w{2})(\w{2})"', drawn)
    greys = [one for one in fills if one[0] == one[1] == one[2]]
    assert len({one[0] for one in greys}) >= 4
