"""The scale of an instrument: stated with an uncertainty it stands in u of all that rests on it, else that is told.

The covariance is compared with least squares by the whole covariance of the readings (JCGM 102:2011, 6.2), in which a
scale is u^2 L L^T of the lengths that were read; the simulator shares no code with the package.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import robust_fit
from monitor.exceptions import CampaignError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments.as_stated import as_stated
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.readers import read_campaign
from monitor.readers.writer import write_campaign
from monitor.records import Campaign
from monitor.reporting.certificate.grounds import GroundKind
from monitor.workflow.uncertainty.grounds import grounds_of
from tests.simulator import horizontal_centre as centre

GAINS = ("EXX", "EYY", "EZZ")
KEY = "scale_standard_uncertainty_um_per_m = 2.0\n"


def _campaign(
    folder: Path,
    seed: int,
    keys: str = "",
    scale: float = 0.0,
    only: str = "",
    of: str = 'reading = "displacement"\n',
) -> tuple[Campaign, dict[str, float]]:
    """A horizontal centre of its own whose laser reads ``scale`` too much; its setups have ``keys``."""
    rng = np.random.default_rng(seed)
    truth = centre.truth_of(rng)
    path = centre.campaign(folder / "shop", rng, truth, otherwise=("laser", 1.0 + scale), only=only)
    file = path / "campaign.toml"
    file.write_text(file.read_text(encoding="utf-8").replace(of, of + keys), encoding="utf-8")
    campaign = read_campaign(path)
    assert isinstance(campaign, Campaign)
    return campaign, {**truth, "EZ0B": truth["EZ0B"] - truth["EZ0A"]}


def _problem(campaign: Campaign) -> InstrumentProblem:
    problem = campaign_method(campaign).problem_of(campaign)
    assert isinstance(problem, InstrumentProblem)
    return problem


def _gains(problem: InstrumentProblem) -> tuple[np.ndarray, np.ndarray]:
    """The gains and their covariance, mm/mm."""
    solution = solve_problem(problem)
    at = [problem.base_names.index(name) for name in GAINS]
    return solution.local[0, at], solution.local_covariance[0][np.ix_(at, at)]


def test_jcgm102_6_2_the_scale_is_a_covariance_of_all_readings_of_the_laser(tmp_path: Path) -> None:
    problem = _problem(_campaign(tmp_path / "plain", 7)[0])
    at = problem.linearise(problem.start, problem.common_start)
    rows = at.local.shape[1] - len(problem.extra_names)
    lengths = np.zeros(problem.sigma.shape)
    for part in problem.parts:
        if part.reading.name == "displacement":
            lengths[part.at] = part.rows.measured
    scaled = np.concatenate([(lengths / problem.sigma).ravel(), np.zeros(len(problem.extra_names))])
    assert len(scaled) == rows + len(problem.extra_names)
    whole = np.eye(len(scaled)) + 2e-6**2 * np.outer(scaled, scaled)
    length = np.linalg.norm(at.local[0], axis=0)
    length[length == 0.0] = 1.0
    jacobian = at.local[0] / length
    expected = np.linalg.pinv(jacobian.T @ np.linalg.solve(whole, jacobian), rcond=1e-10)
    expected /= np.outer(length, length)
    gains = [problem.base_names.index(name) for name in GAINS]
    _, covariance = _gains(_problem(_campaign(tmp_path / "stated", 7, KEY)[0]))
    np.testing.assert_allclose(covariance, expected[np.ix_(gains, gains)], rtol=1e-3, atol=1e-17)


@pytest.mark.parametrize(("setups", "expected"), [("one", 2.0), ("each its own", 2.0 / np.sqrt(3.0))])
def test_setups_of_one_instrument_have_one_scale(tmp_path: Path, setups: str, expected: float) -> None:
    """The mean of three gains is as sure as one of them, unless three lasers gave them."""
    campaign, _ = _campaign(tmp_path, 8, KEY, only="laser")
    if setups != "one":
        own = tuple(replace(setup, instrument=setup.id) for setup in campaign.artefact.setups)
        campaign = replace(campaign, artefact=replace(campaign.artefact, setups=own))
    _, covariance = _gains(_problem(campaign))
    assert 1e6 * np.sqrt(covariance.sum()) / 3.0 == pytest.approx(expected, rel=0.05)


def test_runs_of_one_instrument_have_one_scale(tmp_path: Path) -> None:
    """The mean over two runs is as sure as each: the laser was the same."""
    campaign, _ = _campaign(tmp_path, 8, KEY, only="laser")
    (run,) = campaign.runs
    count = len(campaign.probings)
    probings = campaign.probings.rows(np.tile(np.arange(count), 2))
    both = replace(
        campaign,
        runs=(run, replace(run, run=2)),
        probings=replace(probings, run=np.repeat([1, 2], count)),
    )
    problem = _problem(both)
    assert problem.stays is not None
    solution = solve_problem(problem)
    at = problem.base_names.index("EXX")
    assert 1e6 * np.sqrt(solution.local_covariance[:, at, at]) == pytest.approx([2.0, 2.0], rel=0.05)
    alone = problem.beside_others(solution, 1)
    assert alone.from_others is not None
    np.testing.assert_allclose(1e6 / alone.from_others.root, 2.0, rtol=0.05)


def test_a_scale_that_is_off_as_stated_is_held_and_one_that_is_not_stated_is_told(tmp_path: Path) -> None:
    """1 K of air and 10 hPa together."""
    off = {}
    for name, keys in (("exact", ""), ("stated", KEY)):
        campaign, truth = _campaign(tmp_path / name, 9, keys, 3.6e-6)
        problem = _problem(campaign)
        gains, covariance = _gains(problem)
        off[name] = np.abs(gains - [truth[gain] for gain in GAINS]) / np.sqrt(np.diag(covariance))
        told = {each.name: each.moved["scale"] for each in as_stated(problem) if "scale" in each.moved}
        # The gain of Y moves what the head shows of its own place, by 0.1 u for 1 um/m.
        assert told == ({"laser interferometer": ("EZ0B", *GAINS)} if name == "exact" else {})
        grounds = [
            ground
            for ground in grounds_of(campaign, robust_fit(problem), 1)
            if ground.kind is GroundKind.SCALE
        ]
        assert [ground.subject for ground in grounds] == (
            ["laser interferometer (EZ0B, EXX, EYY, EZZ)"] if name == "exact" else []
        )
    assert np.all(off["exact"] > 5.0)
    assert np.all(off["stated"] < 2.5)


LASER, BAR = 'reading = "displacement"\n', 'reading = "distance"\n'
LENGTH = "length_standard_uncertainty_um = 0.3\n"
CONTRADICTIONS = (
    (LASER, (KEY, KEY.replace("2.0", "3.0"), KEY), KEY.split(" ")[0], "known to 3 µm/m here and known to 2 µm/m in"),
    (LASER, (KEY, KEY, ""), KEY.split(" ")[0], "without an uncertainty here and known to 2 µm/m in setup 'laser-X'"),
    (LASER, ('known = ["scale"]\n', "", ""), KEY.split(" ")[0], "without an uncertainty here and known in setup"),
    (LASER, (KEY, KEY, 'known = ["scale"]\n'), "known", "' is one unknown of all its setups; it is known here"),
    (LASER, (KEY + 'known = ["scale"]\n',) * 3, KEY.split(" ")[0], "take 'scale' out of known, so that"),
    (LASER, ('known = ["direction"]\n', "", ""),
     "direction_standard_uncertainty_urad", "or leave this key out where the direction holds exactly"),
    (LASER, (f'{KEY}certificate = "C-7"\n', f'{KEY}certificate = "C-8"\n', KEY), "certificate",
     "is calibrated by certificate 'C-8' here and by certificate 'C-7' in setup 'laser-X'; one instrument has one"),
    (BAR, ('certificate = "B-1"\n', "", ""), "certificate", "without one here and by certificate 'B-1' in setup"),
    (BAR, ('known = ["length"]\n',) * 3, LENGTH.split(" ")[0], "the length is stated with an uncertainty and as known"),
)  # fmt: skip


@pytest.mark.parametrize(("of", "keys", "named", "words"), CONTRADICTIONS)
def test_statements_that_contradict_each_other_are_refused(
    tmp_path: Path, of: str, keys: tuple[str, ...], named: str, words: str
) -> None:
    rng = np.random.default_rng(3)
    path = centre.campaign(
        tmp_path / "shop", rng, centre.truth_of(rng), only="laser" if of == LASER else "bar"
    )
    file = path / "campaign.toml"
    first, *others = file.read_text(encoding="utf-8").split(of)
    text = first + "".join(of + key + other for key, other in zip(keys, others, strict=True))
    file.write_text(text, encoding="utf-8")
    with pytest.raises(CampaignError, match=re.escape(words)) as refused:
        read_campaign(path)
    lines = text.splitlines()
    for fault in refused.value.faults:
        assert fault.line is not None
        assert fault.file == "campaign.toml"
        assert lines[fault.line - 1].startswith((named, "[[setups]]"))


@pytest.mark.parametrize("otherwise", ["length_mm = 100.0", "another instrument"])
def test_another_bar_has_a_length_of_its_own(tmp_path: Path, otherwise: str) -> None:
    rng = np.random.default_rng(3)
    path = centre.campaign(tmp_path / "shop", rng, centre.truth_of(rng), only="bar")
    file = path / "campaign.toml"
    head, rest = file.read_text(encoding="utf-8").split(LENGTH, 1)
    if otherwise == "another instrument":
        head = head.replace('instrument = "', 'instrument = "other ')
    else:
        head = re.sub("length_mm = .*", otherwise, head)
    file.write_text(head + "length_standard_uncertainty_um = 0.9\n" + rest, encoding="utf-8")
    campaign = read_campaign(path)
    assert isinstance(campaign, Campaign)
    assert sorted(1e3 * (setup.length_uncertainty or 0.0) for setup in campaign.artefact.setups)[
        -1
    ] == pytest.approx(0.9)


def test_a_scale_that_is_stated_as_known_is_no_ground(tmp_path: Path) -> None:
    campaign, _ = _campaign(tmp_path, 9, 'known = ["scale"]\n')
    problem = _problem(campaign)
    assert not any("scale" in each.moved for each in as_stated(problem))
    assert not any("scale" in name for name in problem.own_names)


def test_a_bar_that_states_its_scale_is_as_one_that_states_its_length(tmp_path: Path) -> None:
    """0.3 um of 150 mm are 2 um/m."""
    of = 'reading = "distance"\n'
    campaign, _ = _campaign(tmp_path, 10, KEY, only="bar", of=of)
    bars = tuple(replace(setup, known=("length",)) for setup in campaign.artefact.setups)
    campaign = replace(campaign, artefact=replace(campaign.artefact, setups=bars))
    _, by_scale = _gains(_problem(campaign))
    _, by_length = _gains(_problem(_campaign(tmp_path / "length", 10, only="bar")[0]))
    np.testing.assert_allclose(by_scale, by_length, rtol=1e-3, atol=1e-16)


def test_the_scale_is_read_and_written_again(tmp_path: Path) -> None:
    campaign, _ = _campaign(tmp_path, 9, KEY)
    assert [setup.scale_uncertainty for setup in campaign.artefact.setups[:3]] == [2e-6] * 3
    write_campaign(campaign, tmp_path / "again")
    assert read_campaign(tmp_path / "again").artefact.setups == campaign.artefact.setups


def test_deviations_have_no_scale(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="scale_standard_uncertainty_um_per_m"):
        _campaign(tmp_path, 9, KEY, of='reading = "vector"\n')
