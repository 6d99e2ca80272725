"""Freely placed axes: every refusal of the chain tables by its message, line and key; and the way there and back."""

# ruff: noqa: E501 (one case a line)

from __future__ import annotations

import dataclasses
import math

import pytest

from monitor.readers import read_campaign, write_campaign
from monitor.records import ChainAxis
from monitor.store.record_json import machine_json, machine_record

T = "campaign.toml"
ROBOT = """\
format = 1
campaign = "robot"
method = "loose"
[machine]
id = "R1"
gravity = [0.0, 0.0, 1.0]
[[machine.work_chain]]
name = "rail"
kind = "linear"
along = "Y"
[[machine.tool_chain]]
name = "J1"
kind = "rotary"
about = "Z"
offset_mm = [0.0, 0.0, 290.0]
sign = -1
[[machine.tool_chain]]
name = "J2"
kind = "rotary"
about = [0.0, 0.7071, 0.7071]
[[machine.tool_chain]]
name = "S"
kind = "spindle"
about = "X"
[machine.axes.J2]
stroke_deg = [-90.0, 90.0]
gear_ratio = 121.0
[machine.tolerances]
EA0J2 = 100.0
EXrail = 20.0
[probe]
id = "p"
model = "m"
standard_uncertainty_um = 20
"""
RUNS = "run,started_at,day,warm_up,ambient_degC\n1,2026-03-02T08:37:06Z,1,false,20\n"
PROBINGS = "run,sequence,time_s,target,rail_mm,j1_deg,j2_deg,s_deg\n1,1,0,a,500.1,10.1,-20.2,0\n1,2,1,a,100,11.3,30,5\n"


@pytest.fixture
def robot(tmp_path):
    """A folder of a robot on a rail, without a fault."""
    folder = tmp_path / "robot"
    folder.mkdir()
    for name, text in ((T, ROBOT), ("runs.csv", RUNS), ("probings.csv", PROBINGS)):
        (folder / name).write_text(text)
    return folder


def spoilt(folder, old, new):
    assert ROBOT.count(old) == 1, old
    (folder / T).write_text(ROBOT.replace(old, new))
    return folder


def test_freely_placed_axes_in_internal_units(robot):
    campaign = read_campaign(robot)
    half = 1.0 / math.sqrt(2.0)
    rail, one, two, spindle = campaign.machine.chain
    assert rail == ChainAxis("rail", "linear", "work", (0.0, 1.0, 0.0))
    assert one == ChainAxis("J1", "rotary", "tool", (0.0, 0.0, 1.0), (0.0, 0.0, 290.0), -1)
    assert two.direction == pytest.approx((0.0, half, half), abs=1e-15)
    assert spindle.kind == "spindle"
    assert campaign.machine.topology == "w rail b J1 J2 (S) t"
    assert campaign.machine.gravity == (0.0, 0.0, 1.0)
    assert campaign.machine.axes["J2"].gear_ratio == 121.0
    assert campaign.probings.readings["rail"][0] == 500.1
    assert campaign.probings.readings["J1"][0] == 10.1 * (math.pi / 180)


def test_freely_placed_axes_come_back_from_writing(robot, tmp_path):
    campaign = read_campaign(robot)
    again = read_campaign(write_campaign(campaign, tmp_path / "again"))
    assert again.machine == campaign.machine
    for axis, values in campaign.probings.readings.items():
        assert again.probings.readings[axis].tolist() == values.tolist()


def test_freely_placed_axes_come_back_from_the_store(robot):
    machine = read_campaign(robot).machine
    assert machine_record(machine_json(machine)) == machine


def test_a_machine_of_letters_is_stored_as_ever(robot):
    machine = dataclasses.replace(
        read_campaign(robot).machine, chain=(), gravity=None, axes={}, topology="w X b Y t"
    )
    assert machine_json(machine) == (
        '{"id": "R1", "topology": "w X b Y t", "manufacturer": null, "model": null, "serial_number": null, '
        '"location": null, "axes": {}, "tolerances": {"EA0J2": 100.0, "EXrail": 20.0}}'
    )


@pytest.mark.parametrize(
    ("old", "new", "line", "key", "words"),
    [
        ('id = "R1"', 'id = "R1"\ntopology = "w b X t"', 6, "machine.topology", "[[machine.work_chain]] places the axes already; leave out topology"),
        ('name = "rail"\n', "", 7, "machine.work_chain[1].name", 'this key is missing; write for example name = "J1"'),
        ('name = "rail"', 'name = "1A"', 8, "machine.work_chain[1].name", "'1A' cannot name an axis: write a letter, then letters and digits, such as J1"),
        ('name = "rail"', 'name = "x_axis"', 8, "machine.work_chain[1].name", "'x_axis' cannot name an axis"),
        ('name = "rail"', f'name = "{"r" * 17}"', 8, "machine.work_chain[1].name", "cannot name an axis"),
        ('name = "rail"', 'name = "j2"', 18, "machine.tool_chain[2].name", "axis J2 appears twice (small and capital letters are the same in columns)"),
        ('kind = "linear"', 'kind = "prismatic"', 9, "machine.work_chain[1].kind", "'prismatic' is no kind of axis; write linear, rotary or spindle"),
        ('kind = "linear"', 'kind = "strut"', 9, "machine.work_chain[1].kind", "hexapods, delta robots and other parallel kinematics cannot be identified here"),
        ('kind = "linear"\n', "", 7, "machine.work_chain[1].kind", 'this key is missing; write for example kind = "rotary"'),
        ('along = "Y"', 'about = "Y"', 10, "machine.work_chain[1].about", "a linear axis travels along a direction: write along = ... instead of about"),
        ('about = "Z"', 'along = "Z"', 14, "machine.tool_chain[1].along", "a rotary axis turns about a direction: write about = ... instead of along"),
        ('along = "Y"\n', "", 7, "machine.work_chain[1].along", 'this key is missing; write for example along = "Z"'),
        ('along = "Y"', 'along = "A"', 10, "machine.work_chain[1].along", "'A' is no direction; write X, Y, Z or a unit vector"),
        ('along = "Y"', "along = 1", 10, "machine.work_chain[1].along", "1 is no direction; write X, Y, Z or a unit vector"),
        ("[0.0, 0.7071, 0.7071]", "[0.0, 1.0]", 20, "machine.tool_chain[2].about", "[0.0, 1.0] is no direction"),
        ("[0.0, 0.7071, 0.7071]", "[0.0, 3.0, 4.0]", 20, "machine.tool_chain[2].about", "the direction has the length 5; a unit vector has 1: write [0, 0.6, 0.8]"),
        ("[0.0, 0.7071, 0.7071]", "[0.0, 0.0, 0.0]", 20, "machine.tool_chain[2].about", "the direction has no length; write X, Y, Z or a unit vector"),
        ("[0.0, 0.7071, 0.7071]", "[0.0, nan, 0.0]", 20, "machine.tool_chain[2].about", "nan is not a finite number"),
        ("[0.0, 0.0, 290.0]", "[0.0, 290.0]", 15, "machine.tool_chain[1].offset_mm", "is not 3 numbers; write for example offset_mm = [0.0, 0.0, 400.0]"),
        ("[0.0, 0.0, 290.0]", "[0.0, 0.0, 2.9e6]", 15, "machine.tool_chain[1].offset_mm", "is beyond 100000 mm; is its unit mm?"),
        ("sign = -1", "sign = 0", 16, "machine.tool_chain[1].sign", "0 is not a sign; write sign = 1 or sign = -1"),
        ("sign = -1", "stroke_deg = [0, 1]", 16, "machine.tool_chain[1].stroke_deg", "this key is not known; the keys here are name, kind, about"),
        ("[machine.axes.J2]", "[machine.axes.J1]\nsign = 1\n[machine.axes.J2]", 26, "machine.axes.J1.sign", "the chain gives axis J1 a sign already; write it in one place"),
        ("[machine.axes.J2]", "[machine.axes.J3]", 25, "machine.axes.J3", "the topology has no axis 'J3'; its axes are rail, J1, J2, S"),
        ("gear_ratio = 121.0", "gear_ratio = -121.0", 27, "machine.axes.J2.gear_ratio", "-121.0 must be greater than 0"),
        ("EA0J2", "EA0J3", 29, "machine.tolerances.EA0J3", "the topology has no axis J3; its axes are rail, J1, J2, S"),
        ("[0.0, 0.0, 1.0]", "[0.0, 0.0, 9.81]", 6, "machine.gravity", "the direction has the length 9.81; a unit vector has 1: write [0, 0, 1]"),
        ("[0.0, 0.0, 1.0]", '"down"', 6, "machine.gravity", "'down' is no direction"),
        ('name = "J2"\nkind = "rotary"', 'name = "J2"\nkind = "spindle"', 19, "machine.tool_chain[2].kind", "a spindle is the last axis of the tool chain; write rotary, or put it last"),
    ],
)  # fmt: skip
def test_chain_tables_bad_key_is_named_with_its_line(robot, faults_of, old, new, line, key, words):
    faults = [fault for fault in faults_of(spoilt(robot, old, new)) if fault.file == T]
    told = [(fault.line, fault.column, fault.message) for fault in faults]
    assert any(
        (line is None or found == line) and column == key and words in message
        for found, column, message in told
    ), told


def test_chain_tables_at_most_nine_joints(robot, faults_of):
    more = "".join(f'[[machine.tool_chain]]\nname = "K{n}"\nkind = "rotary"\nabout = "X"\n' for n in range(6))
    at = "[[machine.work_chain]]"
    told = [(fault.line, fault.column, fault.message) for fault in faults_of(spoilt(robot, at, more + at))]
    words = "the chain has 10 joints; a serial machine here has at most 9 of them"
    assert (45, "machine.tool_chain[9]", words) in told


def test_chain_tables_need_an_axis(robot, faults_of):
    text = (
        ROBOT[: ROBOT.index("[[machine.work_chain]]")] + "tool_chain = []\n" + ROBOT[ROBOT.index("[probe]") :]
    )
    (robot / T).write_text(text)
    assert any(
        "the chain has no axis; write [[machine.tool_chain]] above each of them" in fault.message
        for fault in faults_of(robot)
    )


def test_a_column_of_no_axis_is_refused(robot, faults_of):
    (robot / "probings.csv").write_text(PROBINGS.replace("j2_deg", "j3_deg"))
    told = [fault.message for fault in faults_of(robot)]
    assert any(
        "the topology has no axis for 'j3_deg'; its columns are rail_mm, j1_deg, j2_deg, s_deg" in one
        for one in told
    )
