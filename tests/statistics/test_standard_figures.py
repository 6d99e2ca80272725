"""ISO 230-2:2014 and ISO 230-4:2005, clause 3: by hand, by closed forms, and by a plain computation of this file."""

from __future__ import annotations

import statistics

import numpy as np
import pytest

from monitor.approach import directions_of_approach
from monitor.exceptions import InputError
from monitor.statistics.standards.circles import circles
from monitor.statistics.standards.positioning import positioning

NOISE, GAIN = 0.4, 1e-3


def series(rng: np.random.Generator, *, runs: int = 5, noise: float = NOISE) -> tuple[np.ndarray, np.ndarray]:
    """Eleven targets there and back: a bent line, a reversal that grows along the axis."""
    targets = np.linspace(0.0, 500.0, 11)
    position, deviation = [], []
    for _ in range(runs):
        for way in (1, -1):
            places = targets[::way]
            position.append(places)
            systematic = 4.0 * np.sin(places / 120.0) + way * (0.5 + places / 1000.0)
            deviation.append(systematic + rng.normal(0.0, noise, 11))
    return np.concatenate(position), np.concatenate(deviation)


def test_iso_230_2_by_hand() -> None:
    """Two targets, two runs: forward 1, 3 and 5, 9; backward 0, 2 and 4, 4 (µm)."""
    position = np.array([0, 10, 10, 0, 0, 10, 10, 0], dtype=float)
    deviation = np.array([1, 5, 4, 0, 3, 9, 4, 2], dtype=float)
    answer = positioning(
        position, deviation, tolerance=0.1, u_reading=0.1, u_gain=0.0, rng=np.random.default_rng(1)
    )
    np.testing.assert_array_equal(answer.mean, [[2, 7], [1, 4]])
    root = np.sqrt(2.0)
    np.testing.assert_allclose(answer.deviation, [[root, 2 * root], [root, 0]])
    figures = answer.figures
    assert (figures.reversal, figures.mean_reversal) == (3.0, 2.0)
    assert figures.repeatability_forward == pytest.approx(8 * root)
    # Target 2: 2 s + 2 s + |B| = 4 sqrt 2 + 3; R forward = 8 sqrt 2 is more. Target 1: 4 sqrt 2 + 1.
    assert figures.repeatability == pytest.approx(max(8 * root, 4 * root + 3))
    assert (figures.systematic, figures.systematic_forward, figures.systematic_backward) == (6.0, 5.0, 3.0)
    assert figures.mean_deviation == 5.5 - 1.5
    assert figures.accuracy == pytest.approx((7 + 4 * root) - (1 - 2 * root))


def test_iso_230_2_against_a_plain_computation() -> None:
    position, deviation = series(np.random.default_rng(4))
    answer = positioning(
        position, deviation, tolerance=0.1, u_reading=0.1, u_gain=0.0, rng=np.random.default_rng(1)
    ).figures
    table = deviation.reshape(5, 2, 11)
    table[:, 1] = table[:, 1, ::-1]
    mean, s = table.mean(axis=0), table.std(axis=0, ddof=1)
    reversal = [mean[0, i] - mean[1, i] for i in range(11)]
    repeat = [max(2 * s[0, i] + 2 * s[1, i] + abs(reversal[i]), 4 * s[0, i], 4 * s[1, i]) for i in range(11)]
    assert answer.reversal == pytest.approx(max(map(abs, reversal)), rel=1e-12)
    assert answer.mean_reversal == pytest.approx(sum(reversal) / 11, rel=1e-12)
    assert answer.repeatability == pytest.approx(max(repeat), rel=1e-12)
    assert answer.accuracy == pytest.approx((mean + 2 * s).max() - (mean - 2 * s).min(), rel=1e-12)
    assert answer.systematic == pytest.approx(mean.max() - mean.min(), rel=1e-12)
    middle = mean.mean(axis=0)
    assert answer.mean_deviation == pytest.approx(middle.max() - middle.min(), rel=1e-12)


def test_a_repeated_position_was_approached_from_beyond() -> None:
    np.testing.assert_array_equal(
        directions_of_approach(np.array([0.0, 1, 2, 2, 1, 0, 0, 1])), [1, 1, 1, -1, -1, -1, 1, 1]
    )


def test_a_unidirectional_test_begins_each_run_in_its_direction() -> None:
    """The axis returns without a reading; by the step alone its first target was approached from the other side."""
    targets = np.linspace(0.0, 200.0, 5)
    position = np.tile(targets, 4)
    np.testing.assert_array_equal(directions_of_approach(position), np.ones(20))
    np.testing.assert_array_equal(directions_of_approach(position[::-1]), -np.ones(20))
    deviation = np.random.default_rng(3).normal(0.0, 1.0, 20)
    answer = positioning(
        position, deviation, tolerance=0.1, u_reading=0.1, u_gain=0.0, rng=np.random.default_rng(1)
    )
    s = [statistics.stdev(deviation[index::5]) for index in range(5)]
    mean = [statistics.fmean(deviation[index::5]) for index in range(5)]
    assert answer.figures.repeatability_forward == pytest.approx(4.0 * max(s), rel=1e-12)
    high, low = ([m + sign * 2.0 * each for m, each in zip(mean, s, strict=True)] for sign in (1.0, -1.0))
    assert answer.figures.accuracy_forward == pytest.approx(max(high) - min(low), rel=1e-12)
    assert np.isnan([answer.figures.reversal, answer.figures.repeatability_backward]).all()


@pytest.mark.parametrize(
    "position",
    [[0, 300, 60, 240, 120, 180, 0, 300], [0, 2, 0, 2, 1], [0, 500, 1000, 0, 1000, 0, 1000, 500, 0]],
)
def test_a_jump_that_is_no_return_between_runs_is_an_approach(position: list[int]) -> None:
    approached = directions_of_approach(np.array(position, dtype=float))
    np.testing.assert_array_equal(approached[1:], np.sign(np.diff(position)))


def test_a_reading_that_is_missing_turns_no_direction() -> None:
    """Forward to 4 and back, with 2 missing on the way back, then with the far end read once."""
    np.testing.assert_array_equal(
        directions_of_approach(np.array([0.0, 1, 2, 3, 4, 4, 3, 1, 0])), [1, 1, 1, 1, 1, -1, -1, -1, -1]
    )
    np.testing.assert_array_equal(
        directions_of_approach(np.array([0.0, 1, 2, 4, 3, 2, 1, 0])), [1, 1, 1, 1, -1, -1, -1, -1]
    )


def test_figures_need_what_they_compare() -> None:
    """One direction only: no reversal, no bi-directional figure, and no uncertainty of what there is not."""
    position = np.linspace(0.0, 100.0, 6)
    answer = positioning(
        position, position * 1e-3, tolerance=0.1, u_reading=0.1, u_gain=0.0, rng=np.random.default_rng(1)
    )
    assert np.isnan([answer.figures.reversal, answer.figures.accuracy, answer.u["accuracy"]]).all()
    assert answer.figures.systematic_forward == pytest.approx(0.1)


def test_the_uncertainties_are_the_scatter_of_tests_made_again() -> None:
    """Over 100 tests the standard deviation of each figure is known to 7 %, the bootstrap's median to a few more."""
    stated: dict[str, list[float]] = {
        "mean_reversal": [],
        "systematic": [],
        "mean_deviation": [],
        "accuracy": [],
    }
    values: dict[str, list[float]] = {name: [] for name in stated}
    for seed in range(100):
        rng = np.random.default_rng(seed)
        position, deviation = series(rng)
        deviation = deviation + rng.normal(0.0, GAIN) * position
        answer = positioning(position, deviation, tolerance=0.1, u_reading=0.4, u_gain=GAIN, rng=rng)
        for name in stated:
            stated[name].append(answer.u[name])
            values[name].append(getattr(answer.figures, name))
    ratio = {name: float(np.median(stated[name]) / np.std(values[name])) for name in stated}
    assert all(0.8 < value < 1.25 for value in ratio.values()), ratio


ANGLES = np.deg2rad(np.concatenate([np.arange(0.0, 359.0, 2.0), np.arange(358.0, -1.0, -2.0)]))
SENSE = np.repeat([1.0, -1.0], 180)
RADIUS = 150e3


def evaluated(deviation: np.ndarray, angles: np.ndarray = ANGLES) -> object:
    """The circle's figures in µm without noise; the centre lies 12 and -7 µm off."""
    eccentric = deviation + 12.0 * np.cos(angles) - 7.0 * np.sin(angles)
    return circles(angles, eccentric, u_reading=0.0, u_radius=0.3, rng=np.random.default_rng(1))


def test_iso_230_4_squareness_makes_g_of_alpha_times_r() -> None:
    """x' = x - alpha y: dR = -alpha R sin(2 theta) / 2 has the range alpha R; so has its minimum zone."""
    answer = evaluated(-40e-6 * RADIUS * 0.5 * np.sin(2.0 * ANGLES))
    assert answer.circular[1] == pytest.approx(6.0, rel=2e-3)
    assert answer.minimum_zone[1] == pytest.approx(6.0, rel=2e-3)
    assert answer.both == pytest.approx(6.0, rel=2e-3)
    assert answer.hysteresis == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(answer.centre, [12.0, -7.0], atol=1e-9)


def test_iso_230_4_scale_mismatch_and_radius() -> None:
    """Gains of 30 and -10 µm/m of X and Y: dR = R (gx cos^2 + gy sin^2), of range 6 µm between 4.5 and -1.5."""
    answer = evaluated(RADIUS * (30e-6 * np.cos(ANGLES) ** 2 - 10e-6 * np.sin(ANGLES) ** 2))
    assert (answer.largest[1], answer.smallest[-1]) == pytest.approx((4.5, -1.5), abs=1e-9)
    assert answer.circular[-1] == pytest.approx(6.0, abs=1e-9)
    assert answer.u["Fmax1"] == pytest.approx(0.3)


def test_iso_230_4_a_radius_that_depends_on_the_sense_is_hysteresis() -> None:
    answer = evaluated(1.5 * SENSE + 2.0 * np.cos(3.0 * ANGLES))
    assert answer.hysteresis == pytest.approx(3.0, abs=1e-2)
    assert answer.circular[1] == pytest.approx(4.0, abs=1e-2)
    assert answer.both == pytest.approx(7.0, abs=2e-2)


def test_hysteresis_is_of_what_both_senses_passed() -> None:
    """An oval of 10 um read over a whole turn and back over 220 degrees: across the rest the one sense has no path."""
    there, back = np.arange(0.0, 359.0, 2.0), np.arange(220.0, -1.0, -2.0)
    angles = np.deg2rad(np.concatenate([there, back]))
    answer = evaluated(10.0 * np.cos(2.0 * angles), angles)
    assert answer.hysteresis == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("points", [720, 730, 1080])
def test_hysteresis_of_turns_that_overlap_does_not_hang_on_the_jitter_of_their_angles(points: int) -> None:
    """Two to three turns in each sense, whose stops lie 0.01 degrees beside each other, and 4 um up and down between
    the senses over 20 degrees."""
    rng = np.random.default_rng(points)
    there = np.deg2rad(np.arange(points))
    angles = np.concatenate([there, there[-1] + np.deg2rad(0.5) - there])
    angles += np.deg2rad(0.01) * rng.standard_normal(2 * points)
    sense = np.repeat([1.0, -1.0], points)
    apart = np.where(np.abs(np.degrees(angles) % 360.0 - 100.0) < 10.0, 4.0 * sense, 0.0)
    answer = evaluated(apart + 0.01 * rng.standard_normal(2 * points), angles)
    assert answer.hysteresis == pytest.approx(8.0, abs=0.1)


def test_the_minimum_zone_is_no_wider_than_the_least_squares_zone_and_both_hold_the_path() -> None:
    """A spike on one side: the minimum-zone centre moves towards it (linear programme against a grid of centres)."""
    angles = ANGLES[:180]
    path = np.where(np.abs(angles - 1.0) < 0.3, 5.0, 0.0)
    answer = circles(angles, path, u_reading=0.0, u_radius=0.0, rng=np.random.default_rng(1))
    grid = np.linspace(-3.0, 3.0, 121)
    x, y = np.meshgrid(grid, grid)
    shifted = path - x[..., None] * np.cos(angles) - y[..., None] * np.sin(angles)
    best = float(np.ptp(shifted, axis=-1).min())
    assert answer.minimum_zone[1] == pytest.approx(best, abs=0.05)
    assert answer.minimum_zone[1] < answer.circular[1]


def test_a_short_arc_is_refused() -> None:
    with pytest.raises(InputError, match="needs 12 points and half a turn in each sense"):
        evaluated(np.zeros(40), np.linspace(0.0, 2.0, 40))
