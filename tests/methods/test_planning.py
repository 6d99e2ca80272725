"""Expected uncertainties before anyone measures, and the best plans; trends after Los 2017, chapter 6."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from monitor.exceptions import DataError, InputError
from monitor.methods.chain.least_squares import solve
from monitor.methods.planning.candidates import STEP_RAD, Candidates, TimeModel, more_balls, pose_grid
from monitor.methods.planning.expected import sums_of
from monitor.methods.planning.search import _Search, best_plan, quickest_plan
from monitor.methods.planning.touches import candidate_touches, planned_context
from monitor.methods.samba.method import problem_of
from monitor.methods.samba.virtual import BALLS, BAR_LENGTH, ERRORS, GAINS, INDEXATIONS, virtual_campaign

BAR_ENDS = {"S1": (-150.0, BAR_LENGTH / 2, 60.0), "S2": (-150.0, -BAR_LENGTH / 2, 60.0)}
# Los 2017, section 6.5: seven pairs of B and C, the spindle not turned.
SEVEN = ((90, 270), (60, 180), (30, 90), (0, 0), (-90, -270), (-60, -180), (-30, -90))
TIME = TimeModel(60.0, 30.0, "test")


@pytest.fixture(scope="module")
def problem():
    """The problem of a virtual campaign of 20 runs with 1 µm noise."""
    return problem_of(virtual_campaign("v", np.random.default_rng(21)))


@pytest.fixture(scope="module")
def candidates_of(problem):
    """A function that makes candidates of poses in degrees (b, c, c1) and balls; the bar stands at the first zero."""
    chain = problem.context.chain
    one = replace(problem, distances=(replace(problem.distances[0], length=np.array([BAR_LENGTH])),))

    def make(poses, balls=None, *, bar=None, tip_known=False, strokes=None, bar_u=1.2e-3):
        places = {**(BALLS if balls is None else balls), **(bar or BAR_ENDS)}
        turned = np.zeros((len(poses), len(chain.joints)))
        for column, name in enumerate(("B", "C", "C1")):
            values = [pose[column] if column < len(pose) else 0 for pose in poses]
            turned[:, chain.index(name)] = chain.joint(name).sign * np.radians(values)
        mine = replace(one, distances=(replace(one.distances[0], standard_uncertainty=bar_u),))
        touches = candidate_touches(
            mine, turned, list(places), np.array(list(places.values())), strokes or {}, tip_known=tip_known
        )
        zero = int(np.flatnonzero(np.all(turned == 0.0, axis=1))[0])
        return Candidates(touches, tuple(range(len(places) - 2)), (zero,), TIME)

    return make


def _u(choice, name):
    """The expected standard uncertainty in µrad, µm or µm/m."""
    u = choice.expected.u[choice.expected.names.index(name)]
    return u / (1e-3 if name[1] in "XYZ" and "0" in name else 1e-6)


def _all(candidates, balls=None):
    return candidates.choice(tuple(range(len(candidates.touches.poses))), balls or candidates.balls)


def test_conventions_expected_uncertainties_of_the_five_day_plan(candidates_of):
    # "About", computed independently of the project (docs/conventions.md), with a bar of 1 µm.
    found = _all(candidates_of(INDEXATIONS, bar_u=1.0e-3))
    stated = {
        "EA0B": 1.9, "EC0B": 1.7, "EA0C": 2.0, "EB0C": 1.7, "EB0Z": 2.3, "EA0Y": 2.7, "EC0Y": 2.2, "EX0C": 0.28,
        "EX0C1": 0.33, "EY0C1": 0.36, "EXX": 6.2, "EYY": 5.7, "EZZ": 6.3,
    }  # fmt: skip
    for name, u in stated.items():
        assert _u(found, name) == pytest.approx(u, rel=0.05)


def test_two_ways_expected_covariance_is_that_of_the_least_squares(problem, candidates_of):
    found = _all(candidates_of(INDEXATIONS[:9]))
    touches = candidates_of(INDEXATIONS[:9]).touches
    pose, target = np.nonzero(found.touched)
    places = np.array([*BALLS.values(), *BAR_ENDS.values()])[target]
    names = [touches.targets[place] for place in target]
    context = planned_context(problem.context, touches.positions[pose, target], names, places, pose)
    planned = replace(
        problem,
        context=context,
        sigma=np.full((len(context), 3), touches.sigma),
        distances=(replace(problem.distances[0], length=np.array([BAR_LENGTH])),),
    )
    solution = solve(planned.linearise, planned.start, np.zeros(0))
    count = len(planned.base_names)
    determined = found.expected.determined
    np.testing.assert_array_equal(determined, solution.local_free[0, :count])
    both = np.ix_(determined, determined)
    np.testing.assert_allclose(
        found.expected.covariance[both],
        solution.local_covariance[0][:count, :count][both],
        rtol=1e-6,
        atol=1e-18,
    )


def test_two_ways_expected_uncertainties_are_those_that_runs_show(problem, candidates_of):
    found = _all(candidates_of(INDEXATIONS)).expected
    solution = solve(problem.linearise, problem.start, np.zeros(0))
    estimates = solution.local[:, : len(found.names)]
    true = dict(ERRORS) | {f"E{axis}{axis}": gain for axis, gain in GAINS.items()}
    away = estimates - [true[name] for name in found.names]
    # The bar's one error is common to all runs and moves the gains; the others are independent.
    free = [place for place, name in enumerate(found.names) if name not in ("EXX", "EYY", "EZZ")]
    ratio = np.mean((away[:, free] / found.u[free]) ** 2)
    assert abs(ratio - 1.0) < 4.0 * np.sqrt(2.0 / away[:, free].size) * 2.0


def test_conventions_without_spindle_indexations_two_parameters_get_no_number(candidates_of):
    found = _all(candidates_of(SEVEN)).expected
    assert {name for name, seen in zip(found.names, found.determined, strict=True) if not seen} == {
        "EX0C1",
        "EY0C1",
    }
    assert found.separation[found.names.index("EX0C1")] == 0.0


@pytest.fixture(scope="module")
def chapter_6(candidates_of):
    """Expected uncertainties of every subset of four balls, by their number; the bar lies along X, the tip is known."""
    bar = {"S1": (BAR_LENGTH / 2, -150.0, 60.0), "S2": (-BAR_LENGTH / 2, -150.0, 60.0)}
    candidates = candidates_of(SEVEN, bar=bar, tip_known=True)
    return {
        count: [_all(candidates, balls) for balls in combinations(candidates.balls, count)]
        for count in (1, 2, 3, 4)
    }


@pytest.mark.parametrize("name", ["EA0C", "EB0Z", "EC0Y", "EY0C1"])
def test_los2017_6_6_more_balls_make_these_much_better(chapter_6, name):
    means = [np.mean([_u(plan, name) for plan in chapter_6[count]]) for count in (1, 2, 3, 4)]
    assert means[0] > means[1] > means[2] > means[3]
    assert means[0] > 1.5 * means[3]


@pytest.mark.parametrize("name", ["EA0C", "EB0Z", "EC0Y", "EY0C1"])
def test_los2017_6_6_more_balls_narrow_the_range_between_configurations(chapter_6, name):
    ranges = [np.ptp([_u(plan, name) for plan in chapter_6[count]]) for count in (1, 2, 3)]
    assert ranges[0] > ranges[1] > ranges[2]


def test_los2017_6_6_exx_rests_on_the_bar_alone(chapter_6):
    values = [_u(plan, "EXX") for plans in chapter_6.values() for plan in plans]
    # Two ends probed with 1 µm each and a bar of 1.2 µm.
    assert values == pytest.approx(
        [np.hypot(np.sqrt(2.0) * 1.0, 1.2) / BAR_LENGTH * 1e3] * len(values), rel=1e-6
    )


def test_los2017_6_7_two_balls_take_half_the_time_of_four(chapter_6):
    two, four = chapter_6[2][0], chapter_6[4][0]
    assert two.seconds < 0.65 * four.seconds
    assert two.touched.sum() == 2 * 7 + 2


def _costs(search, plans):
    return search.cost(sums_of(search.candidates.touches, np.array(plans)))


def test_a_optimal_exchange_finds_the_best_pair_of_balls(candidates_of):
    candidates = candidates_of(INDEXATIONS)
    search = _Search(candidates, {})
    poses = tuple(range(len(INDEXATIONS)))
    pairs = list(combinations(candidates.balls, 2))
    costs = _costs(search, [candidates.touched(poses, pair) for pair in pairs])
    found = best_plan(candidates, 2, present=poses)
    assert set(found.balls) == set(pairs[int(costs.argmin())])


def test_a_optimal_exchange_comes_close_to_the_best_of_all_sets_of_poses(candidates_of):
    candidates = candidates_of(INDEXATIONS)
    search = _Search(candidates, {})
    zero = candidates.bar_poses[0]
    others = [place for place in range(len(INDEXATIONS)) if place != zero]
    sets = [(zero, *rest) for rest in combinations(others, 4)]
    costs = _costs(search, [candidates.touched(poses, candidates.balls) for poses in sets])
    found = search.poses(5, candidates.balls)
    assert len(set(found)) == 5
    assert _costs(search, [candidates.touched(found, candidates.balls)])[0] <= 1.02 * costs.min()


def test_chosen_poses_beat_as_many_of_the_five_day_plan(problem, candidates_of):
    chain = problem.context.chain
    grid = np.degrees(pose_grid(chain, problem.context.positions, {}))
    columns = [chain.index(name) for name in ("B", "C", "C1")]
    signs = [chain.joints[column].sign for column in columns]
    every = [*INDEXATIONS, *(grid[:, columns] * signs)]
    candidates = candidates_of(every)
    present = tuple(range(len(INDEXATIONS)))
    found = best_plan(candidates, 4, 10, present=present)
    whole = candidates.choice(present, candidates.balls)
    assert len(found.poses) == 10
    assert set(candidates.bar_poses) <= set(found.poses)
    # Ten well-chosen indexations are worth about the fifteen of the thesis: two thirds of the time.
    assert found.seconds < 0.7 * whole.seconds
    assert np.mean(np.log(found.expected.u / whole.expected.u)) < 0.05


def test_one_to_twenty_four_balls_only_ever_help(candidates_of):
    old = np.array(list(BALLS.values()))
    new = {f"new {number}": tuple(place) for number, place in enumerate(more_balls(old, 20))}
    candidates = candidates_of(INDEXATIONS, {**BALLS, **new})
    present = tuple(range(len(INDEXATIONS)))
    found = [best_plan(candidates, count, present=present) for count in (1, 2, 4, 8, 24)]
    sums = [float(np.sum((plan.expected.u / found[-1].expected.u) ** 2)) for plan in found]
    assert sums == sorted(sums, reverse=True)
    assert _u(found[-1], "EA0C") < 0.6 * _u(found[2], "EA0C")
    # The bar's own uncertainty is a floor that no ball lowers.
    assert _u(found[-1], "EYY") == pytest.approx(_u(found[2], "EYY"), rel=1e-6)


def test_more_balls_stand_apart_within_the_cylinder_of_the_others():
    old = np.array(list(BALLS.values()))
    new = more_balls(old, 20)
    radius = np.linalg.norm(new[:, :2], axis=1)
    assert radius.max() <= np.linalg.norm(old[:, :2], axis=1).max()
    assert old[:, 2].min() <= new[:, 2].min()
    assert new[:, 2].max() <= old[:, 2].max()
    gaps = np.linalg.norm(new[:, None] - new[None], axis=2) + 1e9 * np.eye(20)
    assert gaps.min() > 20.0


def test_the_quickest_plan_reaches_what_is_wanted_and_needs_all_its_poses(candidates_of):
    candidates = candidates_of(INDEXATIONS)
    wanted = {"EA0C": 3.0e-6, "EX0C1": 0.6e-3, "EXX": 9.0e-6}
    found = quickest_plan(candidates, wanted, 4)
    for name, limit in wanted.items():
        assert found.expected.u[found.expected.names.index(name)] <= limit
    assert found.seconds < 0.7 * _all(candidates).seconds
    fewer = _Search(candidates, wanted).poses(len(found.poses) - 1, found.balls)
    reduced = candidates.choice(fewer, found.balls).expected
    assert any(not reduced.u[reduced.names.index(name)] <= limit for name, limit in wanted.items())


def test_touches_beyond_the_strokes_are_left_out(problem, candidates_of):
    free = candidates_of(INDEXATIONS)
    y = free.touches.positions[..., problem.context.chain.index("Y")]
    middle = float(np.median(y))
    bounded = candidates_of(INDEXATIONS, strokes={"Y": (-1e3, middle)})
    assert bounded.touches.reachable.sum() < free.touches.reachable.sum()
    assert _all(bounded).touched[:, :4].sum() == bounded.touches.reachable[:, :4].sum()


def test_the_grid_of_poses_keeps_to_the_strokes(problem):
    chain = problem.context.chain
    found = pose_grid(chain, problem.context.positions, {"B": (-0.6, 0.6), "C": (0.0, 2.0 * np.pi)})
    b, c, spindle = (found[:, chain.index(name)] for name in ("B", "C", "C1"))
    np.testing.assert_allclose(np.unique(np.round(b, 9)), np.round([-STEP_RAD, 0.0, STEP_RAD], 9))
    assert len(np.unique(np.round(c, 9))) == 12
    assert np.all((spindle == 0.0) | ((b == 0.0) & (c == 0.0)))
    assert len(np.unique(spindle)) == 4


def test_time_of_a_plan_counts_probings_and_indexations(candidates_of):
    found = _all(candidates_of(SEVEN))
    assert found.seconds == 60.0 * (4 * 7 + 2) + 30.0 * 7


def test_refused_numbers_that_the_candidates_do_not_allow(candidates_of):
    candidates = candidates_of(SEVEN)
    with pytest.raises(InputError, match="--balls 5: choose 1 to 4"):
        best_plan(candidates, 5, present=(0,))
    with pytest.raises(InputError, match="--poses 2: choose 3 to 7; a ball needs three indexations"):
        best_plan(candidates, 4, 2, present=(0,))


def test_refused_uncertainties_that_no_plan_reaches(candidates_of):
    candidates = candidates_of(SEVEN)
    with pytest.raises(
        DataError, match="no plan of up to 4 balls and 7 indexations reaches the wanted uncertainties"
    ):
        quickest_plan(candidates, {"EXX": 1e-9}, 4)
    with pytest.raises(InputError, match="--wanted EQQ: there is no such parameter; there are EA0B"):
        quickest_plan(candidates, {"EQQ": 1e-6}, 4)
    with pytest.raises(InputError, match="--wanted EXX: an uncertainty is a number above 0"):
        quickest_plan(candidates, {"EXX": -1e-6}, 4)


def test_refused_a_bar_whose_ends_are_not_there(problem):
    with pytest.raises(DataError, match="the calibrated distance needs S1 and S2, but the targets are 1"):
        candidate_touches(problem, np.zeros((1, 6)), ["1"], np.zeros((1, 3)), {})
