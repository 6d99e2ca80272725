"""A tool point that a setup states with an uncertainty is an unknown: a head that turns shows it, and nothing moves.

The simulator shares no code with the package (``tests/simulator/horizontal_centre.py``).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain
from monitor.exceptions import CampaignError, NotConvergedError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments.as_stated import as_stated
from monitor.readers import read_campaign
from monitor.readers.writer import write_campaign
from monitor.records import Campaign
from tests.simulator import horizontal_centre as centre

#: What the stated tool point of the R-test is off, mm: along A, across it, and along the tool.
OFF = np.array([0.3, -0.2, 1.0])
KEY = "tool_point_standard_uncertainty_mm = 1.0\n"


def _campaign(
    folder: Path, seed: int, off: np.ndarray | None = None, key: str = ""
) -> tuple[Path, dict[str, float]]:
    """A horizontal centre of its own; the tool point of the R-test is stated ``off``, with ``key``."""
    rng = np.random.default_rng(seed)
    truth = centre.truth_of(rng)
    path = centre.campaign(folder / "shop", rng, truth)
    file, point = path / "campaign.toml", f"tool_point_mm = {centre.TOOL.tolist()}\n"
    stated = point if off is None else f"tool_point_mm = {(centre.TOOL - off).tolist()}\n"
    setups = file.read_text(encoding="utf-8").split("[[setups]]")
    changed = [text.replace(point, stated + key) if "r-test" in text else text for text in setups]
    file.write_text("[[setups]]".join(changed), encoding="utf-8")
    return path, {**truth, "EZ0B": truth["EZ0B"] - truth["EZ0A"]}


def _read(path: Path) -> Campaign:
    campaign = read_campaign(path)
    assert isinstance(campaign, Campaign)
    return campaign


@pytest.mark.parametrize("seed", [9000, pytest.param(9001, marks=pytest.mark.slow)])
def test_a_turning_head_shows_its_tool_point(tmp_path: Path, seed: int) -> None:
    path, truth = _campaign(tmp_path, seed, OFF, KEY)
    problem = campaign_method(campaign := _read(path)).problem_of(campaign)
    solution = solve_problem(problem)
    u = np.sqrt(np.diag(solution.local_covariance[0]))
    columns = [index for index, name in enumerate(problem.local_names) if "tool point" in name]
    assert [problem.local_names[index] for index in columns] == [
        f"r-test-B tool point {axis}" for axis in "xyz"
    ]
    along, *across = columns
    # Along the axis of the head the point of the work does the same: what is stated stays.
    assert solution.local[0, along] == pytest.approx(0.0, abs=1e-3)
    assert u[along] == pytest.approx(1.0, rel=1e-3)
    for index, off in zip(across, OFF[1:], strict=True):
        assert u[index] < 3e-4
        assert abs(solution.local[0, index] - off) < 4.0 * u[index]
    for index, name in enumerate(problem.base_names):
        assert solution.local_free[0, index], name
        assert abs(solution.local[0, index] - truth[name]) < 4.0 * u[index], name


@pytest.mark.slow
def test_a_tool_point_that_is_not_an_unknown_does_not_settle(tmp_path: Path) -> None:
    """The refusal says what fits, and how to have it solved for."""
    path, _ = _campaign(tmp_path, 9000, OFF)
    campaign = _read(path)
    with pytest.raises(NotConvergedError, match="tool_point_standard_uncertainty_mm"):
        campaign_method(campaign).identify(campaign)


@pytest.mark.slow
def test_a_stated_uncertainty_where_the_point_is_right_costs_little(tmp_path: Path) -> None:
    """EYY shares its readings with the tool point: u grows, and the value stays within both."""
    values = []
    for key in ("", KEY):
        path, truth = _campaign(tmp_path / str(len(key)), 9002, np.zeros(3), key)
        result = campaign_method(campaign := _read(path)).identify(campaign)
        at, (run,) = result.parameters.index("EYY"), result.runs
        u = float(np.sqrt(run.covariance[at, at]))
        assert abs(run.estimate[at] - truth["EYY"]) < 4.0 * u
        values.append((float(run.estimate[at]), u))
    (plain, u_plain), (free, u_free) = values
    assert u_plain <= u_free < 2.0 * u_plain
    # Difference of an estimate and one of more unknowns (J. A. Hausman, Econometrica 46 (1978) 1251).
    assert abs(free - plain) < 4.0 * np.sqrt(u_free**2 - u_plain**2) + 1e-9


def test_the_uncertainty_is_read_and_written_again(tmp_path: Path) -> None:
    campaign = _read(_campaign(tmp_path, 9000, OFF, KEY)[0])
    stated = [setup.tool_point_uncertainty for setup in campaign.artefact.setups]
    assert stated.count(1.0) == 2
    assert stated.count(None) == 6
    named = replace(
        campaign,
        artefact=replace(
            campaign.artefact,
            setups=tuple(replace(setup, certificate="K 17") for setup in campaign.artefact.setups),
        ),
    )
    write_campaign(named, tmp_path / "again")
    assert read_campaign(tmp_path / "again").artefact.setups == named.artefact.setups


def test_readings_of_angles_have_no_such_key(tmp_path: Path) -> None:
    path, _ = _campaign(tmp_path, 9000)
    with (path / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write(
            '\n[[setups]]\nid = "level"\nreading = "level"\nstandard_uncertainty_urad = 1.0\ndirection = "X"\n'
            + KEY
        )
    with pytest.raises(CampaignError, match="tool_point_standard_uncertainty_mm"):
        read_campaign(path)


@pytest.mark.parametrize("key", ["", pytest.param(KEY, marks=pytest.mark.slow)])
def test_a_point_off_along_the_axis_of_the_head_moves_the_place_of_the_table_alone(
    tmp_path: Path, key: str
) -> None:
    """At b04ae590 the bar across the plane x = 0 was tilted by the millimetre, and EXX went by 13 u."""
    fits = []
    for off, of_fit in ((np.zeros(3), ""), (np.array([1.0, 0.0, 0.0]), key)):
        path, _ = _campaign(tmp_path / f"{off[0]}", 12000, off, of_fit)
        problem = campaign_method(campaign := _read(path)).problem_of(campaign)
        fits.append((problem, solve_problem(problem)))
    (problem, right), (_, moved) = fits
    u = np.sqrt(np.diag(right.local_covariance[0]))
    for index, name in enumerate(problem.base_names):
        change = moved.local[0, index] - right.local[0, index]
        if name == "EX0B":
            assert change == pytest.approx(-1.0, abs=1e-5)
            assert (np.sqrt(moved.local_covariance[0, index, index]) > 0.9) == bool(key)
        else:
            # What the point may do along the head adds to u; without it nothing moves.
            assert abs(change) < (1.5 if key else 0.4) * u[index], name


@pytest.mark.parametrize(
    ("key", "expected"), [("", {"x": ("EX0B",)}), pytest.param(KEY, None, marks=pytest.mark.slow)]
)
def test_what_counts_from_a_stated_tool_point_is_told(
    tmp_path: Path, key: str, expected: dict[str, tuple[str, ...]] | None
) -> None:
    """B carries the sphere, and A shows the point across its axis: only x is taken as stated."""
    path, _ = _campaign(tmp_path, 9000, np.zeros(3), key)
    problem = campaign_method(campaign := _read(path)).problem_of(campaign)
    assert {each.name: each.moved for each in as_stated(problem) if "scale" not in each.moved} == (
        {} if expected is None else {"R-test": expected}
    )


def test_places_of_the_table_have_numbers_where_every_setup_states_its_tool_point(tmp_path: Path) -> None:
    """Until 26 November 2026 EX0B was then no error of the machine, and what it is went into others: on an R-test alone
    EA0Z was 2 u off."""
    campaign = _read(_campaign(tmp_path, 9001)[0])
    own = tuple(replace(setup, tool_point_uncertainty=0.005) for setup in campaign.artefact.setups)
    known = replace(campaign, artefact=replace(campaign.artefact, setups=own))
    problems = [campaign_method(each).problem_of(each) for each in (campaign, known)]
    assert problems[0].base_names == problems[1].base_names
    solution = solve_problem(problems[1])
    at = problems[1].base_names.index("EX0B")
    assert solution.local_free[0, at]
    # Of three instruments one has the sphere: its tool point alone.
    assert np.sqrt(solution.local_covariance[0, at, at]) == pytest.approx(0.005, rel=0.05)


def test_a_bar_off_the_plane_of_its_swing_has_the_derivatives_of_its_readings(tmp_path: Path) -> None:
    """The centre follows the mean of what errors do across the plane; differences of readings say so too."""
    path, _ = _campaign(tmp_path, 9000)
    problem = campaign_method(campaign := _read(path)).problem_of(campaign)
    (bar,) = (part for part in problem.parts if part.id == "bar-yz")
    guess = bar.rows.guess.copy()
    guess[:, 9:] += 1.4 * np.array([1.0, 0.0, 0.0])
    parts = tuple(
        replace(part, rows=replace(part.rows, guess=guess), tool_point=1.0) if part is bar else part
        for part in problem.parts
    )
    wide = replace(problem, parts=parts, is_whole=True, has_products=True)
    rows = slice(bar.at[0], bar.at[-1] + 1)
    by_local = wide.linearise(wide.start, wide.common_start).local[0]
    numbers = wide.sigma.shape[1]
    columns = [index for index, name in enumerate(wide.local_names) if "tool point" in name]
    for index in (*range(len(wide.base_names)), *columns):
        step = np.zeros_like(wide.start)
        step[0, index] = 1e-4
        ahead, behind = (
            wide.evaluated(wide.start + sign * step, wide.common_start).residual[rows, 0] for sign in (1, -1)
        )
        expected = (ahead - behind) / 2e-4 / wide.sigma[rows, 0]
        np.testing.assert_allclose(
            by_local[rows.start * numbers : rows.stop * numbers : numbers, index], expected, atol=2e-3
        )


@pytest.mark.parametrize(
    ("off", "key", "told"),
    [
        ((0.0, 0.0, 0.01), "", ["EZA:const"]),
        ((0.0, 0.0, 0.01), KEY, []),
        # The zero of A does the same at these poses: either leads, and the other is its rival.
        pytest.param((0.0, -0.006, 0.0), "", ["EYA:const"], marks=pytest.mark.slow),
    ],
)
@pytest.mark.slow
def test_what_a_head_carries_elsewhere_than_stated_is_a_constant(
    tmp_path: Path, off: tuple[float, ...], key: str, told: list[str]
) -> None:
    """Was a free shape of the head, "bearing of A is worn": its zero and its spindle's offset were no candidates."""
    campaign = _read(_campaign(tmp_path, 9001, np.array(off), key)[0])
    problem = campaign_method(campaign).problem_of(campaign)
    answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    assert len(answer.missing) == len(told)
    for name, effect in zip(told, answer.missing, strict=True):
        assert name in {effect.effect, *(rival.effect for rival in effect.rivals if rival.coincides)}
    # What free errors take up is no blind spot.
    assert "EZ0A" not in answer.blind
