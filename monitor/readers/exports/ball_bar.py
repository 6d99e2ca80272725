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

from monitor.readers.delimited import Style, cells_of, fact_of, is_data
from monitor.readers.export import Export, ExportFile, ExportFormat
from monitor.readers.exports import table as plain_table
from monitor.readers.faults import Faults, quoted
from monitor.readers.foreign_text import decode_foreign
from monitor.readers.foreign_units import decimal_of, foreign_unit
from monitor.readers.toml_table import Table

#: What the head of a circle calls a thing, in small letters, by what it is.
_KEYS = {
    "radius": (
        "radius",
        "nominal radius",
        "ballbar length",
        "ball bar length",
        "length",
        "nominal length",
        "bar length",
    ),
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
_QUANTITY = re.compile(r"([+-]?[0-9]*[.,]?[0-9]+)\s*([^\s0-9]\S*)?")
#: Digits of mm that a computed position is written with: a picometre.
_DIGITS = 9
#: Radii of file and mapping that differ by less are the same.
_SAME_RADIUS = 1e-3
#: A column of angles, and one of deviations.
_ANGLES = ("angle", "winkel", "position")
_DEVIATIONS = ("deviation", "radial deviation", "radius deviation", "error", "abweichung", "length change")


@dataclass(frozen=True)
class BallBarSettings:
    """What the mapping says of the circles: the ``axes`` of the plane, their readings at its centre, its radius."""

    axes: tuple[str, str] | None
    centre: tuple[float, float] | None
    radius: float | None
    style: Style = field(default_factory=Style)


@dataclass
class _Circle:
    """One circle: its head, the circle before it, the line that its table begins on, and the lines of the table."""

    facts: list[tuple[str, str]] = field(default_factory=list)
    facts_at: list[int] = field(default_factory=list)
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
        return next((value for key, value in self.facts if _plain(key) in _KEYS[what]), None)

    def line_of(self, what: str) -> int:
        """Return the line on which the head says a thing, that of the table where it does not."""
        lines = (
            line
            for (key, _), line in zip(self.facts, self.facts_at, strict=True)
            if _plain(key) in _KEYS[what]
        )
        return next(lines, self.begin + 1)


def _plain(key: str) -> str:
    """Return a key without the unit behind it."""
    return re.sub(r"\s*[\[(].*", "", key).strip().casefold()


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
    return BallBarSettings(axes, None if centre is None else (centre[0], centre[1]), radius, style)


def read(file: ExportFile, how: BallBarSettings, faults: Faults) -> Export | None:
    """Read all circles of a file; None with the faults noted."""
    decoded = decode_foreign(file.name, file.content, faults)
    if decoded is None:
        return None
    before = len(faults)
    circles = _circles(decoded[0].split("\n"), how.style)
    if not circles:
        faults.add(
            file.name,
            1,
            None,
            "there is no table of angles and deviations; say in the mapping how it is written",
        )
        return None
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
    return Export(columns, stated, lines, layout, tuple(facts), circles[0].value("date"))


def _read_circles(
    name: str, circles: Sequence[_Circle], encoding: str, how: BallBarSettings, faults: Faults
) -> tuple[dict[str, list[str]], list[int], str, str] | None:
    """Return the columns of all circles, their lines, the unit of the deviations and the layout; None with faults."""
    columns: dict[str, list[str]] = {}
    units: list[str] = []
    lines: list[int] = []
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
    return columns, lines, units[0], layout


def _circles(lines: Sequence[str], style: Style) -> list[_Circle]:
    """Cut a file into circles: a head, a line of names and units, and rows of numbers until the next head."""
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
            circle.facts.append(fact)
            circle.facts_at.append(number)
        else:
            names = (number - 1, [line]) if names is None else (names[0], [*names[1], line])
    return circles


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
    turns = [float(number * unit.factor) for number in numbers if number is not None]
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
    text = head.value("radius")
    wrong = None
    radius = how.radius
    if text is None and radius is None:
        wrong = "nothing states the radius of this circle; write it as radius_mm in the mapping, in mm"
    elif text is not None:
        number, unit = _length(head, text)
        if number is None:
            wrong = f"{quoted(text)} is no radius; write for example Radius: 100.0 mm"
        elif unit is None and radius is None:
            wrong = (
                f"nothing states the unit of the radius {quoted(text)}; write radius_mm = {text} if it is mm"
            )
        else:
            read_radius = number * (1.0 if unit is None else unit)
            radius = radius or read_radius
            if abs(read_radius / radius - 1.0) > _SAME_RADIUS:
                hint = (
                    "; the file is in inches" if abs(read_radius * 25.4 / radius - 1.0) < _SAME_RADIUS else ""
                )
                wrong = (
                    f"the file says {read_radius:g} mm, the mapping {radius:g} mm{hint}: correct one of them"
                )
    if wrong is not None:
        faults.add(name, head.line_of("radius"), "radius", wrong)
    return None if wrong is not None else radius


def _length(circle: _Circle, text: str) -> tuple[float | None, float | None]:
    """Return the number of a length and how many mm its unit has, behind the number or in the key; None without."""
    match = _QUANTITY.fullmatch(text)
    if match is None:
        return None, None
    key = next(key for key, _ in circle.facts if _plain(key) in _KEYS["radius"])
    bracket = re.search(r"[\[(](.*?)[\])]", key)
    unit = foreign_unit(match[2] or (bracket[1] if bracket else ""))
    number = decimal_of(match[1].replace(",", "."))
    is_length = unit is not None and unit.quantity == "length"
    return None if number is None or not number else float(number), float(
        unit.factor
    ) if is_length and unit else None


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
    head = circle.stating("feed")
    match = _QUANTITY.match(head.value("feed") or "")
    feed = 0.0 if match is None else float(match[1].replace(",", "."))
    text = f"{head.value('feed') or ''} {[key for key, _ in head.facts if _plain(key) in _KEYS['feed']]}".casefold()
    if feed <= 0.0 or "mm/min" not in text:
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
