"""The curve of an effect whose shape the catalogue does not have: its size where the axis stood, with its band."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.discovery.machine.scene import MachineEffect
from monitor.effects import ChainEffect, Context
from monitor.effects.shapes.free import Follows, Free
from monitor.records import Array

# A part of a shape that is larger than so many times its standard uncertainty is said.
SEEN = 2.0
# Points that agree to so many decimals of the largest are one.
SAME_DIGITS = 9
# A curve is drawn through no more points than a figure shows.
MOST_POINTS = 200


@dataclass(frozen=True)
class Curve:
    """Size (m,) and standard uncertainty (m,) of an effect, in internal units, at readings (m,) of the axis ``joint``
    in mm or rad, to which it came in a direction (m,)."""

    joint: str
    turns: bool
    at: Array
    direction: Array
    size: Array
    u: Array


def curve_of(context: Context, effect: MachineEffect, coefficients: Array, covariance: Array) -> Curve | None:
    """The curve of an effect of the given coefficients (k,); None for what is no error of an axis."""
    if not isinstance(effect, ChainEffect):
        return None
    at = effect.joint.sign * context.places[:, effect.term.joint]
    direction = effect.joint.sign * context.travel[:, effect.term.joint]
    first = np.flatnonzero(context.run == context.run[0])
    shape = beyond_base(context, effect)[first]
    variance = np.einsum("mi,ij,mj->m", shape, covariance, shape)
    points = np.column_stack(
        [at[first], direction[first], shape @ coefficients, np.sqrt(np.maximum(variance, 0.0))]
    )
    points = _each_once(points)
    points = points[
        np.unique(np.linspace(0, len(points) - 1, min(len(points), MOST_POINTS)).astype(np.int64))
    ]
    return Curve(effect.joint.name, effect.joint.turns, *points.T)


def _each_once(points: Array) -> Array:
    """Points (m, k) in the order of their first number, those that come to the same once: several targets, touched
    where the axis stands still."""
    scale = np.abs(points).max(axis=0, initial=0.0)
    rounded = np.round(points / np.where(scale > 0.0, scale, 1.0), SAME_DIGITS)
    _, once = np.unique(rounded, axis=0, return_index=True)
    return np.asarray(points[once])


def beyond_base(context: Context, effect: ChainEffect) -> Array:
    """The columns (n, k) of a shape without what the base has already, which is no part of the shape: a constant, and
    a slope where a linear axis shifts something (its gain, a squareness)."""
    has_slope = not effect.joint.turns and not effect.term.is_rotation
    return without_powers(context, effect, (0, 1) if has_slope else (0,))


def without_powers(context: Context, effect: ChainEffect, powers: Sequence[int]) -> Array:
    """The columns (n, k) of a shape without powers of the position of its axis."""
    columns, at = (
        effect.shape.columns(context, effect.term.joint),
        context.places[:, effect.term.joint],
    )
    plain = np.power(at[:, None], np.asarray(powers, dtype=np.int64))
    return np.asarray(columns - plain @ np.linalg.lstsq(plain, columns, rcond=None)[0])


def follows(
    context: Context, effect: ChainEffect, coefficients: Array, covariance: Array
) -> frozenset[Follows]:
    """Return what an effect of free shape with coefficients (k,) follows: what its parts of that kind make together,
    where it is largest, is beyond twice its standard uncertainty."""
    assert isinstance(effect.shape, Free)
    columns, kinds = beyond_base(context, effect), effect.shape.following(context, effect.term.joint)
    shown = []
    for kind in Follows:
        of_kind = kinds == kind
        sizes = columns[:, of_kind] @ coefficients[of_kind]
        row = columns[int(np.abs(sizes).argmax()), of_kind]
        variance = float(row @ covariance[np.ix_(of_kind, of_kind)] @ row)
        if float(np.abs(sizes).max()) > SEEN * np.sqrt(max(variance, 0.0)):
            shown.append(kind)
    return frozenset(shown)
