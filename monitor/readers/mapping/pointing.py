"""Directions of a telescope from two columns of angles, by the convention that ``[exports.direction]`` states.

The outer frame is right-handed: for azimuths x points north, y west and z up; for hour angles x points to where
meridian and equator meet, y east and z to the north celestial pole. In both the first angle turns from x towards -y.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from monitor.exceptions import did_you_mean
from monitor.readers.faults import one_of, quoted
from monitor.readers.mapping.column_source import ColumnSource, column_source
from monitor.readers.mapping.refraction import FARTHEST, lifted
from monitor.readers.toml_table import Table
from monitor.records import Array

#: The columns that the angles become.
DIRECTION = ("direction_x", "direction_y", "direction_z")
#: Where an azimuth is zero and how it grows: the azimuth from north through east is start + sense * azimuth, degrees.
AZIMUTHS: Mapping[str, tuple[float, float]] = {
    "north through east": (0.0, 1.0),
    "north through west": (0.0, -1.0),
    "south through west": (180.0, 1.0),
    "south through east": (180.0, -1.0),
}
#: The first angle, and the second ones that go with it: those above the plane first.
PAIRS: Mapping[str, tuple[str, str]] = {
    "azimuth_deg": ("elevation_deg", "zenith_distance_deg"),
    "hour_angle_deg": ("declination_deg", "pole_distance_deg"),
}
WEATHER = ("pressure_hPa", "temperature_degC")
#: What an angle or the weather at a telescope can be.
_RANGES: Mapping[str, tuple[float, float]] = {
    **dict.fromkeys(PAIRS, (-720.0, 720.0)),
    **{above: (-90.0, 90.0) for above, _ in PAIRS.values()},
    **{off: (0.0, 180.0) for _, off in PAIRS.values()},
    "pressure_hPa": (400.0, 1100.0),
    "temperature_degC": (-90.0, 60.0),
}


@dataclass(frozen=True)
class Pointing:
    """The two columns of angles, the weather where refraction has to be added, and their convention.

    ``start`` (degrees) and ``sense`` make of the first angle one that turns from x towards -y; ``latitude`` (degrees)
    is that of the zenith in the outer frame: 90 where z points up, None where nobody needs it.
    """

    first: str
    second: str
    sources: Mapping[str, ColumnSource]
    convention: str
    start: float = 0.0
    sense: float = 1.0
    latitude: float | None = None

    @property
    def adds_refraction(self) -> bool:
        """Whether the angles are those of light above the air."""
        return WEATHER[0] in self.sources


def read_pointing(table: Table | None) -> Pointing | None:
    """Read ``[exports.direction]``; None where there is none, or with its faults noted."""
    if table is None:
        return None
    before = len(table.faults)
    first = _one_key(table, tuple(PAIRS))
    second = None if first is None else _one_key(table, PAIRS[first])
    start, sense, convention = (
        _azimuth(table) if first == "azimuth_deg" else (0.0, 1.0, "growing to the west")
    )
    added = _refraction(table)
    latitude = 90.0 if first == "azimuth_deg" else None
    if added and first == "hour_angle_deg":
        latitude = table.number("latitude_deg", required=True, largest=90.0, unit="deg", example="31.7")
    names = [name for name in (first, second, *(WEATHER if added else ())) if name is not None]
    sources = {name: source for name in names if (source := _source(table, name)) is not None}
    table.finish()
    if first is None or second is None or len(table.faults) > before:
        return None
    return Pointing(first, second, sources, convention, start, sense, latitude)


def _one_key(table: Table, keys: tuple[str, ...]) -> str | None:
    """Return the one of some keys that is there; None with the fault noted."""
    present = [key for key in keys if key in table.data]
    for key in present:
        table.raw(key, required=False, example="")
    if len(present) == 1:
        return present[0]
    what = "only one of these keys is right" if present else "one of these keys is missing"
    table.fault(None, f"{what}: {one_of(keys)}")
    return None


def _azimuth(table: Table) -> tuple[float, float, str]:
    origin = table.text("azimuth_from", required=True, example='"north through east"')
    if origin is not None and origin not in AZIMUTHS:
        hint = did_you_mean(origin, AZIMUTHS)
        table.fault("azimuth_from", f"{quoted(origin)} is not known; {hint}write one of {one_of(AZIMUTHS)}")
    start, sense = AZIMUTHS.get(origin or "", (0.0, 1.0))
    return start, sense, f"from {origin}"


def _refraction(table: Table) -> bool:
    """Return whether refraction has to be added."""
    state = table.text("refraction", required=True, example='"applied"')
    if state not in (None, "applied", "not applied"):
        table.fault(
            "refraction",
            f'{quoted(state)} is not known; write "applied" where the angles say where the light is seen, '
            '"not applied" where they are those above the air',
        )
    return state == "not applied"


def _source(table: Table, name: str) -> ColumnSource | None:
    """Return the source of an angle or of the weather; None with the fault noted."""
    if name not in table.data:
        table.raw(name, required=True, example='"COLUMN"')
        return None
    source = column_source(table, name)
    if source is not None and source.deviation:
        table.fault(name, "deviation = true is for a setup of displacement; leave it out")
    return source


def beyond(name: str, value: float) -> str | None:
    """Return a sentence on a number that no angle or weather of this name can be; None where it can."""
    low, high = _RANGES[name]
    if low <= value <= high:
        return None
    unit = name.rpartition("_")[2]
    return f"{value:g} lies beyond {low:g} to {high:g} {unit}; is it {name}, and is its unit right?"


def vectors(pointing: Pointing, numbers: Mapping[str, Array]) -> Array:
    """Return unit vectors (n, 3) in the outer frame, of angles (n,) in degrees and weather (n,) by their names."""
    around = np.deg2rad(pointing.start + pointing.sense * numbers[pointing.first])
    angle = numbers[pointing.second]
    above = np.deg2rad(angle if pointing.second == PAIRS[pointing.first][0] else 90.0 - angle)
    directions = np.column_stack(
        [np.cos(above) * np.cos(around), -np.cos(above) * np.sin(around), np.sin(above)]
    )
    if not pointing.adds_refraction:
        return directions
    return lifted(directions, _zenith(pointing), *(numbers[name] for name in WEATHER))


def too_low(pointing: Pointing, directions: Array) -> Array:
    """Return which directions (n,) stand too low for refraction to be added."""
    if not pointing.adds_refraction:
        return np.zeros(len(directions), dtype=np.bool_)
    return np.asarray(directions @ _zenith(pointing) < np.cos(FARTHEST))


def _zenith(pointing: Pointing) -> Array:
    latitude = np.deg2rad(90.0 if pointing.latitude is None else pointing.latitude)
    return np.array([np.cos(latitude), 0.0, np.sin(latitude)])


def in_words(pointing: Pointing) -> str:
    """Return how the directions are computed, for people to look at."""
    first, second = (
        name.removesuffix("_deg").replace("_", " ") for name in (pointing.first, pointing.second)
    )
    air = "refraction added" if pointing.adds_refraction else "as the light is seen"
    return f"{first} {pointing.convention} and {second}, {air}"
