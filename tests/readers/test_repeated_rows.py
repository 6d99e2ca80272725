"""Rows that repeat rows before them: files joined with themselves are told, whatever kind of file it was."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.readers import read_campaign
from monitor.readers.repeated_rows import repeated_rows

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize("name", ["bar-xy.bar", "square.prn", "TCHPR421.TXT"])
def test_a_file_that_is_joined_with_itself_is_told(tmp_path: Path, name: str) -> None:
    source = next(path.parent for path in EXAMPLES.glob(f"files-*/{name}"))
    folder = tmp_path / source.name
    shutil.copytree(source, folder)
    (folder / name).write_bytes((source / name).read_bytes() * 2)
    (sentence,) = repeated_rows(read_campaign(folder))
    assert "in every number, which two measurements never do" in sentence
    assert not list(repeated_rows(read_campaign(source)))


def test_rows_in_another_order_or_with_one_other_digit_are_measured() -> None:
    campaign = read_campaign(EXAMPLES / "laser")
    probings, count = campaign.probings, len(campaign.probings)
    there = np.arange(count)
    back = replace(campaign, probings=probings.rows(np.concatenate([there, there[::-1]])))
    assert not list(repeated_rows(back))
    twice = probings.rows(np.concatenate([there, there]))
    readings = twice.channels["reading_um"].copy()
    readings[count::5] += 1e-5
    other = replace(campaign, probings=replace(twice, channels={**twice.channels, "reading_um": readings}))
    assert not list(repeated_rows(other))
    (sentence,) = repeated_rows(replace(campaign, probings=twice))
    # Rows that agree by chance in the first pass end a block.
    assert int(sentence.split()[0]) > 50
