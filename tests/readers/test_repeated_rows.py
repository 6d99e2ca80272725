"""Rows that repeat rows before them: files joined with themselves are told, whatever kind of file it was."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.readers import doubts, read_campaign, read_exports
from monitor.readers.doubts.repeated_rows import repeated_rows
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


def accused(campaigns: Iterable[Campaign]) -> int:
    """How many are said to hold copies, and not that their display may hide the scatter."""
    return sum(
        "hides the scatter" not in sentence for campaign in campaigns for sentence in repeated_rows(campaign)
    )


def passes(
    seed: int,
    scatter: float,
    directions: Sequence[int],
    *,
    stops: int = 11,
    warming: int = 0,
    copies: int = 1,
) -> Campaign:
    """A file of passes over the stops of X on a display of 1 µm, with a reversal of 2 µm, ``copies`` times behind
    itself; then two other axes. The first ``warming`` passes differ by 1.7 µm each."""
    campaign, rng = read_campaign(EXAMPLES / "laser"), np.random.default_rng(seed)
    order = np.concatenate([np.arange(stops)[::direction] for direction in directions])
    back = np.repeat([direction < 0 for direction in directions], stops)
    between = rng.uniform(-0.5, 0.5, (2, stops))[back.astype(int), order]
    growth = 1.7 * np.repeat(np.maximum(warming - np.arange(len(directions)), 0), stops)
    seen = 1e4 * order + between + 2.0 * back + growth + rng.normal(0.0, scatter, len(order))
    rows = np.concatenate([np.zeros(len(order) * copies, dtype=np.int64), np.arange(110, 330)])
    probings = campaign.probings.rows(rows)
    reading, place = probings.channels["reading_um"].copy(), probings.readings["X"].copy()
    reading[: len(order) * copies] = np.tile(np.round(seen), copies)
    place[: len(order) * copies] = np.tile(10.0 * order, copies)
    return numbered(
        replace(
            campaign,
            probings=replace(
                probings,
                readings={**probings.readings, "X": place},
                channels={**probings.channels, "reading_um": reading},
            ),
        )
    )


@pytest.mark.parametrize("scatter_um", [0.15, 0.3, 1.0])
def test_a_coarse_display_of_a_stable_machine_repeats_itself(seeds: Seeds, scatter_um: float) -> None:
    """Of 100 seeds each none is told at ten cycles (82, 59 and none were, when eight equal rows were enough)."""
    assert told(cycles(seed, scatter_um, 1.0) for seed in seeds(100, 15)) == 0


@pytest.mark.parametrize("scatter_um", [0.05, 0.075, 0.1])
@pytest.mark.parametrize("count", [2, 3, 4, 10, 20])
def test_passes_that_scatter_far_less_than_a_digit_are_no_copies(
    seeds: Seeds, scatter_um: float, count: int
) -> None:
    """Of 200 seeds each none is accused (31 of ten passes at 0.05 and 84 of three, when they were taken for copies)."""
    assert accused(cycles(seed, scatter_um, 1.0, count) for seed in seeds(100, 8)) == 0


@pytest.mark.parametrize("scatter", [0.02, 0.05, 0.1, 0.3])
@pytest.mark.parametrize(
    ("directions", "stops", "warming"),
    [([1, -1] * 5, 11, 0), ([1, -1] * 2, 40, 0), ([1] * 2, 40, 0), ([1] * 10, 11, 4), ([1, -1] * 5, 40, 4)],
)
def test_there_and_back_and_warming_up_are_no_copies(
    seeds: Seeds, scatter: float, directions: list[int], stops: int, warming: int
) -> None:
    """A reversal is no scatter, nor is what a warm-up changes (of 40 files there and back at 0.05 a digit 37 were
    accused, of those that warmed up first 19)."""
    drawn = (passes(seed, scatter, directions, stops=stops, warming=warming) for seed in seeds(100, 4))
    assert accused(drawn) == 0


@pytest.mark.parametrize("noise", [0.7, 1.0])
@pytest.mark.parametrize("copies", [2, 3, 4])
def test_a_coarse_file_joined_with_itself_is_told_however_often(
    seeds: Seeds, copies: int, noise: float
) -> None:
    """Its passes show that a digit of 1 µm does not hide the scatter (joined three times none of 20 was told)."""
    tried = list(seeds(100, 5))
    assert accused(passes(seed, noise, [1, -1] * 5, copies=copies) for seed in tried) == len(tried)


def test_one_coarse_pass_so_many_times_is_either() -> None:
    (sentence,) = repeated_rows(passes(2000, 0.7, [1, -1], copies=3))
    assert sentence == (
        "44 rows of run 1, from sequence 23 on, equal those from sequence 1 on in every number: either they were "
        "exported twice, or files joined, and counted so often they make u too small; or the display hides the "
        "scatter, and passes that agree so say nothing of repeatability"
    )


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


def test_lines_of_a_file_that_are_told_as_a_block_are_told_once(tmp_path: Path) -> None:
    folder = tmp_path / "files"
    shutil.copytree(EXAMPLES / "files-as-they-come", folder)
    lines = (folder / "r-test.csv").read_text(encoding="latin-1").splitlines()
    files = [path for path in folder.iterdir() if path.name != "mapping.toml"]
    (folder / "r-test.csv").write_text("\n".join([*lines, *lines[4:]]) + "\n", encoding="latin-1")
    read = read_exports(folder / "mapping.toml", files)
    (told,) = (sentence for sentence in (*read.notes, *doubts(read.campaign)) if "exported twice" in sentence)
    assert told.startswith("25 rows of run 1")
    # Apart from each other they are no block.
    (folder / "r-test.csv").write_text("\n".join([*lines, lines[-1], lines[-5]]) + "\n", encoding="latin-1")
    read = read_exports(folder / "mapping.toml", files)
    (told,) = (sentence for sentence in (*read.notes, *doubts(read.campaign)) if "exported twice" in sentence)
    assert told.startswith("r-test.csv: 2 rows equal an earlier one in every cell (line ")
