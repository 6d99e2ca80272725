"""Serial machines that are no elbow robots, effects that cancel, and poses to which a run comes back."""

from __future__ import annotations

import importlib
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
import scipy
from scipy.spatial.transform import Rotation

from monitor.discovery import Verdict, compare, explain, fit
from monitor.discovery.machine.shapes.refine import counts_readings
from monitor.discovery.machine.sizes import largest_deviation
from monitor.discovery.search.plausible import LARGEST_RATIO
from monitor.effects import parse_effect
from monitor.methods.model import Model
from monitor.methods.tracker.method import METHOD as tracker
from monitor.readers import read_campaign
from monitor.workflow.explain.machine_answer import machine_explanation


@pytest.fixture(scope="module")
def machines(simulator: ModuleType) -> ModuleType:
    """The simulator of serial machines seen by a tracker."""
    return importlib.import_module(f"{simulator.__name__}.tracked_machine")


@pytest.fixture(scope="module")
def robots(simulator: ModuleType) -> ModuleType:
    """The simulator of tracked robots."""
    return importlib.import_module(f"{simulator.__name__}.robot_campaign")


def explained(folder):
    campaign = read_campaign(folder)
    return explain(campaign, tracker.problem_of(campaign), "tracker", rng=np.random.default_rng(1))


@pytest.mark.parametrize(
    ("name", "joint", "effect"),
    [("scara", "J2", "ECJ2:harmonic2"), ("pan and tilt", "P", "ECP:harmonic2")],
)
def test_a_harmonic_of_a_machine_with_few_axes(machines, tmp_path, name, joint, effect):
    scene = machines.Scene(along={joint: lambda q: 3e-4 * np.cos(2.0 * q - 1.0)})
    axes = machines.MACHINES[name]
    answer = explained(machines.write(tmp_path / "m", axes, np.random.default_rng(3), scene, poses=100))
    assert [finding.effect for finding in answer.missing] == [effect]
    assert abs(answer.missing[0].amplitude - 3e-4) < 4.0 * answer.missing[0].u


def test_one_turning_axis_with_nothing_hidden(machines, tmp_path):
    """The frame may turn about such an axis and shift along it: four of its unknowns and the reflectors' have none."""
    axes = machines.MACHINES["one turning axis"]
    answer = explained(machines.write(tmp_path / "m", axes, np.random.default_rng(3), poses=60))
    assert answer.missing == ()
    assert answer.comparison.verdict is Verdict.EXPLAINED


@pytest.mark.parametrize("offset", [0.0, 0.1, 5.0])
def test_axes_that_nearly_meet_have_a_first_guess(machines, tmp_path, offset):
    pan, tilt = machines.MACHINES["pan and tilt"]
    axes = (pan, replace(tilt, offset=(offset, 0.0, 0.0)))
    campaign = read_campaign(machines.write(tmp_path / "m", axes, np.random.default_rng(1), poses=60))
    assert fit(tracker.problem_of(campaign)).rms == pytest.approx(15e-3, rel=0.15)


def test_two_large_shifts_that_cancel_are_no_findings(robots, tmp_path):
    """Shifts of 54 mm with gravity, one against the other, leave what 1 mrad between their axes makes of them."""
    hidden = robots.Hidden(hanging={"J5": 54.0, "J6": -54.0})
    track = robots.track(np.random.default_rng(5), hidden, poses=150)
    answer = explained(robots.write_tracked(tmp_path / "robot", track))
    assert answer.missing
    for finding in answer.missing:
        removed = np.sqrt(finding.rms_before**2 - finding.rms_after**2)
        assert finding.peak < LARGEST_RATIO * removed
        assert finding.peak < 0.5
    assert answer.final.scale == pytest.approx(1.0, abs=0.05)


def test_weights_of_links_are_one_angle_and_what_remains_is_said(robots, tmp_path):
    hidden = robots.Hidden(compliance={"J2": 4e-4})
    track = robots.track(np.random.default_rng(2), hidden, poses=100, fixed_every=10)
    campaign = read_campaign(robots.write_tracked(tmp_path / "robot", track))
    problem = tracker.problem_of(campaign)
    answer = explain(campaign, problem, "tracker", rng=np.random.default_rng(1))
    document = machine_explanation(answer)
    remaining = document.remaining
    assert remaining is not None
    assert remaining.deviation_um == pytest.approx(20.0, rel=0.1)
    fixed = np.isin(campaign.probings.target, ["F1", "F2"])
    rms = 1e3 * np.sqrt(np.mean(answer.final.vectors[fixed] ** 2))
    assert remaining.resting_rms_um == pytest.approx(rms)
    assert remaining.carried_rms_um == pytest.approx(
        1e3 * np.sqrt(np.mean(answer.final.vectors[~fixed] ** 2))
    )


@pytest.mark.parametrize(("step", "shared", "counts"), [(1.0, 1, True), (1.0, 3, True), (5.0, 1, False)])
def test_a_column_of_times_that_counts_is_no_time(machines, tmp_path, step, shared, counts):
    """The number of the row, or of the pose that three reflectors share; 5 s from row to row is a time."""
    axes = machines.MACHINES["pan and tilt"]
    campaign = read_campaign(machines.write(tmp_path / "m", axes, np.random.default_rng(1), poses=20))
    time = step * (np.arange(60) // shared)
    timed = replace(campaign, probings=replace(campaign.probings, time=time))
    assert counts_readings(tracker.problem_of(timed).context) is counts


def textbook_f(machines, folder, axes) -> tuple[float, int, int]:
    """F of lack of fit (Draper and Smith, section 2.1) of a machine of two turning axes by an own least squares: every
    small error of both axes, the frame and the place of the reflector; its degrees of freedom."""
    frames = importlib.import_module(machines.__name__.replace("tracked_machine", "robot")).frames
    rows = [line.split(",") for line in (folder / "probings.csv").read_text().splitlines()[1:]]
    angles = np.deg2rad(np.array([[float(cell) for cell in row[4:6]] for row in rows]))
    seen = np.array([[float(cell) for cell in row[6:9]] for row in rows])
    joints = [
        {"name": axis.name, "kind": axis.kind, "axis": axis.direction, "offset": axis.offset, "sign": 1}
        for axis in axes
    ]
    readings = {axis.name: angles[:, index] for index, axis in enumerate(axes)}

    def residual(unknowns):
        location = {axis.name: unknowns[6 * n : 6 * n + 6] for n, axis in enumerate(axes)}
        tool = frames(joints, readings, location)[-1]
        at = tool[:, :3, :3] @ unknowns[12:15] + tool[:, :3, 3]
        return (Rotation.from_rotvec(unknowns[15:18]).apply(at) + unknowns[18:21] - seen).reshape(-1)

    nominal = frames(joints, readings)[-1][:, :3, :3] @ np.array(machines.TARGETS["R1"])
    turn = Rotation.align_vectors(seen - seen.mean(axis=0), nominal - nominal.mean(axis=0))[0]
    start = np.concatenate([np.zeros(12), machines.TARGETS["R1"], turn.as_rotvec(), np.zeros(3)])
    start[18:] = seen.mean(axis=0) - turn.apply(nominal.mean(axis=0))
    best = scipy.optimize.least_squares(residual, start, x_scale="jac", xtol=1e-14, ftol=1e-14)
    rank = np.linalg.matrix_rank(best.jac / np.linalg.norm(best.jac, axis=0), tol=1e-5)
    poses, cell = np.unique(angles, axis=0, return_inverse=True)
    left = best.fun.reshape(-1, 3)
    mean = np.stack([left[cell.reshape(-1) == number].mean(axis=0) for number in range(len(poses))])
    pure = float(np.sum((left - mean[cell.reshape(-1)]) ** 2))
    pure_freedom = 3 * (len(left) - len(poses))
    freedom = left.size - rank - pure_freedom
    return (np.sum(left**2) - pure) / freedom / (pure / pure_freedom), freedom, pure_freedom


def test_lack_of_fit_of_one_run_that_came_back(machines, tmp_path):
    axes = machines.MACHINES["pan and tilt"]
    scene = machines.Scene(along={"P": lambda q: 1e-4 * np.cos(2.0 * q)})
    folder = machines.write(
        tmp_path / "m", axes, np.random.default_rng(8), scene, poses=30, visits=2, targets=("R1",)
    )
    f, freedom, pure_freedom = textbook_f(machines, folder, axes)
    test = compare(fit(tracker.problem_of(read_campaign(folder))), "m", "tracker").lack_of_fit
    assert (test.degrees_of_freedom, test.pure_error_degrees_of_freedom) == (freedom, pure_freedom)
    assert test.f == pytest.approx(f, rel=1e-3)
    assert test.p_value == pytest.approx(scipy.stats.f.sf(f, freedom, pure_freedom), rel=0.02)


def test_three_reflectors_of_a_visit_count_as_one(machines, tmp_path):
    axes = machines.MACHINES["pan and tilt"]
    folder = machines.write(tmp_path / "m", axes, np.random.default_rng(8), poses=30, visits=2)
    test = compare(fit(tracker.problem_of(read_campaign(folder))), "m", "tracker").lack_of_fit
    third = (test.degrees_of_freedom / 3.0, test.pure_error_degrees_of_freedom / 3.0)
    assert test.p_value == pytest.approx(scipy.stats.f.sf(test.f, *third))


def test_a_pose_that_is_not_left_shows_the_instrument_alone(machines, tmp_path):
    axes = machines.MACHINES["pan and tilt"]
    folder = machines.write(
        tmp_path / "m", axes, np.random.default_rng(8), poses=20, visits=1, targets=("R1", "R1", "R2")
    )
    assert compare(fit(tracker.problem_of(read_campaign(folder))), "m", "tracker").lack_of_fit is None


def test_link_weights_are_told_as_the_largest_angle(robots, tmp_path):
    """The coefficients are products of masses and softness, a different one a link; their effect is one angle."""
    track = robots.track(np.random.default_rng(2), robots.Hidden(), poses=60)
    problem = tracker.problem_of(
        read_campaign(robots.write_tracked(tmp_path / "robot", track)), Model("tracker")
    )
    columns = (
        parse_effect("EBJ5:compliance@link_weights", problem.context.chain).basis(problem.context).columns
    )
    coefficients = np.linspace(1e-7, 4e-7, columns.shape[1])
    angle = columns @ coefficients
    size, u = largest_deviation(columns, coefficients, 1e-16 * np.eye(len(coefficients)))
    assert size == pytest.approx(np.abs(angle - angle.mean()).max())
    worst = int(np.abs(angle - angle.mean()).argmax())
    assert u == pytest.approx(1e-8 * np.linalg.norm(columns[worst] - columns.mean(axis=0)))


@pytest.mark.parametrize(
    "length",
    [1500.0, pytest.param(3000.0, marks=pytest.mark.slow), pytest.param(6000.0, marks=pytest.mark.slow)],
)
def test_a_cycle_of_a_long_axis_is_on_the_grid(machines, tmp_path, length):
    """Steps of 1/800 per mm are of axes of 400 mm: over 3 m a wave between two of them is none of either."""
    axes = (
        machines.Axis("X", "linear", machines.X, (0.0, 0.0, 0.0), (0.0, length)),
        machines.Axis("Z", "linear", machines.Z, (0.0, 0.0, 0.0), (-500.0, 0.0)),
    )
    scene = machines.Scene(along={"X": lambda x: 0.02 * np.cos(2.0 * np.pi * x / 41.03 + 1.0)})
    (finding,) = explained(
        machines.write(tmp_path / "m", axes, np.random.default_rng(4), scene, poses=150)
    ).missing
    assert finding.effect.startswith("EXX:cyclic")
    assert abs(finding.searched.value - 41.03) < 4.0 * finding.searched.u
    assert abs(finding.amplitude - 0.02) < 4.0 * finding.u
