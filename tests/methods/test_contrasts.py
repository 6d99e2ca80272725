"""Which setup contradicts all others: against other least squares, over drawn readings, and by who was read wrongly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy

from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments.contrasts import contrast, contrasts, contrasts_of, scatters
from monitor.methods.instruments.run_rows import RunRows, run_rows
from monitor.methods.instruments.suspects import who_contradicts
from monitor.methods.method import Contrast, ContrastKind
from monitor.readers import read_campaign
from monitor.workflow.instruments.against_others import against_others
from monitor.workflow.instruments.answer import AgainstOthers
from tests.simulator import four_instruments as shop, horizontal_centre as centre

#: Levels of the rates: that of `compare`, and one at which a few hundred draws say something.
LEVELS = (0.01, 0.1)


def _rows(folder: Path, seed: int, otherwise: tuple[str, float] | None = None) -> RunRows:
    """The run of laser, ball bar and R-test on a horizontal centre of its own."""
    rng = np.random.default_rng(seed)
    truth = centre.truth_of(rng)
    campaign = read_campaign(centre.campaign(folder / "shop", rng, truth, otherwise=otherwise))
    problem = campaign_method(campaign).problem_of(campaign)
    return run_rows(problem, solve_problem(problem), 1)


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> RunRows:
    return _rows(tmp_path_factory.mktemp("centre"), 61)


def _left(rows: RunRows, mine: np.ndarray) -> tuple[float, int]:
    """What least squares leave of the residuals of rows, and the rank: that of a machine without errors, whose products
    make no direction of their own."""

    def scaled(matrix: np.ndarray) -> np.ndarray:
        length = np.linalg.norm(matrix, axis=0)
        return matrix / np.where(length > 1e-9 * length.max(), length, np.inf)

    s = np.linalg.svd(scaled(rows.nominal[mine]), compute_uv=False)
    rank = int(np.sum(s > 1e-5 * s[0]))
    u, _, _ = np.linalg.svd(scaled(rows.jacobian[mine]), full_matrices=False)
    residual = rows.residual[mine]
    beside = residual - u[:, :rank] @ (u[:, :rank].T @ residual)
    return float(beside @ beside), rank


def test_chow_1960_the_joint_fit_leaves_more_than_two_fits(rows: RunRows) -> None:
    """Where no setup scatters more than stated, the distance is the difference of three sums of squares."""
    calm = replace(rows, residual=0.5 * rows.residual)
    (contrast,) = (each for each in contrasts_of(calm) if each.name == "r-test-A")
    mine = np.zeros(len(calm.residual), dtype=bool)
    mine[calm.of_setups(("r-test-A",))] = True
    joint, rank = _left(calm, mine | ~mine)
    parts = [_left(calm, side) for side in (mine, ~mine)]
    assert contrast.directions == sum(of for _, of in parts) - rank
    square = joint - sum(left for left, _ in parts)
    assert contrast.size**2 * contrast.directions == pytest.approx(square, rel=1e-6)
    assert contrast.freedom == np.inf
    assert contrast.p == pytest.approx(scipy.stats.chi2.sf(square, contrast.directions), rel=1e-6)


def test_what_one_says_alone_is_what_it_says_among_all(tmp_path: Path) -> None:
    rng = np.random.default_rng(63)
    campaign = read_campaign(centre.campaign(tmp_path / "shop", rng, centre.truth_of(rng)))
    problem = campaign_method(campaign).problem_of(campaign)
    solution = solve_problem(problem)
    every = contrasts(problem, solution, 1)
    assert len(every) > 3
    for each in every:
        assert contrast(problem, solution, 1, each.name) == replace(each, others_left=None, others_p=None)
    assert contrast(problem, solution, 1, "no such setup") is None


def _drawn(rows: RunRows, rng: np.random.Generator, times: float, of: str) -> RunRows:
    """The joint fit of right readings that scatter ``times`` as stated, of all setups or of one instrument's."""
    scale = np.where(rows.is_read, times if not of else 1.0, 1.0)
    if of:
        setups = tuple(part.id for part in rows.problem.parts if part.id.startswith(of))
        scale[rows.of_setups(setups)] = times
    noise = scale * rng.standard_normal(len(scale)) * np.any(rows.jacobian != 0.0, axis=1)
    length = np.linalg.norm(rows.jacobian, axis=0)
    u, s, _ = np.linalg.svd(rows.jacobian / np.where(length > 0.0, length, 1.0), full_matrices=False)
    basis = u[:, s > 1e-5 * s[0]]
    return replace(rows, residual=noise - basis @ (basis.T @ noise))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("times", "of"),
    [
        (2.0, "bar"),
        *(
            pytest.param(*scatter, marks=pytest.mark.all_seeds)
            for scatter in ((1.0, ""), (1.1, ""), (1.5, ""), (2.0, ""), (2.0, "r-test-B"))
        ),
    ],
)
def test_right_readings_contradict_each_other_as_seldom_as_said(rows: RunRows, times: float, of: str) -> None:
    """Bonferroni's bound over all setups and instruments, for scatter of 1 to 2 times the stated one."""
    rng = np.random.default_rng([62, int(10 * times), len(of)])
    draws, least = 150, []
    for _ in range(draws):
        every = contrasts_of(_drawn(rows, rng, times, of))
        least.append(len(every) * min(each.p for each in every))
    for level in LEVELS:
        count = int(np.sum(np.array(least) <= level))
        assert scipy.stats.binomtest(count, draws, level, alternative="greater").pvalue > 1e-3, (level, count)


@pytest.mark.slow
def test_a_setup_with_the_other_sign_is_named(tmp_path: Path) -> None:
    """R-test around B with the other sign: its own instrument's R-test around A agrees with laser and bar.

    Where the gains are small only the squareness of Z and X contradicts, which a plane of the bar shows as well: then
    either may be the wrong one.
    """
    suspects = []
    for seed in range(62, 68):
        campaign = read_campaign(_campaign(tmp_path / str(seed), seed, ("r-test-B", -1.0)))
        problem, ability = (
            campaign_method(campaign).problem_of(campaign),
            campaign_method(campaign).instruments,
        )
        beside = against_others(problem, solve_problem(problem), ability, 1)
        assert beside is not None
        assert "r-test-B" in _names(beside)
        assert beside.by_chance < 1e-3
        assert beside.size > beside.limit
        suspects.append(_names(beside))
    assert set(suspects) == {("r-test-B",), ("bar-zx", "r-test-B")}


def test_others_that_contradict_each_other_for_certain_are_compared_no_further(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    misread = _rows(tmp_path, 63, ("r-test-B", -1.0))
    told = contrasts_of(misread)
    monkeypatch.setattr("monitor.methods.instruments.contrasts.CERTAIN", 0.0)
    whole = contrasts_of(misread)
    assert who_contradicts(told).suspects == who_contradicts(whole).suspects
    certain = [
        every.others_p for each, every in zip(told, whole, strict=True) if each.others_p != every.others_p
    ]
    assert certain
    assert max(certain) < 1e-6


def test_nobody_is_asked_who_is_wrong_where_nothing_contradicts(rows: RunRows) -> None:
    calm = replace(rows, residual=0.3 * rows.residual)
    assert all(each.others_p is None for each in contrasts_of(calm))


def test_a_wrong_length_of_a_bar_is_named_and_no_plane_of_it(tmp_path: Path) -> None:
    """The length is one number of all three planes: 5 µm too long, each of them contradicts the laser alike."""
    campaign = read_campaign(_campaign(tmp_path, 65, None))
    longer = tuple(
        replace(setup, length=None if setup.length is None else setup.length + 5e-3)
        for setup in campaign.artefact.setups
    )
    campaign = replace(campaign, artefact=replace(campaign.artefact, setups=longer))
    problem, ability = campaign_method(campaign).problem_of(campaign), campaign_method(campaign).instruments
    beside = against_others(problem, solve_problem(problem), ability, 1)
    assert beside is not None
    (suspect,) = beside.suspects
    assert suspect.name == beside.name == "the stated length of ball bar"
    assert suspect.kind is beside.kind is ContrastKind.STATED
    assert suspect.setups == beside.setups == ("bar-xy", "bar-yz", "bar-zx")


def _names(beside: AgainstOthers) -> tuple[str, ...]:
    return tuple(suspect.name for suspect in beside.suspects)


def test_of_two_that_share_something_either_may_be_wrong(tmp_path: Path) -> None:
    """Laser and bar alone: without the bar nothing is compared, which is no contradiction."""
    rng, chain = np.random.default_rng(31), shop.machine(0.0)
    laser, bar = shop.laser(chain, rng, 1), shop.ball_bar(chain, rng, 30.0)
    for row in bar[1]:
        row["reading_um"] = -float(row["reading_um"])  # type: ignore[arg-type]
    chain.write(tmp_path / "week", laser[0] + bar[0], [*laser[1], *bar[1]])
    campaign = read_campaign(tmp_path / "week")
    problem, ability = campaign_method(campaign).problem_of(campaign), campaign_method(campaign).instruments
    beside = against_others(problem, solve_problem(problem), ability, 1)
    assert beside is not None
    assert "ball bar" in _names(beside)
    assert len(beside.suspects) > 1


def _of_setups(
    folder: Path, seed: int, setups: tuple[str, ...], grown: float
) -> tuple[tuple[Contrast, ...], AgainstOthers | None]:
    """What is said of the run of some setups; the bar meets a machine whose X has ``grown`` by so much of it."""
    rng = np.random.default_rng(seed)
    truth = centre.truth_of(rng)
    text, rows = "", []
    for measure, of in ((centre.laser, truth), (centre.ball_bar, {**truth, "EXX": truth["EXX"] + grown})):
        part, read = measure(centre.machine(of), rng, rng)
        text, rows = text + part, rows + read
    campaign = read_campaign(
        centre.machine(truth).write(folder / "shop", *centre.only_of(setups, text, rows))
    )
    problem, ability = campaign_method(campaign).problem_of(campaign), campaign_method(campaign).instruments
    solution = solve_problem(problem)
    return contrasts(problem, solution, 1), against_others(problem, solution, ability, 1)


def test_of_two_setups_that_contradict_each_other_either_may_be_wrong(tmp_path: Path) -> None:
    """Without one of them nothing is compared, which is no contradiction."""
    _, beside = _of_setups(tmp_path, 3, ("laser-X", "bar-xy"), 30e-6)
    assert beside is not None
    assert beside.is_of_two
    assert _names(beside) == ("laser-X", "bar-xy")
    assert not any(suspect.others_agree for suspect in beside.suspects)


def test_the_others_are_compared_as_if_they_were_measured_alone(tmp_path: Path) -> None:
    """Laser Y and bar share one direction, hidden before by what only laser X separates: they agree without it."""
    three, beside = _of_setups(tmp_path / "three", 4, ("laser-X", "laser-Y", "bar-xy"), 15e-6)
    alone, nobody = _of_setups(tmp_path / "alone", 4, ("laser-Y", "bar-xy"), 15e-6)
    assert nobody is None
    by_name = {each.name: each for each in three}
    (without,) = {(each.directions, each.p) for each in alone if each.name == "laser-Y"}
    assert without[0] == 1
    assert by_name["laser-X"].others_left == 1
    assert by_name["laser-X"].others_p == pytest.approx(without[1], rel=0.01)
    assert beside is not None
    assert _names(beside) == ("laser-X", "bar-xy")


def _campaign(folder: Path, seed: int, otherwise: tuple[str, float] | None) -> Path:
    rng = np.random.default_rng(seed)
    truth = centre.truth_of(rng)
    return centre.campaign(folder / "shop", rng, truth, otherwise=otherwise)


def test_readings_in_another_unit_scatter_too_little(tmp_path: Path) -> None:
    """A bar in mm under a header of µm scatters a thousandth of what it states, whatever the machine's errors."""
    campaign = read_campaign(_campaign(tmp_path, 63, ("bar", 1e-3)))
    problem = campaign_method(campaign).problem_of(campaign)
    by_setup = {each.setup: each for each in scatters(problem, solve_problem(problem), 1)}
    for setup, scatter in by_setup.items():
        if setup.startswith("bar"):
            assert scatter.times < 2e-3
            assert scatter.p < 1e-20
        else:
            assert 0.5 < scatter.times < 1.6


def test_one_instrument_alone_contradicts_nobody(tmp_path: Path) -> None:
    rng = np.random.default_rng(64)
    campaign = read_campaign(centre.campaign(tmp_path / "shop", rng, centre.truth_of(rng), only="laser"))
    problem = campaign_method(campaign).problem_of(campaign)
    assert contrasts(problem, solve_problem(problem), 1) == ()
