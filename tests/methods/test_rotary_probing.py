"""Rotary probing against the independent simulator and the equations of Ibaraki, Iritani, Matsushita 2012."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from by_path import load

from monitor.exceptions import DataError
from monitor.machine import parse_topology
from monitor.methods.chain.problem import solve_problem
from monitor.methods.model import Model
from monitor.methods.rotary_probing.base import rotary_base
from monitor.methods.rotary_probing.method import METHOD as rotary_probing
from monitor.reporting.refused import refusal_sentence

campaigns = load("rotary_campaigns", Path(__file__).with_name("rotary_campaigns.py"))
reference = load("closed_forms", Path(__file__).with_name("closed_forms.py"))
PARAMETERS, SYMBOLS, Touches = reference.PARAMETERS, reference.SYMBOLS, reference.Touches
closed_forms = reference.closed_forms
PAPER, TRUTH, location, touched = campaigns.PAPER, campaigns.TRUTH, campaigns.location, campaigns.touched


@pytest.fixture(scope="session")
def rp(simulator: ModuleType) -> ModuleType:
    return importlib.import_module("simulator.rotary_probing")


@pytest.fixture(scope="session")
def chain_of(simulator: ModuleType):
    return sys.modules["simulator.chain"].read_topology


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20120301)


def as_touches(plan, seen) -> Touches:
    return Touches(
        np.column_stack([seen[axis] for axis in "XYZ"]),
        np.radians(seen["A"]),
        np.radians(seen["C"]),
        np.array([one.target for one, _ in plan]),
        np.array([one.normal for one, _ in plan]),
    )


def estimates(campaign, model=rotary_probing.own_model):
    found = rotary_probing.identify(campaign, model)
    return dict(zip(found.parameters, found.runs[0].estimate, strict=True)), found


# The simulator itself, and the names


@pytest.mark.parametrize(("a", "c"), [(0.0, 0.0), (0.0, 1.1), (-1.5707963267948966, 3.0), (-0.6, 4.2)])
def test_eq1_of_the_paper_is_our_chain_with_the_names_of_the_table(rp, simulator, a, c):
    symbols = dict(zip(SYMBOLS, (15, 24, 27, -10, -20, -12, 4, 6), strict=True))
    symbols = {s: v * (1e-3 if s.startswith("d") else 1e-6) for s, v in symbols.items()}
    theirs = rp.paper_machine(symbols, a, c)
    chain = sys.modules["simulator.chain"]
    names = {SYMBOLS[symbol]: value for symbol, value in symbols.items()}
    six = {axis: values[None] for axis, values in location(names).items()}
    readings = {"C": np.array([c]), "A": np.array([a]), "Y": np.zeros(1)}
    ours = chain.branch_matrix(chain.read_topology(PAPER).work, readings, six, {}, 1)[0]
    # R_A R_B R_C there, R_C R_B R_A here: products of two small angles, and the zero of A taken behind A.
    np.testing.assert_allclose(ours[:3, :3], theirs[:3, :3], atol=1e-9)
    np.testing.assert_allclose(ours[:3, 3], theirs[:3, 3], atol=1e-6)


def test_table_1_names_the_eight_errors_of_a_tilting_table():
    assert set(rotary_base(parse_topology(PAPER))) == set(SYMBOLS.values()) == set(PARAMETERS)


@pytest.mark.parametrize(
    ("topology", "expected"),
    [
        ("w C B b X Y Z t", "EX0B EY0B EZ0B EA0B EC0B EX0C EA0C EB0C"),
        ("w C B X b Z Y (C1) t", "EX0B EY0B EZ0B EA0B EC0B EX0C EA0C EB0C"),
        ("w b X Y Z C B t", "EA0C EB0C EX0B EY0B EA0B EB0B EC0B"),
        ("w C X b Y Z B t", "EX0C EY0C EA0C EB0C EA0B EB0B EC0B"),
        ("w C Y b X Z t", "EX0C EY0C EA0C EB0C"),
    ],
)
def test_other_arrangements_have_their_own_complete_set(topology, expected):
    assert " ".join(rotary_base(parse_topology(topology))) == expected


def test_a_machine_without_rotary_axis_is_refused():
    with pytest.raises(DataError, match="'w Y b X Z t' has no rotary axis"):
        rotary_base(parse_topology("w Y b X Z t"))


# The closed forms


@pytest.mark.parametrize("symbol", SYMBOLS)
def test_eqs_6_to_19_give_each_error_alone(rp, chain_of, rng, symbol):
    size = 0.02 if symbol.startswith("d") else 3e-5
    seen = rp.touch(chain_of(PAPER), rp.paper_plan(), location({SYMBOLS[symbol]: size}), rng)
    expected = np.where(np.array(PARAMETERS) == SYMBOLS[symbol], size, 0.0)
    # 0.3 nm and 0.01 µrad: products of two errors. Without the 1/2 of Eq. (17) EY0C would be out by its own size.
    np.testing.assert_allclose(closed_forms(as_touches(rp.paper_plan(), seen)), expected, atol=3e-6)


def test_eq_17_as_printed_is_wrong_by_a_factor(rp, chain_of, rng):
    seen = rp.touch(chain_of(PAPER), rp.paper_plan(), location({"EY0C": 0.02}), rng)
    touches = as_touches(rp.paper_plan(), seen)
    dy = dict(zip(PARAMETERS, closed_forms(touches), strict=True))
    both = dy["EY0C"] + dy["EY0A"]
    assert 2.0 * both - dy["EY0A"] == pytest.approx(0.04, rel=1e-3)  # (y2 + y1 + 2 z alpha) - dy_AY
    assert dy["EY0C"] == pytest.approx(0.02, rel=1e-3)


def test_eqs_11_and_12_hold_away_from_x_0_only_with_their_terms_in_x(rp, chain_of, rng):
    # Eq. (6) needs its sign, too: the piece stands at +Y.
    truth = {"EB0A": 4e-5, "EC0A": -3e-5, "EA0C": 2e-5, "EZ0A": 0.01}
    plan = rp.every_pose(rp.block(top=(60.0, 180.0, 170.0)), [{"A": a, "C": c} for a, c in rp.PAPER_POSES])
    seen = rp.touch(chain_of(PAPER), plan, location(truth), rng)
    expected = [truth.get(name, 0.0) for name in PARAMETERS]
    np.testing.assert_allclose(closed_forms(as_touches(plan, seen)), expected, atol=3e-6)


def test_closed_forms_need_the_seven_poses(rp, chain_of, rng):
    plan = [(one, at) for one, at in rp.paper_plan() if at != {"A": -90.0, "C": 180.0}]
    seen = rp.touch(chain_of(PAPER), plan, {}, rng)
    with pytest.raises(ValueError, match=r"no touch at A = -90°, C = 180°: the closed forms need"):
        closed_forms(as_touches(plan, seen))


# The general least squares


def test_least_squares_and_closed_forms_agree_on_the_papers_layout(rp, chain_of, rng):
    plan = rp.paper_plan()
    seen = rp.touch(chain_of(PAPER), plan, location(TRUTH), rng)
    found, whole = estimates(touched(PAPER, plan, [seen]))
    assert whole.runs[0].refused == ()
    assert len(plan) == 154  # section 4.2
    assert whole.runs[0].degrees_of_freedom == 154 - 8 - 28
    np.testing.assert_allclose([found[name] for name in TRUTH], list(TRUTH.values()), atol=1e-11)
    closed = dict(zip(PARAMETERS, closed_forms(as_touches(plan, seen)), strict=True))
    for name in TRUTH:
        assert found[name] == pytest.approx(closed[name], abs=5e-7 if name[1] in "XYZ" else 5e-9)


def test_section_5_place_turn_and_shape_of_the_block_cancel(rp, chain_of, rng):
    plan = rp.paper_plan()
    piece = rp.Piece(
        shift=(0.5, -0.4, 0.2), turn=(1e-3, -2e-3, 3e-3), tilt={(0.0, 0.0, 1.0): (0.0, 2e-3, 0.0)},
        form={one.target: rng.normal(0.0, 0.05) for one in rp.block()},
    )  # fmt: skip
    seen = rp.touch(chain_of(PAPER), plan, location(TRUTH), rng, piece=piece)
    found, _ = estimates(touched(PAPER, plan, [seen]))
    for name, value in TRUTH.items():
        # What is left is a tilt of 3 mrad times location errors of 30 µm, and no more.
        assert found[name] == pytest.approx(value, abs=0.1e-3 if name[1] in "XYZ" else 0.5e-6)


MIXED = {
    "w C B b X Y Z t": ("B", (0.0, 0.0, 0.0)),
    "w b X Y Z C B t": ("B", (0.0, 0.0, -180.0)),
    "w b X Y Z C A t": ("A", (0.0, 0.0, -180.0)),
    "w C X b Y Z B t": ("B", (0.0, 0.0, -180.0)),
}


@pytest.mark.parametrize("topology", MIXED)
def test_other_arrangements_are_identified(rp, chain_of, rng, topology):
    tilt, tip = MIXED[topology]
    angles = [{tilt: a, "C": c} for a in (0.0, -60.0, 45.0) for c in (0.0, 90.0, 200.0, 290.0)]
    names = rotary_base(parse_topology(topology))
    truth = {name: rng.normal(0.0, 0.02 if name[1] in "XYZ" else 3e-5) for name in names}
    plan = rp.every_pose(rp.block(top=(20.0, -90.0, 120.0), height=100.0), angles)
    seen = rp.touch(chain_of(topology), plan, location(truth), rng, tip=tip)
    found, whole = estimates(touched(topology, plan, [seen], tip=tip))
    assert whole.runs[0].refused == ()
    np.testing.assert_allclose([found[name] for name in names], list(truth.values()), atol=1e-10)


def test_a_piece_of_other_faces_needs_no_block(rp, chain_of, rng):
    faces = []
    for k in range(9):
        normal = np.array([np.cos(k), np.sin(k), 0.4 + 0.1 * (k % 3)])
        place = np.array([0.0, -150.0, 100.0]) + 40.0 * normal + rng.normal(0.0, 8.0, 3)
        faces.append(rp.Feature(f"p{k}", tuple(place), tuple(normal / np.linalg.norm(normal))))
    plan = rp.every_pose(faces, [{"A": a, "C": c} for a, c in rp.PAPER_POSES])
    seen = rp.touch(chain_of(PAPER), plan, location(TRUTH), rng)
    found, _ = estimates(touched(PAPER, plan, [seen]))
    np.testing.assert_allclose([found[name] for name in TRUTH], list(TRUTH.values()), atol=1e-10)


def test_spheres_serve_as_well_and_give_their_radius(rp, chain_of, rng):
    spheres = [*rp.sphere("K1", (80.0, -120.0, 90.0)), *rp.sphere("K2", (-70.0, -150.0, 60.0), 10.0)]
    plan = rp.every_pose(spheres, [{"A": a, "C": c} for a, c in rp.PAPER_POSES])
    piece = rp.Piece(shift=(0.3, -0.2, 0.25))
    seen = rp.touch(chain_of(PAPER), plan, location(TRUTH), rng, piece=piece)
    found, whole = estimates(touched(PAPER, plan, [seen]))
    for name, value in TRUTH.items():
        assert found[name] == pytest.approx(value, abs=2e-6 if name[1] in "XYZ" else 2e-8)
    # Own radius and that of the tip, 3 mm; the centre where the piece was shifted to.
    assert whole.runs[0].unknowns["ball K2 radius"] == pytest.approx(13.0, abs=1e-4)
    assert whole.runs[0].unknowns["ball K1 x"] == pytest.approx(0.3, abs=1e-3)


# Statistics, rank, refusals


def test_stated_uncertainties_hold_their_rate_and_chi_square_its_expectation(rp, chain_of, rng):
    plan = rp.paper_plan()
    runs = [rp.touch(chain_of(PAPER), plan, location(TRUTH), rng, noise_mm=0.7e-3) for _ in range(60)]
    whole = rotary_probing.identify(touched(PAPER, plan, runs))
    error = np.array([run.estimate - [TRUTH[name] for name in whole.parameters] for run in whole.runs])
    u = np.array([np.sqrt(np.diag(run.covariance)) for run in whole.runs])
    inside = np.mean(np.abs(error) < 2.0 * u)
    assert 0.92 < inside < 0.98  # 480 intervals of 95.4 %: standard deviation 1 %, correlated
    chi = np.array([run.chi_square for run in whole.runs])
    assert chi.mean() == pytest.approx(118.0, abs=4 * np.sqrt(2 * 118 / 60))


def test_a_plan_without_tilting_says_what_it_cannot_separate(rp, chain_of, rng):
    plan = [(one, at) for one, at in rp.paper_plan() if at["A"] == 0.0]
    seen = rp.touch(chain_of(PAPER), plan, location(TRUTH), rng)
    found, whole = estimates(touched(PAPER, plan, [seen]))
    refused = {name for refusal in whole.runs[0].refused for name in refusal.parameters}
    assert {"EY0A", "EY0C", "EB0A", "EB0C", "EZ0A"} <= refused
    assert all(np.isnan(found[name]) for name in refused)
    assert any(
        "A stands at one angle throughout; index it too" in refusal_sentence(one)
        for one in whole.runs[0].refused
    )
    assert found["EX0A"] == pytest.approx(TRUTH["EX0A"], abs=1e-6)


def test_e06_the_zero_of_a_named_twice_is_not_separable(rp, chain_of, rng):
    plan = rp.paper_plan()
    seen = rp.touch(chain_of(PAPER), plan, location(TRUTH), rng)
    _, whole = estimates(touched(PAPER, plan, [seen]), Model("both", base=(*TRUTH, "EA0A")))
    assert [set(one.parameters) for one in whole.runs[0].refused] == [{"EA0A", "EA0C"}]


def test_an_added_effect_is_found_in_all_runs_together(rp, chain_of, rng):
    plan = rp.paper_plan()
    gain = 2e-5
    runs = [
        rp.touch(chain_of(PAPER), plan, location(TRUTH), rng, linear=lambda xyz: xyz * np.array([0.0, 0.0, gain]))
        for _ in range(2)
    ]  # fmt: skip
    model = Model("gain", added=("EZZ:poly1",))
    found = rotary_probing.identify(touched(PAPER, plan, runs), model)
    assert found.added_estimate[0] == pytest.approx(gain, rel=1e-3)


def test_a_wrong_sign_in_the_machine_file_is_seen(rp, chain_of, rng):
    plan = rp.paper_plan()
    seen = rp.touch(chain_of(PAPER), plan, {}, rng)
    seen = seen | {"C": -seen["C"]}
    with pytest.raises(
        DataError, match=r"the touches of point side1-1 lie up to .* mm apart in the table's frame"
    ):
        rotary_probing.problem_of(touched(PAPER, plan, [seen]))


def test_a_sphere_with_wrong_normals_is_refused(rp, chain_of, rng):
    plan = rp.every_pose(
        rp.sphere("K1", (80.0, -120.0, 90.0)), [{"A": 0.0, "C": c} for c in (0.0, 90.0, 180.0)]
    )
    campaign = touched(PAPER, plan, [rp.touch(chain_of(PAPER), plan, {}, rng)])
    turned = dict(campaign.probings.channels)
    turned["normal_x"], turned["normal_y"] = turned["normal_y"], turned["normal_x"]
    with pytest.raises(DataError, match=r"the stated normal and the line from the centre of ball K1"):
        rotary_probing.problem_of(replace(campaign, probings=replace(campaign.probings, channels=turned)))


def test_derivatives_are_those_of_the_residuals(rp, chain_of, rng):
    spheres = rp.sphere("K1", (80.0, -120.0, 90.0))
    plan = rp.every_pose([*spheres, *rp.block()], [{"A": a, "C": c} for a, c in rp.PAPER_POSES])
    problem = rotary_probing.problem_of(
        touched(PAPER, plan, [rp.touch(chain_of(PAPER), plan, location(TRUTH), rng)])
    )
    point = solve_problem(problem).local + 1e-4 * rng.standard_normal((1, len(problem.local_names)))
    analytic = problem.linearise(point, np.zeros(0)).local[0]
    for place in range(len(problem.local_names)):
        step = np.zeros_like(point)
        step[0, place] = 1e-5
        both = [problem.linearise(point + sign * step, np.zeros(0)).residual[0] for sign in (1.0, -1.0)]
        slope = (both[0] - both[1]) / 2e-5
        np.testing.assert_allclose(analytic[:, place], slope, atol=1e-5 * np.abs(analytic[:, place]).max())
