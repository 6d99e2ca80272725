"""What the head of a file says of itself, compared with what the mapping makes of its rows.

``Axis: X`` above the deviations of Y, an angular file read as lengths, a bar of 150 mm in a setup of 100 mm: one of the
two is wrong, and no number shows which. Keys are compared in small letters; values that are not known say nothing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from monitor.readers.export import Export, Fact
from monitor.readers.exports.ball_bar import RADIUS_KEYS
from monitor.readers.faults import one_of
from monitor.readers.foreign_units import decimal_of
from monitor.readers.mapping.mapping_file import OVERRULED, Entry
from monitor.readers.mapping.rows import Rows, Wanted
from monitor.readers.tables.delimited import length_of, plain_key

#: Axes that move less have the same reading in all rows, in mm or degrees.
_STILL = 1e-3
#: Bars are set to their nominal length within the travel of their sensor, in mm.
_TRAVEL = 1.0
_POSITION = re.compile(r"(?:axis|achse)?[\s:-]*([A-Z][0-9]?)(?:[\s-]*(?:axis|achse))?", re.IGNORECASE)
_PLANE = re.compile(r"([XYZUVW])\s*[-/,]?\s*([XYZUVW])(?:[\s-]*(?:plane|ebene))?", re.IGNORECASE)
_PLANES = {"g17": "XY", "g18": "ZX", "g19": "YZ"}
#: So many times an axis has to turn at its ends before a pass that stops short says something, and by which part.
_LEAST_TURNS, _LEFT = 2, 0.01
_COUNT = re.compile(r"[0-9]{1,6}")
#: What a file may call itself, by the kinds of readings that it can be.
_KINDS: Mapping[str, tuple[str, ...]] = {
    "linear": ("linear", "distance", "displacement", "positioning", "position", "positionierung", "rtl"),
    "angular": ("angular", "angle", "rotary", "pitch", "yaw", "roll", "winkel", "rta", "nicken", "gieren", "rollen"),
    "straightness": ("straightness", "geradheit", "rts"),
}  # fmt: skip
_READINGS = {
    "linear": ("displacement", "distance", "component", "vector", "point", "pose"),
    "angular": ("angle", "level", "direction", "pose"),
    "straightness": ("offset", "component", "vector", "point", "pose"),
}
_KEYS: Mapping[str, tuple[str, ...]] = {
    "axis": ("axis", "achse", "axis under test", "measured axis", "test axis"),
    "kind": ("file type", "filetype", "measurement type", "type of measurement", "test type", "messart"),
    "plane": ("plane", "ebene", "test plane", "plane of test", "measurement plane"),
    "radius": RADIUS_KEYS,
}
_POINTS = (
    "points", "number of points", "no. of points", "number of targets", "targets", "target-count", "target count",
    "number of readings", "readings", "samples", "number of rows", "rows", "messpunkte", "anzahl messpunkte",
    "anzahl punkte", "punkte", "anzahl werte", "messwerte", "zeilen",
)  # fmt: skip
_RUNS = ("runs", "number of runs", "no. of runs", "run-count", "run count", "anzahl läufe", "läufe")


def compare(entry: Entry, file: str, export: Export, rows: Rows, wanted: Wanted) -> Iterator[str]:
    """Note where a file contradicts its mapping, by the line that says so; yield a sentence where that is overruled."""
    for fact in export.facts:
        what = next((what for what, keys in _KEYS.items() if plain_key(fact.key) in keys), None)
        wrong = None if what is None else _RULES[what](fact, rows, wanted)
        if what is None or wrong is None:
            continue
        if what in entry.overruled:
            yield f"the file says {fact.key}: {fact.value} and is overruled by the mapping"
            continue
        entry.table.faults.add(
            file, fact.line, fact.key,
            f'{wrong}; or write {OVERRULED} = ["{what}"] in [[exports]] where the file is wrong',
        )  # fmt: skip
    yield from _announced(entry, file, export, _turns_at_once(rows, wanted))
    yield from _last_pass(rows, wanted)


def _axis(fact: Fact, rows: Rows, wanted: Wanted) -> str | None:
    """Say what is wrong where another axis moves than the head names."""
    match = _POSITION.fullmatch(fact.value.strip())
    moving = _moving(rows, wanted)
    if match is None or not moving:
        return None
    name = match[1].upper()
    if name not in (axis.name for axis in wanted.axes):
        name = name[0]
    if name in moving:
        return None
    columns = one_of(axis.column for axis in wanted.axes if axis.name == name)
    right = (
        f"the machine has no axis {name}; take a file of this machine"
        if columns == "none"
        else f"map its positions to {columns}, or take the file of {one_of(moving)}"
    )
    return f"the file says axis {name}, by the mapping {one_of(moving)} moves: {right}"


def _kind(fact: Fact, rows: Rows, wanted: Wanted) -> str | None:
    """Say what is wrong where the file has other quantities than the setup reads."""
    word = fact.value.strip().casefold().split(" ")[0]
    kind = next((kind for kind, names in _KINDS.items() if word in names), None)
    if kind is None or wanted.setup is None or wanted.setup.reading in _READINGS[kind]:
        return None
    setup = wanted.setup
    return (
        f"the file says {fact.value}, the setup {setup.id} reads {setup.reading}: such a file is of a setup with "
        f'reading = "{_READINGS[kind][0]}"'
    )


def _plane(fact: Fact, rows: Rows, wanted: Wanted) -> str | None:
    """Say what is wrong where the axes of the plane do not both move."""
    word = fact.value.strip()
    match = _PLANE.fullmatch(_PLANES.get(word.casefold(), word))
    moving = _moving(rows, wanted)
    if match is None or not moving or wanted.setup is None or wanted.setup.reading != "distance":
        return None
    plane = [match[1].upper(), match[2].upper()]
    if set(plane) <= set(moving):
        return None
    return (
        f"the file says plane {''.join(plane)}, by the mapping {one_of(moving)} move: "
        f"map it to these axes, a ball bar by axes = {plane}, or take the file of the other plane".replace(
            "'", '"'
        )
    )


def _radius(fact: Fact, rows: Rows, wanted: Wanted) -> str | None:
    """Say what is wrong where the bar has another length than its setup, by more than a sensor travels."""
    number, unit = length_of(fact)
    setup = wanted.setup
    if number is None or unit is None or setup is None or setup.reading != "distance" or setup.length is None:
        return None
    stated = number * unit
    if abs(stated - setup.length) <= _TRAVEL:
        return None
    return (
        f"the file says {stated:g} mm, the setup {setup.id} has length_mm = {setup.length:g}: correct length_mm, or "
        "take the file of that bar"
    )


_RULES: Mapping[str, Callable[[Fact, Rows, Wanted], str | None]] = {
    "axis": _axis, "kind": _kind, "plane": _plane, "radius": _radius,
}  # fmt: skip


def _moving(rows: Rows, wanted: Wanted) -> list[str]:
    """Return the axes that do not stand still, by their names; none where a cell is no number, refused elsewhere."""
    moving = []
    for axis in wanted.axes:
        numbers = [decimal_of(cell) for cell in rows.cells.get(axis.column, ())]
        if None in numbers:
            return []
        if numbers and np.ptp([float(number) for number in numbers if number is not None]) > _STILL:
            moving.append(axis.name)
    return moving


def _turns_at_once(rows: Rows, wanted: Wanted) -> bool:
    """Whether no two rows that follow each other stand at one place: where an axis turns it is measured once."""
    moving = _moving(rows, wanted)
    columns = [axis.column for axis in wanted.axes if axis.name in moving]
    steps = [np.abs(np.diff([float(cell) for cell in rows.cells[column]])) for column in columns]
    return not steps or bool((np.max(steps, axis=0) > _STILL).all())


def _announced(entry: Entry, file: str, export: Export, turns_at_once: bool) -> Iterator[str]:
    """Note fewer rows than the head announces; yield a sentence where they are no whole number of passes."""
    points, runs = (_count(export, keys) for keys in (_POINTS, _RUNS))
    if points is None:
        return
    rows, asked, passes = len(export.lines), int(points.value), 1 if runs is None else int(runs.value)
    times = "" if runs is None else f" in {passes} runs"
    # Where the axis turns a target may be measured once for both ways.
    is_whole = rows >= asked * passes or (turns_at_once and rows == (asked - 1) * passes + 1)
    if not is_whole:
        if "points" in entry.overruled:
            yield f"the file announces {asked} {points.key}{times} and is overruled by the mapping"
            return
        entry.table.faults.add(
            file, points.line, points.key,
            f"{asked} are announced{times} and the table has {rows} rows: the file is cut; export it again, or write "
            f'{OVERRULED} = ["points"] in [[exports]] where it is whole (a run a file, readings averaged)',
        )  # fmt: skip
    elif asked > 1 and rows % asked and (rows - 1) % (asked - 1):
        yield f"{asked} {points.key} are announced, and {rows} rows are no whole number of passes: is it cut?"


def _last_pass(rows: Rows, wanted: Wanted) -> Iterator[str]:
    """Yield a sentence where one axis goes to and fro between two ends and its last pass stops before its end."""
    moving = _moving(rows, wanted)
    if len(moving) != 1:
        return
    column = next(axis.column for axis in wanted.axes if axis.name == moving[0])
    positions = np.array([float(cell) for cell in rows.cells[column]])
    steps = np.diff(positions)
    signs = np.sign(steps[np.abs(steps) > _STILL])
    turns = np.flatnonzero(np.diff(signs))
    places = positions[np.concatenate([[True], np.abs(steps) > _STILL])]
    if len(turns) < _LEAST_TURNS:
        return
    ends = places[turns + 1]
    reach = float(np.ptp(places))
    is_whole = all(min(end - places.min(), places.max() - end) < _STILL for end in ends)
    short = float(abs((places.max() if signs[-1] > 0.0 else places.min()) - places[-1]))
    if is_whole and short > _LEFT * reach:
        yield (
            f"the last pass of {moving[0]} ends at {places[-1]:g}, {short:g} before the end of the {len(ends)} others, "
            f"on line {rows.lines[-1]}: is the file cut?"
        )


def _count(export: Export, keys: tuple[str, ...]) -> Fact | None:
    """Return what the head says of a number; None where it says none."""
    facts = (fact for fact in export.facts if plain_key(fact.key) in keys)
    return next((fact for fact in facts if _COUNT.fullmatch(fact.value) and int(fact.value) > 0), None)
