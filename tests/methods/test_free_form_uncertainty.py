"""Uncertainties of free-form against section 6 of its source: Figures 18 to 20 and Table 2, u = 1.38 µm.

The paper does not print where its points are, so sizes are compared by a factor and rankings exactly.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from monitor.methods.free_form.method import METHOD as free_form
from monitor.methods.free_form.plan import candidates_of

K = 2.0  # the figures state k = 2


@pytest.fixture
def expected(sim, made):
    """What angles promise for a layout."""

    def of(layout, *plans):
        _, campaign = made(layout, sim.CASE_1_ANGLES)
        there = candidates_of(campaign, free_form.own_model, (15,))
        return [there.expected(plan) for plan in plans]

    return of


def on_cross(plan):
    """Expanded uncertainties of the points of the cross, in µm."""
    return K * 1e3 * np.array([u for name, u in plan.u.items() if name.startswith("shape(W")])


def test_fig_18_more_angles_less_uncertainty(sim, expected):
    """Printed largest values: 6.5, 3.0 and 2.1 µm for two, three and four angles."""
    angles = sim.CASE_1_ANGLES
    two, three, four = (on_cross(p) for p in expected(sim.cross_pocket(), angles[:2], angles[:3], angles))
    assert np.all(four < three)
    assert np.all(three < two)
    assert 2.1 < three.max() / four.max() * 2.1 < 6.0  # printed 3.0 / 2.1
    assert 2.1 / 3 < four.max() < 2.1 * 3
    assert 3.0 / 3 < three.max() < 3.0 * 3
    assert (
        two.max() > 6.5
    )  # worse than printed: two angles barely see some tables, so the method refuses them


def test_fig_19_spheres_lower_the_uncertainty(sim, expected):
    """Without spheres larger, by about 4 µm at most."""
    with_spheres = on_cross(expected(sim.cross_pocket(), sim.CASE_1_ANGLES)[0])
    without = on_cross(expected(sim.cross_pocket().keep("W"), sim.CASE_1_ANGLES)[0])
    assert np.all(without >= with_spheres)
    assert 1.0 < (without - with_spheres).max() < 8.0


def test_fig_20_the_ends_of_y_are_worst(sim, made):
    """Expanded uncertainty of the positioning errors on the grid: 0 at the origin, 28 µm at most, at Y = ±110."""
    _, campaign = made(sim.cross_pocket(), sim.CASE_1_ANGLES)
    found = free_form.identify(campaign)
    places = {name: place for place, name in enumerate(found.parameters)}
    covariance = found.runs[0].covariance
    size = np.zeros((11, 11))
    for column, x in enumerate(sim.GRID_1):
        for row, y in enumerate(sim.GRID_1):
            by = np.zeros((2, len(places)))
            for direction, name, factor in (
                (0, f"EXX({x:g})", 1.0), (0, f"EXY({y:g})", 1.0), (1, f"EYX({x:g})", 1.0), (1, f"EYY({y:g})", 1.0),
                (1, f"ECY({y:g})", x), (1, "EC0X", x),
            ):  # fmt: skip
                if name in places:
                    by[direction, places[name]] += factor
            size[row, column] = K * 1e3 * np.sqrt(np.trace(by @ covariance @ by.T))
    assert size[5, 5] == 0.0
    assert np.unravel_index(size.argmax(), size.shape)[0] in (0, 10)
    assert 28.0 / 3 < size.max() < 28.0 * 3
    assert np.mean(size[1:-1] < 10.0) > 0.6


def test_table_2_errors_of_the_table(sim, expected):
    """U_CC of 8.9, 9.3 and 8.2 µrad within a half, U_XC and U_YC of 1.0 to 1.2 µm within a factor of four."""
    (plan,) = expected(sim.cross_pocket(), sim.CASE_1_ANGLES)
    for angle, turn in ((75, 8.9), (130, 9.3), (210, 8.2)):
        assert K * 1e6 * plan.u[f"ECC({angle})"] == pytest.approx(turn, rel=0.5)
        for symbol in ("EX0C", "EY0C"):
            assert 1.0 / 4 < K * 1e3 * plan.u[f"{symbol}({angle})"] / 1.1 < 4.0
    assert "ECC(0)" not in plan.u  # zero by its condition


def _expanded(sim, angles, conditions):
    """Expanded covariance in µm² of all unknowns of Eq. (15) under conditions, by numpy alone, and where each
    stands."""
    rows, names = sim.design_matrix(sim.cross_pocket(), angles)
    place = {name: k for k, name in enumerate(names)}
    matrix = np.zeros((len(conditions), len(names)))
    for row, condition in zip(matrix, conditions, strict=True):
        for name, weight in condition.items():
            row[place[name]] = weight
    left = np.linalg.svd(matrix)[2][len(conditions) :].T  # what the conditions leave free
    size = np.linalg.norm(rows @ left, axis=0)
    inverse = np.linalg.pinv(rows @ left / size, rcond=1e-12) / size[:, None]
    return (K * 1.38) ** 2 * left @ (inverse @ inverse.T) @ left.T, place


def _printed_conditions(sim):
    """Eqs. (16) and (17)."""
    end = sim.cross_pocket().grid[-1]
    zero = [f"{table}(0)" for table in ("EXX", "EYX", "EXY", "EYY", "ECY", "EXC", "EYC", "ECC")]
    return [{name: 1.0} for name in (*zero, f"EYX({end:g})", f"EXY({end:g})", f"EXX({end:g})")]


def test_fig_18_the_factor_of_two_to_three_is_one_mode_the_size_of_the_shape(sim):
    """Eq. (17) ties the size of the shape to one end node of EXX, which few points see. Without that mode 1.6 and 2.1
    µm are left for four and three angles (docs/free-form.md); 2.1 and 3.0 are printed."""
    layout = sim.cross_pocket()
    size = np.sum(layout.points * layout.normals, axis=1)
    (x, y), (u, v) = layout.points.T, layout.normals.T
    placed = np.column_stack([u, v, x * v - y * u])  # a shift and a turn of the whole workpiece
    on_cross = np.array([name.startswith("W") for name in layout.names])
    for angles, whole, without in ((sim.CASE_1_ANGLES, 3.5, 1.6), (sim.CASE_1_ANGLES[:3], 7.7, 2.1)):
        covariance, place = _expanded(sim, angles, _printed_conditions(sim))
        shape = [place[f"G({name})"] for name in layout.names]
        largest = []
        for modes in (placed, np.column_stack([placed, size])):
            free = np.eye(len(size)) - modes @ np.linalg.pinv(modes)
            left = free @ covariance[np.ix_(shape, shape)] @ free.T
            largest.append(np.sqrt(np.diag(left)[on_cross].max()))
            if modes is placed:
                worst = np.linalg.eigh(left)[1][:, -1]
                assert abs(worst @ (free @ size)) / np.linalg.norm(free @ size) > 0.99
        assert largest == pytest.approx([whole, without], rel=0.05)


def test_table_2_u_xc_is_that_of_tables_centred_on_all_their_nodes(sim):
    """With E(0) = 0 of a single node U_XC, U_YC are 2.5 to 3.9 µm; with the mean of the nodes at zero they are the
    0.9 to 1.2 that are printed, within 0.35 µm. U_CC is the same under both."""
    layout, angles = sim.cross_pocket(), sim.CASE_1_ANGLES
    printed = _printed_conditions(sim)
    centred = [
        {f"{table}({node:g})": 1.0 for node in layout.grid} for table in ("EXX", "EYX", "EXY", "EYY")
    ] + printed[4:]
    by_node, place = _expanded(sim, angles, printed)
    by_mean, _ = _expanded(sim, angles, centred)
    for angle, row in ((75, (1.0, 0.9)), (130, (1.2, 1.1)), (210, (1.2, 1.2))):
        for symbol, value in zip(("EXC", "EYC"), row, strict=True):
            k = place[f"{symbol}({angle})"]
            assert np.sqrt(by_mean[k, k]) == pytest.approx(value, abs=0.35)
            assert np.sqrt(by_node[k, k]) > 2.4
        k = place[f"ECC({angle})"]
        assert by_mean[k, k] == pytest.approx(by_node[k, k], rel=1e-6)


def test_what_a_plan_promises_is_what_it_gives(sim, made):
    _, campaign = made(sim.cross_pocket(), sim.CASE_1_ANGLES)
    (plan,) = [candidates_of(campaign, free_form.own_model, (15,)).expected(sim.CASE_1_ANGLES)]
    found = free_form.identify(campaign)
    u = dict(zip(found.parameters, np.sqrt(np.diag(found.runs[0].covariance)), strict=True))
    assert plan.nullity == 0
    assert plan.probings == 368
    for name, promised in plan.u.items():
        assert promised == pytest.approx(u[name], rel=1e-6)


@pytest.mark.slow
def test_monte_carlo_of_whole_identifications_agrees(sim, made):
    """Spread over 60 runs, each identified by itself, against the stated covariance (first-order is exact here)."""
    _, campaign = made(sim.cross_pocket(), sim.CASE_1_ANGLES, runs=60)
    found = free_form.identify(campaign)
    values = np.array([run.estimate for run in found.runs])
    u = np.sqrt(np.diag(found.runs[0].covariance))
    # The known length has one error for all runs: its share is taken out of what runs may differ in.
    calibration = campaign.artefact.self_calibration
    sure = replace(calibration, length=replace(calibration.length, standard_uncertainty=1e-9))
    alone = free_form.identify(
        replace(
            campaign,
            artefact=replace(campaign.artefact, self_calibration=sure),
            runs=campaign.runs[:1],
            probings=campaign.probings.rows(campaign.probings.run == 1),
        )
    )
    ratio = values.std(axis=0, ddof=1) / np.sqrt(np.diag(alone.runs[0].covariance))
    # a standard deviation of 60 is good to 9 %; 149 of them, correlated
    assert np.mean(ratio**2) == pytest.approx(1.0, abs=0.12)
    assert np.all(ratio < 1.5)
    assert np.all(u >= np.sqrt(np.diag(alone.runs[0].covariance)) - 1e-12)


def test_the_best_next_angle_beats_all_others(sim, made):
    """The proposed angle against every other of the candidates, each as a plan of its own."""
    _, campaign = made(sim.cross_pocket(), sim.CASE_1_ANGLES)
    there = candidates_of(campaign, free_form.own_model, range(0, 360, 30))
    single, chosen = there.next_angles(1)
    means = {plan.angles[-1]: np.mean(plan.shape**2) for plan in single}
    assert chosen[0] == min(means, key=means.get)
    assert len(means) == 10  # of twelve, 0 and 210 are in the plan already
    assert np.mean(there.expected((*sim.CASE_1_ANGLES, chosen[0])).shape ** 2) == min(means.values())


def test_quarter_turns_leave_dimensions_unseen_and_the_next_angle_closes_them(sim, made):
    _, campaign = made(sim.cross_pocket(), (0.0, 90.0, 180.0, 270.0))
    there = candidates_of(campaign, free_form.own_model, range(0, 360, 15))
    assert there.expected(there.present).nullity > 0
    single, chosen = there.next_angles(1)
    assert single[0].nullity == 0
    assert chosen[0] % 90.0 != 0.0
