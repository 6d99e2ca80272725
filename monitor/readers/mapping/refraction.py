"""How far the air lifts a line of sight towards the zenith.

Two terms, R = A tan z + B tan³ z with z the zenith distance as seen (R. M. Green, Spherical Astronomy (1985),
eq. 4.31), of dry air in yellow light (0.574 µm). Humid air refracts 0.1 % less at 7 °C and 80 %; light of 0.4 µm 1.9 %
more, of 0.8 µm 0.9 % less. Against rays traced through a model atmosphere (C. Y. Hohenkerk and A. T. Sinclair, NAO
Technical Note 63 (1985)) it is within 0.25 % down to 10 degrees above the horizon; below, it is not computed.
"""

from __future__ import annotations

import numpy as np

from monitor.records import Array

#: Zenith distance (rad) up to which two terms suffice.
FARTHEST = np.deg2rad(80.0)
#: n - 1 of dry air at 15 °C and 1013.25 hPa in light of 0.574 µm: K. P. Birch and M. J. Downs, Metrologia 30 (1993)
#: 155.
_STANDARD_AIR = 2.7740e-4
#: Height of the atmosphere, were it of one density, over the radius of the Earth, by kelvin: R. C. Stone, Publ. Astron.
#: Soc. Pacific 108 (1996) 1051, eq. 9.
_HEIGHT_BY_KELVIN = 4.5908e-6
#: Fixed-point steps: each leaves a hundredth of the error (the slope of R at 80 degrees is 0.009).
_STEPS = 8


def refractivity(pressure: Array, temperature: Array) -> Array:
    """Return n - 1 (n,) of dry air at pressures in hPa and temperatures in °C, by Birch and Downs' eq. 3."""
    pascal = 100.0 * pressure
    density = pascal / 96095.43 * (1.0 + 1e-8 * (0.601 - 0.00972 * temperature) * pascal)
    return np.asarray(_STANDARD_AIR * density / (1.0 + 0.0036610 * temperature))


def refraction(zenith_distance: Array, pressure: Array, temperature: Array) -> Array:
    """Return by how much (n,) rad light from zenith distances (n,) rad above the air is seen nearer to the zenith.

    ``pressure`` (n,) in hPa and ``temperature`` (n,) in °C are those at the telescope. Meaningless beyond FARTHEST.
    """
    bending = refractivity(pressure, temperature)
    height = _HEIGHT_BY_KELVIN * (temperature + 273.15)
    first, third = bending * (1.0 - height), -bending * (height - bending / 2.0)
    lift = np.zeros_like(zenith_distance)
    for _ in range(_STEPS):
        tangent = np.tan(zenith_distance - lift)
        lift = first * tangent + third * tangent**3
    return np.asarray(lift)


def lifted(directions: Array, zenith: Array, pressure: Array, temperature: Array) -> Array:
    """Return unit vectors (n, 3) towards light as it is seen through the air, of those above it and of the ``zenith``
    (3,)."""
    cosine = np.clip(directions @ zenith, -1.0, 1.0)
    upwards = zenith - cosine[:, None] * directions
    sine = np.linalg.norm(upwards, axis=1)
    upwards = upwards / np.maximum(sine, 1e-300)[:, None]
    lift = refraction(np.arctan2(sine, cosine), pressure, temperature)[:, None]
    return np.asarray(directions * np.cos(lift) + upwards * np.sin(lift))
