"""Campaign format 1: every refusal of ``campaign.toml``, by its message, line and key."""

# ruff: noqa: E501 (one case a line)

from __future__ import annotations

import pytest

from monitor.exceptions import CampaignError, Fault

T = "campaign.toml"
TOPOLOGY = '"w C B X b Z Y (C1) t"'

ONE_FAULT = [
    ("format = 1", "format = 2", 1, "format", "format 2 is not known; this software reads format = 1"),
    ("format = 1", "format = true", 1, "format", "format True is not known"),
    ("format = 1\n", "", None, "format", "this key is missing; write for example format = 1"),
    ('campaign = "small"', "campaign = 5", 2, "campaign", "5 is not a text; write it in quotes"),
    ('campaign = "small"', 'campaign = " "', 2, "campaign", "is empty or begins or ends with a space"),
    ('campaign = "small"', 'campaign = "a\\u0007"', 2, "campaign", "one line of at most 200 printable characters"),
    ('campaign = "small"', f'campaign = "{"a" * 201}"', 2, "campaign", "at most 200 printable characters"),
    ('"samba"', '"sambo"', 3, "method", "method 'sambo' is not known; did you mean 'samba'? the methods are free-form"),
    ('[machine]\nid = "M1"', "[machine]", 5, "machine.id", "this key is missing; write for example id ="),
    ('id = "M1"', 'id = "M1"\nvendor = "x"', 7, "machine.vendor", "this key is not known; the keys here are id, topology"),
    ('id = "M1"', 'id = "M1"\nmanufacturr = "x"', 7, "machine.manufacturr", "did you mean 'manufacturer'?"),
    ('id = "M1"', 'id = "M1"\nvertical = "Y"', 7, "machine.vertical", "this key is not known"),
    # a topology that cannot be parsed
    (TOPOLOGY, '"w C B X Z Y (C1) t"', 7, "machine.topology", "cannot be parsed: name w (workpiece), b (bed) and t (tool) once each"),
    (TOPOLOGY, '"hexapod"', 7, "machine.topology", "one serial chain, each axis carried by the one before it; hexapods, delta robots"),
    (TOPOLOGY, '"C w B X b Z Y (C1) t"', 7, "machine.topology", "must begin with w and end with t"),
    (TOPOLOGY, '"w C B X b Z Y (C) t"', 7, "machine.topology", "axis C appears twice; name each axis once"),
    (TOPOLOGY, '"w C B Q b Z Y (C1) t"', 7, "machine.topology", "an axis cannot be called Q"),
    (TOPOLOGY, '"w C B X b Z Y (X1) t"', 7, "machine.topology", "a spindle cannot be called X1; the letters are A, B, C"),
    (TOPOLOGY, '"w C B X b (C1) Z Y t"', 7, "machine.topology", "the spindle in brackets stands once, just before t"),
    (TOPOLOGY, '"w C B X b Z Y (C1 t"', 7, "machine.topology", "'(' has no meaning in a topology"),
    (TOPOLOGY, '"w b t"', 7, "machine.topology", "the topology has no axis; an example is"),
    (TOPOLOGY, '"five axes"', 7, "machine.topology", "has no meaning in a topology"),
    # axes and tolerances
    ("sign = -1", "sign = -2", 10, "machine.axes.X.sign", "-2 is not a sign; write sign = 1 or sign = -1"),
    ("sign = -1", "sign = true", 10, "machine.axes.X.sign", "True is not a sign"),
    ("[machine.axes.X]", "[machine.axes.A]", 9, "machine.axes.A", "the topology has no axis 'A'; its axes are C, B, X, Z, Y, C1"),
    ("[-300.0, 300.0]", "[300.0, -300.0]", 11, "machine.axes.X.stroke_mm", "300 is not below -300; write stroke_mm = [lowest, highest]"),
    ("[-300.0, 300.0]", "[-300.0]", 11, "machine.axes.X.stroke_mm", "is not 2 numbers"),
    ("[-300.0, 300.0]", "[-300.0, inf]", 11, "machine.axes.X.stroke_mm", "is not a finite number"),
    ("stroke_deg", "stroke_mm", 15, "machine.axes.B.stroke_mm", "axis B is rotary: write stroke_deg = [lowest, highest]"),
    ("scale_pitch_mm = 0.02", "scale_pitch_mm = 0", 12, "machine.axes.X.scale_pitch_mm", "0 must be greater than 0"),
    ("EC0Y = 20.0", "EC0Y = -20.0", 18, "machine.tolerances.EC0Y", "-20.0 must be greater than 0"),
    ("EC0Y = 20.0", "squareness = 20.0", 18, "machine.tolerances.squareness", "is not the name of a term; write it as in ISO 230-1"),
    ("EC0Y = 20.0", '"EAA:reversal" = 20.0', 18, "machine.tolerances.EAA:reversal", "the topology has no axis A"),
    ("EC0Y = 20.0", '"EXX:reversal" = 0', 18, "machine.tolerances.EXX:reversal", "0 must be greater than 0"),
    ("EC0Y = 20.0", "EC0A = 20.0", 18, "machine.tolerances.EC0A", "the topology has no axis A"),
    ("EC0Y = 20.0", "ECOY = 20.0", 18, "machine.tolerances.ECOY", "the topology has no axis OY; did you mean 'EC0Y'? its axes are"),
    ("EC0Y = 20.0", "EC0y = 20.0", 18, "machine.tolerances.EC0y", "the topology has no axis y; did you mean 'EC0Y'? its axes are"),
    # probe and artefact
    ("standard_uncertainty_um = 0.7", 'standard_uncertainty_um = "0,7"', 24, "probe.standard_uncertainty_um", "'0,7' is not a number; write standard_uncertainty_um = 0.7 (in um)"),
    ("standard_uncertainty_um = 0.7", "standard_uncertainty_um = nan", 24, "probe.standard_uncertainty_um", "nan is not a finite number"),
    ("standard_uncertainty_um = 0.7", "standard_uncertainty_um = 0.0", 24, "probe.standard_uncertainty_um", "0.0 must be greater than 0"),
    ("standard_uncertainty_um = 0.7", f"standard_uncertainty_um = 1{'0' * 400}", 24, "probe.standard_uncertainty_um", "is not a finite number"),
    ("standard_uncertainty_um = 0.7", f"standard_uncertainty_um = 0x{'f' * 5000}", 24, "probe.standard_uncertainty_um", "a value too long to repeat is not a finite number"),
    ("standard_uncertainty_um", "standard_uncertainty_mm", 24, "probe.standard_uncertainty_mm", None),
    ("[0.0, 0.1, -150.0]", "[0.0, 0.1]", 25, "probe.tip_mm", "is not 3 numbers; write for example tip_mm = [0.0, 0.0, -150.0]"),
    ('id = "S2"', 'id = "S1"', 41, "artefact.balls[3].id", None),
    ('id = "S2"', "id = 2", 41, "artefact.balls[3].id", "2 is not a text; write it in quotes"),
    ("[118.0, 6.0, 178.8]", "[118000000.0, 6.0, 178.8]", 32, "artefact.balls[1].nominal_mm", "is beyond 100000 mm; is its unit mm?"),
    ('["S1", "S2"]', '["S1", "S3"]', 46, "artefact.scale_bar.balls", "there is no ball 'S3'; the balls are 1, S1, S2"),
    ('["S1", "S2"]', '["S1", "S1"]', 46, "artefact.scale_bar.balls", "both ends are 'S1'; a bar has two balls"),
    ('[-150.0, -152.494615, 60.0]', '[-150.0, 152.494615, 60]', 45, "artefact.scale_bar", "its balls 'S1' and 'S2' have the same nominal_mm"),
    ('["S1", "S2"]', '"S1"', 46, "artefact.scale_bar.balls", "'S1' is not two ball ids"),
    ("304.98923", "-304.98923", 47, "artefact.scale_bar.length_mm", "-304.98923 must be greater than 0 (in mm)"),
    ("11.5e-6", "11.5", 50, "artefact.scale_bar.expansion_coefficient_per_K", "11.5 is beyond 0.001 1/K; is its unit 1/K?"),
    # the file itself
    ("sign = -1", "sign = ", 10, None, "this is not TOML at character 8: Invalid value"),
    ("sign = -1", "sign = 1\nsign = 1", 11, None, "this is not TOML at character 9: Cannot overwrite a value"),
    ("sign = -1", "sign = " + "[" * 5000, None, None, "the brackets are nested too deeply"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line", "key", "words"), ONE_FAULT)
def test_format_1_bad_key_is_named_with_its_line(spoil, faults_of, old, new, line, key, words):
    faults = [fault for fault in faults_of(spoil(T, old, new)) if fault.file == T]
    assert (line, key) in [(fault.line, fault.column) for fault in faults]
    if words is not None:
        assert len(faults) == 1
        assert words in faults[0].message


def test_format_1_a_key_misspelt_in_every_ball_is_one_line(small, faults_of):
    text = (small / T).read_text()
    count = text.count("nominal_mm")
    (small / T).write_text(text.replace("nominal_mm", "nominl_mm"))
    faults = faults_of(small)
    assert [fault.column for fault in faults] == [
        f"artefact.balls[{i}].nominl_mm" for i in range(1, count + 1)
    ]
    assert all("this key is not known; did you mean 'nominal_mm'?" in fault.message for fault in faults)
    said = str(CampaignError("small", faults)).splitlines()
    assert len(said) == 2
    assert said[1].endswith(f"(and {count - 1} more like it, to line {faults[-1].line})")


def test_faults_without_a_line_are_counted_without_one():
    faults = tuple(
        Fault("campaign.toml", None, "setups", f"setup '{name}' has no row in probings.csv")
        for name in "abcdefgh"
    )
    assert str(CampaignError("week", faults)).endswith("has no row in probings.csv (and 7 more like it)")


@pytest.mark.parametrize("table", ["machine", "probe"])
def test_format_1_missing_table(small, faults_of, table):
    text = (small / T).read_text().replace(f"[{table}", f"[left_out_{table}")
    (small / T).write_text(text)
    assert any(f"the table [{table}] is missing" in fault.message for fault in faults_of(small))


def test_format_1_samba_needs_a_bar(small, faults_of):
    text = (small / T).read_text()
    (small / T).write_text(text[: text.index("[artefact.scale_bar]")])
    (fault,) = faults_of(small)
    assert (
        "the table [artefact.scale_bar] is missing; the method samba needs a calibrated bar" in fault.message
    )


def test_format_1_samba_needs_a_ball_beside_the_bar(small, faults_of):
    text = (small / T).read_text()
    start, end = text.index('[[artefact.balls]]\nid = "1"'), text.index('[[artefact.balls]]\nid = "S1"')
    (small / T).write_text(text[:start] + text[end:])
    assert any(
        "there is no [[artefact.balls]] beside the bar's" in fault.message for fault in faults_of(small)
    )


def test_format_1_wrong_kind_of_table(spoil, faults_of):
    faults = faults_of(
        spoil(T, '[probe]\nid = "probe-1"\nmodel = "touch-trigger probe"', "[[probe]]\nid = 1")
    )
    assert any("write [probe] and its keys below" in fault.message for fault in faults)
