"""The Monte Carlo route of Type B sources against distributions drawn in the test, and what repeated runs show of them.

References: identifications of readings moved by hand, numpy's generators and scipy's Kolmogorov-Smirnov test; no
derivative, law or sampler of ours.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.reporting.covariance_source import CovarianceKind
from monitor.sources import Law, Quantity, Sharing, Source
from monitor.uncertainty import measured_run, sensitivity_of
from monitor.uncertainty.covariance import uncorrelated
from monitor.uncertainty.monte_carlo.sampling import BlockSampler
from monitor.uncertainty.monte_carlo.sourced_trials import Moves, moved_estimator
from monitor.uncertainty.type_b import source_columns
from monitor.workflow.campaign_parts import only_run
from monitor.workflow.uncertainty.sources import shown_part

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
#: Kelvin and 1/K: the bar dominates every gain, so that its law shows.
HALF_WIDTH, ALPHA = 20.0, 11.5e-6
NAMES = ("EXX", "EYY", "EZZ")
DRAWS = {
    Law.RECTANGULAR: lambda rng, n: rng.uniform(-1.0, 1.0, n),
    Law.TRIANGULAR: lambda rng, n: rng.triangular(-1.0, 0.0, 1.0, n),
    Law.ARCSINE: lambda rng, n: np.sin(rng.uniform(0.0, 2.0 * np.pi, n)),
}

KURTOSIS = {Law.RECTANGULAR: 1.8, Law.TRIANGULAR: 2.4, Law.ARCSINE: 1.5}


@pytest.fixture(scope="module")
def balls():
    return only_run(read_campaign(EXAMPLES / "five-days"), 3)


def gains(campaign) -> np.ndarray:
    identification = campaign_method(campaign).identify(campaign)
    places = [identification.parameters.index(name) for name in NAMES]
    return identification.runs[0].estimate[places]


def longer(campaign, strain: float):
    bar = campaign.artefact.scale_bar
    changed = replace(bar, length=bar.length * (1.0 + strain))
    return replace(campaign, artefact=replace(campaign.artefact, scale_bar=changed))


@pytest.mark.parametrize("law", list(DRAWS))
def test_the_trials_of_a_warm_bar_have_its_law_in_every_gain(balls, law):
    run = measured_run(campaign_method(balls).problem_of(balls), 3)
    at = sensitivity_of(run)
    units = ("mm",) * len(run.input_names)
    inputs = uncorrelated(run.input_names, units, run.inputs, np.full(len(units), 1e-6), source="probing")
    size = (
        HALF_WIDTH
        / {Law.RECTANGULAR: np.sqrt(3.0), Law.TRIANGULAR: np.sqrt(6.0), Law.ARCSINE: np.sqrt(2.0)}[law]
    )
    bar = Source(
        name="bar", quantity=Quantity.STANDARD_TEMPERATURE, size=HALF_WIDTH, law=law, expansion_coefficient=ALPHA
    )  # fmt: skip
    parts = source_columns(run, at.unknowns, balls, 3, (bar,))
    moves = Moves(parts)
    model = moved_estimator(run, inputs, NAMES, moves, seed=1)
    sampler = BlockSampler(moves.distributions(inputs), seed=1, block_size=4000)
    outputs, converged = model(sampler.draw(0))
    assert converged.all()
    middle = gains(balls)
    slope = (gains(longer(balls, 1e-5)) - gains(longer(balls, -1e-5))) / 2e-5
    rng = np.random.default_rng(2)
    expected = middle + np.outer(ALPHA * HALF_WIDTH * DRAWS[law](rng, 100_000), slope)
    for drawn, reference in zip(outputs.T, expected.T, strict=True):
        assert drawn.std() == pytest.approx(ALPHA * size, rel=0.05)
        assert stats.ks_2samp(drawn, reference).pvalue > 1e-3
        # The fourth moment tells the laws from a normal one, of which it is 3: 1.8, 2.4 and 1.5.
        assert stats.kurtosis(drawn, fisher=False) == pytest.approx(KURTOSIS[law], abs=0.15)
    # A bar has one temperature: the three gains move together.
    assert np.corrcoef(outputs.T) == pytest.approx(np.ones((3, 3)), abs=1e-3)


@pytest.mark.parametrize("shared", list(Sharing))
@pytest.mark.parametrize("kind", [CovarianceKind.POOLED_BY_DAY, CovarianceKind.ALL_RUNS])
@pytest.mark.parametrize(("days", "between_days"), [(1, False), (5, False), (5, True)])
def test_a_source_counts_once_whatever_shares_its_value(kind, days, between_days, shared):
    """2000 campaigns drawn run by run: scatter of the runs, and the source beside it where that does not show it.

    A source of 2 beside a repeatability of 1; what is stated is held against the variance of a run over all campaigns.
    Where the uncertainty does not hold over the days, a value a day is right within the day alone: it is counted.
    """
    rng = np.random.default_rng([days, between_days, list(Sharing).index(shared)])
    campaigns, runs = 2000, 4
    shape = {
        Sharing.ALL_RUNS: (campaigns, 1, 1), Sharing.DAY: (campaigns, days, 1), Sharing.RUN: (campaigns, days, runs),
        Sharing.PROBING: (campaigns, days, runs),
    }[shared]  # fmt: skip
    values = rng.normal(size=(campaigns, days, runs)) + 2.0 * rng.normal(size=shape)
    true = float(values.var())
    within = float(values.var(axis=2, ddof=1).mean())
    if kind is CovarianceKind.POOLED_BY_DAY:
        scatter = within
        if between_days:
            scatter += float(values.mean(axis=2).var(axis=1, ddof=1).mean()) - within / runs
    else:
        scatter = float(values.reshape(campaigns, -1).var(axis=1, ddof=1).mean())
    beside = 4.0 * (1.0 - shown_part(kind, (runs,) * days, between_days).get(shared, 0.0))
    stated = scatter + beside
    # Of 2000 campaigns a variance of a source of all runs or of a day of one is good to 3 %, others to 1.5.
    assert stated == pytest.approx(true, rel=0.1)


@pytest.mark.parametrize("runs_of_days", [(1, 8), (3, 3, 3), (2, 2, 2, 2, 2), (5, 4, 1)])
def test_a_value_a_day_shows_among_all_runs_in_the_part_that_unequal_days_leave(runs_of_days):
    """Without the rest, u of days of one and eight runs was half of what it is; drawn run by run."""
    rng = np.random.default_rng([7, *runs_of_days])
    campaigns, days = 20_000, np.repeat(np.arange(len(runs_of_days)), runs_of_days)
    drawn = 2.0 * rng.normal(size=(campaigns, len(runs_of_days)))
    values = rng.normal(size=(campaigns, len(days))) + drawn[:, days]
    scatter = float(values.var(axis=1, ddof=1).mean())
    shown = shown_part(CovarianceKind.ALL_RUNS, runs_of_days, False)[Sharing.DAY]
    assert scatter + 4.0 * (1.0 - shown) == pytest.approx(5.0, rel=0.03)
