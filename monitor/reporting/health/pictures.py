"""The pictures of a machine's page: its volumetric error, where the model fails, what is missing, how errors fall."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from monitor.reporting.figures.residuals import view_of
from monitor.reporting.health.comparison import ErrorStep, ModelHealth, ResidualAgainst, ResidualMap
from monitor.reporting.health.records import VolumetricMap
from monitor.reporting.palette import BLUE, INK, MID, ORANGE, PALE
from monitor.reporting.svg.map_slices import map_drawing
from monitor.reporting.svg.plot import (
    LETTER,
    SCALE,
    Drawing,
    Panel,
    arrow_head,
    shortened,
    text_width,
    tick_room,
)

#: The whole text width of the page, and the two parts that stand side by side.
WIDTH_MM, LEFT_MM, RIGHT_MM = 176.0, 104.0, 66.0
#: Signs of group means, and the head of an arrow: half their size in tenths of a millimetre.
_SIGN, _HEAD = 9.0, 9.0


@dataclass(frozen=True)
class PrintedPictures:
    """The pictures of a machine's page as SVG, each with the sentence over it; empty where there is none."""

    where: Markup
    against: Markup
    against_says: str
    steps: Markup
    steps_say: str


def printed_pictures(model: ModelHealth | None) -> PrintedPictures:
    """What is drawn of the comparison; the pictures escape their own words."""
    where = against = steps = Markup()
    against_says = steps_say = ""
    if model is not None and model.where is not None:
        where = Markup(where_it_fails(model.where))
    if model is not None and model.against is not None:
        against = Markup(against_driver(model.against))
        effect = model.missing[0].effect if model.missing else None
        against_says = (
            f"What is missing: {effect}"
            if effect
            else f"Nothing known is missing; it follows {model.against.driver}"
        )
    if model is not None and len(model.steps) > 1:
        steps = Markup(error_steps(model))
        first, last = model.steps[0].rms_um, model.steps[-1].rms_um
        verb = "would fall" if model.steps[-1].proposed else "fell"
        steps_say = f"The error {verb} from {first:.2f} to {last:.2f} µm"
    return PrintedPictures(where, against, against_says, steps, steps_say)


def map_picture(error_map: VolumetricMap | None) -> Markup:
    """The volumetric error in three slices, in the greys of a certificate; empty where there is nothing to draw."""
    if error_map is None or not error_map.slices:
        return Markup()
    title = "Volumetric error over the workspace in three slices"
    return Markup(map_drawing(error_map.slices, title=title, scale_words="length of the error / µm").svg())


def where_it_fails(residual_map: ResidualMap) -> str:
    """Residual vectors, magnified, seen along Z, Y and X; the largest tenth thick and in the accent colour."""
    position, residual = np.array(residual_map.place_mm), np.array(residual_map.residual_um)
    view = view_of(position, residual)
    on = Drawing(WIDTH_MM, 63.0, "Mean residual vectors over the workspace, seen along Z, Y and X")
    ranges = [(middle - view.reach, middle + view.reach) for middle in view.middle]
    room = max(88.0, *(tick_room(ranges[up], 5) + 8.0 + LETTER for up in (1, 2)))
    gap = room + 24.0
    side = min(465.0, (WIDTH_MM * SCALE - room - 2.0 * gap - 36.0) / 3.0)
    for index, (across, up) in enumerate(((0, 1), (0, 2), (1, 2))):
        panel = Panel(
            room + index * (side + gap), 34.0, side, side, ranges[across], ranges[up],
        )  # fmt: skip
        panel.frame(on, f"{'XYZ'[across]} / mm", f"{'XYZ'[up]} / mm", ticks=4)
        on.text(panel.x0, panel.top - 10, f"{'XYZ'[across]}{'XYZ'[up]}", bold=True)
        for large, colour, width in ((False, BLUE, 2.6), (True, ORANGE, 5.0)):
            shafts, heads = [], []
            for at, vector in zip(position[view.large == large], residual[view.large == large], strict=True):
                end = at + vector * 1e-3 * view.magnify
                x1, y1, x2, y2 = panel.x(at[across]), panel.y(at[up]), panel.x(end[across]), panel.y(end[up])
                shafts.append(f"M{x1:.1f} {y1:.1f}L{x2:.1f} {y2:.1f}")
                heads.append(arrow_head(x1, y1, x2, y2, _HEAD * (1.3 if large else 1.0)))
            on.path("".join(shafts), stroke=colour, width=width)
            on.path("".join(heads), fill=colour)
        if index == 0:
            length = side * view.key * 1e-3 * view.magnify / (2.0 * view.reach)
            x, y = panel.x0 + 14.0, panel.top + side - 16.0
            on.line(x, y, x + length, y, INK, 7)
            on.text(x, y - 9, f"{view.key:g} µm", bold=True)
    times = _thousands(view.magnify) if view.magnify >= 1.0 else f"{view.magnify:g}"
    on.text(
        0.0, 62.4 * SCALE,
        f"Mean of the runs at every pose of the plan, {times} times enlarged; bar: {view.key:g} µm; "
        "thick: the largest tenth.",
        colour=MID,
    )  # fmt: skip
    return on.svg()


@dataclass(frozen=True)
class _Means:
    """Means of groups as points (x, y, u) of the picture, in one colour and with one sign."""

    points: tuple[tuple[float, float, float], ...]
    colour: str
    sign: Callable[[float, float, float], str]
    name: str


def against_driver(residual: ResidualAgainst) -> str:
    """The residual against what drives it: means of groups before (circles) and after (squares), points in grey."""
    on = Drawing(LEFT_MM, 58.0, f"Residual along {residual.along} against {residual.driver}")
    drivers = [*residual.at, *(group.at for group in residual.groups)]
    directions = {-1.0: "towards \N{MINUS SIGN}", 1.0: "towards +"} if set(drivers) == {-1.0, 1.0} else None
    right_room = 12.0 if directions is None else 52.0
    sizes = _with_margin(_means_and_bars(residual), 0.08)
    left_edge = max(88.0, tick_room(sizes, 6) + 12.0 + LETTER)
    panel = Panel(
        left_edge, 40.0, LEFT_MM * SCALE - left_edge - right_room, 430.0, _with_margin(drivers, 0.05), sizes
    )
    panel.frame(on, residual.driver, "residual / µm", named=directions)
    low, high = panel.up
    points = [
        (at, size) for at, size in zip(residual.at, residual.before_um, strict=True) if low <= size <= high
    ]
    on.path("".join(_square(panel.x(at), panel.y(size), 2.6) for at, size in points), fill=PALE)
    series = _series(residual, panel)
    for means in series:
        _draw_means(on, panel, means)
    for index, means in enumerate(series):
        x = panel.x0 + 6 + 330 * index
        on.path(means.sign(x, 16, _SIGN), fill=means.colour)
        on.text(x + 16, 24, means.name, bold=True, colour=means.colour)
    return on.svg()


def _means_and_bars(residual: ResidualAgainst) -> list[float]:
    """What the scale has to hold: the means with their bars and zero; points far from them are left out."""
    return [
        *(np.quantile(residual.before_um, [0.15, 0.85]) if residual.before_um else []),
        *(group.before_um + sign * 1.3 * group.u_before_um for group in residual.groups for sign in (-1, 1)),
        *(group.after_um for group in residual.groups if group.after_um is not None),
        0.0,
    ]


def _with_margin(values: Sequence[float], share: float) -> tuple[float, float]:
    """The range of values, widened at both ends by a share of it."""
    margin = share * float(np.ptp(values)) or 1.0
    return float(np.min(values)) - margin, float(np.max(values)) + margin


def _series(residual: ResidualAgainst, panel: Panel) -> list[_Means]:
    """The means before and, where there are some, after; moved apart where groups are few, so that both are seen."""
    shift = 0.012 * panel.width if len(residual.groups) <= 8 else 0.0
    before = tuple(
        (panel.x(group.at) - shift, group.before_um, group.u_before_um) for group in residual.groups
    )
    after = tuple(
        (panel.x(group.at) + shift, group.after_um, group.u_after_um or 0.0)
        for group in residual.groups
        if group.after_um is not None
    )
    series = [_Means(before, ORANGE, _circle, "as the model is")]
    return [*series, _Means(after, BLUE, _square, "with what is missing added")] if after else series


def _draw_means(on: Drawing, panel: Panel, means: _Means) -> None:
    """Draw means as signs with bars of a standard uncertainty, joined by a line."""
    if not means.points:
        return
    bars = "".join(f"M{x:.1f} {panel.y(y - u):.1f}L{x:.1f} {panel.y(y + u):.1f}" for x, y, u in means.points)
    line = "M" + "L".join(f"{x:.1f} {panel.y(y):.1f}" for x, y, _ in means.points)
    signs = "".join(means.sign(x, panel.y(y), _SIGN) for x, y, _ in means.points)
    on.path(line, stroke=means.colour, width=3.2)
    on.path(bars, stroke=means.colour, width=3.2)
    on.path(signs, fill=means.colour, stroke="white", width=1.5)


def error_steps(model: ModelHealth) -> str:
    """A row a version: the fitted error as a bar, the held-out one as a circle, the probe's statement as a line."""
    steps = _shown(model.steps)
    row = 92.0
    on = Drawing(RIGHT_MM, (64.0 + row * len(steps) + 62.0) / SCALE, "The error, model by model")
    most = max(
        [step.rms_um for step in steps] + [step.heldout_um or 0.0 for step in steps] + [model.stated_um]
    )
    # Numbers stand behind the longest bar and the circle, wherever these end.
    numbers = [_error_words(step) for step in steps]
    wide = RIGHT_MM * SCALE - 6.0 - max(160.0, *map(text_width, numbers)) - _SIGN - 10.0
    panel = Panel(6.0, 40.0, wide, row * len(steps), (0.0, 1.04 * most), (0.0, 1.0))
    at = panel.x(model.stated_um)
    for index, (step, errors) in enumerate(zip(steps, numbers, strict=True)):
        top = panel.top + index * row
        on.text(
            panel.x0, top + 26, shortened(str(step.what), RIGHT_MM * SCALE - 12.0), bold=not step.proposed
        )
        y = top + 36
        end = panel.x(step.rms_um)
        on.path(
            f"M{panel.x0:g} {y:.1f}H{end:.1f}V{y + 34:.1f}H{panel.x0:g}Z",
            fill="white" if step.proposed else BLUE, stroke=BLUE, width=3,
        )  # fmt: skip
        # Beside the bars alone: it would strike the names of the models through.
        on.line(at, y - 5, at, y + 39, "white", 8)
        on.line(at, y - 5, at, y + 39, INK, 3, "10 6")
        held = end
        if step.heldout_um is not None:
            held = panel.x(step.heldout_um)
            on.path(_circle(held, y + 17, _SIGN), fill="white", stroke=ORANGE, width=4)
        beside = max(end, held + _SIGN, at) + 14.0
        on.text(min(beside, RIGHT_MM * SCALE - text_width(errors)), y + 26, errors)
    bottom = panel.top + panel.height
    stated = f"probe's statement {model.stated_um:.2g} µm"
    half = text_width(stated) / 2.0
    on.text(min(max(at, half), RIGHT_MM * SCALE - half), panel.top - 14, stated, anchor="middle")
    on.path(f"M{panel.x0:g} {bottom + 16:.1f}h22v14h-22Z", fill=BLUE)
    on.text(panel.x0 + 30, bottom + 32, "fitted runs, µm")
    on.path(_circle(panel.x0 + 250, bottom + 23, _SIGN), fill="white", stroke=ORANGE, width=4)
    on.text(panel.x0 + 268, bottom + 32, "(held-out runs)")
    if any(step.proposed for step in steps):
        on.text(panel.x0, bottom + 32 + 1.25 * LETTER, "empty bar: if it is added", colour=MID)
    return on.svg()


def _error_words(step: ErrorStep) -> str:
    """The fitted error, and the held-out one in brackets."""
    held_out = "" if step.heldout_um is None else f" ({_micrometres(step.heldout_um)})"
    return _micrometres(step.rms_um) + held_out


def _micrometres(value: float) -> str:
    return f"{value:.2f}" if 0.1 <= value < 1e3 or value == 0.0 else f"{value:.3g}"


def _shown(steps: tuple[ErrorStep, ...]) -> tuple[ErrorStep, ...]:
    """The first and the last ones, as many as a page has room for."""
    return steps if len(steps) <= 8 else (steps[0], *steps[-7:])


def _thousands(value: float) -> str:
    return f"{value:,.0f}".replace(",", "\N{NO-BREAK SPACE}")


def _square(x: float, y: float, half: float) -> str:
    side = 1.8 * half
    return f"M{x - side / 2:.1f} {y - side / 2:.1f}h{side:.1f}v{side:.1f}h{-side:.1f}Z"


def _circle(x: float, y: float, radius: float) -> str:
    half = f"a{radius:g} {radius:g} 0 1 0"
    return f"M{x - radius:.1f} {y:.1f}{half} {2 * radius:g} 0{half} {-2 * radius:g} 0Z"
