"""The readings of one setup or instrument are wrong: a unit, a sign or exchanged columns are said in its name.

Six instruments of one machine, simulated without a line of the package.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import find_reading_mistakes, find_setup_mistakes, fit, robust_fit
from monitor.discovery.machine.mistakes.fewer_rows import fewer_rows
from monitor.discovery.machine.mistakes.setup_mistakes import _contradicts_itself, _doubted, _explains
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.method import SetupScatter
from monitor.readers import read_campaign
from monitor.records import Campaign, Probings
from monitor.reporting.machine_finding import MistakeFound, mistake_sentence, what_to_do
from tests.simulator import four_instruments as shop
from tests.simulator.instrument_errors import week


def _of_machine(campaign: Campaign) -> ChainProblem:
    method = campaign_method(campaign)
    return method.problem_of(campaign, method.own_model)


def _told(campaign: Campaign) -> list[str]:
    return [each.what for each in find_setup_mistakes(campaign, _of_machine, fit(_of_machine(campaign)))]


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    campaign = read_campaign(
        week(tmp_path_factory.mktemp("week") / "week", np.random.default_rng(31), shop.TRUTH)
    )
    assert isinstance(campaign, Campaign)
    return campaign


def _spoilt(campaign: Campaign, setup: str, change: dict[str, tuple[str, float]]) -> Campaign:
    """The campaign in whose rows of a setup columns have the values of another one, times a factor."""
    probings = campaign.probings
    rows = probings.target == setup
    channels = {name: np.array(values) for name, values in probings.channels.items()}
    for name, (source, factor) in change.items():
        channels[name][rows] = factor * probings.channels[source][rows]
    return replace(campaign, probings=replace(probings, channels=channels))


@pytest.mark.parametrize(
    ("setup", "change", "what"),
    [
        ("bar-yz", {"reading_um": ("reading_um", -1.0)}, "the sign of reading_um were the other way round"),
        ("r-test", {"dz_um": ("dz_um", -1.0)}, "the sign of dz_um were the other way round"),
        (
            "r-test",
            {name: (name, -1.0) for name in ("dx_um", "dy_um", "dz_um")},
            "the signs of dx_um, dy_um, dz_um were the other way round",
        ),
        ("bar-zx", {"reading_um": ("reading_um", 1e-3)}, "reading_um was in mm"),
        pytest.param(
            "r-test", {"dx_um": ("dy_um", 1.0), "dy_um": ("dx_um", 1.0)}, "the columns dx_um and dy_um were exchanged",
            marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
@pytest.mark.slow
def test_what_is_wrong_in_one_setup_is_said_in_its_name(
    right: Campaign, setup: str, change: dict[str, tuple[str, float]], what: str
) -> None:
    assert f"{what} in setup {setup}" in _told(_spoilt(right, setup, change))


@pytest.mark.parametrize(
    ("change", "contradicts"),
    [
        ({}, False),
        ({"dx_um": ("dy_um", 1.0), "dy_um": ("dx_um", 1.0)}, True),
        # With all signs turned it contradicts the others, not itself.
        ({name: (name, -1.0) for name in ("dx_um", "dy_um", "dz_um")}, False),
    ],
)
def test_a_setup_alone_contradicts_itself_where_no_machine_reads_so(
    right: Campaign, change: dict[str, tuple[str, float]], contradicts: bool
) -> None:
    spoilt = _spoilt(right, "r-test", change)
    alone = replace(spoilt, probings=spoilt.probings.rows(spoilt.probings.target == "r-test"))
    assert _contradicts_itself(alone, _of_machine, int(alone.probings.run[0])) is contradicts


@pytest.mark.all_seeds
def test_right_setups_and_errors_of_an_instrument_are_no_mistake(right: Campaign, tmp_path: Path) -> None:
    assert _told(right) == []
    for error, size in (
        ("bar-xy:length", 10.0),
        ("bar-xy:length", 37.5),
        ("laser-Y:dead_path@air_degC", 15.0),
    ):
        folder = week(
            tmp_path / f"{error[:3]}{size}",
            np.random.default_rng(32),
            shop.TRUTH,
            f"instrument:{error}",
            size,
        )
        campaign = read_campaign(folder)
        assert isinstance(campaign, Campaign)
        assert _told(campaign) == []
        # Exchanged for one of another instrument, a column leaves readings that nothing contradicts.
        assert find_reading_mistakes(campaign, _of_machine, fit(_of_machine(campaign))) == ()


@pytest.mark.parametrize(
    ("word", "columns", "factor", "what"),
    [
        ("bar", ("reading_um",), 1e-3, "reading_um was in mm in all setups of ball bar"),
        ("bar", ("reading_um",), -1.0, "the sign of reading_um were the other way round in all setups of ball bar"),
        ("r-test", ("dx_um", "dy_um", "dz_um"), 1.0 / 25400.0, "dx_um, dy_um, dz_um were in inches in setup r-test"),
        ("level", ("reading_urad",), 1e-3, "reading_urad was in mrad in setup level"),
    ],
)  # fmt: skip
@pytest.mark.slow
def test_all_setups_of_an_instrument_in_another_unit_or_sign_are_said_in_its_name(
    right: Campaign, word: str, columns: tuple[str, ...], factor: float, what: str
) -> None:
    spoilt = right
    for setup in right.artefact.setups:
        if setup.id.startswith(word):
            spoilt = _spoilt(spoilt, setup.id, {name: (name, factor) for name in columns})
    assert _told(spoilt) == [what]


@pytest.mark.slow
def test_exchanged_axes_of_a_setup_are_said_where_the_fit_settles(right: Campaign) -> None:
    probings = right.probings
    rows = probings.target == "bar-xy"
    readings = {name: np.array(values) for name, values in probings.readings.items()}
    readings["X"][rows], readings["Y"][rows] = probings.readings["Y"][rows], probings.readings["X"][rows]
    told = _told(replace(right, probings=replace(probings, readings=readings)))
    assert told == ["the columns y_mm and x_mm were exchanged in setup bar-xy"]


def test_a_gross_reading_of_another_setup_hides_no_mistake(right: Campaign) -> None:
    spoilt = _spoilt(right, "bar-yz", {"reading_um": ("reading_um", -1.0)})
    reading = np.array(spoilt.probings.channels["reading_um"])
    reading[np.flatnonzero(spoilt.probings.target == "laser-X")[7]] += 80.0
    channels = {**spoilt.probings.channels, "reading_um": reading}
    spoilt = replace(spoilt, probings=replace(spoilt.probings, channels=channels))
    first = robust_fit(_of_machine(spoilt)).fit
    assert first.left_out.sum() == 1
    mistakes = [each.what for each in find_setup_mistakes(spoilt, _of_machine, first)]
    assert "the sign of reading_um were the other way round in setup bar-yz" in mistakes


def _repeated(campaign: Campaign, times: int, rng: np.random.Generator) -> Campaign:
    """The campaign with all rows so many times, each time with noise of its own on what was read."""
    probings = campaign.probings
    rows = np.tile(np.arange(len(probings)), times)
    many = probings.rows(rows)
    noise = {"reading_um": 0.3, "reading_urad": 0.3, "dx_um": 0.3, "dy_um": 0.3, "dz_um": 0.3}
    channels = {
        name: values + rng.normal(0.0, noise.get(name, 0.0), len(rows))
        for name, values in many.channels.items()
    }
    sequence = np.arange(1, len(rows) + 1)
    return replace(
        campaign, probings=replace(many, sequence=sequence, time=6.0 * sequence, channels=channels)
    )


def test_of_very_many_rows_some_are_tried_and_all_say_what_is_left(right: Campaign) -> None:
    many = _repeated(right, 2, np.random.default_rng(33))
    tried: list[int] = []

    def of_machine(campaign: Campaign) -> ChainProblem:
        tried.append(len(campaign.probings))
        return _of_machine(campaign)

    spoilt = _spoilt(many, "r-test", {"dz_um": ("dz_um", -1.0)})
    (mistake,) = find_setup_mistakes(spoilt, of_machine, fit(_of_machine(spoilt)))
    assert mistake.what == "the sign of dz_um were the other way round in setup r-test"
    assert mistake.rms_undone == pytest.approx(fit(_of_machine(many)).rms, rel=1e-6)
    # All rows are fitted once, to say what is left with the mistake undone.
    assert max(tried[:-1]) <= 500
    assert tried[-1] == len(spoilt.probings)


def test_setups_share_the_rows_that_are_tried_and_their_poses_do(right: Campaign) -> None:
    probings = _repeated(right, 6, np.random.default_rng(33)).probings
    rows = fewer_rows(probings)
    assert np.all(np.diff(rows) > 0)
    whole, some = (
        {str(name): int(count) for name, count in zip(*np.unique(each, return_counts=True), strict=True)}
        for each in (probings.target, probings.target[rows])
    )
    share = max(some.values())
    assert some == {name: min(count, share) for name, count in whole.items()}
    assert 490 < len(rows) <= 500
    x = probings.readings["X"][rows][probings.target[rows] == "laser-X"]
    assert len(np.unique(x)) == len(
        np.unique(right.probings.readings["X"][right.probings.target == "laser-X"])
    )


def _read_by(setup: np.ndarray, target: np.ndarray, run: np.ndarray) -> Probings:
    """Rows of setups that read targets in runs, at poses that rise."""
    count = len(setup)
    place = np.arange(count)
    channels = {"setup": setup.astype(np.float64)}
    return Probings(run, place + 1, 6.0 * place, target, {"X": place.astype(np.float64)}, channels)


def test_two_setups_that_read_one_target_have_their_rows_each() -> None:
    setup = np.repeat([1, 2], [3000, 40])
    rows = fewer_rows(_read_by(setup, np.full(3040, "T1"), np.ones(3040, dtype=np.int64)))
    assert np.unique(setup[rows], return_counts=True)[1].tolist() == [460, 40]


def test_targets_and_runs_do_not_make_the_rows_that_are_tried_many() -> None:
    """Were 15 000 of 20 000."""
    run, of_run = (each.ravel() for each in np.meshgrid(np.arange(1, 11), np.arange(2000), indexing="ij"))
    target = np.array([f"T{number:02}" for number in range(50)])[of_run % 50]
    rows = fewer_rows(_read_by(np.ones(20_000), target, run))
    assert len(rows) == 500
    assert np.unique(run[rows]).tolist() == list(range(1, 11))
    # Every target is among those of a run.
    assert all(len(np.unique(target[rows][run[rows] == number])) == 50 for number in range(1, 11))


def test_of_many_runs_of_many_setups_the_last_ones_are_tried() -> None:
    run, of_run = (each.ravel() for each in np.meshgrid(np.arange(1, 41), np.arange(400), indexing="ij"))
    setup = 1 + of_run % 4
    rows = fewer_rows(_read_by(setup, setup.astype(str), run))
    assert len(rows) <= 600
    assert np.unique(run[rows]).tolist() == [36, 37, 38, 39, 40]
    few = of_run < 3
    assert len(fewer_rows(_read_by(setup[few], setup[few].astype(str), run[few]))) == 120


def test_the_other_frame_of_an_r_test_is_said(right: Campaign) -> None:
    """Was: the sign of one of its components, which left twelve times what is stated."""
    setups = tuple(
        replace(setup, frame="tool") if setup.id == "r-test" else setup for setup in right.artefact.setups
    )
    told = _told(replace(right, artefact=replace(right.artefact, setups=setups)))
    assert told[0] == '`frame = "work"` were right in setup r-test'


def test_what_only_comes_nearest_is_not_enough() -> None:
    """Of 16 µm are 6.7 left, where 0.55 are stated."""
    nearest = MistakeFound("the sign of dy_um were the other way round", 15.7e-3, 6.68e-3, enough=False)
    assert mistake_sentence([nearest]).startswith("No single mistake of those that are tried explains")
    assert "do not correct this alone" in what_to_do([nearest])
    assert what_to_do([replace(nearest, enough=True)]) == "correct the file first."


def test_of_many_setups_that_scatter_the_three_worst_are_tried_and_the_others_counted() -> None:
    scatters = [
        SetupScatter(f"bar-{times:g}", times, 1.0, 40.0) for times in (4.0, 20.0, 1.0, 9.0, 6.0, 30.0)
    ]
    doubted, untried = _doubted((), scatters)
    assert [each.name for each in doubted] == ["bar-30", "bar-20", "bar-9"]
    assert untried == 2
    mistake = MistakeFound("the sign of dy_um were the other way round", 15.7e-3, 0.6e-3)
    assert mistake_sentence([mistake]).endswith("residual 0.6 µm with that undone.")
    several = mistake_sentence([replace(mistake, untried=2)])
    assert several.endswith(
        " 2 more setups contradict, and were not tried: `monitor compare` lists every setup."
    )
    assert " One more setup contradicts" in mistake_sentence([replace(mistake, untried=1)])


@pytest.mark.parametrize(("left", "explains"), [(645.0, True), (5e3, True), (2e5, False)])
def test_a_mistake_explains_where_effects_may_be_all_that_is_left(left: float, explains: bool) -> None:
    assert _explains(615, 645e3, left) is explains
