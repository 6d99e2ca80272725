"""What lack of fit adds to the uncertainty: coverage of the true parameters with a hidden effect and without."""

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.discovery.machine.compare import lack_of_fit
from monitor.discovery.machine.model_uncertainty import model_uncertainty
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.effects.catalogue import catalogue
from monitor.methods.samba.method import problem_of
from monitor.methods.samba.virtual import ERRORS, GAINS, virtual_campaign

TRUE = np.array([*ERRORS.values(), *GAINS.values()])
LAST = 19
# Effects of every family, and four that the catalogue does not have.
HIDDEN = [
    "EYX:poly2", "EXZ:poly2", "EBB:harmonic2", "EYB:harmonic1", "EAB:harmonic2", "EZC:harmonic1", "EBC:harmonic1",
    "EXX:reversal", "EXC1:harmonic1", "EXX:cyclic20mm",
    "EYX:poly4", "EBB:harmonic4", "EYB:harmonic5", "EXZ:poly4",
]  # fmt: skip


def _evaluated(effect, seed):
    """Deviations of all runs (20, 13) in µm or µrad, the plain covariance and what lack of fit adds to it."""
    campaign = virtual_campaign("v", np.random.default_rng(seed), effect=effect, peak=5e-3 if effect else 0.0)
    found = fit(problem_of(campaign))
    chain = found.problem.context.chain
    known = [one.text for one in found.problem.base]
    variants = [one for effect in catalogue(chain, known, ("run_time",), {}) for one in variants_of(effect)]
    added = model_uncertainty(found, LAST, variants)
    size = len(TRUE)
    plain = found.solution.local_covariance[LAST][:size, :size]
    extra = np.zeros_like(plain) if added is None else added.covariance[:size, :size]
    return found, found.solution.local[:, :size] - TRUE, plain, extra, added


def _distance(deviations, covariance):
    """Mean squared Mahalanobis distance a parameter: 1 where the covariance is right."""
    inverse = np.linalg.inv(covariance)
    return float(np.mean(np.einsum("ri,ij,rj->r", deviations, inverse, deviations)) / len(inverse))


@pytest.fixture(scope="module")
def hidden():
    """The campaigns with a hidden effect of 5 µm."""
    return [_evaluated(effect, 100 + seed) for seed, effect in enumerate(HIDDEN)]


@pytest.mark.slow
def test_gum_f_2_4_5_covariance_is_right_on_average_where_an_effect_is_hidden(hidden):
    without = [_distance(deviations, plain) for _, deviations, plain, _, _ in hidden]
    added = [_distance(deviations, plain + extra) for _, deviations, plain, extra, _ in hidden]
    assert np.mean(without) > 5.0
    assert 0.8 < np.mean(added) < 1.25
    assert max(added) < 2.0


@pytest.mark.slow
def test_intervals_of_k_2_hold_where_an_effect_is_hidden(hidden):
    without = [np.abs(d) < 2.0 * np.sqrt(np.diag(plain)) for _, d, plain, _, _ in hidden]
    added = [np.abs(d) < 2.0 * np.sqrt(np.diag(plain + extra)) for _, d, plain, extra, _ in hidden]
    assert np.mean(without) < 0.85
    assert 0.93 < np.mean(added) < 0.99


@pytest.mark.slow
def test_taken_as_more_noise_the_line_would_be_far_too_small(hidden):
    # The reason of the module: a mean square of lack of fit, spread as white noise, misses what the fit absorbed.
    distances = []
    for found, deviations, plain, _, _ in hidden:
        test, _ = lack_of_fit(found)
        distances.append(_distance(deviations, plain * (1.0 + (test.f - 1.0) / len(found.problem.runs))))
    assert np.mean(distances) > 2.5


def test_the_hidden_effect_is_the_most_probable_cause_where_the_catalogue_has_it(hidden):
    named = {effect: added.effects for effect, (_, _, _, _, added) in zip(HIDDEN, hidden, strict=True)}
    for effect in ("EYX:poly2", "EBB:harmonic2", "EXX:reversal"):
        assert named[effect][0][0] == effect
        assert named[effect][0][1] > 0.9
    # Coinciding effects share the probability: what they do to the parameters differs, and both count.
    both = dict(named["EBC:harmonic1"])
    assert both["EAC:harmonic1"] == pytest.approx(0.5, abs=0.01)
    assert both["EBC:harmonic1"] == pytest.approx(0.5, abs=0.01)


def test_nothing_is_added_where_nothing_is_hidden():
    evaluated = [_evaluated(None, seed) for seed in range(300, 312)]
    called = [added is not None for *_, added in evaluated]
    # The line appears below a p-value of 0.05: in 12 campaigns more than four times with a probability of 2e-4.
    assert sum(called) <= 4
    distances = [_distance(deviations, plain + extra) for _, deviations, plain, extra, _ in evaluated]
    assert 0.8 < np.mean(distances) < 1.2


def test_without_candidates_lack_of_fit_counts_as_noise():
    campaign = virtual_campaign("v", np.random.default_rng(5), effect="EBB:harmonic2", peak=5e-3)
    found = fit(problem_of(campaign))
    test, _ = lack_of_fit(found)
    added = model_uncertainty(found, LAST, [])
    ratio = added.covariance[0, 0] / found.solution.local_covariance[LAST][0, 0]
    assert added.effects == ()
    assert added.dof == test.degrees_of_freedom
    assert ratio == pytest.approx((test.f - 1.0) / 20.0, rel=0.2)
