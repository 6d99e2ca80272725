"""ISO 230-7: error motions against least-squares circles of scipy and plain loops."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from monitor.exceptions import InputError
from monitor.statistics.standards.rotation import error_motion

ANGLES = np.deg2rad(np.arange(0.0, 360.0, 10.0))


def evaluated(
    angle: np.ndarray, deviation: np.ndarray, *, about_circle: bool = True, u: float = 1e-4
) -> object:
    return error_motion(
        angle, deviation, about_circle=about_circle, tolerance=1e-4, u_reading=u, rng=np.random.default_rng(1)
    )


def test_iso_230_7_against_a_true_circle_and_plain_loops() -> None:
    """The circle is that of scipy around points at 50 mm; the eccentricity of 20 µm makes 4 nm of second order."""
    rng = np.random.default_rng(3)
    angle = np.concatenate([ANGLES, ANGLES, ANGLES])
    motion = 3e-3 * np.cos(2.0 * angle) + 1e-3 * np.sin(5.0 * angle) + rng.normal(0.0, 4e-4, len(angle))
    deviation = motion + 20e-3 * np.cos(angle - 1.0) + 7e-3
    points = (50.0 + deviation)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    circle = scipy.optimize.least_squares(
        lambda c: np.hypot(points[:, 0] - c[0], points[:, 1] - c[1]) - c[2],
        [0.0, 0.0, 50.0],
        xtol=1e-15,
        ftol=1e-15,
    ).x
    about = np.hypot(points[:, 0] - circle[0], points[:, 1] - circle[1]) - circle[2]
    result = evaluated(angle, deviation)
    assert result.total == pytest.approx(about.max() - about.min(), abs=2e-5)
    means, widths = [], []
    for place in range(len(ANGLES)):
        at = about[place :: len(ANGLES)]
        means.append(sum(at) / 3.0)
        widths.append(max(at) - min(at))
    assert result.synchronous == pytest.approx(max(means) - min(means), abs=2e-5)
    assert result.asynchronous == pytest.approx(max(widths), abs=2e-5)
    assert result.revolutions == 3
    np.testing.assert_allclose(result.synchronous_at, means, atol=2e-5)


def test_iso_230_7_what_moves_once_a_revolution_is_axial_error_motion_and_radial_eccentricity() -> None:
    deviation = 5e-3 * np.sin(ANGLES)
    assert evaluated(ANGLES, deviation, about_circle=False).total == pytest.approx(9.962e-3, abs=5e-5)
    assert evaluated(ANGLES, deviation).total == pytest.approx(0.0, abs=1e-12)


def test_one_revolution_has_no_asynchronous_error_motion() -> None:
    result = evaluated(ANGLES, np.cos(3.0 * ANGLES))
    assert np.isnan(result.asynchronous)
    assert result.total == result.synchronous


def test_the_uncertainties_are_the_scatter_of_tests_made_again() -> None:
    rng = np.random.default_rng(5)
    angle = np.concatenate([ANGLES, ANGLES])
    motion = 3e-3 * np.cos(2.0 * angle)
    again = [evaluated(angle, motion + rng.normal(0.0, 1e-4, len(angle))) for _ in range(150)]
    for name in ("total", "synchronous", "asynchronous"):
        scatter = np.std([getattr(result, name) for result in again])
        ratio = np.mean([result.u[name] for result in again]) / scatter
        # The scatter of 150 tests is known to 6 %. Draws are laid on readings that have noise already: where the width
        # at one angle is nothing but noise, u is up to half too large, never too small.
        assert 0.75 < ratio < (1.6 if name == "asynchronous" else 1.35)


@pytest.mark.parametrize(
    ("angles", "words"),
    [(ANGLES[::6], "here are 6, with a gap of 60"), (ANGLES[:20], "here are 20, with a gap of 170")],
)
def test_too_little_of_a_revolution_is_refused(angles: np.ndarray, words: str) -> None:
    with pytest.raises(InputError, match=words):
        evaluated(angles, np.zeros(len(angles)))
