"""The simulator against cases worked out by hand: it is the truth of other tests, so its own truth is arithmetic."""

import csv
import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from . import (
    SAMBA_TERMS,
    Effect,
    Plan,
    SimulatedMachine,
    around_the_clock,
    cold_cold_plan,
    five_days_plan,
    hu40,
    simulate,
    travel_signs,
    wandering,
    working_days,
    write_campaign,
)

EXACT = {"noise_um": 0.0, "spread_mm": 0.0, "bar_error_mm": 0.0, "decimals": None}
MICRO = 1e-6


def one_ball(point, *angles):
    """A plan that touches one ball once at every dict of angles."""
    return Plan("one", {"1": point}, tuple(("1", a) for a in angles), bar=None)


def touch(machine, plan, runs=1, **others):
    rng = np.random.default_rng(0)
    return simulate(plan, machine, around_the_clock(rng, runs=runs), rng, **(EXACT | others))


def row(campaign, index=0):
    return np.array([campaign["readings"][a][index] for a in "XYZ"])


def test_pure_translation_with_every_sign_plus_one():
    """A work-side axis of sign +1 carries the ball itself: X must go to minus the ball's x."""
    np.testing.assert_allclose(
        row(touch(hu40({}), one_ball((118.0, 6.0, 178.8), {}))), [-118.0, 6.0, 178.8], atol=1e-9
    )


def test_iso_841_signs_a_positive_reading_moves_the_tool_positively():
    machine = SimulatedMachine("w C B X b Z Y (C1) t")
    np.testing.assert_allclose(
        row(touch(machine, one_ball((118.0, 6.0, 178.8), {}))), [118.0, 6.0, 178.8], atol=1e-9
    )


def test_ninety_degrees_of_b_and_of_c():
    """C = 90 takes (x, y, z) to (-y, x, z); B = 90 takes it to (z, y, -x)."""
    seen = touch(hu40({}), one_ball((10.0, 20.0, 30.0), {"C": 90.0}, {"B": 90.0}, {"B": 90.0, "C": 90.0}))
    np.testing.assert_allclose(row(seen, 0), [20.0, 10.0, 30.0], atol=1e-9)
    np.testing.assert_allclose(row(seen, 1), [-30.0, 20.0, -10.0], atol=1e-9)
    np.testing.assert_allclose(row(seen, 2), [-30.0, 10.0, 20.0], atol=1e-9)


def test_tip_offset_turns_with_the_spindle():
    machine = replace(hu40({}), tip_mm=(1.0, 2.0, 3.0))
    seen = touch(machine, one_ball((0.0, 0.0, 0.0), {}, {"C1": 90.0}))
    np.testing.assert_allclose(row(seen, 0), [1.0, -2.0, -3.0], atol=1e-9)
    np.testing.assert_allclose(row(seen, 1), [-2.0, -1.0, -3.0], atol=1e-9)


def test_squareness_of_y_to_z_shifts_z_by_the_height():
    """EA0Y turns Y's direction to (0, cos a, sin a): y cos a = 200 and z + y sin a = 50."""
    a = 100 * MICRO
    seen = row(touch(hu40({"EA0Y": a}), one_ball((0.0, 200.0, 50.0), {})))
    np.testing.assert_allclose(seen, [0.0, 200.0 / math.cos(a), 50.0 - 200.0 * math.tan(a)], atol=1e-9)


def test_squareness_of_y_to_x_on_a_machine_whose_table_carries_x():
    """EC0Y = c: the tip goes to x = -y sin c, so the table follows by the same; its reading is -x_ball - y tan c."""
    c = 50 * MICRO
    seen = row(touch(hu40({"EC0Y": c}), one_ball((30.0, 100.0, 0.0), {})))
    np.testing.assert_allclose(seen, [-30.0 - 100.0 * math.tan(c), 100.0 / math.cos(c), 0.0], atol=1e-9)


def test_positioning_gain_shortens_the_reading():
    seen = row(touch(hu40({"EYY:poly1": 1e-4}), one_ball((0.0, 300.0, 0.0), {})))
    assert seen[1] == pytest.approx(300.0 / 1.0001, abs=1e-9)


def test_location_of_c_moves_the_ball_wherever_the_table_stands():
    """EX0C = 10 um: the ball is carried by +x of the frame of B, which B = 90 turns into -z."""
    seen = touch(hu40({"EX0C": 0.010}), one_ball((0.0, 0.0, 0.0), {"C": 77.0}, {"B": 90.0, "C": -5.0}))
    np.testing.assert_allclose(row(seen, 0), [-0.010, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(row(seen, 1), [0.0, 0.0, -0.010], atol=1e-9)


def test_tilt_of_b_is_two_products_of_sines_by_hand():
    """EA0B = a before B's own 90 degrees: (10, 20, 30) -> B -> (30, 20, -10) -> turned by a about X."""
    a = 1e-3
    seen = row(touch(hu40({"EA0B": a}), one_ball((10.0, 20.0, 30.0), {"B": 90.0})))
    y, z = 20 * math.cos(a) + 10 * math.sin(a), 20 * math.sin(a) - 10 * math.cos(a)
    np.testing.assert_allclose(seen, [-30.0, y, z], atol=1e-9)


def test_indexing_error_adds_to_the_angle_of_its_axis():
    a = 25 * MICRO
    machine = hu40({}, [Effect("EBB:harmonic2", coefficients=(0.0, a))])
    seen = row(touch(machine, one_ball((100.0, 0.0, 0.0), {"B": 45.0})))
    angle = math.pi / 4 + a
    np.testing.assert_allclose(seen, [-100 * math.cos(angle), 0.0, -100 * math.sin(angle)], atol=1e-9)


def test_three_axis_cmm_needs_no_rotary_axis():
    machine = SimulatedMachine("w b Y X Z t", terms={"EC0X": 1e-4, "EXX:poly1": 1e-5})
    seen = touch(machine, one_ball((100.0, 50.0, -20.0), {}))
    x = 100.0 / 1.00001 / math.cos(1e-4)
    np.testing.assert_allclose(row(seen), [x, 50.0 - 100.0 * math.tan(1e-4), -20.0], atol=1e-9)
    assert list(seen["columns"]) == ["x_mm", "y_mm", "z_mm"]


@pytest.mark.parametrize(
    "topology", ["w A C b X Y Z (C1) t", "w X Y b Z C B t", "w C b Y X Z A t", "w Z b X Y t"]
)
def test_every_topology_reaches_its_ball_with_all_errors(topology):
    """What is left between tip and ball, by a second independent product of matrices, is nothing."""
    rng = np.random.default_rng(5)
    names = [part.strip("()") for part in topology.split() if part not in "wbt"]
    terms = {f"E{d}0{n}": 1e-4 * rng.standard_normal() for n in names for d in "XYZABC"}
    machine = SimulatedMachine(topology, terms=terms)
    rotary = [n for n in names if n[0] in "ABC"]
    angles = [
        {n: float(a) for n, a in zip(rotary, rng.uniform(-90, 90, len(rotary)), strict=True)}
        for _ in range(4)
    ]
    seen = touch(machine, one_ball((40.0, -70.0, 90.0), *angles))
    bed = topology.split().index("b")
    for k in range(4):
        ends = []
        for side, default, point in (
            (topology.split()[1:bed][::-1], -1.0, np.array([40.0, -70.0, 90.0])),
            (topology.split()[bed + 1 : -1], 1.0, np.zeros(3)),
        ):
            for part in reversed(side):
                name = part.strip("()")
                reading = default * seen["exact"][name][k]
                if name[0] in "ABC":
                    point = about(name[0], math.radians(reading)) @ point
                else:
                    point = point + reading * np.eye(3)["XYZ".index(name[0])]
                for letter in "ABC":
                    point = about(letter, terms[f"E{letter}0{name}"]) @ point
                point = point + [terms[f"E{letter}0{name}"] for letter in "XYZ"]
            ends.append(point)
        np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)


def about(letter, angle):
    """Rodrigues' formula, so as not to use the simulator's own rotations."""
    x, y, z = np.eye(3)["ABC".index(letter)]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def test_last_travel_keeps_its_sign_and_the_first_probing_follows_the_option():
    readings = np.array([5.0, 5.0, 3.0, 3.0, 4.0, -2.0, -2.0, 0.0])
    run = np.array([1, 1, 1, 1, 1, 2, 2, 2])
    rest = [-1, -1, 1]
    assert travel_signs(readings, run, "reading").tolist() == [1, 1, *rest, -1, -1, 1]
    assert travel_signs(readings, run, "plus").tolist() == [1, 1, *rest, 1, 1, 1]
    assert travel_signs(readings, run, "minus").tolist() == [-1, -1, *rest, -1, -1, 1]
    assert travel_signs(readings, run, "zero").tolist() == [0, 0, *rest, 0, 0, 1]
    assert travel_signs(readings[::-1], run, "carry").tolist() == [0, -1, -1, 1, -1, -1, 1, 1]


def test_lost_motion_shifts_the_reading_against_the_last_travel():
    """EXX:reversal = 4 um at sign +1: the carriage stands 4 um further than it says, so it says 4 um less."""
    plan = Plan("two", {"1": (10.0, 0, 0), "2": (-10.0, 0, 0)}, (("1", {}), ("2", {}), ("1", {})), bar=None)
    seen = touch(hu40({}, [Effect("EXX:reversal", peak_um=4.0)]), plan)
    np.testing.assert_allclose(seen["readings"]["X"], [-10 + 0.004, 10 - 0.004, -10 + 0.004], atol=1e-9)


def test_warm_up_runs_from_the_first_run_of_the_day():
    schedule = working_days(np.random.default_rng(2), days=2, runs_per_day=2)
    machine = hu40({}, [Effect("EZC1:const@warmup", coefficients=0.008, tau_s=1800.0)])
    seen = simulate(one_ball((0.0, 0.0, 0.0), {}), machine, schedule, np.random.default_rng(0), **EXACT)
    gap = (schedule.started_at[3] - schedule.started_at[2]).total_seconds()
    z = seen["readings"]["Z"]
    np.testing.assert_allclose(z[[0, 2]], 0.0, atol=1e-9)
    assert z[3] == pytest.approx(-0.008 * (1 - math.exp(-gap / 1800.0)), abs=1e-9)


def test_run_time_channel_and_table_shape():
    plan = one_ball((0.0, 0.0, 100.0), {}, {}, {})
    effects = [
        Effect("EZZ:table@run_time", coefficients=(0.0, 0.010), grid=(0.0, 200.0)),
        Effect("EYZ:const@x_axis_degC", coefficients=0.002, reference=22.0),
    ]
    seen = touch(hu40({}, effects), plan, channels={"x_axis_degC": np.array([22.0, 23.0, 25.0])})
    np.testing.assert_allclose(seen["readings"]["Z"], [100.0, 99.9975, 99.995], atol=2e-6)
    np.testing.assert_allclose(seen["readings"]["Y"], [0.0, -0.002, -0.006], atol=1e-9)


def test_gravity_is_seen_from_the_turned_table():
    """Gravity is -Y; the table turned by C = 90 sees it along -X of its own: the ball sinks along -Y in the bed."""
    machine = hu40({}, [Effect("stem:gravity", coefficients=0.003)])
    seen = touch(machine, one_ball((0.0, 0.0, 100.0), {}, {"C": 90.0}, {"C": 180.0}))
    np.testing.assert_allclose(seen["readings"]["Y"], -0.003, atol=1e-9)
    np.testing.assert_allclose(seen["readings"]["X"], 0.0, atol=1e-9)
    frame = hu40({}, [Effect("EXC:const@gravity", coefficients=(0.001, 0.010, 0.100))])
    seen = touch(frame, one_ball((0.0, 0.0, 0.0), {}, {"C": 90.0}))
    np.testing.assert_allclose(row(seen, 0), [0.010, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(row(seen, 1), [0.0, -0.001, 0.0], atol=1e-9)


def test_a_ball_that_came_loose_and_an_artefact_that_grew():
    effects = [
        Effect("ball:1:moved", coefficients=(0.0, 0.020, 0.0), at=(2, 1)),
        Effect("artefact:expansion@ambient_degC", coefficients=1e-5, reference=0.0),
    ]
    rng = np.random.default_rng(3)
    schedule = replace(around_the_clock(rng, runs=2), ambient_degC=np.array([0.0, 10.0]))
    seen = simulate(one_ball((0.0, 100.0, 0.0), {}), hu40({}, effects), schedule, rng, **EXACT)
    np.testing.assert_allclose(seen["readings"]["Y"], [100.0, 100.0 + 0.020 + 0.010], atol=1e-9)


@pytest.mark.parametrize(
    "effect",
    [
        "EXX:reversal",
        "EYX:poly2",
        "EBB:harmonic2",
        "EZC1:const@warmup",
        "EYY:cyclic20mm",
        "stem:gravity",
        "EAC:poly1@gravity",
    ],
)
def test_peak_is_the_largest_displacement_of_the_tip_to_ball_vector(effect):
    """At any pose the linear readings move by the displacement turned, so their norm is the displacement's."""
    plan, rng = five_days_plan(), np.random.default_rng(4)
    schedule = working_days(rng, days=1)
    without = simulate(plan, hu40({}), schedule, np.random.default_rng(9), **EXACT)
    machine = hu40({}, [Effect(effect, peak_um=5.0)])
    within = simulate(plan, machine, schedule, np.random.default_rng(9), **EXACT)
    moved = [within["exact"][a] - without["exact"][a] for a in "XYZ"]
    assert np.linalg.norm(moved, axis=0).max() == pytest.approx(0.005, rel=2e-3)


def test_noise_is_white_and_rounded_to_the_digits_of_the_controller():
    plan, rng = five_days_plan(), np.random.default_rng(6)
    seen = simulate(plan, hu40(), working_days(rng), rng, noise_um=2.0)
    noise = np.array([seen["readings"][a] - seen["exact"][a] for a in "XYZ"]).ravel()
    assert noise.std() == pytest.approx(0.002, rel=0.06)  # 3720 draws: four sigma of the standard deviation
    assert abs(noise.mean()) < 4 * 0.002 / math.sqrt(noise.size)
    for axis in "XYZ":
        np.testing.assert_array_equal(seen["readings"][axis], np.round(seen["readings"][axis], 6))
    assert np.unique(seen["readings"]["B"]).tolist() == [-90, -60, -45, 0, 15, 30, 50, 90]


def test_bar_has_its_calibrated_length_and_its_own_error():
    plan, rng = cold_cold_plan(), np.random.default_rng(7)
    seen = simulate(plan, hu40(), around_the_clock(rng, runs=2), rng, bar_error_mm=0.002)
    assert seen["bar_length_mm"] == pytest.approx(304.6686 + 0.002, abs=1e-10)


def test_terms_may_differ_from_run_to_run():
    rng = np.random.default_rng(8)
    schedule = working_days(rng, days=2, runs_per_day=3)
    terms = wandering({"EYY:poly1": 1e-4}, schedule, rng, per_run=0.0, per_day=0.5)
    seen = simulate(one_ball((0.0, 300.0, 0.0), {}), hu40(terms), schedule, rng, **EXACT)
    assert np.ptp(terms["EYY:poly1"][:3]) == 0.0
    assert terms["EYY:poly1"][0] != terms["EYY:poly1"][3]
    np.testing.assert_allclose(seen["readings"]["Y"], 300.0 / (1 + terms["EYY:poly1"]), atol=1e-9)


def test_a_bad_point_is_one_point():
    plan, schedule = cold_cold_plan(), around_the_clock(np.random.default_rng(1), runs=2)
    clean = simulate(plan, hu40(), schedule, np.random.default_rng(1))
    bad = simulate(plan, hu40(), schedule, np.random.default_rng(1), bad_points=[(2, 5, (0.0, 30.0, 0.0))])
    change = bad["readings"]["Y"] - clean["readings"]["Y"]
    assert np.flatnonzero(change).tolist() == [34]
    assert change[34] == pytest.approx(0.030, abs=2e-6)


def test_the_folder_has_the_three_files_of_format_1(tmp_path):
    plan, machine, rng = five_days_plan(), hu40(), np.random.default_rng(11)
    schedule = working_days(rng)
    seen = simulate(plan, machine, schedule, rng)
    folder: Path = write_campaign(tmp_path / "sim", "sim", plan, machine, schedule, seen)
    head = tomllib.loads((folder / "campaign.toml").read_text(encoding="utf-8"))
    assert (head["format"], head["method"], head["machine"]["topology"]) == (1, "samba", machine.topology)
    assert [b["id"] for b in head["artefact"]["balls"]] == ["1", "2", "3", "4", "S1", "S2"]
    rows = list(csv.DictReader((folder / "probings.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == 1240
    assert list(rows[0])[4:10] == ["x_mm", "y_mm", "z_mm", "b_deg", "c_deg", "c1_deg"]
    assert float(rows[700]["y_mm"]) == seen["readings"]["Y"][700]
    runs = list(csv.DictReader((folder / "runs.csv").read_text(encoding="utf-8").splitlines()))
    assert [r["day"] for r in runs] == [str(d) for d in range(1, 6) for _ in range(4)]
    assert all(r["started_at"].endswith("-05:00") for r in runs)


def test_thirteen_base_terms_are_those_of_samba():
    assert len(SAMBA_TERMS) == 13
    assert SimulatedMachine().chain.topology == "w C B X b Z Y (C1) t"


@pytest.mark.parametrize(
    ("machine", "message"),
    [
        (hu40({"EQX": 1.0}), "not an ISO 230-1 symbol"),
        (hu40({"EX0C:poly1": 1.0}), "can only be constant"),
        (hu40({"EXX:poly1@oil_degC": 1.0}), "no driver 'oil_degC'"),
        (hu40({}, [Effect("EXX:reversal")]), "needs coefficients or peak_um"),
        (SimulatedMachine("w b X Y t"), "needs three linear axes"),
    ],
)
def test_what_cannot_be_simulated_is_refused(machine, message):
    with pytest.raises(ValueError, match=message):
        touch(machine, one_ball((1.0, 2.0, 3.0), {}))
