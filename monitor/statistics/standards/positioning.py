"""Accuracy and repeatability of positioning along an axis, as ISO 230-2:2014 (clause 3) defines its terms.

With deviations x_ij of run j at target i, approached in the positive or negative direction: mean deviations, reversal,
repeatability and accuracy, with the standard uncertainty that each has by the scatter of the readings and by a gain
that is known only so well (ISO 230-2, annex A names both; thermal contributions are the user's). ISO 230-6:2002
(clause 3) uses the same terms along a diagonal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from monitor.approach import directions_of_approach, targets_of
from monitor.records import Array

#: Runs in each direction that ISO 230-2, 5.3.2 asks for up to 2 m of travel.
USUAL_RUNS = 5
#: Draws for the uncertainties: the standard deviation of so many is known to 2 %.
DRAWS = 1000


@dataclass(frozen=True)
class AxisFigures:
    """The figures of one axis by the names of ISO 230-2, in the unit of the deviations.

    ``forward`` and ``backward`` are the two directions of approach. NaN is what needs both directions, or two runs in
    each, and does not have them.
    """

    reversal: float
    mean_reversal: float
    repeatability_forward: float
    repeatability_backward: float
    repeatability: float
    systematic_forward: float
    systematic_backward: float
    systematic: float
    mean_deviation: float
    accuracy_forward: float
    accuracy_backward: float
    accuracy: float


@dataclass(frozen=True)
class Positioning:
    """Targets (m,), means (2, m) and standard deviations (2, m) of the deviations in both directions, their numbers
    (2, m), the figures of the axis, and the standard uncertainty of each figure by its name."""

    targets: Array
    mean: Array
    deviation: Array
    runs: npt.NDArray[np.int64]
    figures: AxisFigures
    u: Mapping[str, float]


def figures_of(mean: Array, deviation: Array) -> dict[str, Array]:
    """Every figure (...,) of means and standard deviations (..., 2, m); NaN where a direction or a scatter is missing.

    ISO 230-2:2014, clause 3: B_i = x_i(forward) - x_i(backward), R_i(forward) = 4 s_i,
    R_i = max(2 s_i(forward) + 2 s_i(backward) + |B_i|, R_i(forward), R_i(backward)), E the range of the means,
    M that of the bi-directional means, A the range of mean + 2 s and mean - 2 s.
    """
    forward, backward = mean[..., 0, :], mean[..., 1, :]
    s_forward, s_backward = deviation[..., 0, :], deviation[..., 1, :]
    reversal = forward - backward
    together = 2.0 * s_forward + 2.0 * s_backward + np.abs(reversal)
    repeatability = np.maximum(np.maximum(together, 4.0 * s_forward), 4.0 * s_backward)
    high, low = mean + 2.0 * deviation, mean - 2.0 * deviation
    middle = 0.5 * (forward + backward)
    return {
        "reversal": np.max(np.abs(reversal), axis=-1),
        "mean_reversal": np.mean(reversal, axis=-1),
        "repeatability_forward": np.max(4.0 * s_forward, axis=-1),
        "repeatability_backward": np.max(4.0 * s_backward, axis=-1),
        "repeatability": np.max(repeatability, axis=-1),
        "systematic_forward": np.ptp(forward, axis=-1),
        "systematic_backward": np.ptp(backward, axis=-1),
        "systematic": np.ptp(mean.reshape(*mean.shape[:-2], -1), axis=-1),
        "mean_deviation": np.ptp(middle, axis=-1),
        "accuracy_forward": np.max(high[..., 0, :], axis=-1) - np.min(low[..., 0, :], axis=-1),
        "accuracy_backward": np.max(high[..., 1, :], axis=-1) - np.min(low[..., 1, :], axis=-1),
        "accuracy": np.max(high, axis=(-2, -1)) - np.min(low, axis=(-2, -1)),
    }


def positioning(
    position: Array,
    deviation: Array,
    *,
    tolerance: float,
    u_reading: float,
    u_gain: float,
    rng: np.random.Generator,
) -> Positioning:
    """The figures of deviations (n,) at positions (n,), in the order of measuring.

    Positions within ``tolerance`` are one target. ``u_reading`` is the stated standard uncertainty of a reading, which
    stands for the scatter where a target was measured once in a direction; ``u_gain`` that of the instrument's unit,
    per unit of position. Standard uncertainties are those of the whole test made again (a parametric bootstrap:
    means and scatter drawn anew from those that were measured). Raises InputError for fewer than two targets.
    """
    target = targets_of(position, tolerance)
    count = int(target.max()) + 1
    targets = np.bincount(target, weights=position) / np.bincount(target)
    direction = directions_of_approach(targets[target])
    runs = np.zeros((2, count), dtype=np.int64)
    mean, scatter = np.full((2, count), np.nan), np.full((2, count), np.nan)
    for side, sign in enumerate((1, -1)):
        for index in range(count):
            values = deviation[(target == index) & (direction == sign)]
            runs[side, index] = len(values)
            mean[side, index] = values.mean() if len(values) else np.nan
            scatter[side, index] = values.std(ddof=1) if len(values) > 1 else np.nan
    figures = AxisFigures(**{name: float(value) for name, value in figures_of(mean, scatter).items()})
    u = _uncertainties(targets, mean, np.where(np.isnan(scatter), u_reading, scatter), runs, u_gain, rng)
    usable = {
        field.name: u[field.name] if np.isfinite(getattr(figures, field.name)) else np.nan
        for field in fields(figures)
    }
    return Positioning(targets, mean, scatter, runs, figures, usable)


def _uncertainties(
    targets: Array,
    mean: Array,
    scatter: Array,
    runs: npt.NDArray[np.int64],
    u_gain: float,
    rng: np.random.Generator,
) -> dict[str, float]:
    """The standard deviation of each figure over tests made again."""
    freedom = np.maximum(runs - 1, 1)
    shape = (DRAWS, *mean.shape)
    means = mean + rng.standard_normal(shape) * scatter / np.sqrt(np.maximum(runs, 1))
    means = means + rng.standard_normal((DRAWS, 1, 1)) * u_gain * (targets - targets.mean())
    scatters = scatter * np.sqrt(rng.chisquare(freedom, shape) / freedom)
    return {name: float(np.std(values)) for name, values in figures_of(means, scatters).items()}
