"""A campaign of very many rows is fitted some rows at a time: what comes out is what all rows at once give."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.exceptions import DataError, TooManyRowsError
from monitor.methods import campaign_method
from monitor.methods.chain import parts, problem
from monitor.methods.chain.memory import free_memory
from monitor.progress import listening
from monitor.readers import read_campaign
from monitor.readers.row_places import RowPlaces
from monitor.records import Campaign
from monitor.workflow.identify.notes import note

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CHAIN = "monitor.methods.chain"


@pytest.fixture(params=["cold-cold", "tilting-table", "tracked-robot"])
def campaign(request: pytest.FixtureRequest) -> Campaign:
    """Balls that are touched, faces and spheres of a piece, reflectors that are tracked."""
    return read_campaign(EXAMPLES / request.param)


def let_few_rows_be_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let blocks be so small that some lack a run, a target or the spheres, and parts as small as plans are; a part is
    fitted at once, as with the numbers that are shipped."""
    assert parts.MOST_TOGETHER < problem.MOST_AT_ONCE
    monkeypatch.setattr(f"{CHAIN}.problem.MOST_AT_ONCE", 210)
    monkeypatch.setattr(f"{CHAIN}.problem.ROWS_AT_ONCE", 17)
    monkeypatch.setattr(f"{CHAIN}.parts.MOST_TOGETHER", 150)


@pytest.fixture
def in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few rows are many."""
    let_few_rows_be_many(monkeypatch)


def test_the_triangle_of_a_run_says_what_its_rows_say(campaign: Campaign, in_parts: None) -> None:
    problem = campaign_method(campaign).problem_of(campaign)
    assert problem.is_in_parts
    local = problem.start
    whole, few = (
        problem.linearise(local, problem.common_start),
        problem.condensed(local, problem.common_start),
    )
    assert few.local.shape[1] == local.shape[1] + 1 + len(problem.extra_names)
    for run in range(len(problem.runs)):
        rows, triangle = (np.column_stack([at.local[run], at.residual[run]]) for at in (whole, few))
        scale = np.linalg.norm(rows, axis=0)
        scale[scale == 0.0] = 1.0
        np.testing.assert_allclose(
            triangle.T @ triangle / np.outer(scale, scale), rows.T @ rows / np.outer(scale, scale), atol=1e-12
        )


def test_identify_in_parts_is_identify_at_once(campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers to a millionth of their standard uncertainty, and everything that is refused or noted."""
    method = campaign_method(campaign)
    at_once = method.identify(campaign)
    let_few_rows_be_many(monkeypatch)
    assert len(list(parts.parts_of(campaign))) > 1
    parted = method.identify(campaign)
    assert (parted.iterations, parted.gross, parted.unsearched) == (at_once.iterations, at_once.gross, ())
    for mine, theirs in zip(parted.runs, at_once.runs, strict=True):
        u = np.sqrt(np.diag(theirs.covariance))
        np.testing.assert_allclose(mine.estimate / u, theirs.estimate / u, rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(mine.covariance, theirs.covariance, rtol=1e-6)
        np.testing.assert_allclose(mine.residuals, theirs.residuals, atol=1e-9)
        assert mine.chi_square == pytest.approx(theirs.chi_square, rel=1e-9)
        assert (mine.refused, mine.degrees_of_freedom) == (theirs.refused, theirs.degrees_of_freedom)


def many_touches(names: tuple[str, ...] = ("S1", "S2")) -> Campaign:
    """Run 1 of an example four times over with noise, its bar touched once; of a second run just ``names`` of it."""
    whole = read_campaign(EXAMPLES / "cold-cold")
    one = np.flatnonzero(whole.probings.run == whole.runs[0].run)
    bar = np.isin(whole.probings.target[one], ("S1", "S2"))
    rows = np.concatenate([one[bar], np.repeat(one[~bar], 12)])
    again = rows[
        np.isin(whole.probings.target[rows], names) | ~np.isin(whole.probings.target[rows], ("S1", "S2"))
    ]
    both = whole.probings.rows(np.concatenate([rows, again]))
    rng = np.random.default_rng(3)
    readings = {
        axis: values + rng.normal(0.0, 3e-4, len(values)) if axis in "XYZ" else values
        for axis, values in both.readings.items()
    }
    run = np.repeat([1, 2], [len(rows), len(again)])
    sequence = np.concatenate([np.arange(1, len(rows) + 1), np.arange(1, len(again) + 1)])
    runs = tuple(replace(whole.runs[0], run=number) for number in (1, 2))
    return replace(whole, runs=runs, probings=replace(both, run=run, sequence=sequence, readings=readings))


def with_wrong_touch(campaign: Campaign, row: int, off: float) -> Campaign:
    readings = dict(campaign.probings.readings)
    readings["Y"] = readings["Y"].copy()
    readings["Y"][row] += off
    return replace(campaign, probings=replace(campaign.probings, readings=readings))


def test_a_bar_that_is_touched_once_a_run_is_in_every_part(in_parts: None) -> None:
    campaign = many_touches()
    for _, part in parts.parts_of(campaign):
        assert set(campaign.artefact.scale_bar.balls) <= set(part.probings.target.tolist())
    row = int(np.flatnonzero(campaign.probings.run == 2)[40])
    found = campaign_method(campaign).identify(with_wrong_touch(campaign, row, 0.5))
    assert [reading.row for reading in found.gross] == [row]
    assert found.gross[0].size == pytest.approx(0.5, abs=0.01)
    assert found.unsearched == ()


def test_a_run_that_cannot_be_searched_in_parts_is_identified_and_says_so(
    in_parts: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run without the bar is none by itself; beside one that has it, it is identified but for its gains."""
    monkeypatch.setattr(f"{CHAIN}.parts.FEWEST_TOGETHER", 1)
    campaign = many_touches(names=())
    row = int(np.flatnonzero(campaign.probings.run == 1)[40])
    found = campaign_method(campaign).identify(with_wrong_touch(campaign, row, 0.5))
    assert [reading.row for reading in found.gross] == [row]
    assert found.unsearched == (2,)
    assert [
        note(campaign.machine, found, run, RowPlaces(campaign)).count("not looked at for wrong readings")
        for run in found.runs
    ] == [0, 1]


def test_the_refusal_of_a_fit_is_not_replaced_by_that_of_a_part(
    in_parts: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"{CHAIN}.parts.FEWEST_TOGETHER", 1)
    campaign = many_touches(names=())

    def refuse(problem: object) -> None:
        raise DataError("the axes go the other way")

    with pytest.raises(DataError, match="the axes go the other way"):
        campaign_method(campaign).identify(campaign, solve=refuse)


def test_effects_that_look_at_all_rows_are_fitted_at_once(in_parts: None) -> None:
    campaign = read_campaign(EXAMPLES / "cold-cold")
    method = campaign_method(campaign)
    model = replace(method.own_model, added=("EXX:reversal",))
    problem = method.problem_of(campaign, model)
    assert not problem.is_in_parts


def test_what_needs_more_memory_than_there_is_is_refused_in_words(
    in_parts: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel would end the process; `identify` needs little, and goes on."""
    monkeypatch.setattr(f"{CHAIN}.memory.SMALL", 1e6)
    monkeypatch.setattr(f"{CHAIN}.memory.free_memory", lambda: 2e6)
    campaign = read_campaign(EXAMPLES / "cold-cold")
    method = campaign_method(campaign)
    problem = method.problem_of(campaign)
    with pytest.raises(
        TooManyRowsError, match=r"1320 rows at once takes some 0 GB of memory, and 0.0 GB are free"
    ):
        fit(problem)
    model = replace(method.own_model, added=("EXX:reversal",))
    with pytest.raises(TooManyRowsError, match="import fewer of them: some runs, or one row of so many"):
        method.identify(campaign, model)
    assert len(method.identify(campaign).runs) == 44


def test_much_memory_is_said_before_it_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{CHAIN}.memory.SMALL", 1e6)
    said: list[str] = []
    problem = campaign_method(campaign := read_campaign(EXAMPLES / "cold-cold")).problem_of(campaign)
    with listening(lambda share: None, said.append):
        fit(problem)
    assert said == ["1320 rows at once, some 0 GB of memory", ""]


@pytest.mark.skipif(not Path("/proc/meminfo").exists(), reason="only Linux says what is free")
def test_free_memory_is_what_the_system_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    free = free_memory()
    assert free is not None
    assert 0.0 < free < 1e15
    monkeypatch.setattr(f"{CHAIN}.memory._MEMORY", tmp_path / "none")
    assert free_memory() is None


#: What a container of 8 GB shows that read 6.8 GB of files, of which 6.5 GB may go.
OF_GROUP = {
    2: {
        "memory.max": "8000000000",
        "memory.current": "7800000000",
        "memory.stat": "anon 1\ninactive_file 6500000000",
    },
    1: {
        "memory.limit_in_bytes": "8000000000",
        "memory.usage_in_bytes": "7800000000",
        "memory.stat": "inactive_file 3\ntotal_inactive_file 6500000000",
    },
}


@pytest.mark.parametrize("available_gb", [32.0, 3.0])
@pytest.mark.parametrize("place", ["", "of-all", "of-all/own", "of-all/own/below", None])
@pytest.mark.parametrize("version", [1, 2])
def test_free_memory_is_what_the_control_groups_leave(
    version: int, place: str | None, available_gb: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The limit may stand on the group of the process or on one around it; files that were read are no use."""
    for name in ("_MEMORY", "_OWN_GROUPS", "_GROUPS"):
        monkeypatch.setattr(f"{CHAIN}.memory.{name}", tmp_path / name)
    (tmp_path / "_MEMORY").write_text(f"MemAvailable: {available_gb * 1e9 / 1024.0:.0f} kB\n")
    controllers = {1: "12:cpu,cpuacct:/elsewhere\n4:memory:/of-all/own\n0::/\n", 2: "0::/of-all/own\n"}
    (tmp_path / "_OWN_GROUPS").write_text(controllers[version])
    root = tmp_path / "_GROUPS" / ("memory" if version == 1 else "")
    (root / "of-all/own/below").mkdir(parents=True)
    # The version 2 group around has no limit, as most have none.
    (root / "memory.max").write_text("max\n")
    if place is not None:
        for name, text in OF_GROUP[version].items():
            (root / place / name).write_text(text + "\n")
    is_limited = place is not None and place != "of-all/own/below"
    assert free_memory() == pytest.approx(min(6.7e9 if is_limited else np.inf, available_gb * 1e9), rel=1e-6)


def test_a_control_group_that_is_full_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{CHAIN}.memory._OWN_GROUPS", tmp_path / "own")
    monkeypatch.setattr(f"{CHAIN}.memory._GROUPS", tmp_path)
    monkeypatch.setattr(f"{CHAIN}.memory._MEMORY", tmp_path / "memory")
    (tmp_path / "memory").write_text("MemAvailable: 1000000 kB\n")
    (tmp_path / "own").write_text("0::/../away\n")
    for name, text in {"max": "1000", "current": "1100", "stat": "inactive_file 50"}.items():
        (tmp_path / f"memory.{name}").write_text(text + "\n")
    assert free_memory() == 0.0
