"""Joint curves of many lines, as measured robots have them, against a simulator of its own."""

from __future__ import annotations

import importlib
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import Fit, explain, fit
from monitor.discovery.machine.evidence.held_out import LeftOutBlocks, pose_blocks
from monitor.discovery.machine.explain import variants_of_campaign
from monitor.discovery.machine.joints.joint_curves import joint_curves
from monitor.discovery.machine.shapes.tables import occupied
from monitor.discovery.machine.surroundings import surroundings_of
from monitor.discovery.machine.suspects.bad_poses import bad_poses
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.shapes import Harmonics
from monitor.exceptions import CampaignError, DataError, EffectError
from monitor.methods.model import Model
from monitor.methods.tracker.method import METHOD as tracker
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.workflow.predict.predict import beside

ORDERS = {"J1": (1, 24, 121, 242), "J3": (2, 45, 121, 242)}


@pytest.fixture(scope="module")
def robots() -> ModuleType:
    """The simulator of measured robots, loaded by path."""
    simulator()
    return importlib.import_module("simulator.measured_robot")


@pytest.fixture(scope="module")
def session(robots):
    """A robot with two joint curves of four lines each, and compliances."""
    rng = np.random.default_rng(4)
    curves = {
        joint: [robots.Line(order, 90e-6, rng.uniform(0.0, 6.0)) for order in orders]
        for joint, orders in ORDERS.items()
    }
    scene = robots.Scene(softness={"J2": 8e-6, "J3": 8e-6}, curves=curves)
    return robots.measure(rng, scene, poses=300, fixed_every=30)


@pytest.fixture(scope="module")
def campaign(robots, session, tmp_path_factory) -> Campaign:
    read = read_campaign(robots.write_session(tmp_path_factory.mktemp("robot") / "robot", session))
    assert isinstance(read, Campaign)
    return read


@pytest.fixture(scope="module")
def plain(campaign) -> Fit:
    return fit(tracker.problem_of(campaign))


def curves_of(campaign: Campaign, plain: Fit) -> dict[str, tuple[float, ...]]:
    variants = variants_of_campaign(campaign, plain.problem, surroundings_of(campaign, plain.problem).drivers)
    curves = {}
    for variant in joint_curves(plain, variants, 0.01):
        effect = variant.effect
        assert isinstance(effect, ChainEffect)
        assert isinstance(effect.shape, Harmonics)
        curves[effect.joint.name] = effect.shape.orders
    return curves


def test_all_lines_of_two_joints_and_none_of_the_others(campaign, plain):
    assert curves_of(campaign, plain) == {name: tuple(map(float, orders)) for name, orders in ORDERS.items()}


def test_lines_that_the_model_has_are_looked_for_no_more(campaign):
    """No column of a low line is left beside itself: p-values of none were asked (ValueError)."""
    model = Model("one", added=(f"ECJ1:harmonics({','.join(map(str, ORDERS['J1']))})",))
    more = curves_of(campaign, fit(tracker.problem_of(campaign, model)))
    assert more == {"J3": tuple(map(float, ORDERS["J3"]))}


def test_nodes_of_a_table_lie_where_poses_stand():
    """One pose at 20, all others above 28: of 22 nodes 11 lay between and were told as 1e-10 +- 3e-10 urad."""
    rng = np.random.default_rng(1)
    reading = np.concatenate([[20.0], rng.uniform(28.04, 34.9, 299)])
    even = np.round(np.linspace(20.0, 35.0, 24), 2)
    nodes = occupied(even, reading, 3)
    assert nodes[:2].tolist() == [20.0, 27.83]
    assert set(even[even > 28.0]) <= set(nodes)
    spread = rng.uniform(20.0, 35.0, 600)
    assert np.array_equal(occupied(even, spread, 3), even)


def test_every_node_of_a_table_has_a_number():
    """Schoenberg and Whitney, Trans. Am. Math. Soc. 74 (1953) 246: a place of its own under each hat."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        reading = np.concatenate([rng.uniform(low, low + 4.0, 8) for low in rng.uniform(-90.0, 90.0, 4)])
        even = np.linspace(np.floor(reading.min()), np.ceil(reading.max()), 24)
        nodes = occupied(even, reading)
        hats = np.stack([np.interp(reading, nodes, hat) for hat in np.eye(len(nodes))], axis=1)[:, 1:-1]
        assert np.linalg.matrix_rank(hats) == len(nodes) - 2
        assert len(nodes) > 3


def test_new_poses_are_predicted_to_the_noise(robots, session, campaign, plain):
    texts = tuple(
        f"E{'CB'[n]}J{2 * n + 1}:harmonics({','.join(map(str, ORDERS[f'J{2 * n + 1}']))})" for n in (0, 1)
    )
    texts += ("EBJ2:compliance@link_weights", "EBJ3:compliance@link_weights")
    new = session.pose >= 240
    fitted = fit(tracker.problem_of(campaign, Model("all", added=texts)), new)
    tool = np.array([name.startswith("R") for name in session.tracked.target])
    noise = np.sqrt(np.mean((session.tracked.points - session.exact)[new & tool] ** 2))
    assert np.sqrt(np.mean(fitted.vectors[new & tool] ** 2)) < 1.15 * noise


def test_bad_poses_are_one_each_and_no_other_is_dropped(robots, session, campaign):
    points = session.tracked.points.copy()
    pose = np.isin(session.pose, (50, 200)) & np.array(
        [name.startswith("R") for name in session.tracked.target]
    )
    points[pose] += 0.3
    single = int(np.flatnonzero(session.pose == 120)[0])
    points[single, 1] -= 0.3
    channels = {f"tracker_{axis}_mm": points[:, number] for number, axis in enumerate("xyz")}
    changed = replace(campaign, probings=replace(campaign.probings, channels=channels))
    texts = [
        f"ECJ1:harmonics({','.join(map(str, ORDERS['J1']))})",
        f"EBJ3:harmonics({','.join(map(str, ORDERS['J3']))})",
    ]
    texts += ["EBJ2:compliance@link_weights", "EBJ3:compliance@link_weights"]
    points_off = bad_poses(fit(tracker.problem_of(changed, Model("all", added=tuple(texts)))))
    rows = {row for point in points_off for row in point.all_rows}
    wanted = {single} if session.tracked.target[single].startswith("R") else set()
    assert rows == set(np.flatnonzero(pose).tolist()) | wanted
    assert sum(len(point.rows) == 3 for point in points_off) == 2


def test_blocks_left_out_against_fits_of_all_columns(plain):
    parts = pose_blocks(plain)
    rng = np.random.default_rng(0)
    basis = plain.nuisance.basis.reshape(len(parts), -1)
    columns = rng.normal(size=(len(parts), 3))
    columns -= basis @ (basis.T @ columns)
    residual = plain.white.reshape(-1)
    whole = np.concatenate([basis, columns], axis=1)
    total = 0.0
    for part in range(10):
        rows = parts == part
        sizes = np.linalg.lstsq(whole[~rows], residual[~rows], rcond=None)[0]
        total += float(np.sum((residual[rows] - whole[rows] @ sizes) ** 2))
    assert LeftOutBlocks(basis, parts).sum_of_squares(residual, columns) == pytest.approx(total, rel=1e-8)


def test_rows_of_a_lost_beam_are_refused_with_their_lines(robots, session, tmp_path):
    lost = robots.lose_beam(session, [7, 9])
    with pytest.raises(CampaignError, match=r"line 9.*lost the beam(.|\n)*line 11.*leave the row out"):
        read_campaign(robots.write_session(tmp_path / "lost", lost))


def test_rows_of_another_machine_or_target_are_not_predicted(campaign):
    other = replace(campaign, machine=replace(campaign.machine, id="another"))
    with pytest.raises(DataError, match="a model of the one says nothing of the other"):
        beside(campaign, other)
    joined, rows = beside(campaign, campaign)
    assert len(joined.probings) == 2 * len(campaign.probings)
    assert rows.sum() == len(campaign.probings)


@pytest.mark.parametrize("orders", ["", "2,1", "0,1", "a"])
def test_orders_that_are_none_are_refused(plain, orders):
    with pytest.raises(EffectError, match="must be periods a turn, above 0 and rising"):
        parse_effect(f"ECJ1:harmonics({orders})", plain.problem.context.chain)


def test_a_single_line_of_a_joint_is_named_beside_the_curve_of_another(robots, tmp_path):
    """The search beside curves looks for no lines: one of J5 was lost where J1 had two."""
    scene = robots.Scene(
        softness={"J2": 8e-6},
        curves={
            "J1": [robots.Line(1, 90e-6, 0.3), robots.Line(2, 60e-6, 1.0)],
            "J5": [robots.Line(100, 90e-6, 0.2)],
        },
    )
    session = robots.measure(np.random.default_rng(9), scene, poses=260, fixed_every=30)
    campaign = read_campaign(robots.write_session(tmp_path / "robot", session))
    answer = explain(campaign, tracker.problem_of(campaign), "tracker", rng=np.random.default_rng(0))
    named = [effect.effect for effect in answer.missing]
    assert set(named) - {"EBJ2:compliance@gravity", "EBJ2:compliance@link_weights"} == {
        "ECJ1:harmonics(1,2)",
        "EBJ5:harmonic100",
    }
    assert len(named) == 3
    (line,) = [effect for effect in answer.missing if effect.effect == "EBJ5:harmonic100"]
    assert abs(line.amplitude - 90e-6) < 4.0 * line.u


@pytest.mark.slow
def test_a_base_that_settles_beside_curves_is_no_drift_of_the_tracker(robots, session, tmp_path):
    """With curves of joints resting reflectors were not asked, and tracker:shift@warmup was told."""
    tracked = session.tracked
    tool = np.array([name.startswith("R") for name in tracked.target])
    settled = tool * (1.0 - np.exp(-4.0 * np.linspace(0.0, 1.0, len(tool))))
    points = tracked.points + np.outer(settled, [0.1, 0.1, 0.1])
    moved = replace(session, tracked=replace(tracked, points=points))
    campaign = read_campaign(robots.write_session(tmp_path / "robot", moved))
    answer = explain(campaign, tracker.problem_of(campaign), "tracker", rng=np.random.default_rng(0))
    named = [effect.effect for effect in answer.missing]
    assert any("0J1@" in name for name in named)
    assert not any(name.startswith("tracker:") for name in named)
    curves = [effect for effect in answer.missing if "harmonic" in effect.effect]
    assert len(curves) == 2
    assert all(effect.q_value <= 0.01 for effect in curves)


@pytest.mark.slow
def test_low_orders_over_a_part_of_a_turn_do_not_cancel_each_other(robots, tmp_path, monkeypatch):
    """A step of 700 urad within 130 degrees of J3: orders 1 to 3 of 35 to 46 mrad and 13 to 17 mm were told. Of the
    step the largest deviation from its mean is 408 urad; lines overshoot beside it by up to a third."""
    limited = tuple(
        (*words, (-70.0, 60.0)) if words[0] == "J3" else (*words, limits) for *words, limits in robots.ELBOW
    )
    monkeypatch.setattr(robots, "ELBOW", limited)
    orders = 0.7 * np.arange(1, 80, 2)
    step = [robots.Line(order, 350e-6 * 2.8 / np.pi / order, 0.1 * order + np.pi / 2) for order in orders]
    session = robots.measure(
        np.random.default_rng(2), robots.Scene(curves={"J3": step}), poses=260, fixed_every=30
    )
    campaign = read_campaign(robots.write_session(tmp_path / "robot", session))
    (found,) = explain(
        campaign, tracker.problem_of(campaign), "tracker", rng=np.random.default_rng(0)
    ).missing
    assert found.effect.startswith("EBJ3:harmonics(2,3,")
    assert 408e-6 - 3.0 * found.u < found.amplitude < 1.35 * 408e-6
    assert found.peak < 0.7
