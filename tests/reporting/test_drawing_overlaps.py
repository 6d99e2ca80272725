"""No text of a drawing covers another or leaves the sheet, at its extremes; every figure has its check."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from html import unescape
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.records import Array
from monitor.reporting import figures
from monitor.reporting.certificate.drawings import interval_drawings, residual_drawing
from monitor.reporting.certificate.results import ResidualSummary, ResultSet
from monitor.reporting.figures.curve import MeasuredCurve, Residuals, residuals_figure
from monitor.reporting.figures.shape import Deviations, raw_and_identified
from monitor.reporting.figures.standards import circle_figure, positioning_figure
from monitor.reporting.figures.unknown_shape import ShapeCurve, unknown_shape
from monitor.reporting.figures.volumetric import expected_uncertainties, volumetric_slices
from monitor.reporting.health.comparison import (
    ErrorStep,
    GroupMean,
    ModelHealth,
    ResidualAgainst,
    ResidualMap,
)
from monitor.reporting.health.pictures import against_driver, error_steps, where_it_fails
from monitor.reporting.health.trend_picture import trend_picture
from monitor.reporting.svg.letter_widths import BOLD, in_units, units_an_em
from monitor.reporting.svg.map_slices import map_drawing, slices_of
from monitor.reporting.svg.plot import LETTER, SCALE, nice_ticks, words_of_ticks
from monitor.reporting.texts import texts_of

HERE = Path(__file__).parent
first_page = load("first_page_records", HERE / "test_first_page.py")
overlaps = load("figure_overlaps", HERE / "test_figure_overlaps.py")
LONG = overlaps.LONG
#: The huge ones, whose numbers are the widest, in every run of the tests.
SIZES = [pytest.param(size, marks=() if size > 1.0 else pytest.mark.slow) for size in (1e-6, 1.0, 3e5)]
Box = tuple[str, float, float, float, float]


def boxes_of(svg: str) -> list[Box]:
    """Every text with the edges of its letters (left, top, right, bottom) in units of the drawing."""
    boxes = []
    pattern = r'<text x="([-\d.]+)" y="([-\d.]+)" text-anchor="(\w+)"([^>]*)>(.*?)</text>'
    for x, y, anchor, look, text in re.findall(pattern, svg):
        written = unescape(re.sub("<[^>]*>", "", text))
        size = float(match[1]) if (match := re.search(r'font-size="([\d.]+)"', look)) else LETTER
        width = in_units(written) / units_an_em() * size * (BOLD if "700" in look else 1.0)
        back = {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * width
        # Capitals are 0.73 of the letter high; what stands below the base line is left out.
        if "rotate(-90" in look:
            boxes.append(
                (written, float(x) - 0.73 * size, float(y) - width + back, float(x), float(y) + back)
            )
        else:
            boxes.append(
                (written, float(x) - back, float(y) - 0.73 * size, float(x) - back + width, float(y))
            )
    return [box for box in boxes if box[0].strip()]


def corners_of(d: str) -> Iterator[tuple[float, float]]:
    """Return the corners of a path of lines, and the ends of its arcs."""
    x = y = 0.0
    for command, written in re.findall(r"([A-Za-z])([^A-Za-z]*)", d):
        numbers = [float(number) for number in re.findall(r"-?[\d.]+(?:e-?\d+)?", written)]
        # Of an arc the last two of seven numbers are its end; of other curves none are drawn.
        width = {"h": 1, "v": 1, "a": 7, "z": 1}.get(command.lower(), 2)
        assert command.lower() in "mlhvaz", command
        for first in range(0, len(numbers), width):
            *_, before, last = [0.0, *numbers[first : first + width]]
            across = {"h": last, "v": 0.0}.get(command.lower(), before)
            up = 0.0 if command.lower() == "h" else last
            if command.islower():
                x, y = x + across, y + up
            else:
                x, y = (x if command == "V" else across), (y if command == "H" else up)
            yield x, y


def strokes_off_the_sheet(svg: str, wide: float, high: float) -> list[str]:
    """Return the lines, areas and dots that leave a sheet by more than a tenth of a millimetre."""
    return [
        f"a stroke leaves the sheet at {x:.0f}, {y:.0f} of {wide:.0f}, {high:.0f}"
        for d in re.findall(r'<path d="([^"]*)"', svg)
        for x, y in corners_of(d)
        if not (-1.0 < x < wide + 1.0 and -1.0 < y < high + 1.0)
    ][:3]


def faults(svg: str) -> list[str]:
    """Return what covers what, or leaves the sheet, by more than a tenth of a millimetre."""
    boxes = boxes_of(svg)
    assert boxes
    size = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', svg)
    assert size is not None
    wide, high = map(float, size.groups())
    outside = strokes_off_the_sheet(svg, wide, high) + [
        f"{text!r} leaves the sheet"
        for text, left, top, right, bottom in boxes
        if left < -1.0 or top < -1.0 or right > wide + 1.0 or bottom > high + 1.0
    ]
    return outside + [
        f"{first[0]!r} covers {other[0]!r}"
        for first, other in combinations(boxes, 2)
        if min(first[3], other[3]) - max(first[1], other[1]) > 1.0
        and min(first[4], other[4]) - max(first[2], other[2]) > 1.0
    ]


@pytest.mark.parametrize("runs", [1, 2, 200])
@pytest.mark.parametrize("value", [1e-6, 24.0, -3e7])
def test_trend_picture(runs: int, value: float) -> None:
    for per_month in (0.0, 0.1 * value):
        drawn = first_page.parameter(value=value, per_month=per_month, tolerance=abs(value), runs=runs)
        assert faults(trend_picture(LONG, drawn)) == []


def _model(count: int, size: float, heldout: float | None) -> ModelHealth:
    steps = tuple(
        ErrorStep(f"EZC1:const@warmup_of_the_spindle_{index}", size * (3.0 - 2.0 * index / count),
                  None if heldout is None else heldout * size, index == count - 1)
        for index in range(count)
    )  # fmt: skip
    return ModelHealth(
        "c", "all", "samba", "something is missing", "", size, None, None, None, (), size, None, None, steps
    )


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("count", [1, 2, 9])
@pytest.mark.parametrize("heldout", [None, 0.2, 3.0])
def test_error_steps(count: int, size: float, heldout: float | None) -> None:
    assert faults(error_steps(_model(count, size, heldout))) == []


@pytest.mark.parametrize("count", [1, 9])
@pytest.mark.parametrize("heldout", [0.2, 3.0])
@pytest.mark.parametrize("size", [1e-6, 1.0, 3e5])
def test_nothing_strikes_names_or_numbers_of_the_steps_through(
    count: int, heldout: float, size: float
) -> None:
    svg = error_steps(_model(count, size, heldout))
    marks = [
        (float(x), float(top), float(x), float(bottom))
        for x, top, bottom in re.findall(r'd="M([-\d.]+) ([-\d.]+)L\1 ([-\d.]+)"', svg)
    ] + [
        (float(x), float(y) - float(r), float(x) + 2 * float(r), float(y) + float(r))
        for x, y, r in re.findall(r'd="M([-\d.]+) ([-\d.]+)a([\d.]+) ', svg)
    ]
    assert len(marks) > 2 * min(count, 8)
    struck = [
        (text, mark)
        for text, left, top, right, bottom in boxes_of(svg)
        for mark in marks
        if min(right, mark[2]) - max(left, mark[0]) >= 0.0 and min(bottom, mark[3]) - max(top, mark[1]) > 0.0
    ]
    assert struck == []
    # Small numbers are numbers, too.
    assert "0.00" not in svg


@pytest.mark.parametrize("level", [0.0, 24.0, 3e7])
@pytest.mark.parametrize("span", [1e-3, 2.0])
def test_numbers_along_an_axis_are_told_from_each_other(level: float, span: float) -> None:
    words = words_of_ticks(nice_ticks(level, level + span, 6))
    assert len(set(words.values())) == len(words) > 2


@pytest.mark.parametrize("size", SIZES)
def test_where_it_fails(size: float) -> None:
    grid = np.stack(np.meshgrid([0.0, 12345.0], [-400.0, 400.0], [0.0, 50.0]), axis=-1).reshape(-1, 3)
    rows = tuple(map(tuple, grid.tolist()))
    residuals = tuple(map(tuple, (size * (grid * 2e-3 - 1.0)).tolist()))
    assert faults(where_it_fails(ResidualMap(rows, residuals))) == []
    assert faults(where_it_fails(ResidualMap(rows[:1], residuals[:1]))) == []


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("drivers", [(1.0,), (-1.0, 1.0), tuple(np.linspace(-9e4, 9e4, 30).tolist())])
def test_against_driver(drivers: tuple[float, ...], size: float) -> None:
    groups = tuple(GroupMean(5, at, size * (1.0 + 1e-5 * at), 0.1 * size, 0.0, 0.1 * size) for at in drivers)
    residual = ResidualAgainst(
        "temperature of the ball screw of axis X within the run / °C", "EXX", groups, drivers, drivers
    )
    assert faults(against_driver(residual)) == []


def _cube(size: float, longest: float = 2500.0) -> tuple[Array, Array, Array]:
    steps = np.linspace(-1.0, 1.0, 5)
    cube = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    return cube * np.array([longest, 400.0, 300.0]), size * (cube + 0.1), size * np.ones(125)


@pytest.mark.parametrize("size", [1e-6, 1.0, 999.0])
def test_map_drawing(size: float) -> None:
    slices = slices_of(*_cube(size), ("X", "Y", "Z"))
    assert faults(map_drawing(slices, title="t", scale_words="Länge der Abweichung / µm").svg()) == []


@pytest.mark.parametrize("count", [1, 13, 51])
@pytest.mark.parametrize("factor", [1e-6, 1.0, 3e5])
def test_interval_drawings(make_result: Callable[..., ResultSet], count: int, factor: float) -> None:
    made = make_result(count)
    result = replace(
        made, estimate=factor * made.estimate, covariance=factor**2 * made.covariance,
        tolerances=np.full(count, 10.0 * factor),
    )  # fmt: skip
    for drawing in interval_drawings(result, texts_of("de"), 176.0):
        assert faults(drawing.svg()) == []


@pytest.mark.parametrize("count", [1, 8, 40])
@pytest.mark.parametrize("width", [80.0, 176.0])
def test_residual_drawing(count: int, width: float) -> None:
    names = tuple("the ball on the far corner" if index == 0 else f"S{index}" for index in range(count))
    summary = ResidualSummary(
        "target", names, tuple(3e5 * (1.0 + 0.1 * index) for index in range(count)), 2e5
    )
    assert faults(residual_drawing(summary, texts_of("de"), width, 60.0, "t").svg()) == []


@pytest.mark.parametrize("size", SIZES)
def test_volumetric_slices(size: float) -> None:
    cube = _cube(min(size, 999.0), 1000.0)
    assert overlaps.faults(volumetric_slices(*cube, names=("X", "Y", "Z"), title=LONG, note=LONG)) == []


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("count", [1, 13, 51])
@pytest.mark.slow
def test_expected_uncertainties(count: int, size: float) -> None:
    names, u = [f"EX0C1({index})" for index in range(count)], size * np.linspace(1.0, 2.0, count)
    for proposed in (None, 0.5 * u):
        figure = expected_uncertainties(names, ["µrad"] * count, u, proposed, title=LONG, note=LONG)
        assert overlaps.faults(figure) == []


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.slow
def test_standards_curves_and_shapes(size: float) -> None:
    at = np.linspace(-9e3, 9e3, 11)
    two = size * np.stack([at, -at]) / 9e3
    drawn = [
        positioning_figure(at, two, 0.1 * size + 0.0 * two, axis="X", units=("mm", "µm"), title=LONG),
        circle_figure(np.linspace(0, 6, 11), two[0], np.ones(11, dtype=int), plane=("X", "Y"), title=LONG),
        unknown_shape(
            ShapeCurve(at, np.sign(at), two[0], np.full(11, 0.1 * size)), title=LONG,
            axis_name="temperature of the ball screw of axis X / °C", value_name="angular positioning error / µrad",
        ),
        residuals_figure(
            MeasuredCurve(at, two[0], at > 8e3, "load / kN", "deflection / (mV/V)"),
            [Residuals(LONG, two[1]) for _ in range(7)], title=LONG,
        ),
        raw_and_identified(
            Deviations(
                np.stack([at, at**2 / 9e3], axis=1), np.tile([0.0, 1.0], (11, 1)), np.tile(two[0][:, None], (1, 8)),
                [float(45 * angle) for angle in range(8)], two[0], np.full(11, size),
            ),
            title=LONG,
        ),
    ]  # fmt: skip
    assert [overlaps.faults(figure) for figure in drawn] == [[]] * len(drawn)


def test_every_figure_has_its_check() -> None:
    """A function that returns a figure is called in one of the two files that look for overlaps."""
    checks = "".join(
        (HERE / name).read_text() for name in ("test_figure_overlaps.py", "test_drawing_overlaps.py")
    )
    names = [
        name
        for module in pkgutil.iter_modules(figures.__path__, f"{figures.__name__}.")
        for name, function in inspect.getmembers(importlib.import_module(module.name), inspect.isfunction)
        if function.__module__ == module.name
        and not name.startswith("_")
        and name != "new_figure"
        and inspect.signature(function).return_annotation == "Figure"
    ]
    assert len(names) >= 14
    assert [name for name in names if not re.search(rf"\b{name}\(", checks)] == []


def test_the_last_number_of_an_axis_stays_on_the_sheet(make_result: Callable[..., ResultSet]) -> None:
    """Wherever it falls: of seven of these forty sizes one left it before."""
    made = make_result(13)
    for factor in np.geomspace(1e-6, 1e-5, 40):
        sizes = {"estimate": factor * made.estimate, "covariance": factor**2 * made.covariance}
        for drawing in interval_drawings(replace(made, **sizes, tolerances=None), texts_of("de"), 176.0):
            assert faults(drawing.svg()) == [], factor


def test_the_check_sees_a_text_on_a_text_and_off_the_sheet() -> None:
    text = '<text x="{}" y="50" text-anchor="start" fill="x">word</text>'
    for left, fault in ((10, "covers"), (480, "leaves the sheet"), (200, "")):
        svg = f'<svg viewBox="0 0 {50 * SCALE:g} 100">{text.format(20)}{text.format(left)}</svg>'
        assert [fault] == [one.split(" ", 1)[1].removesuffix(" 'word'") for one in faults(svg)] or not fault
        assert bool(faults(svg)) == bool(fault)


def test_the_check_sees_a_stroke_off_the_sheet() -> None:
    for d, fault in (
        ("M10 10L90 90", False),
        ("M10 10L190 90", True),
        ("M10 10h90v-30z", True),
        ("M9 9h9v9z", False),
    ):
        svg = f'<svg viewBox="0 0 100 100"><path d="{d}" fill="x"/></svg>'
        assert bool(strokes_off_the_sheet(svg, 100.0, 100.0)) == fault, d
