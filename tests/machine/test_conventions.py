"""The examples of docs/conventions.md, recomputed from the document with rotation matrices of the independent
simulator."""

import re
from pathlib import Path

import numpy as np
import pytest

from monitor.machine import evaluate, frame_of, machine_frame, parse_topology
from monitor.machine.topology import chain_of_axes
from monitor.methods.chain.base_effects import base_effects
from monitor.records import ChainAxis, FrameKind, FrameOfReference

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "conventions.md"
#: Rounding to whole µm and µrad, and products of two errors: 65 µrad of 60 µrad.
PRINTED = 0.51
EXAMPLES = {"w C B X b Z Y (C1) t": 1.0, "w C A Y b X Z t": -1.0}


def _rows(text):
    return [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in text.splitlines()
        if line.startswith("|") and not line.startswith("| ---")
    ]


@pytest.fixture(scope="module")
def printed():
    """By topology: values of the chain, values in the machine frame, quantities, all as printed."""
    text = DOCUMENT.read_text(encoding="utf-8").partition("### Examples")[2].partition("\n## ")[0]
    parts = re.split(r"^`([^`]+)`, .*sign = -?1`:$", text, flags=re.MULTILINE)
    found = {}
    for topology, part in zip(parts[1::2], parts[2::2], strict=True):
        errors, quantities = part.split("| quantity | value |")
        rows = _rows(errors)[1:]
        found[topology] = (
            {name: float(value) for name, value, _ in rows if value != "-"},
            {name: float(value) for name, _, value in rows if value != "-"},
            {name: [float(v) for v in values.split(",")] for name, values in _rows(quantities)},
        )
    return found


def _frames(simulator, topology, values, angles=None):
    """(4, 4) frame of every axis in the machine's, with errors in µm and µrad and rotary axes at angles (rad)."""
    chain = simulator.chain
    frames = {}
    for branch in (machine := chain.read_topology(topology)).work, machine.tool:
        product = np.eye(4)[None]
        for axis in branch:
            six = [values.get(f"E{c}0{axis.name}", 0.0) * (1e-3 if c in "XYZ" else 1e-6) for c in "XYZABC"]
            product = product @ chain.small_motion(np.array([six]))
            if axis.rotary:
                product = product @ chain.turn(axis.name[0], np.array([(angles or {}).get(axis.name, 0.0)]))
            frames[axis.name] = product[0]
    return frames


def _direction(frames, axis):
    return frames[axis][:3, {"X": 0, "Y": 1, "Z": 2, "A": 0, "B": 1, "C": 2}[axis[0]]]


def _pierced(frames, axis, normal, at):
    """Where the axis pierces the plane whose coordinate ``normal`` is ``at`` mm; µm."""
    v, p = _direction(frames, axis), frames[axis][:3, 3]
    return (p + (at - p[normal]) / v[normal] * v) * 1e3


def _expected(simulator, topology, values, sign, quantity):
    """A quantity of the document, from matrices alone."""
    frames = _frames(simulator, topology, values)
    letters = ["XYZ".index(letter) for letter in re.findall(r"[XYZ]", quantity.rpartition(":")[2])]
    if match := re.match(r"v of (\w)", quantity):
        return sign * _direction(frames, match[1])[letters] * 1e6
    if match := re.match(r"p of (\w) in the plane (\w) = (\d+)", quantity):
        return _pierced(frames, match[1], "XYZ".index(match[2]), float(match[3]))[letters]
    if quantity.startswith("angle from +X to +Y"):
        cosine = _direction(frames, "X") @ _direction(frames, "Y")
        return [(np.arccos(cosine) - np.pi / 2) * 1e6]
    # The sphere was centred to the tool at C = 0; the linear axes, without error, follow the nominal circle.
    of_table = {name: value for name, value in values.items() if name[-1] in "ABC"}
    before = _frames(simulator, topology, of_table)["C"]
    after = _frames(simulator, topology, of_table, {"C": np.pi})["C"]
    start = np.array([80.0, 30.0, 0.0, 1.0])
    sphere = after @ np.linalg.inv(before) @ start
    tool = np.diag([-1.0, -1.0, 1.0, 1.0]) @ start
    moved = (sphere - tool)[:3][letters] * 1e3
    return moved if quantity.startswith("sphere relative to the tool") else -moved


@pytest.mark.parametrize("topology", EXAMPLES)
def test_document_quantities_follow_from_independent_matrices(simulator, printed, topology):
    chain_values, _, quantities = printed[topology]
    assert len(quantities) >= 5
    for quantity, values in quantities.items():
        expected = _expected(simulator, topology, chain_values, EXAMPLES[topology], quantity)
        np.testing.assert_allclose(values, expected, atol=PRINTED, err_msg=quantity)


@pytest.mark.parametrize("topology", EXAMPLES)
def test_document_machine_frame_is_that_of_the_product_and_of_independent_matrices(
    simulator, printed, topology
):
    chain_values, in_machine, _ = printed[topology]
    frame = machine_frame(tuple(chain_values), parse_topology(topology))
    product = dict(zip(frame.names, frame.matrix @ np.array(list(chain_values.values())), strict=True))
    assert product == pytest.approx(in_machine)
    frames = _frames(simulator, topology, chain_values)
    for name, value in in_machine.items():
        letter, axis = name[1], name[3:]
        if letter in "XYZ":
            matrix = frames[axis][:3, 3]["XYZ".index(letter)] * 1e3
        else:
            # A rotation about one direction, read from a direction across it.
            k = "ABC".index(letter)
            i, j = (k + 1) % 3, (k + 2) % 3
            matrix = frames[axis][j, i] * 1e6
        assert value == pytest.approx(matrix, abs=PRINTED), name


def test_document_error_vector_of_the_sphere_is_the_products(printed):
    topology = "w C B X b Z Y (C1) t"
    chain = parse_topology(topology, dict.fromkeys("XYZBC", 1))
    values = printed[topology][0]
    errors = np.zeros((2, len(chain.joints), 2, 6))
    for name in ("EX0C", "EY0C"):
        errors[:, chain.index("C"), 0, "XYZABC".index(name[1])] = values[name] * 1e-3
    start = np.array([80.0, 30.0, 0.0])
    positions = np.zeros((2, len(chain.joints)))
    positions[:, chain.index("C")] = (0.0, np.pi)
    # The linear axes put the tip at the sphere's nominal place: X moves the table, Y the tool.
    for row, at in enumerate((start, start * (-1.0, -1.0, 1.0))):
        positions[row, chain.index("X")], positions[row, chain.index("Y")] = -at[0], at[1]
    pose = evaluate(chain, positions, errors, np.tile(start, (2, 1)), np.zeros(3))
    vectors = np.einsum("nij,nj->ni", pose.work_rotation, pose.residual - pose.residual[0])
    quantity = "this product's error vector there, tool relative to the workpiece: X, Y"
    np.testing.assert_allclose(vectors[1, :2] * 1e3, printed[topology][2][quantity], atol=1e-6)


def test_frames_of_reference_of_every_kind():
    chain = parse_topology("w C B X b Z Y (C1) t")
    kinds = {
        name: frame_of(name, chain) for name in ("EA0C", "EB0Z", "EXX", "EYX:poly2", "EXX(-110)", "shape(W7)")
    }
    assert (kinds["EA0C"].kind, kinds["EA0C"].axis) == (FrameKind.PRECEDING_AXIS, "B")
    assert (kinds["EB0Z"].kind, kinds["EB0Z"].axis) == (FrameKind.MACHINE, None)
    assert {kinds[name].axis for name in ("EXX", "EYX:poly2", "EXX(-110)")} == {"X"}
    assert kinds["shape(W7)"] is None


def test_offsets_between_axes_are_levers_and_agree_with_matrices(simulator):
    # C stands 300 mm above B's axis and 40 mm beside it.
    axes = [
        ChainAxis("B", "rotary", "work", (0.0, 1.0, 0.0), (0.0, 0.0, 0.0), None),
        ChainAxis("C", "rotary", "work", (0.0, 0.0, 1.0), (40.0, 0.0, 300.0), None),
    ]
    values = {"EA0B": 50.0, "EC0B": -20.0, "EX0B": 3.0, "EZ0B": 4.0, "EX0C": 7.0, "EY0C": -8.0, "EA0C": 11.0}
    frame = machine_frame(tuple(values), chain_of_axes(axes))
    product = dict(zip(frame.names, frame.matrix @ np.array(list(values.values())), strict=True))
    chain = simulator.chain
    six = {
        axis: np.array([[values.get(f"E{c}0{axis}", 0.0) * (1e-3 if c in "XYZ" else 1e-6) for c in "XYZABC"]])
        for axis in "BC"
    }
    offset = np.eye(4)
    offset[:3, 3] = (40.0, 0.0, 300.0)
    place = (chain.small_motion(six["B"])[0] @ offset @ chain.small_motion(six["C"])[0])[:3, 3] - (
        40.0,
        0.0,
        300.0,
    )
    assert product["EX0C"] == pytest.approx(place[0] * 1e3, abs=1e-3)
    assert product["EY0C"] == pytest.approx(place[1] * 1e3, abs=1e-2)
    assert product["EA0C"] == pytest.approx(61.0)


def test_a_sum_with_an_unknown_part_is_left_out():
    chain = parse_topology("w C B X b Z Y (C1) t")
    assert machine_frame(["EA0C", "EB0C"], chain, ["EA0B"]).names == ("EB0C",)


def _machine_of_linear_axes(frames, first, second):
    """Columns: the directions of the machine, the first axis along its own letter, the second in the plane of both."""
    i, j = "XYZ".index(first), "XYZ".index(second)
    k = 3 - i - j
    directions = np.zeros((3, 3))
    directions[:, i] = _direction(frames, first) / np.linalg.norm(_direction(frames, first))
    across = _direction(frames, second) - directions[:, i] * (_direction(frames, second) @ directions[:, i])
    directions[:, j] = across / np.linalg.norm(across)
    # The third completes a right-handed system.
    directions[:, k] = np.cross(directions[:, (k + 1) % 3], directions[:, (k + 2) % 3])
    return directions


@pytest.mark.parametrize(
    "topology",
    ["w C A b X Y Z t", "w C B b Z X Y t", "w C A b Y X Z (C1) t", "w C Z A b X Y t"],
)
def test_iso230_1_the_machine_frame_is_that_of_the_linear_axes_where_none_is_the_first_to_carry_the_work(
    simulator, topology
):
    chain = parse_topology(topology)
    names = [name for name in base_effects(chain) if ":" not in name]
    values = dict(
        zip(names, np.random.default_rng(14).uniform(-60.0, 60.0, len(names)).round(1), strict=True)
    )
    frame = machine_frame(names, chain)
    product = dict(zip(frame.names, frame.matrix @ np.array(list(values.values())), strict=True))
    frames = _frames(simulator, topology, values)
    directions = _machine_of_linear_axes(frames, *[axis.name for axis in chain.tool if not axis.turns][:2])
    for name, value in product.items():
        letter, axis = name[1], name[3:]
        turned = directions.T @ frames[axis][:3, :3]
        if letter in "XYZ":
            expected = (directions.T @ frames[axis][:3, 3])["XYZ".index(letter)] * 1e3
        else:
            k = "ABC".index(letter)
            i, j = (k + 1) % 3, (k + 2) % 3
            expected = (turned[j, i] - turned[i, j]) / 2.0 * 1e6
        assert value == pytest.approx(expected, abs=0.02), name
    # The axis that the chain's frame was fixed to is tilted against the linear axes, which is what they are against it.
    tilted = [name for name in product if name[3:] == chain.work[0].name and name[1] in "ABC"]
    assert len(tilted) == 2
    first_linear = next(axis.name for axis in chain.tool if not axis.turns)
    fixed = FrameOfReference(FrameKind.PRECEDING_AXIS, chain.work[0].name)
    assert {frame_of(name, chain) for name in names if name[3:] == first_linear} == {fixed}


def test_an_axis_beside_the_first_does_not_say_how_the_machine_is_turned_about_it():
    """U or X2 lies along X: the machine has no turn about X of Y, as without it."""
    names = ("EA0Y", "EA0Z", "EA0C")
    with_it, without = (machine_frame(names, parse_topology(f"w C A b X {x2}Y Z t")) for x2 in ("X2 ", ""))
    assert with_it.names == without.names
    assert with_it.matrix == pytest.approx(without.matrix)


def test_two_methods_state_one_machine_where_no_linear_axis_carries_the_work():
    """One machine stated twice: by touches that take the linear axes as the machine, and relative to axis A."""
    chain = parse_topology("w C A b X Y Z t")
    of_probing = {"EB0A": 15.0, "EC0A": -35.0, "EA0C": 5.0, "EB0C": 22.0}
    # The same machine from axis A: every linear axis is turned the other way.
    of_samba = {"EA0C": 5.0, "EB0C": 22.0} | {f"E{c}0X": -of_probing[f"E{c}0A"] for c in "BC"}
    rows = []
    for values in (of_probing, of_samba):
        frame = machine_frame(tuple(values), chain)
        rows.append(dict(zip(frame.names, frame.matrix @ np.array(list(values.values())), strict=True)))
    assert rows[0] == pytest.approx({"EB0A": 15.0, "EC0A": -35.0, "EA0C": 5.0, "EB0C": 37.0})
    assert {name: rows[1][name] for name in rows[0]} == pytest.approx(rows[0])
