"""Ball bar, text: a head of ``key: value`` lines and a table of angle and deviation, once for each circle.

``Radius`` and ``Feed rate`` of a head hold for all tables below it until another head states them, ``Direction`` (CW,
CCW, clockwise, G02, G03) for the next one, ``Date`` of the first for the file. Where the axes stood follows from the
centre of the circle, its radius and the angle, counted from the first axis of the plane towards the second.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from monitor.readers.export import Export, ExportFile, ExportFormat, Fact
from monitor.readers.exports import table as plain_table
from monitor.readers.faults import Faults, quoted
from monitor.readers.foreign_units import decimal_of, foreign_unit
from monitor.readers.tables.delimited import (
    Style,
    cells_of,
    fact_of,
    is_data,
    length_of,
    plain_key,
    quantity_of,
)
from monitor.readers.tables.foreign_text import decode_foreign
from monitor.readers.toml_table import Table

#: What a head calls the length of a bar.
RADIUS_KEYS = (
    "radius", "nominal radius", "ballbar length", "ball bar length", "length", "nominal length", "bar length",
)  # fmt: skip
#: What the head of a circle calls a thing, in small letters, by what it is.
_KEYS = {
    "radius": RADIUS_KEYS,
    "feed": ("feed", "feed rate", "feedrate", "vorschub"),
    "sense": ("direction", "sense", "run direction", "rotation", "drehsinn"),
    "date": ("date", "datum", "date/time"),
}
_SENSES = {
    **dict.fromkeys(("cw", "clockwise", "g02", "g2", "-"), "CW"),
    **dict.fromkeys(
        ("ccw", "counter-clockwise", "counterclockwise", "anticlockwise", "anti-clockwise", "g03", "g3", "+"),
        "CCW",
    ),
}
#: A last line without an end that may be the first digits of a row.
_FRAGMENT = re.compile(r"\s*[+-]?[0-9][0-9.,]*[;\t]?")
#: Units of a feed, by how many mm in a minute they are.
_FEEDS = {
    **dict.fromkeys(("mm/min", "mmpm", "mm/minute"), 1.0),
    **dict.fromkeys(("in/min", "ipm", "inch/min", "in/minute"), 25.4),
    **dict.fromkeys(("m/min",), 1e3),
    **dict.fromkeys(("mm/s", "mm/sec"), 60.0),
}
#: Digits of mm that a computed position is written with: a picometre.
_DIGITS = 9
#: Radii of file and mapping that differ by less are the same.
_SAME_RADIUS = 1e-3
#: Arcs that are shorter by less than this part of the longest end where it ends.
_SAME_ARC = 0.02
#: A column of angles, and one of deviations.
_ANGLES = ("angle", "winkel", "position")
_DEVIATIONS = ("deviation", "radial deviation", "radius deviation", "error", "abweichung", "length change")


@dataclass(frozen=True)
class BallBarSettings:
    """What the mapping says of the circles: the ``axes`` of the plane, their readings at its centre, its radius.

    ``is_overruled``: whether the mapping's radius counts where the file states another.
    """

    axes: tuple[str, str] | None
    centre: tuple[float, float] | None
    radius: float | None
    style: Style = field(default_factory=Style)
    is_overruled: bool = False


@dataclass
class _Circle:
    """One circle: its head, the circle before it, the line that its table begins on, and the lines of the table."""

    facts: list[Fact] = field(default_factory=list)
    begin: int = 0
    lines: list[str] = field(default_factory=list)
    before: _Circle | None = None

    def stating(self, what: str) -> _Circle:
        """Return the circle whose head states a thing: this one, or the last before it; this one where none does."""
        circle: _Circle | None = self
        while circle is not None:
            if circle.value(what) is not None:
                return circle
            circle = circle.before
        return self

    def value(self, what: str) -> str | None:
        """Return what the head says of a thing."""
        fact = self.fact(what)
        return None if fact is None else fact.value

    def fact(self, what: str) -> Fact | None:
        """Return the line of the head that says a thing."""
        return next((fact for fact in self.facts if plain_key(fact.key) in _KEYS[what]), None)

    def line_of(self, what: str) -> int:
        """Return the line on which the head says a thing, that of the table where it does not."""
        fact = self.fact(what)
        return self.begin + 1 if fact is None or fact.line is None else fact.line


def settings(table: Table) -> BallBarSettings:
    """Read the keys of a ball bar: ``axes = ["X", "Y"]``, ``centre_mm = [150.0, 120.0]``, ``radius_mm``."""
    names = table.raw("axes", required=True, example='["X", "Y"]')
    axes = None
    if isinstance(names, list) and len(names) == 2 and all(isinstance(name, str) and name for name in names):
        axes = (names[0], names[1])
    elif names is not None:
        table.fault("axes", f'{quoted(names)} is no plane; write for example axes = ["X", "Y"]')
    centre = table.numbers("centre_mm", 2, required=True, largest=1e5, unit="mm", example="[150.0, 120.0]")
    radius = table.number("radius_mm", positive=True, largest=1e5, unit="mm", example="100.0")
    style = plain_table.settings(table).style
    overruled = table.data.get("overruled")
    is_overruled = isinstance(overruled, list) and "radius" in overruled
    return BallBarSettings(
        axes, None if centre is None else (centre[0], centre[1]), radius, style, is_overruled
    )


def read(file: ExportFile, how: BallBarSettings, faults: Faults) -> Export | None:
    """Read all circles of a file; None with the faults noted."""
    decoded = decode_foreign(file.name, file.content, faults)
    if decoded is None:
        return None
    before = len(faults)
    circles, rest = _circles(decoded[0].split("\n"), how.style)
    if not circles:
        faults.add(
            file.name,
            1,
            None,
            "there is no table of angles and deviations; say in the mapping how it is written",
        )
        return None
    if not rest.lines:
        _note_head_alone(file.name, rest, faults)
    last = decoded[0].rpartition("\n")[2]
    if _FRAGMENT.fullmatch(last) and not any(is_data(cells_of(last, mark)) for mark in ";\t, "):
        faults.add(
            file.name,
            decoded[0].count("\n") + 1,
            None,
            f"{quoted(last)} is the beginning of a row: the file is cut here",
        )
    read_circles = _read_circles(file.name, circles, decoded[1], how, faults)
    if read_circles is None or len(faults) > before or how.axes is None:
        return None
    columns, lines, unit, layout = read_circles
    stated = {
        how.axes[0]: "mm",
        how.axes[1]: "mm",
        "angle": "deg",
        "time": "s",
        **({"deviation": unit} if unit else {}),
    }
    facts = [fact for circle in circles for fact in circle.facts]
    return Export(
        columns, stated, lines, layout, tuple(facts), circles[0].value("date"), _without_feed(facts)
    )


def _without_feed(facts: Sequence[Fact]) -> tuple[str, ...]:
    """Return a sentence where a feed has no unit from which times could be computed."""
    feeds = [fact for fact in facts if plain_key(fact.key) in _KEYS["feed"]]
    fact = next((fact for fact in feeds if not _feed_of(fact)), None)
    if fact is None:
        return ()
    return (
        f"the feed {quoted(fact.value)} on line {fact.line} is not in mm/min, m/min, mm/s or in/min: its rows are "
        "counted a second apart",
    )


def _feed_of(fact: Fact | None) -> float:
    """Return the feed in mm/min that a line of a head states; 0 where it states none."""
    number, unit = (None, "") if fact is None else quantity_of(fact)
    return (number or 0.0) * _FEEDS.get(unit.casefold(), 0.0)


def _read_circles(
    name: str, circles: Sequence[_Circle], encoding: str, how: BallBarSettings, faults: Faults
) -> tuple[dict[str, list[str]], list[int], str, str] | None:
    """Return the columns of all circles, their lines, the unit of the deviations and the layout; None with faults."""
    columns: dict[str, list[str]] = {}
    units: list[str] = []
    lines: list[int] = []
    arcs: list[tuple[float, float, int]] = []
    clock, layout = 0.0, encoding
    for circle in circles:
        export = plain_table.read_text(name, "\n".join(circle.lines), encoding, how.style, None, faults)
        if export is None:
            return None
        at = [line + circle.begin for line in export.lines]
        cells = _cells(name, circle, export, at, how, clock, faults)
        if cells is None:
            return None
        clock = float(cells["time"][-1]) + 1.0
        layout = export.layout
        for column, values in cells.items():
            columns.setdefault(column, []).extend(values)
        units.append(_unit(export, _DEVIATIONS) or "")
        if units[0] != units[-1]:
            faults.add(
                name, circle.begin + 1, "deviation",
                f"this circle is in {units[-1] or 'no stated unit'}, the first in {units[0] or 'none'}",
            )  # fmt: skip
        lines += at
        turns = [float(cell) for cell in cells["angle"]]
        arcs.append((abs(turns[-1] - turns[0]), abs(turns[-1] - turns[0]) / max(len(turns) - 1, 1), at[-1]))
    _whole(name, arcs, faults)
    return columns, lines, units[0], layout


def _note_head_alone(name: str, circle: _Circle, faults: Faults) -> None:
    """Refuse a head of a circle at the end of a file that no table follows."""
    fact = next(
        (fact for what in ("radius", "feed", "sense") if (fact := circle.fact(what)) is not None), None
    )
    if fact is not None:
        faults.add(
            name,
            fact.line,
            fact.key,
            "a circle begins here and has no table: the file is cut; export it again",
        )


def _whole(name: str, arcs: Sequence[tuple[float, float, int]], faults: Faults) -> None:
    """Refuse a circle that ends before the longest of its file: arcs and steps in degrees, each with its last line."""
    longest = max(arc for arc, _, _ in arcs)
    for arc, step, line in arcs:
        if arc < longest - max(2.0 * step, _SAME_ARC * longest):
            faults.add(
                name, line, "angle",
                f"this circle ends after {arc:g} deg, where another of the file goes {longest:g} deg: it is cut here; "
                "export it again, or put arcs of different length into files of their own",
            )  # fmt: skip


def _circles(lines: Sequence[str], style: Style) -> tuple[list[_Circle], _Circle]:
    """Cut a file into circles: a head, a line of names and units, and rows of numbers until the next head.

    The second is the last one, also where it has a head alone.
    """
    circles: list[_Circle] = []
    circle = _Circle()
    names: tuple[int, list[str]] | None = None
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        rows = any(
            is_data(cells_of(line, mark)) for mark in ((style.separator,) if style.separator else ";\t, ")
        )
        if rows and ":" not in line:
            if not circle.lines:
                circle.begin, circle.lines = names or (number - 1, [])
                circles.append(circle)
            # Lines that are no rows are there too, so that each keeps its number.
            circle.lines += [""] * (number - 1 - circle.begin - len(circle.lines)) + [line]
            continue
        if circle.lines:
            circle, names = _Circle(before=circle), None
        fact = fact_of(line) if ":" in line or "=" in line else None
        if fact is not None:
            circle.facts.append(Fact(*fact, number))
        else:
            names = (number - 1, [line]) if names is None else (names[0], [*names[1], line])
    return circles, circle


def _cells(
    name: str,
    circle: _Circle,
    export: Export,
    at: Sequence[int],
    how: BallBarSettings,
    clock: float,
    faults: Faults,
) -> dict[str, list[str]] | None:
    """Return the columns of one circle: angle, deviation, sense, where both axes stood, and times from the feed."""
    angles = _column(name, export, _ANGLES, "angle", at, faults)
    deviations = _column(name, export, _DEVIATIONS, "deviation", at, faults)
    radius = _radius(name, circle, how, faults)
    if angles is None or deviations is None or radius is None or how.axes is None or how.centre is None:
        return None
    turns = _turns(name, export, angles, at, faults)
    if turns is None:
        return None
    sense = _sense(name, circle, turns, at, faults)
    first_axis, second_axis = (
        [repr(round(middle + radius * part(turn), _DIGITS)) for turn in turns]
        for middle, part in zip(how.centre, (math.cos, math.sin), strict=True)
    )
    return {
        "angle": [repr(round(math.degrees(turn), _DIGITS)) for turn in turns],
        "deviation": deviations,
        "sense": [sense] * len(turns),
        how.axes[0]: first_axis,
        how.axes[1]: second_axis,
        "time": _times(circle, turns, radius, clock),
    }


def _turns(
    name: str, export: Export, angles: Sequence[str], at: Sequence[int], faults: Faults
) -> list[float] | None:
    """Return the angles in rad; None with the fault noted, also of an angle that is measured twice."""
    stated = _unit(export, _ANGLES)
    unit = foreign_unit(stated or "deg")
    if unit is None or unit.quantity != "angle":
        faults.add(
            name, at[0], "angle", f"{quoted(stated)} is no unit of angles; the column must be in deg or rad"
        )
        return None
    numbers = [decimal_of(cell) for cell in angles]
    for line, cell, number in zip(at, angles, numbers, strict=True):
        if number is None:
            faults.add(name, line, "angle", f"{quoted(cell)} is not a number; export the measurement again")
    if None in numbers:
        return None
    # Angles that begin anew at 360 degrees go on.
    turns = np.unwrap([float(number * unit.factor) for number in numbers if number is not None]).tolist()
    for line, first, second in zip(at[1:], turns[:-1], turns[1:], strict=True):
        if first == second:
            faults.add(
                name, line, "angle", "the angle is that of the row before; remove the copy, or export again"
            )
    return turns


def _column(
    name: str, export: Export, names: Sequence[str], what: str, at: Sequence[int], faults: Faults
) -> list[str] | None:
    folded = {column.casefold(): column for column in export.columns}
    for candidate in names:
        if candidate in folded:
            return list(export.columns[folded[candidate]])
    for column in export.columns:
        if plain_key(column) in names:
            faults.add(
                name,
                at[0],
                what,
                f"{quoted(column)} has a unit that is not known; write deg or rad, um or mm",
            )
            return None
    listed = ", ".join(export.columns)
    faults.add(
        name,
        at[0],
        what,
        f"the table has no column of the {what}; it has {listed}: call it {names[0].title()}",
    )
    return None


def _unit(export: Export, names: Sequence[str]) -> str | None:
    return next((unit for column, unit in export.units.items() if column.casefold() in names), None)


def _radius(name: str, circle: _Circle, how: BallBarSettings, faults: Faults) -> float | None:
    """Return the radius in mm as the file states it, with its unit; the mapping's must be the same."""
    head = circle.stating("radius")
    fact = head.fact("radius")
    if how.is_overruled and how.radius is None:
        radius: float | str = (
            "the mapping overrules the radius of the file and states none; write it as radius_mm, in mm"
        )
    elif how.radius is not None and (fact is None or how.is_overruled):
        radius = how.radius
    elif fact is None:
        radius = "nothing states the radius of this circle; write it as radius_mm in the mapping, in mm"
    else:
        radius = _radius_of(fact, how.radius)
    if isinstance(radius, str):
        faults.add(name, head.line_of("radius"), "radius", radius)
        return None
    return radius


def _radius_of(fact: Fact, mapped: float | None) -> float | str:
    """Return the radius in mm of a line of a head, or what is wrong with it or with that of the mapping."""
    number, unit = length_of(fact)
    if number is None:
        return f"{quoted(fact.value)} is no radius; write for example Radius: 100.0 mm"
    if unit is None and mapped is None:
        return f"nothing states the unit of the radius {quoted(fact.value)}; write radius_mm = {fact.value} if it is mm"
    read_radius = number * (1.0 if unit is None else unit)
    if mapped is None or abs(read_radius / mapped - 1.0) <= _SAME_RADIUS:
        return mapped or read_radius
    hint = "; the file is in inches" if abs(read_radius * 25.4 / mapped - 1.0) < _SAME_RADIUS else ""
    return (
        f"the file says {read_radius:g} mm, the mapping {mapped:g} mm{hint}: correct radius_mm, or write "
        'overruled = ["radius"] where the file is wrong, or states the bar and radius_mm a smaller circle'
    )


def _sense(name: str, circle: _Circle, turns: Sequence[float], at: Sequence[int], faults: Faults) -> str:
    """Return CW or CCW as the angles go; what the head says must be the same."""
    going = "CCW" if turns[-1] > turns[0] else "CW"
    stated = _SENSES.get((circle.value("sense") or "").casefold().split(" ")[0])
    if stated is not None and stated != going and len(turns) > 1:
        faults.add(
            name, at[0], "angle",
            f"the head says {stated}, the angles go {going}; are they counted the other way?",
        )  # fmt: skip
    return going


def _times(circle: _Circle, turns: Sequence[float], radius: float, clock: float) -> list[str]:
    """Return the times of the rows from the feed, a second a row where nobody states it."""
    feed = _feed_of(circle.stating("feed").fact("feed"))
    if feed <= 0.0:
        return [repr(clock + row) for row in range(len(turns))]
    seconds = 60.0 * radius / feed
    return [repr(round(clock + seconds * abs(turn - turns[0]), 6)) for turn in turns]


EXPORT = ExportFormat(
    "ball bar",
    "ball bar, text: a head and a table of angle and deviation for each circle",
    read,
    settings,
    (".bar", ".b20", ".b5t"),
    {"reading_um": "deviation", "time_s": "time"},
)
