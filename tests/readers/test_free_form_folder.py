"""Folders of the method free-form: what is refused, by file, line and column."""

from __future__ import annotations

from pathlib import Path

import pytest

from monitor.readers import read_campaign, write_campaign

EXAMPLE = Path(__file__).parents[2] / "examples" / "free-form-pocket"


TABLE = "[artefact.self_calibration]\n"
KEY = "artefact.self_calibration"
FIRST = "22.000000,15.000000,0.000000000,-1.000000000"


def first_lines(file, count):
    return "".join((EXAMPLE / file).read_text().splitlines(keepends=True)[:count])


@pytest.fixture
def pocket(tmp_path):
    """One run of the example."""
    folder = tmp_path / "pocket"
    folder.mkdir()
    (folder / "campaign.toml").write_text((EXAMPLE / "campaign.toml").read_text())
    (folder / "runs.csv").write_text(first_lines("runs.csv", 2))
    (folder / "probings.csv").write_text(first_lines("probings.csv", 369))
    return folder


def spoilt(folder, file, old, new):
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1))
    return folder


def test_a_sound_folder_says_nodes_length_and_normals(pocket):
    campaign = read_campaign(pocket)
    calibration = campaign.artefact.self_calibration
    assert calibration.nodes["X"] == tuple(range(-110, 111, 22))
    assert calibration.length.parameter == "EXX(110)"
    assert calibration.length.standard_uncertainty == pytest.approx(0.5e-3)
    assert calibration.conditions == ()
    assert campaign.probings.channels["normal_y"][0] == -1.0


def test_conditions_come_back_from_writing(pocket, tmp_path):
    spoilt(
        pocket,
        "campaign.toml",
        "[artefact.self_calibration]\n",
        '[artefact.self_calibration]\nconditions = ["EXX(0)", "shape turn"]\n',
    )
    campaign = read_campaign(pocket)
    again = read_campaign(write_campaign(campaign, tmp_path / "again"))
    assert again.artefact == campaign.artefact
    assert again.artefact.self_calibration.conditions == ("EXX(0)", "shape turn")


@pytest.mark.parametrize(
    ("old", "new", "column", "words"),
    [
        (
            "[artefact.self_calibration.nodes_mm]",
            "[artefact.self_calibration.nodes]",
            KEY + ".nodes",
            "this key is not known; did you mean 'nodes_mm'?",
        ),
        (
            "-110.0, -88.0",
            "-88.0, -110.0",
            KEY + ".nodes_mm.X",
            "-110 does not lie beyond -88; list the nodes in rising order",
        ),
        ("X = [", "X = 5 # [", KEY + ".nodes_mm.X", "5 is not a list of 2 to 99 readings in mm"),
        ("X = [", "B = [", KEY + ".nodes_mm.B", "the topology has no linear axis 'B'; its linear axes are"),
        ('parameter = "EXX(110)"\n', "", KEY + ".length.parameter", "this key is missing"),
        (
            "standard_uncertainty_um = 0.5",
            "standard_uncertainty_um = 0",
            KEY + ".length.standard_uncertainty_um",
            "must be greater than 0",
        ),
        (
            TABLE,
            '[artefact.self_calibration]\nconditions = ["EXX"]\n',
            KEY + ".conditions",
            "'EXX' is no condition; write a parameter that is zero, such as 'EYX(0)'",
        ),
        (
            TABLE,
            '[artefact.self_calibration]\nconditions = ["EXX(0)", "EXX(0)"]\n',
            KEY + ".conditions",
            "is listed twice",
        ),
        (TABLE, "[artefact.self_calibration]\ngauge = 1\n", KEY + ".gauge", "this key is not known"),
    ],
)
def test_bad_tables_are_refused_by_their_key(pocket, faults_of, old, new, column, words):
    faults = faults_of(spoilt(pocket, "campaign.toml", old, new))
    assert column in [fault.column for fault in faults]
    assert any(words in fault.message for fault in faults)


def test_without_a_table_there_are_no_nodes(pocket, faults_of):
    text = (pocket / "campaign.toml").read_text()
    (pocket / "campaign.toml").write_text(text[: text.index("[artefact.self_calibration]")])
    (fault,) = faults_of(pocket)
    assert (
        "the table [artefact.self_calibration] is missing; the method free-form needs its nodes"
        in fault.message
    )


@pytest.mark.parametrize(
    ("old", "new", "line", "column", "words"),
    [
        ("normal_x,normal_y", "normal_x,rough_um", 1, "normal_x", "needs two or three of"),
        (
            FIRST,
            "22.000000,15.000000,0.500000000,-1.000000000",
            2,
            "normal_x",
            "the normal has length 1.1180",
        ),
        (
            FIRST,
            "22.000000,15.100000,0.000000000,-1.000000000",
            94,
            "nominal_y_mm",
            "point 'W1' has another value on line 2",
        ),
        (
            FIRST,
            ",15.000000,0.000000000,-1.000000000",
            2,
            "nominal_x_mm",
            "this cell is empty; every probing needs it",
        ),
        (
            "1,1,0.0,W1,22.000000",
            "1,1,0.0,W1,122.000000",
            2,
            "x_mm",
            "122 mm lies beyond the nodes of X, -110 to 110 mm; add a node",
        ),
    ],
)
def test_bad_rows_are_refused_by_line_and_column(pocket, faults_of, old, new, line, column, words):
    faults = faults_of(spoilt(pocket, "probings.csv", old, new))
    assert (line, column) in [(fault.line, fault.column) for fault in faults]
    assert any(words in fault.message for fault in faults)
