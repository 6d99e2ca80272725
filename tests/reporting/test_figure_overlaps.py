"""No text of a figure covers another or leaves the sheet, at its extremes: long names, 1 and 200 runs, tiny and huge
values, one and 51 parameters."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.quiver import Quiver
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from monitor.reporting.figures.drivers import (
    DrivenResiduals,
    predicted_against_measured,
    residual_against_driver,
)
from monitor.reporting.figures.models import ErrorSteps, RankedEffects, error_falling, ranked_effects
from monitor.reporting.figures.parameters import ParametersOfRuns, parameters_by_run
from monitor.reporting.figures.residuals import residual_bars, residual_vectors
from monitor.reporting.figures.standards import followed_figure, part_figure, rotation_figure
from monitor.reporting.figures.style import style
from monitor.reporting.figures.trend import RunsOverTime, parameter_over_time, selections_side_by_side

LONG = (
    "EC0Y of a machine whose name is longer than anybody would expect (hall 17, bay 4): it stepped by 8 µrad"
)
#: Tiny, usual and huge values; the huge ones, whose numbers are the widest, in every run of the tests.
SIZES = [pytest.param(size, marks=() if size > 1.0 else pytest.mark.all_seeds) for size in (1e-6, 1.0, 3e5)]


def texts(figure: Figure) -> Iterator[tuple[str, Bbox]]:
    """Every visible text with its box, a point smaller at each side than what is drawn."""
    canvas = FigureCanvasAgg(figure)
    with style():
        canvas.draw()
        # Ticks beyond the limits and those kept for later exist too, but are not drawn.
        axes = [axis for part in figure.axes for axis in (part.xaxis, part.yaxis)]
        drawn = {
            id(label)
            for axis in axes
            for tick in axis._update_ticks()
            for label in (tick.label1, tick.label2)
        }
        ticks = {
            id(label)
            for axis in axes
            for tick in (*axis.majorTicks, *axis.minorTicks)
            for label in (tick.label1, tick.label2)
        }
    renderer = canvas.get_renderer()
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if text.get_visible() and text.get_text().strip() and id(text) not in ticks - drawn:
            yield text.get_text(), text.get_window_extent(renderer)


def faults(figure: Figure) -> list[str]:
    """Return what covers what, or leaves the sheet, by more than a point."""
    point = figure.dpi / 72.0
    boxes = [(text, box.padded(-point)) for text, box in texts(figure)]
    sheet = figure.bbox
    outside = [
        f"{text!r} leaves the sheet"
        for text, box in boxes
        if box.x0 < sheet.x0 - point
        or box.y0 < sheet.y0 - point
        or box.x1 > sheet.x1 + point
        or box.y1 > sheet.y1 + point
    ]
    return (
        cut_off(figure)
        + outside
        + [
            f"{one!r} covers {other!r}"
            for (one, box), (other, beside) in combinations(boxes, 2)
            if box.width > 0
            and box.height > 0
            and beside.width > 0
            and beside.height > 0
            and box.overlaps(beside)
        ]
    )


def cut_off(figure: Figure) -> list[str]:
    """Return the lines, bars and arrows that axes cut off, by more than a point beyond their edges."""
    canvas = FigureCanvasAgg(figure)
    with style():
        canvas.draw()
    point = figure.dpi / 72.0
    cut = []
    for axes in figure.axes:
        room = axes.get_window_extent().padded(point)
        drawn = [
            (type(line).__name__, line.get_transform().transform(line.get_xydata())) for line in axes.lines
        ]
        for collection in axes.collections:
            if isinstance(collection, Quiver):
                at = np.asarray(collection.get_offsets())
                tips = at + np.column_stack([collection.U, collection.V]) / (collection.scale or 1.0)
                drawn.append(("arrow", axes.transData.transform(np.concatenate([at, tips]))))
            elif isinstance(collection, LineCollection):
                ends = np.concatenate([np.empty((0, 2)), *collection.get_segments()])
                drawn.append(("bar", collection.get_transform().transform(ends)))
        for kind, ends in drawn:
            ends = ends[np.isfinite(ends).all(axis=1)]
            inside = (ends >= room.min) & (ends <= room.max)
            if axes.name != "polar" and not inside.all():
                cut.append(f"{kind} of {axes.get_title() or axes.get_ylabel()!r} is cut off")
    return cut


def legends_inside(figure: Figure) -> int:
    """Return how many legends share paper with axes, where what is drawn may run through them."""
    canvas = FigureCanvasAgg(figure)
    with style():
        canvas.draw()
    renderer = canvas.get_renderer()
    legends = [part for part in figure.findobj(Legend) if part.get_visible()]
    assert legends
    boxes = [legend.get_window_extent(renderer).padded(-figure.dpi / 72.0) for legend in legends]
    return sum(box.overlaps(axes.get_window_extent(renderer)) for box in boxes for axes in figure.axes)


def by_run(runs: int, count: int, size: float) -> Figure:
    rng = np.random.default_rng(1)
    names = [f"EX0C1({index})" for index in range(count)]
    return parameters_by_run(
        ParametersOfRuns(
            list(range(1, runs + 1)), [1 + index // 4 for index in range(runs)], names, ["µm/m"] * count,
            size * (5.0 + rng.standard_normal((runs, count))), np.full((runs, count), 0.5 * size),
        ),
        title=LONG, interval="U = 2.24 u", highlight=names[:1],
    )  # fmt: skip


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(
    ("runs", "count"),
    [
        (1, 1),
        pytest.param(200, 13, marks=pytest.mark.slow),
        pytest.param(20, 51, marks=pytest.mark.all_seeds),
    ],
)
def test_parameters_by_run(runs: int, count: int, size: float) -> None:
    assert faults(by_run(runs, count, size)) == []


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("runs", [1, 2, 200])
def test_parameter_over_time(runs: int, size: float) -> None:
    days = 20_000.0 + np.linspace(0.0, 700.0, runs)
    values = size * (10.0 + np.arange(runs) / runs)
    figure = parameter_over_time(
        RunsOverTime(days, values, np.full(runs, 0.5 * size), "µrad"),
        title=LONG, limit=12.0 * size, changes=[days[runs // 2]],
        events={days[0]: "crash of the spindle into the fixture", days[-1]: "repair of the spindle bearing"},
        line=(days, values, np.full(runs, 0.3 * size)) if runs > 2 else None,
    )  # fmt: skip
    assert faults(figure) == []
    # Changes and events are upright lines through the whole height.
    assert legends_inside(figure) == 0


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("count", [1, 13, 51])
@pytest.mark.slow
def test_selections_side_by_side(count: int, size: float) -> None:
    rng = np.random.default_rng(2)
    figure = selections_side_by_side(
        [f"EX0C{index}" for index in range(count)], ["µm/m"] * count,
        ["all runs of the campaign", "runs 1 to 10, warming up", "runs of day 3"],
        size * rng.uniform(1.0, 2.0, (3, count)), title=LONG, meaning="expanded uncertainty, k_q = 3.3",
    )  # fmt: skip
    assert faults(figure) == []
    assert legends_inside(figure) == 0


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("count", [1, 2, 8])
@pytest.mark.slow
def test_error_falling(count: int, size: float) -> None:
    names = ["SAMBA", *[f"EZC1:const@warmup_of_the_spindle_{index}" for index in range(count - 1)]]
    rms = size * np.linspace(3.0, 1.0, count)
    for held_out in (rms * 1.003, rms * 1.4, np.full(count, np.nan)):
        assert faults(error_falling(ErrorSteps(names, rms, held_out, size), title=LONG)) == []


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("count", [1, 3, 25])
def test_ranked_effects(count: int, size: float) -> None:
    names = [f"EZC1:harmonic{index}@temperature_of_the_ball_screw" for index in range(count)]
    strength = size * np.linspace(30.0, 1.0, count)
    figure = ranked_effects(
        RankedEffects(names, strength, [index // 3 for index in range(count)]),
        title=LONG, value_name="evidence", threshold=8.0 * size, threshold_name="what noise alone reaches",
    )  # fmt: skip
    assert faults(figure) == []


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("runs", [1, 20, 200])
def test_residual_bars(runs: int, size: float) -> None:
    groups = {
        "run": ([str(run + 1) for run in range(runs)], size * np.linspace(1.0, 3.0, runs)),
        "target": (["the ball on the far corner", "S2", "S3"], size * np.ones(3)),
        "axis": ("XYZ", size * np.ones(3)),
    }
    assert faults(residual_bars(groups, level_um=size, title=LONG)) == []


@pytest.mark.parametrize("size", SIZES)
def test_residual_vectors(size: float) -> None:
    grid = np.stack(np.meshgrid([0, 1000], [0, 400], [0, 50]), axis=-1).reshape(-1, 3)
    assert faults(residual_vectors(grid, size * (grid * 0.002 - 1.0), title=LONG)) == []
    assert faults(residual_vectors(grid[:1], size * np.ones((1, 3)), title=LONG)) == []


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("rows", [1, 2, 200])
def test_residual_against_driver(rows: int, size: float) -> None:
    at = np.arange(float(rows)) * 1e4
    figure = residual_against_driver(
        DrivenResiduals(at, size * (at % 5.0)),
        title=LONG,
        driver_name="temperature of the ball screw of axis X / °C",
    )
    assert faults(figure) == []
    assert faults(predicted_against_measured(size * at, size * at, title=LONG, noise_um=0.5 * size)) == []


@pytest.mark.parametrize("overlapping", [True, False])
def test_the_check_sees_a_text_on_a_text(overlapping: bool) -> None:
    figure = Figure(figsize=(3.0, 2.0))
    figure.text(0.3, 0.5, "one")
    figure.text(0.32 if overlapping else 0.6, 0.5, "other")
    assert bool(faults(figure)) == overlapping


@pytest.mark.parametrize("size", SIZES)
def test_no_text_covers_another_of_motions_and_parts(size: float) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
    motion = size * (np.sin(3.0 * angle) + 0.2 * np.cos(angle))
    square = np.array([[0.0, 0.0], [0.0, 100.0], [100.0, 100.0], [100.0, 0.0]])
    across = np.array([[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]])
    sides = [
        (f"side {name} of the square", np.linspace(square[at], square[(at + 1) % 4], 20), np.tile(across[at], (20, 1)),
         1e-3 * size * np.sin(np.arange(20.0)))
        for at, name in enumerate("1234")
    ]  # fmt: skip
    bore = (
        "bore with a long name", 40.0 * np.column_stack([np.cos(angle), np.sin(angle)]),
        np.column_stack([np.cos(angle), np.sin(angle)]), 1e-3 * motion,
    )  # fmt: skip
    drawn = [
        rotation_figure(angle, motion, unit="µm", title=LONG),
        followed_figure(np.degrees(angle), {"X": motion}, axis="C", title=LONG),
        followed_figure(
            np.degrees(angle), {f"direction {name}": motion for name in "XYZABC"}, axis="C", title=LONG
        ),
        part_figure([bore], title=LONG),
        part_figure(sides, title=LONG),
    ]
    assert [faults(figure) for figure in drawn] == [[]] * len(drawn)
    # The names of sides stand beside them and within the axes, whose lines and numbers are not theirs.
    axes = drawn[-1].axes[0]
    room = axes.get_window_extent()
    boxes = [name.get_window_extent() for name in axes.texts]
    assert len(boxes) == 4
    assert all(
        room.x0 < box.x0 and box.x1 < room.x1 and room.y0 < box.y0 and box.y1 < room.y1 for box in boxes
    )
    lines = [line.get_window_extent() for line in axes.lines]
    assert not any(box.overlaps(line) for box in boxes for line in lines)


@pytest.mark.parametrize("reach", [1.0, 3.0])
def test_the_check_sees_what_axes_cut_off(reach: float) -> None:
    figure = Figure(figsize=(3.0, 2.0))
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [0.0, reach])
    axes.quiver([0.5], [0.5], [0.2], [reach - 1.0], angles="xy", scale_units="xy", scale=1.0)
    axes.axvline(0.3)
    axes.set_ylim(0.0, 1.5)
    assert len(cut_off(figure)) == (0 if reach == 1.0 else 2)
