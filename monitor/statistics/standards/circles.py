"""Circular tests as ISO 230-4:2005 (clause 3) evaluates them: circular deviation G, hysteresis H, radial deviation F.

The centre of the bar is nobody's: a least-squares circle takes it out (the eccentricity by its cosine and sine), one
for both senses of rotation where they are compared.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from monitor.exceptions import InputError
from monitor.records import Array

#: A least-squares circle has three unknowns; fewer points than this, or an arc below half a turn, say nothing of it.
FEWEST_POINTS, SHORTEST_ARC = 12, np.pi
#: Two senses are compared where the one has points no further apart than this many of its usual steps: across a wider
#: gap a straight line between its ends says nothing of the path.
WIDEST_GAP = 3.0
#: Draws for the uncertainties: the standard deviation of so many is known to 2 %.
DRAWS = 1000


@dataclass(frozen=True)
class Circles:
    """A circular test in the unit of its deviations.

    ``circular`` G of each sense (1 counter-clockwise, -1 clockwise) about its least-squares circle,
    ``minimum_zone`` the same between the two nearest concentric circles, ``both`` G of both senses together (G(b)),
    ``hysteresis`` H, ``largest`` and ``smallest`` radial deviation F of each sense. NaN is what needs both senses and
    has one. ``centre`` (2,) is that of the least-squares circle of all points, ``angle`` (n,), ``sense`` (n,) and
    ``radial`` (n,) what a polar plot shows; ``u`` the standard uncertainty of each figure by its name.
    """

    circular: Mapping[int, float]
    minimum_zone: Mapping[int, float]
    both: float
    hysteresis: float
    largest: Mapping[int, float]
    smallest: Mapping[int, float]
    centre: Array
    angle: Array
    sense: Array
    radial: Array
    u: Mapping[str, float]


def circles(
    angle: Array, deviation: Array, *, u_reading: float, u_radius: float, rng: np.random.Generator
) -> Circles:
    """The figures of radial deviations (n,) from the nominal radius at angles (n,) rad, in the order of measuring.

    ``u_reading`` and ``u_radius`` are standard uncertainties of a reading and of the bar's length (NaN: not calibrated,
    F has no uncertainty). Raises InputError for an arc below half a turn or fewer than 12 points in a sense.
    """
    sense = _sense(angle)
    senses = [int(way) for way in (1, -1) if np.any(sense == way)]
    for way in senses:
        turned = np.unwrap(angle[sense == way])
        if len(turned) < FEWEST_POINTS or np.ptp(turned) < SHORTEST_ARC:
            raise InputError(
                f"a circular test needs {FEWEST_POINTS} points and half a turn in each sense; here are {len(turned)} "
                f"over {np.degrees(np.ptp(turned)):.0f} degrees"
            )
    figures = _figures(angle, deviation[None, :], sense, senses)
    drawn = deviation + u_reading * rng.standard_normal((DRAWS, len(deviation)))
    again = _figures(angle, drawn, sense, senses)
    u = {name: float(np.std(values)) for name, values in again.items()}
    for name in u:
        if name.startswith("F"):
            u[name] = float(np.hypot(u[name], u_radius))
    fitted, centre = _centred(angle, deviation[None, :])
    value = {name: float(values[0]) for name, values in figures.items()}
    return Circles(
        circular={way: value[f"G{way}"] for way in senses},
        minimum_zone={
            way: minimum_zone(_columns(angle[sense == way]), deviation[sense == way]) for way in senses
        },
        both=value.get("G", np.nan),
        hysteresis=value.get("H", np.nan),
        largest={way: value[f"Fmax{way}"] for way in senses},
        smallest={way: value[f"Fmin{way}"] for way in senses},
        centre=centre[0],
        angle=angle,
        sense=sense,
        radial=fitted[0],
        u=u,
    )


def _sense(angle: Array) -> Array:
    """The sense (n,), 1 or -1, in which the angle was passed through; the first point goes with the second, and a point
    that repeats the angle before it with the next."""
    step = np.sign(np.round((np.diff(angle) + np.pi) % (2.0 * np.pi) - np.pi, 9))
    following = np.concatenate([step, step[-1:]])
    before = np.concatenate([step[:1], step])
    return np.where(before != 0.0, before, following)


def _columns(angle: Array) -> Array:
    return np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])


def _centred(angle: Array, deviation: Array) -> tuple[Array, Array]:
    """Deviations (B, n) with the eccentricity of the least-squares circle taken out, and its centres (B, 2)."""
    solved = deviation @ np.linalg.pinv(_columns(angle)).T
    return deviation - solved[:, 1:] @ _columns(angle)[:, 1:].T, solved[:, 1:]


def _figures(angle: Array, deviation: Array, sense: Array, senses: list[int]) -> dict[str, Array]:
    """Every figure (B,) of deviations (B, n): ISO 230-4:2005, 3.4 to 3.7."""
    figures: dict[str, Array] = {}
    for way in senses:
        mine = sense == way
        centred, _ = _centred(angle[mine], deviation[:, mine])
        figures[f"G{way}"] = np.ptp(centred, axis=1)
        figures[f"Fmax{way}"], figures[f"Fmin{way}"] = centred.max(axis=1), centred.min(axis=1)
    if len(senses) == 2:
        centred, _ = _centred(angle, deviation)
        figures["G"] = np.ptp(centred, axis=1)
        apart = np.abs(_difference(angle, centred, sense))
        figures["H"] = np.max(apart, axis=1) if apart.shape[1] else np.full(len(deviation), np.nan)
    return figures


def _difference(angle: Array, centred: Array, sense: Array) -> Array:
    """Deviations (B, k) of the one sense less those (B, n) of the other, straight between its points, where it has
    some: both senses of a partial circle may end elsewhere."""
    first, second = sense == 1, sense == -1
    at = angle[first] % (2.0 * np.pi)
    order = np.argsort(angle[second] % (2.0 * np.pi), kind="stable")
    places = (angle[second] % (2.0 * np.pi))[order]
    values = centred[:, second][:, order]
    # By the order of measuring: turns that overlap have neighbours no further apart than their jitter.
    usual = float(np.median(np.abs(np.diff(np.unwrap(angle[second])))))
    places = np.concatenate([places[-1:] - 2.0 * np.pi, places, places[:1] + 2.0 * np.pi])
    values = np.concatenate([values[:, -1:], values, values[:, :1]], axis=1)
    right = np.clip(np.searchsorted(places, at), 1, len(places) - 1)
    gap = np.maximum(places[right] - places[right - 1], 1e-12)
    share = (at - places[right - 1]) / gap
    between = values[:, right - 1] * (1.0 - share) + values[:, right] * share
    is_beside = gap <= WIDEST_GAP * usual
    return np.asarray((centred[:, first] - between)[:, is_beside])


def minimum_zone(columns: Array, deviation: Array) -> float:
    """The least width of a zone about a form that is linear in its unknowns, given by ``columns`` (n, q): a linear
    programme in them and half the width (ISO/TS 12181 and 12780, minimum zone). For circles the columns are 1, cos and
    sin (the limacon approximation: deviations are small beside the radius), for a line 1 and the place along it."""
    half = np.ones((len(deviation), 1))
    above, below = np.hstack([columns, -half]), np.hstack([-columns, -half])
    # -h <= deviation - columns x <= h
    unknowns = columns.shape[1]
    answer = scipy.optimize.linprog(
        [0.0] * unknowns + [1.0],
        A_ub=np.vstack([below, above]),
        b_ub=np.concatenate([-deviation, deviation]),
        bounds=[(None, None)] * unknowns + [(0, None)],
    )
    return float(2.0 * answer.fun)
