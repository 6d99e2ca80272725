"""Rows that repeat rows before them: files joined with themselves are told, whatever kind of file it was."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.readers import read_campaign
from monitor.readers.repeated_rows import repeated_rows
from monitor.records import Campaign

Seeds = Callable[[int, int], Iterable[int]]
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize("name", ["bar-xy.bar", "square.prn", "TCHPR421.TXT"])
def test_a_file_that_is_joined_with_itself_is_told(tmp_path: Path, name: str) -> None:
    source = next(path.parent for path in EXAMPLES.glob(f"files-*/{name}"))
    folder = tmp_path / source.name
    shutil.copytree(source, folder)
    (folder / name).write_bytes((source / name).read_bytes() * 2)
    (sentence,) = repeated_rows(read_campaign(folder))
    assert " on in every number; of " in sentence
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


def cycles(seed: int, scatter_um: float, resolution_um: float, count: int = 10) -> Campaign:
    """Eleven stops of a laser, ``count`` times in one direction, on a display of a resolution; then other axes."""
    campaign, rng = read_campaign(EXAMPLES / "laser"), np.random.default_rng(seed)
    rows = np.concatenate([np.tile(np.arange(11), count), np.arange(110, len(campaign.probings))])
    probings = campaign.probings.rows(rows)
    reading, repeated = probings.channels["reading_um"].copy(), slice(0, 11 * count)
    # Where a stop lies between two digits of the display.
    between = np.tile(rng.uniform(-0.5, 0.5, 11) * resolution_um, count)
    seen = reading[repeated] + between + rng.normal(0.0, scatter_um, 11 * count)
    reading[repeated] = np.round(seen / resolution_um) * resolution_um
    return numbered(
        replace(campaign, probings=replace(probings, channels={**probings.channels, "reading_um": reading}))
    )


def numbered(campaign: Campaign) -> Campaign:
    sequence = np.arange(1, len(campaign.probings) + 1)
    return replace(campaign, probings=replace(campaign.probings, sequence=sequence))


def with_copy(campaign: Campaign, first: int, count: int) -> Campaign:
    """A campaign in which so many rows stand a second time behind themselves."""
    rows = np.arange(len(campaign.probings))
    again = np.concatenate([rows[: first + count], rows[first : first + count], rows[first + count :]])
    return numbered(replace(campaign, probings=campaign.probings.rows(again)))


def told(campaigns: Iterable[Campaign]) -> int:
    return sum(bool(list(repeated_rows(campaign))) for campaign in campaigns)


@pytest.mark.parametrize("scatter_um", [0.15, 0.3, 1.0])
def test_a_coarse_display_of_a_stable_machine_repeats_itself(seeds: Seeds, scatter_um: float) -> None:
    """Of 100 seeds each none is told at ten cycles (82, 59 and none were, when eight equal rows were enough)."""
    assert told(cycles(seed, scatter_um, 1.0) for seed in seeds(100, 15)) == 0


@pytest.mark.parametrize("scatter_um", [0.05, 0.075, 0.1])
@pytest.mark.parametrize("count", [2, 3, 4, 10, 20])
def test_passes_that_scatter_far_less_than_a_digit_are_no_copies(
    seeds: Seeds, scatter_um: float, count: int
) -> None:
    """Of 200 seeds each none is told (31 of ten passes at 0.05 and 84 of three, when they were taken for copies)."""
    assert told(cycles(seed, scatter_um, 1.0, count) for seed in seeds(100, 8)) == 0


def test_a_fine_display_that_repeats_its_passes_is_a_file_joined_with_itself() -> None:
    campaign = cycles(3, 0.3, 0.01, 1)
    rows = np.concatenate([np.tile(np.arange(11), 4), np.arange(11, len(campaign.probings))])
    joined = numbered(replace(campaign, probings=campaign.probings.rows(rows)))
    (sentence,) = repeated_rows(joined)
    assert sentence.startswith("33 rows of run 1, from sequence 12 on, equal those from sequence 1 on")


@pytest.mark.parametrize(
    ("resolution_um", "scatter_um", "least"),
    [(0.01, 0.3, 1.0), (0.1, 0.3, 1.0), (1.0, 1.0, 1.0), (1.0, 0.3, 0.8)],
)
@pytest.mark.parametrize("count", [8, 20])
def test_rows_that_stand_there_twice_are_told(
    seeds: Seeds, count: int, resolution_um: float, scatter_um: float, least: float
) -> None:
    """Of 100 seeds each 100 are told, of 20 rows on the coarsest display 89."""
    tried = list(seeds(100, 15))
    copied = [
        with_copy(
            cycles(seed, scatter_um, resolution_um),
            int(np.random.default_rng(seed + 1000).integers(0, 110 - count)),
            count,
        )
        for seed in tried
    ]
    assert told(copied) >= least * len(tried)
    if resolution_um < 0.1:
        (sentence,) = repeated_rows(copied[0])
        assert re.match(
            rf"{count} rows of run 1, from sequence \d+ on, equal those from sequence \d+ on in every",
            sentence,
        )
