"""Draws the plots that people on the shop floor know: deviations of positioning and of axes that move together, the
polar plots of a circle and of an axis of rotation, the outline of a part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from monitor.records import Array
from monitor.reporting.figures.style import new_figure, style, zero_line
from monitor.reporting.palette import BLUE, INK, MID, ORANGE, PAGE_WIDTH_MM

HEIGHT_MM, CIRCLE_MM = 80.0, 110.0
#: The largest deviation takes this part of the polar plot's radius.
SHOWN_PART = 0.35
#: Colours and lines of several series in one panel.
_LOOKS = ((BLUE, "-"), (ORANGE, "--"), (INK, ":"))


def positioning_figure(
    targets: Array, mean: Array, deviation: Array, *, axis: str, units: tuple[str, str], title: str
) -> Figure:
    """Draw means (2, m) with bands of two standard deviations (2, m) over targets (m,), as ISO 230-2:2014 does."""
    with style():
        figure = new_figure(PAGE_WIDTH_MM, HEIGHT_MM, title)
        axes = figure.subplots()
        zero_line(axes)
        looks = ((BLUE, "-", "forward"), (ORANGE, "--", "backward"))
        for (colour, line, name), means, spread in zip(looks, mean, deviation, strict=True):
            axes.plot(
                targets, means, line, color=colour, linewidth=1.2, marker="o", markersize=2.5, label=name
            )
            band = 2.0 * np.nan_to_num(spread)
            axes.fill_between(targets, means - band, means + band, color=colour, alpha=0.15, linewidth=0.0)
        axes.set_xlabel(f"{axis} / {units[0]}")
        axes.set_ylabel(f"deviation / {units[1]}")
        axes.legend(loc="best", title="mean, and 2 s as a band")
    return figure


def circle_figure(angle: Array, radial: Array, sense: Array, *, plane: tuple[str, str], title: str) -> Figure:
    """Draw radial deviations (n,) µm at angles (n,) rad about a circle, magnified, each sense by itself."""
    largest = float(np.max(np.abs(radial))) or 1.0
    with style():
        figure = new_figure(PAGE_WIDTH_MM, CIRCLE_MM, title)
        axes = figure.subplots(subplot_kw={"projection": "polar"})
        around = np.linspace(0.0, 2.0 * np.pi, 361)
        unit = SHOWN_PART / largest
        axes.plot(around, np.ones_like(around), color=MID, linewidth=0.7)
        for way, colour, line, name in ((1, BLUE, "-", "counter-clockwise"), (-1, ORANGE, "--", "clockwise")):
            mine = sense == way
            if mine.any():
                axes.plot(
                    angle[mine], 1.0 + unit * radial[mine], line, color=colour, linewidth=1.1, label=name
                )
        axes.set_ylim(0.0, 1.0 + 1.25 * SHOWN_PART)
        _number_radii(axes, unit, _signed(largest, "µm"), _least_moved(angle, radial))
        axes.set_xticks(
            np.arange(4) * np.pi / 2.0, [f"+{plane[0]}", f"+{plane[1]}", f"-{plane[0]}", f"-{plane[1]}"]
        )
        axes.grid(color=MID, linewidth=0.3)
        # Beside the circle: within it the lines of the directions run through the words.
        axes.legend(loc="upper left", bbox_to_anchor=(1.1, 1.0))
    return figure


def rotation_figure(angle: Array, synchronous: Array, *, unit: str, title: str) -> Figure:
    """Draw synchronous error motion (n,) at angles (n,) rad about a circle, magnified, as ISO 230-7:2015 does."""
    largest = float(np.max(np.abs(synchronous))) or 1.0
    with style():
        figure = new_figure(PAGE_WIDTH_MM, CIRCLE_MM, title)
        axes = figure.subplots(subplot_kw={"projection": "polar"})
        around = np.linspace(0.0, 2.0 * np.pi, 361)
        scale = SHOWN_PART / largest
        closed = np.append(synchronous, synchronous[:1])
        axes.plot(around, np.ones_like(around), color=MID, linewidth=0.7)
        axes.plot(np.append(angle, angle[:1]), 1.0 + scale * closed, color=BLUE, linewidth=1.1)
        axes.set_ylim(0.0, 1.0 + 1.25 * SHOWN_PART)
        _number_radii(axes, scale, _signed(largest, unit), _least_moved(angle, synchronous))
        axes.grid(color=MID, linewidth=0.3)
    return figure


def followed_figure(degrees: Array, deviations: Mapping[str, Array], *, axis: str, title: str) -> Figure:
    """Draw deviations (n,) µm by direction over the ``degrees`` (n,) of the rotary axis that others follow."""
    names = list(deviations)
    groups = [names[first : first + len(_LOOKS)] for first in range(0, len(names), len(_LOOKS))]
    with style():
        figure = new_figure(PAGE_WIDTH_MM, HEIGHT_MM * len(groups), title)
        panels = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
        for panel, group in zip(panels, groups, strict=True):
            zero_line(panel)
            for (colour, line), name in zip(_LOOKS, group, strict=False):
                off = deviations[name] - deviations[name].mean()
                panel.plot(
                    degrees, off, line, color=colour, linewidth=1.1, marker="o", markersize=2.0, label=name
                )
            panel.set_ylabel("deviation from the mean / µm")
            panel.legend(loc="best")
        panels[-1].set_xlabel(f"{axis} / °")
    return figure


def part_figure(elements: Sequence[tuple[str, Array, Array, Array]], *, title: str) -> Figure:
    """Draw elements of a part, each with its name, places (n, 2) mm, directions (n, 2) across it and deviations (n,) mm
    from its form, magnified so that the largest takes a tenth of the part's size."""
    largest = max(float(np.max(np.abs(deviation))) for *_, deviation in elements) or 1.0
    size = max(float(np.ptp(places, axis=0).max()) for _, places, _, _ in elements)
    scale = 0.1 * size / largest
    middle = np.mean([places.mean(axis=0) for _, places, _, _ in elements], axis=0)
    with style():
        figure = new_figure(PAGE_WIDTH_MM, CIRCLE_MM, title)
        axes = figure.subplots()
        for number, (name, places, across, deviation) in enumerate(elements):
            moved = places + scale * deviation[:, None] * across
            axes.plot(places[:, 0], places[:, 1], color=MID, linewidth=0.7)
            axes.plot(moved[:, 0], moved[:, 1], color=(BLUE, ORANGE)[number % 2], linewidth=1.1)
            _name_element(axes, name, places, middle, size)
        # Names of several elements stand beside the part: a letter is some 2.3 % of its size wide.
        longest = max(len(name) for name, *_ in elements)
        axes.margins(*((0.05, 0.05) if len(elements) == 1 else (0.15 + 0.023 * longest, 0.2)))
        axes.set_aspect("equal")
        times = f"{scale:.0f}" if scale >= 10.0 else f"{scale:.3g}"
        axes.set_xlabel(f"mm; deviations magnified {times} times")
    return figure


def _signed(largest: float, unit: str) -> dict[float, str]:
    """Return the deviations at which a polar plot has rings, and what is written there: nothing at zero."""
    step = _step(largest)
    minus = "\N{MINUS SIGN}"
    return {-step: f"{minus}{step:.3g} {unit}", 0.0: "", step: f"+{step:.3g} {unit}"}


def _number_radii(axes: Axes, scale: float, labels: Mapping[float, str], angle: float) -> None:
    """Draw rings at deviations and write their labels at an angle in rad, on white: no line runs through them."""
    assert isinstance(axes, PolarAxes)
    axes.set_yticks([1.0 + scale * deviation for deviation in labels], list(labels.values()))
    for label in axes.get_yticklabels():
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.6})
    axes.set_rlabel_position(float(np.degrees(angle)))


def _least_moved(angle: Array, deviation: Array) -> float:
    """Return the angle in rad, of 16 between the names of the directions, about which a curve (n,) deviates least."""
    beside = np.pi / 16.0 + np.arange(16) * np.pi / 8.0
    apart = np.abs(np.angle(np.exp(1j * (angle[None, :] - beside[:, None]))))
    # A number covers some 15 degrees to either side.
    near = np.where(apart < np.pi / 12.0, np.abs(deviation), 0.0)
    return float(beside[np.argmin(near.max(axis=1))])


def _name_element(axes: Axes, name: str, places: Array, middle: Array, size: float) -> None:
    """Write a name beside the middle of an element, on the side away from the ``middle`` (2,) of a part of this
    ``size``, beyond the largest deviation; within the element where it goes around that middle."""
    at = places.mean(axis=0)
    away = at - middle
    distance = float(np.hypot(*away))
    if distance < 0.05 * size:
        axes.text(float(at[0]), float(at[1]), name, fontsize="small", ha="center", va="center")
        return
    across, up = away / distance
    sides = (
        "right" if across < -0.5 else "left" if across > 0.5 else "center",
        "top" if up < -0.5 else "bottom",
    )
    x, y = at + 0.13 * size * away / distance
    axes.text(
        float(x), float(y), name, fontsize="small", ha=sides[0],
        va="center" if abs(up) <= 0.5 else sides[1],
    )  # fmt: skip


def _step(largest: float) -> float:
    """A round number of µm (1, 2 or 5 times a power of ten) that is at most the largest deviation."""
    power = 10.0 ** np.floor(np.log10(largest))
    return float(
        max(factor for factor in (1.0, 2.0, 5.0) if factor * power <= largest * (1.0 + 1e-9)) * power
    )
