"""A search whose derivatives leave out products of errors ends where its steps are next to nothing, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.exceptions import NotConvergedError
from monitor.methods.chain.least_squares import Linearisation, solve

NUMBERS = 200


def _readings(step: float, left: float):
    """One number shows an unknown x as x - ``step``, four times as steeply by its derivative; the others are ``left``
    and grow by 0.01 x, of which their derivatives know nothing: the sum of squares falls where none of them says so."""

    def linearise(local: np.ndarray, common: np.ndarray) -> Linearisation:
        residual = left + 0.01 * np.repeat(local, NUMBERS, axis=1)
        residual[:, 0] = local[:, 0] - step
        derivatives = np.zeros((1, NUMBERS, 1))
        derivatives[0, 0, 0] = 4.0
        return Linearisation(local=derivatives, common=np.zeros((1, NUMBERS, 0)), residual=residual)

    return linearise


def test_a_step_of_a_hundredth_of_the_region_is_none() -> None:
    """0.03 of what the readings state, where they scatter twice that: 1.5 % of the radius of its region."""
    solution = solve(_readings(0.03, 2.0), np.zeros((1, 1)), np.zeros(0))
    assert abs(float(solution.local[0, 0])) < 0.03


@pytest.mark.parametrize(
    ("step", "left"),
    [
        pytest.param(0.9, 2.0, id="a step that counts"),
        pytest.param(0.03, 12.0, id="readings of another machine"),
    ],
)
def test_what_has_not_settled_is_refused(step: float, left: float) -> None:
    with pytest.raises(NotConvergedError, match="did not converge"):
        solve(_readings(step, left), np.zeros((1, 1)), np.zeros(0))


@pytest.mark.parametrize("padding", [0, 200])
@pytest.mark.parametrize("left", [8.0, 12.0])
def test_what_is_left_is_that_of_the_numbers_that_were_read(padding: int, left: float) -> None:
    """A search whose steps stop shrinking has settled where no more than ten standard deviations are left a number that
    was read, however many rows of zeros pad its run, and unknowns that stand twice count once."""
    rng = np.random.default_rng(11)
    columns = rng.standard_normal((60, 25)) @ rng.standard_normal((25, 25))
    remainder = rng.standard_normal((60, 1))
    remainder -= columns @ np.linalg.lstsq(columns, remainder, rcond=None)[0]
    remainder *= left * np.sqrt(60 - 25) / np.linalg.norm(remainder)
    calls = iter(range(100_000))

    def at(x: np.ndarray, y: np.ndarray) -> Linearisation:
        # Rounding: each evaluation is off by a ten-thousandth of a standard deviation, now here, now there.
        off = columns[:, 0] * (-1.0) ** next(calls) * 1e-4 / np.linalg.norm(columns[:, 0])
        residual = remainder[:, 0] + off + columns @ np.concatenate([x[0], y[:24] + y[24:]])
        derivatives = np.hstack([columns, columns[:, 1:]])
        residual, derivatives = (
            np.concatenate([read, np.zeros((padding, *read.shape[1:]))]) for read in (residual, derivatives)
        )
        return Linearisation(residual[None], derivatives[None, :, :1], derivatives[None, :, 1:])

    def solved() -> None:
        solve(at, np.zeros((1, 1)), np.zeros(48))

    if left < 10.0:
        solved()
        return
    with pytest.raises(NotConvergedError, match="did not converge in 50 steps"):
        solved()
