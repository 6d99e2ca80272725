"""Deviations of a tool point that should stay at a point of the work while axes move together, as ISO 10791-6 reports
them: the range of the readings in each direction.

Nothing is taken out of the readings but where they begin: what moves once a turn is the place of the rotary axis, which
such a test is for. No text of the standard was at hand (see ``methods.instruments.interpolation_tests``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.records import Array

#: Draws for the uncertainties: the standard deviation of so many is known to 2 %.
DRAWS = 1000


@dataclass(frozen=True)
class Followed:
    """The range of the deviations in one direction, in their unit: of all rows, and of those in which the rotary axis
    turned up (``forward``) or down (``backward``), NaN where it did not; ``u`` by these names."""

    whole: float
    forward: float
    backward: float
    u: Mapping[str, float]


def followed(angle: Array, deviation: Array, *, u_reading: float, rng: np.random.Generator) -> Followed:
    """The ranges of deviations (n,) at angles (n,) rad, in the order of measuring.

    ``u_reading`` is the standard uncertainty of a deviation; u of a range is its standard deviation over tests made
    again. Noise makes a range larger, and u does not correct that.
    """
    rows = _senses(angle)
    drawn = deviation + u_reading * rng.standard_normal((DRAWS, len(deviation)))
    value = {
        name: float(np.ptp(deviation[mine])) if mine.sum() > 1 else np.nan for name, mine in rows.items()
    }
    u = {
        name: float(np.std(np.ptp(drawn[:, mine], axis=1))) if mine.sum() > 1 else np.nan
        for name, mine in rows.items()
    }
    return Followed(**value, u=u)


def _senses(angle: Array) -> dict[str, npt.NDArray[np.bool_]]:
    """The rows (n,) of each sense. A row was reached in the sense of the step before it; the first one is where the
    next step begins, and where the axis turns back the end is a row of both."""
    step = np.sign(np.round(np.diff(angle), 9))
    before, behind = np.concatenate([step[:1], step]), np.concatenate([step, step[-1:]])
    return {
        "whole": np.ones(len(angle), dtype=bool),
        "forward": (before > 0) | (behind > 0),
        "backward": (before < 0) | (behind < 0),
    }
