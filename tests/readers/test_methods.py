"""The methods' own rules: which columns and artefacts a campaign of each method may hold."""

from __future__ import annotations

import pytest

from monitor.readers import method_rules, read_campaign

CMM = """\
format = 1
campaign = "cmm"
method = "{}"
[machine]
id = "K1"
topology = "w Y b X Z t"
[probe]
id = "p"
model = "m"
standard_uncertainty_um = 1
"""
RUNS = "run,started_at,day,warm_up,ambient_degC\n1,2026-03-02T08:37:06Z,1,false,20\n"
PROBINGS = "run,sequence,time_s,target,x_mm,y_mm,z_mm,{}\n1,1,0,start,0,0,0,0.5\n1,2,1,end,100,0,0,0.7\n"


def write(folder, method, column):
    (folder / "campaign.toml").write_text(CMM.format(method))
    (folder / "runs.csv").write_text(RUNS)
    (folder / "probings.csv").write_text(PROBINGS.format(column))
    return folder


def test_the_methods_of_the_format_are_there():
    assert {"samba", "rotary-probing", "free-form", "l-shape"} <= set(method_rules())


@pytest.mark.parametrize("method", ["loose"])
@pytest.mark.parametrize("column", ["pitch_deg", "straightness_um", "room_degC", "gap_mm"])
def test_other_methods_add_columns_with_a_unit_and_need_no_balls(tmp_path, method, column):
    campaign = read_campaign(write(tmp_path, method, column))
    assert campaign.artefact.balls == ()
    assert set(campaign.probings.readings) == {"X", "Y", "Z"}
    assert campaign.probings.channels[column].tolist() == [0.5, 0.7]


@pytest.mark.parametrize("method", ["loose"])
def test_a_column_without_a_unit_is_refused(tmp_path, faults_of, method):
    (fault,) = faults_of(write(tmp_path, method, "angle"))
    assert (fault.file, fault.line, fault.column) == ("probings.csv", 1, "angle")
    assert (
        "the unit of 'angle' is not known; end the name of a recorded column in _um, _mm, _deg"
        in fault.message
    )


def test_a_machine_without_spindle_has_no_column_for_one(tmp_path, faults_of):
    (fault,) = faults_of(write(tmp_path, "loose", "c1_deg"))
    assert "the topology has no axis for 'c1_deg'; its columns are y_mm, x_mm, z_mm" in fault.message
