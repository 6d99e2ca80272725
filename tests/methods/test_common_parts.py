"""What parameters have of a calibrated quantity that outlasts the campaign, by campaigns that the simulator measured
with one laser, whose scale is off by one number; it shares no code with the package.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from monitor.methods import campaign_method
from monitor.methods.chain.identification import RunIdentification
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.sources import CommonQuantity
from monitor.statistics.normalised_error import normalised_error
from tests.simulator import horizontal_centre as centre

GAINS = ("EXX", "EYY", "EZZ")
#: The scale, um/m: three standard uncertainties of what the readings leave of a gain.
U = 1.0
EXAMPLES = Path(__file__).parents[2] / "examples"


def _measured(folder: Path, seed: int, scale: float, truth: dict[str, float]) -> Campaign:
    """A campaign by the laser alone, which reads ``scale`` too much."""
    rng = np.random.default_rng(seed)
    path = centre.campaign(folder, rng, truth, otherwise=("laser", 1.0 + scale), only="laser")
    file, of = path / "campaign.toml", 'reading = "displacement"\n'
    key = f'{of}scale_standard_uncertainty_um_per_m = {U}\ncertificate = "C-7"\n'
    file.write_text(file.read_text(encoding="utf-8").replace(of, key), encoding="utf-8")
    campaign = read_campaign(path)
    assert isinstance(campaign, Campaign)
    return campaign


def _run(campaign: Campaign) -> tuple[RunIdentification, list[int]]:
    result = campaign_method(campaign).identify(campaign)
    return result.runs[0], [result.parameters.index(name) for name in GAINS]


def test_jcgm100_5_1_3_the_part_is_what_the_estimate_changes_by(tmp_path: Path) -> None:
    """A laser that reads u too much gives gains too large by u: so does a stated scale that is u too large, less."""
    truth = centre.truth_of(np.random.default_rng(4))
    right, at = _run(_measured(tmp_path / "right", 4, 0.0, truth))
    off, _ = _run(_measured(tmp_path / "off", 4, 1e-6 * U, truth))
    ((quantity, part),) = right.common_parts.items()
    assert quantity == CommonQuantity("laser interferometer", "C-7", "scale", 1e-6 * U)
    np.testing.assert_allclose(np.abs(part[at]), (off.estimate - right.estimate)[at], rtol=1e-3)
    # Squareness and straightness have nothing of it, to a thousandth of their u.
    others = np.isfinite(right.estimate)
    others[at] = False
    assert np.all(np.abs(part[others]) < 1e-3 * np.sqrt(np.diag(right.covariance))[others])


def test_the_bar_of_balls_and_the_length_of_a_ball_bar_are_such_quantities() -> None:
    """1.2 um of 305 mm and 0.3 um of 100 mm are 3.9 and 3.0 um/m of every gain, nearly all of its u for the bar."""
    for example, of, quantity, expected in (
        ("nothing-hidden", "four balls and a scale bar", "length of the bar", None),
        ("ball-bar", "ball bar", "length of 100 mm", 3.0),
    ):
        campaign = read_campaign(EXAMPLES / example)
        assert isinstance(campaign, Campaign)
        run, at = _run(campaign)
        ((found, part),) = run.common_parts.items()
        assert (found.of, found.quantity) == (of, quantity)
        if expected is None:
            bar = campaign.artefact.scale_bar
            assert bar is not None
            expected = 1e6 * bar.standard_uncertainty / bar.length
        np.testing.assert_allclose(1e6 * np.abs(part[at]), expected, rtol=0.01)


@pytest.mark.all_seeds
def test_jcgm100_f_1_2_3_two_campaigns_of_one_laser_differ_by_what_is_not_common(
    tmp_path: Path, seeds: Callable[[int, int], range]
) -> None:
    """January and June: |E_n| above 1 in 4.6 % with the covariance, in none where both are taken as independent; the
    mean of both is held by u with all of what is common, not by u as of independent results."""
    apart, independent, held, too_sure = 0, 0, 0, 0
    drawn = seeds(200, 15)
    for seed in drawn:
        rng = np.random.default_rng([seed, 17])
        truth, scale = centre.truth_of(rng), 1e-6 * float(rng.normal(0.0, U))
        (first, at), (second, _) = (
            _run(_measured(tmp_path / f"{seed}-{month}", 1000 * seed + month, scale, truth))
            for month in (1, 6)
        )
        u1, u2 = (np.sqrt(np.diag(run.covariance))[at] for run in (first, second))
        (p1,), (p2,) = ([part[at] for part in run.common_parts.values()] for run in (first, second))
        ends = first.estimate[at], u1, second.estimate[at], u2
        apart += np.count_nonzero(~normalised_error(*ends, p1 * p2).agree)
        independent += np.count_nonzero(~normalised_error(*ends).agree)
        off = np.abs((first.estimate + second.estimate)[at] / 2.0 - [truth[gain] for gain in GAINS])
        held += np.count_nonzero(off <= 1.96 * np.sqrt(u1**2 + u2**2 + 2.0 * p1 * p2) / 2.0)
        too_sure += np.count_nonzero(off <= 1.96 * np.hypot(u1, u2) / 2.0)
    count = 3 * len(drawn)
    print(
        f"{count} gains: E_n > 1 {apart}, as independent {independent}; held {held}, as independent {too_sure}"
    )
    # Gains of one campaign share the laser: the levels count once a seed, not three times.
    assert abs(apart / count - 0.0455) < 3.3 * np.sqrt(0.0455 * 0.9545 / count)
    assert independent == 0
    assert abs(held / count - 0.95) < 3.3 * np.sqrt(0.95 * 0.05 / len(drawn))
    assert too_sure < held
