"""The volumetric error at the tool tip: closed forms, two ways that agree, and coverage on virtual campaigns."""

from dataclasses import replace

import numpy as np
import pytest

from monitor.effects import parse_effect
from monitor.exceptions import DataError
from monitor.methods.chain.least_squares import solve
from monitor.methods.samba.method import problem_of
from monitor.methods.samba.virtual import ERRORS, GAINS, virtual_campaign
from monitor.uncertainty.geometric_errors import GeometricErrors
from monitor.uncertainty.volumetric import grid, middle, volumetric_error

RANGES = {"X": (-200.0, 200.0), "Y": (-150.0, 150.0), "Z": (-100.0, 220.0)}


@pytest.fixture(scope="module")
def context(campaign):
    """The context of the first run of five-days, X B C on the work side, Z Y C1 on the tool side."""
    whole = campaign("five-days").context
    first = whole.run == whole.run.min()
    rows = {
        name: getattr(whole, name)[first]
        for name in ("positions", "run", "sequence", "time", "day_time", "run_time", "target", "nominal")
    }
    return replace(whole, **rows, columns={name: values[first] for name, values in whole.columns.items()})


@pytest.fixture(scope="module")
def errors_of(context):
    """A function that makes geometric errors of texts and coefficients."""

    def make(values, covariance=None, tip=(0.0, 0.0, -150.0)):
        effects = tuple(parse_effect(text, context.chain) for text in values)
        count = sum(len(effect.parameters(context)) for effect in effects)
        return GeometricErrors(
            effects=effects,
            names=tuple(name for effect in effects for name in effect.parameters(context)),
            estimate=np.concatenate([np.atleast_1d(value) for value in values.values()]).astype(float),
            covariance=np.zeros((count, count)) if covariance is None else covariance,
            context=context,
            run=int(context.run[0]),
            tip=np.array(tip),
        )

    return make


def _at(context, **readings):
    position = np.zeros((1, len(context.chain.joints)))
    for name, value in readings.items():
        place = context.chain.index(name)
        position[0, place] = context.chain.joints[place].sign * value
    return position


def test_closed_form_gain_of_the_work_side_axis_moves_the_tip_backwards(context, errors_of):
    # The table moves x (1 + e): relative to the workpiece the tip stands at -x (1 + e).
    found = volumetric_error(errors_of({"EXX:poly1": 10e-6}), _at(context, X=100.0))
    np.testing.assert_allclose(found.vectors, [[-1e-3, 0.0, 0.0]], atol=1e-12)


def test_closed_form_squareness_of_y_to_x_grows_with_y(context, errors_of):
    found = volumetric_error(errors_of({"EC0Y": 50e-6}), _at(context, Y=100.0))
    np.testing.assert_allclose(found.vectors, [[-100.0 * np.sin(50e-6), 0.0, 0.0]], atol=1e-6)


def test_closed_form_offset_of_the_c_axis_is_turned_by_b(context, errors_of):
    # The table's centre stands 0.1 mm along x of B's frame, which B = 90 deg turns to -z of the machine.
    found = volumetric_error(errors_of({"EX0C": 0.1}), _at(context, B=np.pi / 2))
    np.testing.assert_allclose(found.vectors, [[0.0, 0.0, 0.1]], atol=1e-12)


def test_closed_form_datum_takes_an_offset_off_where_the_table_does_not_turn(context, errors_of):
    known = errors_of({"EX0C1": -0.097, "EXX:poly1": 10e-6})
    datum = _at(context)[0]
    found = volumetric_error(known, _at(context, X=50.0), datum)
    np.testing.assert_allclose(found.vectors, [[-0.5e-3, 0.0, 0.0]], atol=1e-12)
    assert volumetric_error(known, datum[None], datum).lengths == pytest.approx([0.0], abs=1e-15)


def test_reversal_is_taken_for_an_approach_in_the_positive_direction(context, errors_of):
    found = volumetric_error(errors_of({"EYY:reversal": 2e-3}), _at(context, Y=-30.0))
    np.testing.assert_allclose(found.vectors, [[0.0, 2e-3, 0.0]], atol=1e-12)


def test_a_table_keeps_its_nodes_and_ends_with_a_constant(context, errors_of):
    place = context.chain.index("Z")
    low, high = context.positions[:, place].min(), context.positions[:, place].max()
    known = errors_of({"EZZ:table3": [0.0, 1e-3, 4e-3]})
    along = np.repeat(_at(context), 3, axis=0)
    along[:, place] = [(low + high) / 2, high, high + 500.0]
    np.testing.assert_allclose(volumetric_error(known, along).vectors[:, 2], [1e-3, 4e-3, 4e-3], atol=1e-12)


def test_a_temperature_is_that_of_the_run(context, errors_of):
    warm = replace(context, columns={**context.columns, "x_axis_degC": np.full(len(context), 23.0)})
    known = errors_of({"EXX:poly1@x_axis_degC": 10e-6})
    found = volumetric_error(replace(known, context=warm), _at(context, X=100.0))
    np.testing.assert_allclose(found.vectors, [[-3e-3, 0.0, 0.0]], atol=1e-12)


@pytest.mark.parametrize("effect", ["EZZ:free(6)", "EZZ:free(13,14)", "EZZ:poly1@room_hPa"])
def test_far_points_change_nothing_at_the_others(context, errors_of, effect):
    """The hats of a free shape were spread anew over what was asked for, up to 500 mm beyond what was measured."""
    sized = replace(context, columns={**context.columns, "room_hPa": np.linspace(0.0, 10.0, len(context))})
    known = errors_of({effect: [1e-3] * (2 if "," in effect else 1)})
    place = context.chain.index("Z")
    asked = np.repeat(_at(context, Z=60.0), 2, axis=0)
    near = volumetric_error(replace(known, context=sized), asked[:1]).vectors[0]
    asked[1, place] = context.positions[:, place].max() + 500.0
    np.testing.assert_allclose(
        volumetric_error(replace(known, context=sized), asked).vectors[0], near, rtol=1e-12
    )


@pytest.fixture(scope="module")
def thirteen(errors_of):
    """The thirteen of SAMBA at the thesis's values, with a correlated covariance of about 2 µrad and 0.5 µm."""
    values = {**ERRORS, **{f"E{axis}{axis}:poly1": gain for axis, gain in GAINS.items()}}
    size = np.array([0.5e-3 if name[1] in "XYZ" and ":" not in name else 2e-6 for name in values])
    mixed = np.random.default_rng(6).standard_normal((len(size), 20)) / np.sqrt(20)
    return errors_of(values, size[:, None] * (mixed @ mixed.T) * size)


@pytest.fixture(scope="module")
def places(context):
    """Five generic commanded points."""
    rng = np.random.default_rng(4)
    half = np.array([2.0 if joint.turns else 150.0 for joint in context.chain.joints])
    return rng.uniform(-half, half, (5, len(half)))


def test_exact_jacobian_agrees_with_differences(thirteen, places):
    found = volumetric_error(thirteen, places, places[0])
    for number, u in enumerate(np.sqrt(np.diag(thirteen.covariance))):
        step = np.zeros(len(thirteen.names))
        step[number] = u
        high = volumetric_error(thirteen, places, places[0], thirteen.estimate + step).vectors
        low = volumetric_error(thirteen, places, places[0], thirteen.estimate - step).vectors
        np.testing.assert_allclose(
            found.sensitivity[:, :, number], (high - low) / (2 * u), rtol=1e-6, atol=1e-6
        )


def test_jcgm102_6_2_covariance_agrees_with_monte_carlo(thirteen, places, seeds):
    found = volumetric_error(thirteen, places)
    rng = np.random.default_rng(8)
    trials = len(seeds(1500, 600))
    drawn = rng.multivariate_normal(thirteen.estimate, thirteen.covariance, trials, method="eigh")
    exact = np.array([volumetric_error(thirteen, places, None, one).vectors for one in drawn])
    for place in range(len(places)):
        inverse = np.linalg.inv(found.covariance[place])
        away = exact[:, place] - found.vectors[place]
        distance = np.einsum("ti,ij,tj->t", away, inverse, away)
        # Chi-square of three degrees of freedom: mean 3, variance 6.
        assert abs(distance.mean() - 3.0) < 4.0 * np.sqrt(6.0 / trials)
    lengths = np.linalg.norm(exact, axis=2)
    spread = 4.0 / np.sqrt(2.0 * trials)
    np.testing.assert_allclose(found.u_lengths, lengths.std(axis=0, ddof=1), rtol=spread)
    np.testing.assert_allclose(found.mean[1], lengths.mean(axis=1).std(ddof=1), rtol=spread)
    np.testing.assert_allclose(found.rms[1], np.sqrt((lengths**2).mean(axis=1)).std(ddof=1), rtol=spread)


def test_the_parts_of_the_parameters_add_up_to_the_length(thirteen, places):
    found = volumetric_error(thirteen, places)
    worst = found.worst
    assert found.lengths[worst] == found.lengths.max()
    assert sum(found.budget(worst).values()) == pytest.approx(found.lengths[worst], rel=2e-3)


def test_coverage_on_a_virtual_campaign_with_known_errors():
    virtual = virtual_campaign("v", np.random.default_rng(12))
    problem = problem_of(virtual)
    solution = solve(problem.linearise, problem.start, np.zeros(0))
    true = np.array([*ERRORS.values(), *GAINS.values()])
    count = len(problem.base_names)
    chain = problem.context.chain
    rng = np.random.default_rng(3)
    distances = []
    for place, run in enumerate(problem.runs):
        known = GeometricErrors(
            effects=problem.base,
            names=problem.base_names,
            estimate=solution.local[place, :count],
            covariance=solution.local_covariance[place, :count, :count],
            context=problem.context,
            run=int(run),
            tip=np.zeros(3),
        )
        point = rng.uniform(-100.0, 100.0, (1, len(chain.joints)))
        point[:, [joint.turns for joint in chain.joints]] /= 60.0
        datum = middle(chain, RANGES)
        found = volumetric_error(known, point, datum)
        away = found.vectors[0] - volumetric_error(known, point, datum, true).vectors[0]
        distances.append(away @ np.linalg.solve(found.covariance[0], away))
    # The bar's one error is shared by all runs, so the distances are not quite independent: six sigma.
    assert abs(np.mean(distances) - 3.0) < 6.0 * np.sqrt(6.0 / len(distances))


def test_grid_spans_the_strokes_in_readings_at_every_pose(context):
    chain = context.chain
    poses = np.zeros((2, len(chain.joints)))
    poses[1, chain.index("B")] = 0.5
    found = grid(chain, RANGES, 3, poses)
    assert found.shape == (54, len(chain.joints))
    for name, ends in RANGES.items():
        place = chain.index(name)
        readings = np.sort(chain.joints[place].sign * found[:, place])
        assert (readings[0], readings[-1]) == ends
    np.testing.assert_allclose(middle(chain, RANGES)[chain.index("Z")], chain.joint("Z").sign * 60.0)


def test_refused_without_the_stroke_of_an_axis(context):
    with pytest.raises(DataError, match="the map needs the stroke of axis Z, Y"):
        grid(context.chain, {"X": (0.0, 1.0)}, 3)
    with pytest.raises(DataError, match="at least 2 points along every axis, not 1"):
        grid(context.chain, RANGES, 1)


def test_refused_positions_of_another_chain(errors_of):
    with pytest.raises(DataError, match=r"shape \(points, 6\), one column each for X, B, C, Z, Y, C1"):
        volumetric_error(errors_of({"EC0Y": 1e-6}), np.zeros((2, 3)))


def test_refused_where_coefficients_and_effects_differ(errors_of):
    known = errors_of({"EC0Y": 1e-6})
    with pytest.raises(DataError, match="1 effects have 1 coefficients, but 1 are named and"):
        replace(known, estimate=np.zeros(2))
    with pytest.raises(DataError, match=r"1 coefficients need a covariance of \(1, 1\), not \(2, 2\)"):
        replace(known, covariance=np.zeros((2, 2)))
    with pytest.raises(DataError, match="no run 99; there are runs 1"):
        replace(known, run=99)
