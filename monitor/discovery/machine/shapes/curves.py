"""The curve of an effect whose shape the catalogue does not have: its size where the axis stood, with its band."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.discovery.machine.scene import MachineEffect
from monitor.effects import ChainEffect, Context
from monitor.records import Array

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
    rows = first[np.argsort(at[first], kind="stable")]
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MOST_POINTS)).astype(np.int64))]
    shape = beyond_base(context, effect)[rows]
    variance = np.einsum("mi,ij,mj->m", shape, covariance, shape)
    return Curve(
        effect.joint.name,
        effect.joint.turns,
        at[rows],
        direction[rows],
        shape @ coefficients,
        np.sqrt(np.maximum(variance, 0.0)),
    )


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
