"""Campaign format 1: the folder as a whole, and all its faults told together."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from monitor.exceptions import CampaignError
from monitor.readers import files, read_campaign


@pytest.mark.parametrize("name", ["campaign.toml", "runs.csv", "probings.csv"])
def test_format_1_missing_file(small, faults_of, name):
    (small / name).unlink()
    there = sorted({"campaign.toml", "runs.csv", "probings.csv"} - {name})
    (fault,) = faults_of(small)
    assert (fault.file, fault.line) == (name, None)
    assert fault.message == f"the file is missing; the folder holds {', '.join(there)}"


def test_format_1_empty_folder(tmp_path, faults_of):
    assert [fault.message for fault in faults_of(tmp_path)] == [
        "the file is missing; the folder holds nothing"
    ] * 3


def test_folder_that_is_a_file(small):
    with pytest.raises(CampaignError, match="this is a file; give the folder that holds"):
        read_campaign(small / "runs.csv")


@pytest.mark.parametrize("name", ["nowhere", "a\0b", "x" * 5000, "\udcff"])
def test_folder_that_is_not_there(tmp_path, name):
    with pytest.raises(CampaignError, match="there is no such folder; give a folder with"):
        read_campaign(tmp_path / name)


def test_file_that_is_a_folder(small, faults_of):
    (small / "runs.csv").unlink()
    (small / "runs.csv").mkdir()
    assert [fault.message for fault in faults_of(small)] == [
        "this is not a regular file; a text file is needed"
    ]


def test_file_that_is_a_pipe_is_not_waited_for(small, faults_of):
    (small / "runs.csv").unlink()
    os.mkfifo(small / "runs.csv")
    assert [fault.message for fault in faults_of(small)] == [
        "this is not a regular file; a text file is needed"
    ]


def test_file_larger_than_the_limit_is_refused_unread(small, faults_of):
    with (small / "probings.csv").open("r+b") as stream:
        stream.truncate(files.LARGEST_CSV + 1)  # a sparse file: no byte is written
    assert [fault.message for fault in faults_of(small)] == [
        "the file is larger than 256 MiB; split the campaign"
    ]


def test_format_1_all_faults_are_listed_together_by_file_and_line(small, spoil, faults_of):
    spoil("campaign.toml", "length_mm = 304.98923", "length_mm = 0")
    spoil("runs.csv", "22.08", "NaN")
    spoil("runs.csv", "true", "yes")
    spoil("probings.csv", "1,3,120.0,1", "1,3,120.0,9")
    spoil("probings.csv", "2,2,60.0", "2,1,60.0")
    found = [(fault.file, fault.line, fault.column) for fault in faults_of(small)]
    assert found == [
        ("campaign.toml", 47, "artefact.scale_bar.length_mm"),
        ("runs.csv", 2, "ambient_degC"),
        ("runs.csv", 3, "warm_up"),
        ("probings.csv", 4, "target"),
        ("probings.csv", 8, "sequence"),
    ]


def test_format_1_first_twenty_in_full(small):
    path = small / "probings.csv"
    header, *rows = path.read_text().splitlines()
    header += "".join(f",furlong{k}" for k in range(30))
    path.write_text("\n".join([header, *(row + 30 * ",1" for row in rows)]) + "\n")
    with pytest.raises(
        CampaignError, match=r"30 faults\.\n(  probings\.csv, line .*\n){20}  \.\.\. and 10 more\.$"
    ):
        read_campaign(small)


def test_faults_that_differ_in_their_cells_alone_are_told_once(small):
    path = small / "probings.csv"
    header, *rows = path.read_text().splitlines()
    spoilt = [",".join([*row.split(",")[:4], f'"{k},5"', *row.split(",")[5:]]) for k, row in enumerate(rows)]
    path.write_text("\n".join([header, *spoilt]) + "\n")
    told = (
        r"10 faults\.\n  probings\.csv, line 2, column x_mm: '0,5' is not a number: it has a decimal comma; "
        r"write a decimal point, 0\.5, and no thousands separators \(and 9 more like it, to line 11\)$"
    )
    with pytest.raises(CampaignError, match=told):
        read_campaign(small)


def test_the_same_words_on_many_lines_are_told_once(small):
    path = small / "probings.csv"
    header, *rows = path.read_text().splitlines()
    spoilt = [",".join([*row.split(",")[:4], "n/a", *row.split(",")[5:]]) for row in rows]
    path.write_text("\n".join([header, *spoilt]) + "\n")
    told = r"10 faults\.\n  probings\.csv, line 2, column x_mm: 'n/a' .* \(and 9 more like it, to line 11\)$"
    with pytest.raises(CampaignError, match=told):
        read_campaign(small)


def test_unknown_run_on_many_lines_is_one_fault(small, faults_of):
    path = small / "probings.csv"
    path.write_text(path.read_text().replace("\n2,", "\n33,"))
    messages = {fault.file: fault.message for fault in faults_of(small)}
    assert "run 33 is not listed in runs.csv" in messages["probings.csv"]
    assert "(and on 4 more lines, to line 11)" in messages["probings.csv"]
    assert "run 2 has no row in probings.csv" in messages["runs.csv"]


def test_what_can_be_checked_is_checked_without_a_readable_toml(small, faults_of):
    Path(small / "campaign.toml").write_text("format = ")
    path = small / "probings.csv"
    path.write_text(path.read_text().replace("51.730164", "oops"))
    assert [fault.file for fault in faults_of(small)] == ["campaign.toml", "probings.csv"]
