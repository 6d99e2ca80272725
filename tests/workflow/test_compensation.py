"""Compensation tables applied to an independent machine: the error of the tip falls to the second order.

The machine is tests/simulator/chain.py, plain 4x4 products that share no code with the product. The product is told the
machine's errors, writes its tables, and what the tables say is done by a controller that knows only their headers: the
correction of a row is added to the reading of the same row.
"""

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from monitor.discovery import nearest_readings
from monitor.effects import Context, parse_effect
from monitor.effects.shapes import Step
from monitor.exceptions import InputError
from monitor.machine import parse_topology
from monitor.store import Database
from monitor.uncertainty.geometric_errors import GeometricErrors
from monitor.uncertainty.volumetric import grid, middle, volumetric_error
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.volumetric.between_points import between_points
from monitor.workflow.volumetric.compensation import write_tables
from monitor.workflow.volumetric.error_map import VolumetricMap, poses_of
from monitor.workflow.volumetric.request import VolumetricRequest
from monitor.workflow.volumetric.volumetric import volumetric_map

#: Every topology of the examples, the documents and the tests of methods with three linear axes: rotary axes on the
#: work side, on the tool side, on both, between linear axes and inside them.
TOPOLOGIES = (
    "w C B X b Z Y (C1) t",
    "w C A Y b X Z t",
    "w C A b Y X Z (C1) t",
    "w C A Y X b Z (C1) t",
    "w X b Y Z C B (C1) t",
    "w b X Y Z C A t",
    "w C b X Y Z B (C1) t",
    "w C X b Y Z B t",
    "w X Y Z b t",
    "w Y b X Z t",
    "w X C b Y Z A t",
    "w B X b Z Y (C1) t",
    "w b X B Y Z t",
)
STROKES = {"X": (-210.0, 190.0), "Y": (-150.0, 160.0), "Z": (-120.0, 230.0)}
TIP = np.array([3.0, -2.0, -140.0])
COMPONENTS = "XYZABC"
#: Readings of the rotary axes, degrees: generic, so that no symmetry hides a sign.
POSES = ((0.0, 0.0), (35.0, -60.0), (-80.0, 125.0))


def _signs(topology, flipped):
    """Signs by axis: ISO 841 and, where ``flipped``, every second axis against it."""
    work, tool = (part.split() for part in topology.split(" b "))
    usual = dict.fromkeys(work[1:], -1) | {name.strip("()"): 1 for name in tool[:-1]}
    against = list(usual)[::2] if flipped else []
    return {name: -sign if name in against else sign for name, sign in usual.items()}


class Truth:
    """Errors of every axis of a machine: coefficients of location errors, of q and of q squared, and of turning axes of
    the first harmonic; ``size`` multiplies all. Order of an error: tens of micrometres at the tool where size is 1."""

    def __init__(self, simulator, topology, signs, size, *, only_positioning=False):
        self.chain = simulator.chain
        self.machine = simulator.chain.read_topology(topology, signs)
        self.tip = TIP
        rng = np.random.default_rng(11)
        self.values = {}
        for axis in self.machine.axes:
            for component in COMPONENTS:
                unit = 1e-2 if component in "XYZ" else 60e-6
                draws = size * unit * rng.uniform(-1.0, 1.0, 4)
                if only_positioning and component != axis.name:  # not the spindle
                    continue
                turning = axis.rotary
                if not only_positioning:
                    self.values[f"E{component}0{axis.name}"] = draws[0]
                self.values[f"E{component}{axis.name}:poly1"] = draws[1] / (2.0 if turning else 200.0)
                self.values[f"E{component}{axis.name}:poly2"] = draws[2] / (4.0 if turning else 40000.0)
                if turning:
                    self.values[f"E{component}{axis.name}:harmonic1"] = np.array([draws[3], -draws[0]])

    def miss(self, readings, target):
        """(N, 3) vector from target to tip in the frame of the last work axis, at readings in mm and rad."""
        count = len(target)
        location, motion = {}, {}
        for name, value in self.values.items():
            term, _, shape = name.partition(":")
            axis = self.machine.axis(term[2:] if shape else term[3:])
            q = axis.sign * readings[axis.name]
            add = {
                "": lambda q=q, value=value: np.full(count, value),
                "poly1": lambda q=q, value=value: value * q,
                "poly2": lambda q=q, value=value: value * q**2,
                "harmonic1": lambda q=q, value=value: value @ np.array([np.cos(q), np.sin(q)]),
            }[shape]()
            six = (motion if shape else location).setdefault(axis.name, np.zeros((count, 6)))
            six[:, COMPONENTS.index(term[1])] += add
        return self.between(readings, target, location, motion)

    def between(self, readings, target, location, motion):
        """(N, 3) vector from target to tip, from plain products of matrices."""
        count = len(target)
        work = self.chain.branch_matrix(self.machine.work, readings, location, motion, count)
        tool = self.chain.branch_matrix(self.machine.tool, readings, location, motion, count)
        in_bed = self.chain.carried(tool, np.tile(self.tip, (count, 1)))
        return self.chain.carried(np.linalg.inv(work), in_bed) - target

    def programmed(self, readings):
        """(N, 3) point of the workpiece at which a perfect machine puts the tip."""
        return self.between(readings, np.zeros((len(next(iter(readings.values()))), 3)), {}, {})


def _mapped(truth, topology, signs, points=3):
    """What the product maps when it was told the truth."""
    chain = parse_topology(topology, signs)
    turning = [index for index, joint in enumerate(chain.joints) if joint.kind == "rotary"]
    positions = np.zeros((len(POSES) + 2, len(chain.joints)))
    for row, pose in enumerate(POSES):
        for index, angle in zip(turning, pose, strict=False):
            positions[row, index] = chain.joints[index].sign * np.radians(angle)
    for index, joint in enumerate(chain.joints):
        if not joint.turns:
            positions[-2:, index] = np.multiply(joint.sign, STROKES[joint.name])
    count = len(positions)
    context = Context(
        chain, positions, np.ones(count, np.int64), np.arange(count), np.zeros(count), np.zeros(count), np.zeros(count),
        np.full(count, "1"), np.zeros((count, 3)), {},
    )  # fmt: skip
    effects = tuple(parse_effect(name, chain) for name in truth.values)
    names = tuple(name for effect in effects for name in effect.parameters(context))
    estimate = np.concatenate([np.atleast_1d(value) for value in truth.values.values()])
    covariance = np.diag((0.1 * estimate) ** 2)
    errors = GeometricErrors(effects, names, estimate, covariance, context, 1, TIP)
    ranges = {joint.name: STROKES[joint.name] for joint in chain.joints if not joint.turns}
    poses = poses_of(chain, positions)
    error = volumetric_error(errors, grid(chain, ranges, points, poses), middle(chain, ranges))
    evaluated = SimpleNamespace(
        campaign=SimpleNamespace(name="c", machine=SimpleNamespace(id="M-1")), run=1,
        model=SimpleNamespace(name="m", version=1),
    )  # fmt: skip
    steps = {
        effect.text: [
            nearest_readings(effect.joint.sign * positions[:, effect.term.joint], reading, effect.shape.width)
            for reading in effect.shape.readings
        ]
        for effect in effects
        if isinstance(effect.shape, Step)
    }
    return VolumetricMap(evaluated, errors, ranges, True, poses, points, error, {}, steps)


def _table(path):
    """The header lines and the rows of a table, numbers as floats."""
    lines = Path(path).read_text(encoding="utf-8").splitlines()
    header = [line for line in lines if line.startswith("#")]
    rows = list(csv.DictReader(lines[len(header) :]))
    return header, [
        {key: value if key == "axis" else float(value) for key, value in row.items()} for row in rows
    ]


def _controlled(truth, rows):
    """Readings in mm and rad as commanded and as corrected, as the header of volumetric-csv says."""
    commanded, corrected = {}, {}
    for axis in truth.machine.axes:
        if axis.column not in rows[0]:
            commanded[axis.name] = corrected[axis.name] = np.zeros(len(rows))  # the spindle
            continue
        readings = np.array([row[axis.column] for row in rows])
        if axis.rotary:
            commanded[axis.name] = corrected[axis.name] = np.radians(readings)
        else:
            added = np.array([row[f"correction_{axis.name.lower()}_um"] for row in rows])
            commanded[axis.name], corrected[axis.name] = readings, readings + added * 1e-3
    return commanded, corrected


def _largest(vectors):
    return float(np.linalg.norm(vectors, axis=1).max())


@pytest.mark.parametrize("flipped", [False, True], ids=["iso841", "flipped"])
@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_volumetric_corrections_leave_the_second_order(simulator, tmp_path, topology, flipped):
    signs = _signs(topology, flipped)
    before, after = [], []
    for size in (1.0, 0.25):
        truth = Truth(simulator, topology, signs, size)
        (path,) = write_tables(_mapped(truth, topology, signs), "volumetric-csv", tmp_path)
        _, rows = _table(path)
        commanded, corrected = _controlled(truth, rows)
        target = truth.programmed(commanded)
        # The workpiece's zero was set on the machine with its errors, in the middle of the strokes.
        at_zero = {
            axis.name: np.array([0.0 if axis.rotary else np.mean(STROKES[axis.name])])
            for axis in truth.machine.axes
        }
        zero = truth.miss(at_zero, truth.programmed(at_zero))
        before.append(_largest(truth.miss(commanded, target) - zero))
        after.append(_largest(truth.miss(corrected, target) - zero))
        assert max(row["not_corrected_um"] for row in rows) == 0.0
    assert before[0] > 0.04
    # The error falls with its size, what is left with the square of it (16); four decimals of a micrometre are written.
    assert 3.9 < before[0] / before[1] < 4.1
    assert after[0] < before[0] / 300
    assert after[0] / after[1] == pytest.approx(16.0, rel=0.15)


def _by_axis(truth, paths, between):
    """Readings in mm and rad as commanded and as corrected, as the headers of positioning-csv say: 40 points, of each
    axis a row of its table by chance or, where ``between``, any reading, corrected by a straight line between two
    rows."""
    rows = [row for path in paths for row in _table(path)[1]]
    rng = np.random.default_rng(5)
    commanded, corrected = {}, {}
    for axis in truth.machine.axes:
        own = [row for row in rows if row["axis"] == axis.name]
        if not own:
            commanded[axis.name] = corrected[axis.name] = np.zeros(40)  # the spindle
            continue
        reading, correction = (
            ("reading_deg", "correction_deg") if axis.rotary else ("reading_mm", "correction_um")
        )
        nodes, added = np.array([[row[reading], row[correction]] for row in own]).T
        readings = rng.uniform(nodes[0], nodes[-1], 40) if between else rng.choice(nodes, 40)
        to_radian, of_table = (np.pi / 180.0, 1.0) if axis.rotary else (1.0, 1e-3)
        commanded[axis.name] = readings * to_radian
        corrected[axis.name] = (readings + of_table * np.interp(readings, nodes, added)) * to_radian
    return commanded, corrected


@pytest.mark.parametrize("flipped", [False, True], ids=["iso841", "flipped"])
@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_positioning_corrections_of_linear_and_rotary_axes_leave_the_second_order(
    simulator, tmp_path, topology, flipped
):
    signs = _signs(topology, flipped)
    before, after = [], []
    for size in (8.0, 2.0):
        truth = Truth(simulator, topology, signs, size, only_positioning=True)
        paths = write_tables(_mapped(truth, topology, signs), "positioning-csv", tmp_path)
        for between in (False, True):
            commanded, corrected = _by_axis(truth, paths, between)
            target = truth.programmed(commanded)
            before.append(_largest(truth.miss(commanded, target)))
            after.append(_largest(truth.miss(corrected, target)))
    assert before[0] > 0.04
    assert 3.9 < before[0] / before[2] < 4.1
    assert after[0] < before[0] / 300
    assert after[0] / after[2] == pytest.approx(16.0, rel=0.15)
    assert (
        max(after[1] / before[1], after[3] / before[3]) < 0.01
    )  # straight lines leave half a per cent an axis


@pytest.mark.parametrize("flipped", [False, True])
def test_both_formats_say_the_same_of_a_positioning_error_on_either_side(simulator, tmp_path, flipped):
    topology = "w C B X b Z Y (C1) t"
    signs = _signs(topology, flipped)
    truth = Truth(simulator, topology, signs, 1.0, only_positioning=True)
    truth.values = {"EXX:poly1": 50e-6, "EYY:poly1": -30e-6}
    mapped = _mapped(truth, topology, signs, points=2)
    (path,) = write_tables(mapped, "positioning-csv", tmp_path)
    own = {(row["axis"], row["reading_mm"]): row["correction_um"] for row in _table(path)[1]}
    (path,) = write_tables(mapped, "volumetric-csv", tmp_path)
    for row in _table(path)[1]:
        if row["b_deg"] == row["c_deg"] == 0.0:
            for axis in "XY":
                middle_of = -own[axis, min(STROKES[axis])] - own[axis, max(STROKES[axis])]
                expected = (
                    own[axis, row[f"{axis.lower()}_mm"]] + middle_of / 2.0
                )  # the zero is set in the middle
                assert row[f"correction_{axis.lower()}_um"] == pytest.approx(expected, abs=1e-3)


def test_headers_say_what_is_added_to_what_and_the_reversal_value(simulator, tmp_path):
    topology = "w C B X b Z Y (C1) t"
    signs = _signs(topology, True)
    truth = Truth(simulator, topology, signs, 1.0, only_positioning=True)
    truth.values = {"EXX:reversal": 4e-3, "EBB:harmonic2": np.array([20e-6, 0.0])}
    mapped = _mapped(truth, topology, signs, points=2)
    linear, rotary = write_tables(mapped, "positioning-csv", tmp_path)
    header, rows = _table(linear)
    assert header[1] == (
        "# ADD correction_um to the commanded reading reading_mm of the same axis (-5.0 um at 100 mm: send 99.9950 mm)."
    )
    assert "# X: reversal value 8.00 um (ISO 230-2). Approached towards falling" in header
    # Approached towards growing readings a play of 2 x 4 µm leaves the axis 4 µm further, whatever its sign.
    assert {row["correction_um"] for row in rows} == {-4.0}
    header, rows = _table(rotary)
    assert header[1].startswith("# ADD correction_deg to the commanded reading reading_deg of the same axis")
    for row in rows:
        angle = signs["B"] * np.radians(row["reading_deg"])
        assert row["error_urad"] == pytest.approx(signs["B"] * 20.0 * np.cos(2.0 * angle), abs=1e-3)
        assert row["correction_deg"] == pytest.approx(-np.degrees(row["error_urad"] * 1e-6), abs=1e-7)
    (path,) = write_tables(mapped, "volumetric-csv", tmp_path)
    header, _ = _table(path)
    assert any("correction_x_um to the reading x_mm" in line for line in header)
    assert any("DO NOT add these" in line for line in header)
    assert (
        "# The rows hold for a tool whose tip stands at x 3.000, y -2.000, z -140.000 mm in the frame of the"
        in header
    )


@pytest.mark.parametrize("topology", TOPOLOGIES[:5])
def test_another_tool_than_the_table_names_keeps_an_error_of_first_order(simulator, tmp_path, topology):
    signs = _signs(topology, False)
    truth = Truth(simulator, topology, signs, 1.0)
    (path,) = write_tables(_mapped(truth, topology, signs), "volumetric-csv", tmp_path)
    commanded, corrected = _controlled(truth, _table(path)[1])
    left = {}
    for name, tip in (("its own", TIP), ("150 mm longer", TIP - [0.0, 0.0, 150.0])):
        truth.tip = tip
        at_zero = {
            axis.name: np.array([0.0 if axis.rotary else np.mean(STROKES[axis.name])])
            for axis in truth.machine.axes
        }
        zero = truth.miss(at_zero, truth.programmed(at_zero))
        left[name] = _largest(truth.miss(corrected, truth.programmed(commanded)) - zero)
    assert left["150 mm longer"] > 20.0 * left["its own"]


def test_refused_where_no_axis_has_a_known_positioning_error(simulator, tmp_path):
    truth = Truth(simulator, "w C A Y b X Z t", _signs("w C A Y b X Z t", False), 1.0)
    truth.values = {"EX0C": 1e-3}
    with pytest.raises(
        InputError, match="no positioning error of an axis is known from run 1 with model m; volumetric-csv"
    ):
        write_tables(_mapped(truth, "w C A Y b X Z t", {}), "positioning-csv", tmp_path)


def test_a_cyclic_error_gets_rows_enough_for_straight_lines(simulator, tmp_path):
    truth = Truth(simulator, "w b X Y Z t", {}, 1.0)
    truth.values = {"EXX:cyclic20mm": np.array([3e-3, 0.0])}
    (path,) = write_tables(_mapped(truth, "w b X Y Z t", {}), "positioning-csv", tmp_path)
    _, rows = _table(path)
    nodes, errors = np.array([[row["reading_mm"], row["error_um"]] for row in rows]).T
    readings = np.linspace(-210.0, 190.0, 1999)
    left = np.interp(readings, nodes, errors) - 3.0 * np.cos(2.0 * np.pi * readings / 20.0)
    assert 500 < len(rows) < 4097
    assert np.abs(left).max() < 0.02


def test_all_the_way_from_a_measured_campaign_to_the_corrected_machine(simulator, tmp_path):
    rng = np.random.default_rng(4)
    plan, schedule = simulator.five_days_plan(), simulator.working_days(rng, 2, 3)
    topology = "w C B X b Z Y (C1) t"
    signs = _signs(topology, True)
    machine = simulator.SimulatedMachine(topology=topology, signs=signs, terms=simulator.SAMBA_TERMS)
    measured = simulator.simulate(plan, machine, schedule, rng, noise_um=0.05, bar_error_mm=0.0)
    simulator.write_campaign(tmp_path / "m", "m", plan, machine, schedule, measured)
    request = VolumetricRequest("m", 6, points=3, compensation="volumetric-csv", out=tmp_path)
    with Database(tmp_path / "m.duckdb") as db:
        import_folders(db, ImportRequest([tmp_path / "m"]))
        answer = volumetric_map(db, request)
    _, rows = _table(answer.tables[0])
    truth = Truth(simulator, topology, signs, 1.0)
    truth.values, truth.tip = simulator.SAMBA_TERMS, np.array(measured["tip_mm"])
    commanded, corrected = _controlled(truth, rows)
    target = truth.programmed(commanded)
    at_zero = {
        axis.name: np.array([(answer.datum or {}).get(axis.column, 0.0)]) for axis in truth.machine.axes
    }
    zero = truth.miss(at_zero, truth.programmed(at_zero))
    before = np.linalg.norm(truth.miss(commanded, target) - zero, axis=1)
    after = np.linalg.norm(truth.miss(corrected, target) - zero, axis=1)
    assert before.max() > 0.020
    # What is left is what the identification does not know: 1.2 µm a metre of the bar, and the noise.
    u = np.array([np.linalg.norm([row[f"u_{axis}_um"] for axis in "xyz"]) for row in rows]) * 1e-3
    assert np.all(after < 4.0 * u + 1e-5)
    assert after.max() < before.max() / 10.0


@pytest.mark.parametrize(
    ("effect", "value", "size"),
    [
        ("EXX:sawtooth68mm(12)", 0.0126, 6.3),
        ("EXX:cyclic68mm", (0.003, 0.004), 5.0),
        ("EBX:cyclic68mm", (3e-6, 4e-6), 5.0),
    ],
)
def test_what_repeats_between_the_points_of_a_map_is_said_with_its_size(effect, value, size):
    """Teeth 68 mm apart on points 66.7 mm apart look like next to nothing."""
    truth = SimpleNamespace(values={"EXX:poly1": 1e-5, effect: value})
    topology = "w C B X b Z Y (C1) t"
    mapped = _mapped(truth, topology, _signs(topology, True), points=7)
    (between,) = between_points(mapped)
    assert (between.effect, between.axis, between.pitch_mm) == (effect, "X", 68.0)
    assert between.spacing_mm == pytest.approx(400.0 / 6.0)
    assert between.size == pytest.approx(size, rel=0.01)
    assert between.unit == ("µrad" if effect.startswith("EBX") else "µm")
    assert between_points(replace(mapped, points=49)) == ()


def test_teeth_have_a_row_on_either_side_of_every_edge(simulator, tmp_path):
    """Edges at -195, -111 ... 141 mm fall between even rows; straight lines left half a step beside each."""
    truth = Truth(simulator, "w b X Y Z t", {}, 1.0)
    truth.values = {"EXX:sawtooth84mm(-27)": 4e-3}
    (path,) = write_tables(_mapped(truth, "w b X Y Z t", {}), "positioning-csv", tmp_path)
    header, rows = _table(path)
    nodes, errors = np.array([[row["reading_mm"], row["error_um"]] for row in rows]).T
    assert len(rows) == 33 + 2 * 5
    readings = np.arange(-210.0, 190.0, 0.013)
    of_tooth = (readings + 27.0) / 84.0 % 1.0
    far = np.minimum(of_tooth, 1.0 - of_tooth) * 84.0 > 0.001
    left = np.interp(readings, nodes, errors) - 4.0 * (of_tooth - 0.5)
    assert np.abs(left[far]).max() < 0.001
    assert any(
        "X: the error jumps at 5 readings, each between two rows 0.002 mm apart" in line for line in header
    )


def test_the_header_of_a_volumetric_table_says_what_its_rows_do_not_follow(simulator, tmp_path):
    truth = Truth(simulator, "w b X Y Z t", {}, 1.0)
    truth.values = {"EXX:sawtooth84mm(-27)": 4e-3}
    mapped = _mapped(truth, "w b X Y Z t", {})
    (path,) = write_tables(mapped, "volumetric-csv", tmp_path)
    (between,) = between_points(mapped)
    assert any(line.endswith(f"NOT FOLLOWED {between}.") for line in _table(path)[0])
