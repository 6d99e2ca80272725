"""Figures: the same bytes for the same numbers, wrong shapes refused, and what a reader must find is drawn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from monitor.exceptions import DataError, InputError
from monitor.reporting.figures.drivers import (
    DrivenResiduals,
    predicted_against_measured,
    residual_against_driver,
)
from monitor.reporting.figures.models import ErrorSteps, RankedEffects, error_falling, ranked_effects
from monitor.reporting.figures.parameters import ParametersOfRuns, parameters_by_run
from monitor.reporting.figures.residuals import residual_bars, residual_vectors
from monitor.reporting.figures.style import png, save, svg
from monitor.reporting.palette import BLUE, INK, ORANGE


def by_run() -> Figure:
    values = np.array([[1.0, 5.0], [1.1, 5.1], [9.0, np.nan], [9.1, 5.2]])
    return parameters_by_run(
        ParametersOfRuns(
            [1, 2, 3, 4], [1, 1, 2, 2], ["EB0C", "EX0C"], ["µrad", "µm"], values, np.full((4, 2), 0.3)
        ),
        title="EB0C jumped by 8 µrad",
        interval="U = 2.24 u",
        highlight=["EB0C"],
    )


def bars() -> Figure:
    return residual_bars(
        {"run": (["1", "2"], [1.0, 3.0]), "axis": ("XYZ", [1, 1, 1])}, level_um=1.0, title="T"
    )


def vectors() -> Figure:
    grid = np.stack(np.meshgrid([0, 100], [0, 100], [0, 50]), axis=-1).reshape(-1, 3)
    return residual_vectors(grid, grid * 0.05 - 2.0, title="T")


def driver() -> Figure:
    return residual_against_driver(
        DrivenResiduals(np.arange(40.0), np.arange(40.0) % 5), title="T", driver_name="time / s"
    )


def predicted() -> Figure:
    return predicted_against_measured([-1.0, 0.0, 2.0], [-1.1, 0.1, 1.9], title="T", noise_um=0.5)


def falling() -> Figure:
    return error_falling(ErrorSteps(["SAMBA", "EYX:poly2"], [3.0, 1.1], [3.2, np.nan], 1.0), title="T")


def ranked() -> Figure:
    return ranked_effects(
        RankedEffects(["EAY:poly2", "EZC1:const@warmup", "EZY:poly2"], [7.9, 28.3, 7.6], [1, 2, 1]),
        title="T",
        value_name="v",
        threshold=8.0,
    )


FIGURES = [by_run, bars, vectors, driver, predicted, falling, ranked]


@pytest.mark.parametrize("draw", FIGURES)
def test_same_numbers_same_bytes_without_date_or_software(draw: Callable[[], Figure]) -> None:
    first, second = svg(draw()), svg(draw())
    assert first == second
    assert first.startswith(b"<?xml")
    assert b"dc:date" not in first
    assert b"<text" not in first  # letters are outlines: no font of the reader's machine is used
    picture = png(draw(), dpi=50)
    assert picture == png(draw(), dpi=50)
    assert picture.startswith(b"\x89PNG")
    assert b"Software" not in picture


def test_accents_stay_apart_in_grey() -> None:
    def luminance(colour: str) -> float:
        parts = np.array([int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)])
        linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    ratio = (luminance(ORANGE) + 0.05) / (luminance(BLUE) + 0.05)
    assert ratio > 2.0


def test_parameters_by_run_mark_the_days_and_the_highlighted_parameter() -> None:
    axes = by_run().axes
    assert [one.get_title(loc="left") for one in axes] == ["EB0C", "EX0C"]
    assert [text.get_text() for text in axes[0].texts] == ["day 1", "2"]
    means = [
        line.get_ydata()[0]
        for line in axes[0].lines
        if line.get_linewidth() == 1.5 and line.get_color() == INK
    ]
    np.testing.assert_allclose(means, [1.05, 9.05])
    means = [
        line.get_ydata()[0]
        for line in axes[1].lines
        if line.get_linewidth() == 1.5 and line.get_color() == INK
    ]
    np.testing.assert_allclose(means, [5.05, 5.2])  # the run without a number takes no part


def test_bars_above_twice_the_level_are_hatched_and_explained() -> None:
    figure = bars()
    assert [bar.get_hatch() for bar in figure.axes[0].patches] == ["", "////"]
    assert "hatched: more than twice as large" in figure._supxlabel.get_text()


def test_effects_are_ranked_with_their_group_and_bracketed() -> None:
    axes = ranked().axes[0]
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels == ["EZC1:const@warmup", "EAY:poly2", "EZY:poly2"]
    assert sum("tell these apart" in text.get_text() for text in axes.texts) == 1


def test_steps_get_one_plus_and_break_before_their_driver() -> None:
    figure = error_falling(
        ErrorSteps(["SAMBA", "+ EXX:poly1@x_degC", "EYX:poly2"], [3, 2, 1], [3, 2, 1], 1), title="T"
    )
    labels = [label.get_text() for label in figure.axes[0].get_xticklabels()]
    assert labels == ["SAMBA", "+\N{NO-BREAK SPACE}EXX:poly1\n@x_degC", "+\N{NO-BREAK SPACE}EYX:poly2"]


def test_driver_group_means_are_those_of_the_groups() -> None:
    figure = residual_against_driver(
        DrivenResiduals([0.0, 0.0, 1.0, 1.0], [1.0, 3.0, 5.0, 7.0], ["a", "a", "b", "b"]),
        title="T",
        driver_name="d",
    )
    line = next(line for line in figure.axes[0].lines if line.get_marker() == "o")
    np.testing.assert_allclose(line.get_ydata(), [2.0, 6.0])


def test_vectors_share_one_scale_in_all_views() -> None:
    spans = [np.ptp(limits) for one in vectors().axes for limits in (one.get_xlim(), one.get_ylim())]
    np.testing.assert_allclose(spans, spans[0])


def test_save_writes_what_the_ending_says(tmp_path: Path) -> None:
    assert save(by_run(), tmp_path / "a.svg").read_bytes() == svg(by_run())
    assert save(by_run(), tmp_path / "a.png").read_bytes() == png(by_run())
    with pytest.raises(InputError, match=r"a figure is saved as \.svg or \.png, not as 'a\.jpg'"):
        save(by_run(), tmp_path / "a.jpg")


def test_wrong_shapes_are_refused_in_words() -> None:
    with pytest.raises(DataError, match=r"estimate must have shape \(1, 1\), but has \(2, 1\)"):
        parameters_by_run(
            ParametersOfRuns([1], [1], ["A"], ["µm"], [[1.0], [2.0]], [[1.0]]), title="T", interval="U"
        )
    with pytest.raises(DataError, match=r"the RMS by run must have shape \(2,\), but has \(1,\)"):
        residual_bars({"run": (["1", "2"], [1.0])})
    with pytest.raises(DataError, match="groups is empty"):
        residual_bars({})
    with pytest.raises(DataError, match=r"must have one shape \(n, 3\), but have \(2, 2\) and \(2, 3\)"):
        residual_vectors(np.zeros((2, 2)), np.zeros((2, 3)), title="T")
    with pytest.raises(DataError, match=r"driver and residual_um must have one shape \(n,\)"):
        residual_against_driver(DrivenResiduals([1.0], [1.0, 2.0]), title="T", driver_name="d")
    with pytest.raises(DataError, match=r"predicted_um and measured_um must have one shape \(n,\)"):
        predicted_against_measured([], [], title="T")
    with pytest.raises(DataError, match=r"2 steps need rms_um and heldout_rms_um of shape \(2,\)"):
        error_falling(ErrorSteps(["a", "b"], [1.0], [1.0], 1.0), title="T")
    with pytest.raises(DataError, match="1 effects need as many values and groups"):
        ranked_effects(RankedEffects(["a"], [1.0, 2.0], [1]), title="T", value_name="v")


def test_names_of_many_setups_are_broken_into_lines_before_one_is_left_out() -> None:
    names = [
        "laser X",
        "laser Y",
        "laser Z",
        "ball bar XY",
        "ball bar YZ",
        "ball bar ZX",
        "r-test C",
        "level X",
    ]
    figure = residual_bars({"setup": (names, [1.0] * 8), "run": (["1", "2"], [1.0, 1.0])})
    named = [tick.get_text() for tick in figure.axes[0].get_xticklabels()]
    assert [" ".join(name.split()) for name in named] == names
