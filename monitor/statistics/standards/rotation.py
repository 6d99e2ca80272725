"""Error motions of an axis of rotation as ISO 230-7:2015 (clause 3, definitions) evaluates them.

Total is all that the indicator shows beside the artefact's place, synchronous what repeats with every revolution (the
mean at each angle), asynchronous what does not: the largest width at one angle. Radial and tilt error motions are about
the least-squares circle, which takes out the eccentricity of the artefact; axial ones about the centre of the chart, so
that what moves once a revolution along the axis counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import InputError
from monitor.records import Array

#: A least-squares circle has three unknowns; fewer angles than this say nothing of what is left.
FEWEST_ANGLES = 8
#: Draws for the uncertainties: the standard deviation of so many is known to 2 %.
DRAWS = 1000


@dataclass(frozen=True)
class ErrorMotion:
    """The values of an error motion in the unit of its deviations, with standard uncertainties ``u`` by their names.

    ``asynchronous`` is NaN where some angle was read once. ``angles`` (k,) rad from 0 to 2 pi and ``synchronous_at``
    (k,) are what a polar plot shows; ``revolutions`` are the fewest readings at one angle. The noise of readings that
    makes u is laid on readings that have it already: of a width that is nothing but noise u is up to half too large.
    """

    total: float
    synchronous: float
    asynchronous: float
    revolutions: int
    angles: Array
    synchronous_at: Array
    u: dict[str, float]


def error_motion(
    angle: Array,
    deviation: Array,
    *,
    about_circle: bool,
    tolerance: float,
    u_reading: float,
    rng: np.random.Generator,
) -> ErrorMotion:
    """The error motion of deviations (n,) at angles (n,) rad, in the order of measuring.

    ``about_circle`` takes out what moves once a revolution; angles within ``tolerance`` rad are one. ``u_reading`` is
    the standard uncertainty of a deviation. Raises InputError for fewer than 8 angles, or less than a revolution.
    """
    target, angles = _targets(angle, tolerance)
    gap = float(np.diff(angles, append=angles[:1] + 2.0 * np.pi).max())
    if len(angles) < FEWEST_ANGLES or gap > np.pi / 2.0:
        raise InputError(
            f"an error motion needs {FEWEST_ANGLES} angles all around; here are {len(angles)}, with a gap of "
            f"{np.degrees(gap):.0f} degrees"
        )
    columns = [np.ones_like(angle), *([np.cos(angle), np.sin(angle)] if about_circle else [])]
    fit = np.column_stack(columns)
    without = np.eye(len(angle)) - fit @ np.linalg.pinv(fit)
    figures, synchronous = _figures(deviation[None, :] @ without, target, len(angles))
    drawn = deviation + u_reading * rng.standard_normal((DRAWS, len(deviation)))
    again, _ = _figures(drawn @ without, target, len(angles))
    value = {name: float(values[0]) for name, values in figures.items()}
    return ErrorMotion(
        **value,
        revolutions=int(np.bincount(target).min()),
        angles=angles,
        synchronous_at=synchronous[0],
        u={name: float(np.std(values)) for name, values in again.items()},
    )


def _targets(angle: Array, tolerance: float) -> tuple[npt.NDArray[np.int64], Array]:
    """The index (n,) of each row's angle, and the angles (k,) from 0 to 2 pi."""
    whole = np.mod(angle + tolerance, 2.0 * np.pi) - tolerance
    order = np.argsort(whole, kind="stable")
    begins = np.concatenate([[True], np.diff(whole[order]) > tolerance])
    target = np.empty(len(angle), dtype=np.int64)
    target[order] = np.cumsum(begins) - 1
    return target, np.asarray(np.bincount(target, weights=whole) / np.bincount(target))


def _figures(motion: Array, target: npt.NDArray[np.int64], count: int) -> tuple[dict[str, Array], Array]:
    """Every value (B,) of deviations (B, n) without the artefact's place, and their means (B, k) at each angle."""
    groups = [motion[:, target == index] for index in range(count)]
    means = np.stack([group.mean(axis=1) for group in groups], axis=1)
    alone = any(group.shape[1] < 2 for group in groups)
    widths = np.stack([np.ptp(group, axis=1) for group in groups], axis=1)
    return {
        "total": np.ptp(motion, axis=1),
        "synchronous": np.ptp(means, axis=1),
        "asynchronous": np.full(len(motion), np.nan) if alone else widths.max(axis=1),
    }, means
