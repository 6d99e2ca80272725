"""The scale of a tracker: stated with an uncertainty it stands in u of lengths and gains, else that is told.

The machines are those of the simulator, which shares no code with the package; their gains are zero, and the tracker
reads all lengths too long by its scale.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import robust_fit
from monitor.exceptions import CampaignError
from monitor.methods import campaign_method
from monitor.methods.chain.identification import Identification
from monitor.methods.tracker.problem import TrackingProblem
from monitor.readers import read_campaign
from monitor.readers.writer import write_campaign
from monitor.records import Campaign
from monitor.reporting.certificate.grounds import GroundKind
from monitor.reporting.texts import texts_of
from monitor.sources import CommonQuantity
from monitor.store.record_json import probe_json, probe_record
from monitor.uncertainty import measured_run
from monitor.workflow.certificate.taken_as_stated import known_scale_sentence
from monitor.workflow.uncertainty.grounds import grounds_of
from tests.simulator import tracked_machine as shop

EXAMPLES = Path(__file__).parents[2] / "examples"
GAINS = ("EXX", "EYY", "EZZ")
#: The scale, mm/mm: ten times what the readings leave of a gain.
U = 10e-6


def _campaign(folder: Path, seed: int, scale: float = 0.0, stated: float | None = U) -> Campaign:
    """A measuring machine with a head, whose tracker reads ``scale`` too much."""
    path = shop.write(
        folder, shop.MACHINES["measuring machine with head"], np.random.default_rng(seed), shop.Scene(noise_um=5.0),
        poses=60,
    )  # fmt: skip
    campaign = read_campaign(path)
    assert isinstance(campaign, Campaign)
    columns = {
        name: values * (1.0 + scale) if name.startswith("tracker_") else values
        for name, values in campaign.probings.channels.items()
    }
    return replace(
        campaign,
        probings=replace(campaign.probings, channels=columns),
        probe=replace(campaign.probe, scale_uncertainty=stated, certificate="T-3"),
    )


def _identified(campaign: Campaign) -> Identification:
    return campaign_method(campaign).identify(campaign)


def _gains(result: Identification) -> tuple[np.ndarray, np.ndarray]:
    at = [result.parameters.index(name) for name in GAINS]
    return result.runs[0].estimate[at], result.runs[0].covariance[np.ix_(at, at)]


def test_jcgm102_6_2_the_scale_is_a_covariance_of_all_points(tmp_path: Path) -> None:
    """Least squares by the whole covariance of the readings, u^2 L L^T of the lengths from the middle."""
    campaign = _campaign(tmp_path / "a", 3)
    plain = campaign_method(campaign).problem_of(
        replace(campaign, probe=replace(campaign.probe, scale_uncertainty=None))
    )
    at = plain.linearise(plain.start, plain.common_start)
    # In the machine's frame by the first guess, which is the rotation of the tracker's own points to products.
    points = plain.context.nominal - plain.context.nominal.mean(axis=0)
    lengths = (points / plain.sigma).ravel()
    whole = np.eye(len(lengths)) + U**2 * np.outer(lengths, lengths)
    size = np.linalg.norm(at.local[0], axis=0)
    size[size == 0.0] = 1.0
    jacobian = at.local[0] / size
    expected = np.linalg.pinv(jacobian.T @ np.linalg.solve(whole, jacobian), rcond=1e-12) / np.outer(
        size, size
    )
    at_gains = [plain.base_names.index(name) for name in GAINS]
    _, covariance = _gains(_identified(campaign))
    np.testing.assert_allclose(covariance, expected[np.ix_(at_gains, at_gains)], rtol=0.01)


def test_a_scale_that_is_off_as_stated_is_held_and_one_that_is_not_stated_is_told(tmp_path: Path) -> None:
    for stated in (None, U):
        campaign = _campaign(tmp_path / str(stated), 5, 1.5 * U, stated)
        result = _identified(campaign)
        gains, covariance = _gains(result)
        off = np.abs(gains) / np.sqrt(np.diag(covariance))
        problem = campaign_method(campaign).problem_of(campaign)
        grounds = [
            ground
            for ground in grounds_of(campaign, robust_fit(problem), 1)
            if ground.kind is GroundKind.SCALE
        ]
        if stated is None:
            (told,) = result.as_stated
            assert told.name == "t"
            assert set(GAINS) <= set(told.moved["scale"])
            assert [ground.subject[:3] for ground in grounds if ground.subject] == ["t ("]
            assert np.all(off > 5.0)
        else:
            assert result.as_stated == ()
            assert grounds == []
            assert np.all(off < 2.5)
            ((quantity, part),) = result.runs[0].common_parts.items()
            assert quantity == CommonQuantity("t", "T-3", "scale", U)
            at = [result.parameters.index(name) for name in GAINS]
            np.testing.assert_allclose(np.abs(part[at]), U, rtol=1e-3)


def test_the_scale_moves_what_has_a_length_and_no_angle() -> None:
    """Of the robot the two long links, 455 and 420 mm, by 10 um/m of them."""
    campaign = read_campaign(EXAMPLES / "tracked-robot")
    assert isinstance(campaign, Campaign)
    result = _identified(replace(campaign, probe=replace(campaign.probe, scale_uncertainty=U)))
    ((_, part),) = result.runs[0].common_parts.items()
    of = dict(zip(result.parameters, np.abs(part), strict=True))
    assert of["EZ0J3"] == pytest.approx(455.0 * U, rel=0.01)
    assert of["EX0J5"] == pytest.approx(420.0 * U, rel=0.01)
    u = dict(zip(result.parameters, np.sqrt(np.diag(result.runs[0].covariance)), strict=True))
    assert all(of[name] < 0.02 * u[name] for name in result.parameters if name[1] in "ABC")


def test_the_run_by_itself_has_the_scale_among_what_is_calibrated(tmp_path: Path) -> None:
    campaign = _campaign(tmp_path / "a", 6)
    run = measured_run(campaign_method(campaign).problem_of(campaign), 1)
    assert run.calibrated[0] == ("scale",)


@pytest.mark.slow
def test_the_stated_scale_holds_the_gains(tmp_path: Path, seeds: Callable[[int, int], range]) -> None:
    held, exact, drawn = 0, 0, seeds(100, 30)
    for seed in drawn:
        scale = float(np.random.default_rng([seed, 9]).normal(0.0, U))
        for stated in (U, None):
            campaign = _campaign(tmp_path / f"{seed}-{stated}", 100 + seed, scale, stated)
            gains, covariance = _gains(_identified(campaign))
            square = float(gains @ np.linalg.solve(covariance, gains))
            # 95 % of chi-square with three degrees of freedom.
            inside = square <= 7.815
            held, exact = held + (inside and stated is not None), exact + (inside and stated is None)
    print(f"{len(drawn)} machines: all gains held {held}, with an exact scale {exact}")
    assert abs(held / len(drawn) - 0.95) < 3.3 * np.sqrt(0.95 * 0.05 / len(drawn))
    assert exact < held / 2


def test_the_scale_is_read_and_written_again_and_is_no_key_of_a_touching_probe(tmp_path: Path) -> None:
    campaign = _campaign(tmp_path / "a", 4)
    write_campaign(campaign, tmp_path / "again")
    assert read_campaign(tmp_path / "again").probe == campaign.probe
    assert "scale_uncertainty" in json.loads(probe_json(campaign.probe))
    # Texts of before, and with them the hashes of campaigns, have no such key.
    assert "scale_uncertainty" not in json.loads(probe_json(replace(campaign.probe, scale_uncertainty=None)))
    folder = tmp_path / "touch"
    folder.mkdir()
    for file in (EXAMPLES / "steel-bar").iterdir():
        text = file.read_bytes()
        if file.name == "campaign.toml":
            text = text.replace(b"[probe]\n", b"[probe]\nscale_standard_uncertainty_um_per_m = 1.0\n")
        (folder / file.name).write_bytes(text)
    with pytest.raises(CampaignError, match="scale_standard_uncertainty_um_per_m"):
        read_campaign(folder)


def _stating(folder: Path, *keys: str) -> Path:
    """The example whose ``[probe]`` has some keys besides."""
    shutil.copytree(EXAMPLES / "tracked-robot", folder)
    path = folder / "campaign.toml"
    text = re.sub(r"\nscale_standard_uncertainty.*", "", path.read_text(encoding="utf-8"))
    stated = "".join(f"{key}\n" for key in keys)
    path.write_text(text.replace("[probe]\n", f"[probe]\n{stated}"), encoding="utf-8")
    return folder


def test_a_scale_that_is_stated_as_known_is_no_ground_and_stands_in_the_certificate(tmp_path: Path) -> None:
    campaign = read_campaign(_stating(tmp_path / "known", 'known = ["scale"]'))
    assert isinstance(campaign, Campaign)
    assert campaign.probe.known == ("scale",)
    assert probe_record(probe_json(campaign.probe)) == campaign.probe
    assert "known" not in json.loads(probe_json(replace(campaign.probe, known=())))
    write_campaign(campaign, tmp_path / "again")
    assert read_campaign(tmp_path / "again").probe == campaign.probe
    problem = campaign_method(campaign).problem_of(campaign)
    assert isinstance(problem, TrackingProblem)
    assert problem.exact_scales() == ()
    assert replace(problem, is_scale_known=False).exact_scales() != ()
    sentence = known_scale_sentence(campaign, texts_of("en"))
    assert sentence is not None
    assert campaign.probe.id in sentence


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (("scale_standard_uncertainty_um_per_m = 1.0", 'known = ["scale"]'), "take 'scale' out of known"),
        (('known = ["frame"]',), "'frame' is no unknown of this reading; what may be known is scale"),
        (("known = true",), r'is no list of names; write for example known = \["scale"\]'),
    ],
)
def test_what_a_tracker_may_know_is_its_scale_alone(
    tmp_path: Path, keys: tuple[str, ...], message: str
) -> None:
    with pytest.raises(CampaignError, match=message):
        read_campaign(_stating(tmp_path / "wrong", *keys))
