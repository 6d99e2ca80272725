"""Evidence, amplitudes and held-out errors against other ways to the same numbers."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
import statsmodels.api as sm
from by_path import simulator

from monitor.discovery import fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.discovery.machine.version_error import version_error
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.evidence import Pool, best_of_families, best_of_families_in, weigh, weigh_beside
from monitor.discovery.search.held_out import held_out_rms
from monitor.discovery.search.projection import eigen
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of


@pytest.fixture(scope="module")
def seen(virtual_campaigns):
    """A small campaign with two effects, and what the data see of four."""
    sim = simulator()
    effects = [
        sim.Effect("EXX:reversal", peak_um=4.0),
        sim.Effect("EBB:harmonic2", peak_um=4.0, direction=(1, 2)),
    ]
    campaign, told = virtual_campaigns.virtual(8, effects, days=2, runs_per_day=2)
    now = fit(problem_of(campaign))
    chain = now.problem.context.chain
    texts = ["EXX:reversal", "EBB:harmonic2", "EAX:poly1", "EYX:poly2"]
    variants = [one for text in texts for one in variants_of(parse_effect(text, chain))]
    return now, scene_of(now, variants), told


def test_projected_columns_are_the_residual_of_a_regression_on_the_runs_own_unknowns(seen):
    now, visible, _ = seen
    last = now.solution.last
    rows = last.residual.shape[1]
    for candidate in visible.candidates:
        raw = now.problem.padded(candidate.raw / now.problem.sigma[..., None])
        for run in range(4):
            whole = np.zeros((rows, raw.shape[-1]))
            whole[: raw.shape[1]] = raw[run]
            local = last.local[run] / np.linalg.norm(last.local[run], axis=0)
            left = whole - local @ np.linalg.lstsq(local, whole, rcond=1e-9)[0]
            mine = candidate.columns[run * rows : (run + 1) * rows]
            assert mine == pytest.approx(left, abs=1e-6 * np.abs(whole).max())


def test_f_and_p_against_statsmodels(seen):
    """Nested regressions on [runs' own unknowns, chosen effect] with and without the candidate."""
    now, visible, _ = seen
    last = now.solution.last
    runs, rows = last.residual.shape
    nuisance = np.zeros((runs * rows, 0))
    for run in range(runs):
        block = np.zeros((runs * rows, last.local.shape[2]))
        block[run * rows : (run + 1) * rows] = last.local[run] / np.linalg.norm(last.local[run], axis=0)
        nuisance = np.column_stack([nuisance, block])
    scaled = {one.family: one.columns / np.linalg.norm(one.columns, axis=0) for one in visible.candidates}
    small_x = np.column_stack([nuisance, scaled["EXX:reversal"]])
    small = sm.OLS(visible.residual, small_x).fit()
    chosen = visible.candidates[0]
    for found in weigh(visible.candidates[1:], visible.residual, chosen.columns, visible.degrees_of_freedom):
        large = sm.OLS(visible.residual, np.column_stack([small_x, scaled[found.candidate.family]])).fit()
        f, p, rank = large.compare_f_test(small)
        assert found.rank == rank
        assert found.f == pytest.approx(f, rel=1e-6)
        assert found.p_value == pytest.approx(p, rel=1e-5, abs=1e-200)
        assert found.explained == pytest.approx(small.ssr - large.ssr, rel=1e-6)


def test_weighing_together_and_alone_agree(seen):
    _, visible, _ = seen
    none = np.zeros((len(visible.residual), 0))
    pool = Pool(visible.candidates)
    together = {
        one.candidate.family: one for one in weigh(pool, visible.residual, none, visible.degrees_of_freedom)
    }
    for candidate in visible.candidates:
        (alone,) = weigh([candidate], visible.residual, none, visible.degrees_of_freedom)
        assert together[candidate.family].score == pytest.approx(alone.score, rel=1e-9)


def test_the_best_of_every_family_is_that_of_all(seen):
    now, visible, _ = seen
    chain = now.problem.context.chain
    texts = ("EXX:cyclic10mm", "EXX:cyclic12mm", "EYY:poly2", "EXX:cyclic14mm", "EYY:poly3")
    scene = scene_of(now, [each for text in texts for each in variants_of(parse_effect(text, chain))])
    pool = Pool(scene.candidates)
    selected = list(visible.candidates[:1])
    expected = best_of_families(weigh_beside(scene, pool, selected))
    assert best_of_families_in(scene.remainders.beside(selected), pool) == expected
    able = np.array([each is not expected[0].candidate for each in pool.candidates])
    best = best_of_families_in(scene.remainders.beside(selected), pool, able)
    weighed = [
        each for each in weigh_beside(scene, pool, selected) if each.candidate is not expected[0].candidate
    ]
    assert best == best_of_families(weighed)


@pytest.mark.parametrize("size", [1, 2, 3])
def test_eigenvectors_are_those_of_lapack(size):
    columns = np.random.default_rng(4).normal(size=(30, 2, 5, size))
    columns[:5, :, :, -1] = 2.0 * columns[:5, :, :, 0]
    columns[5:8, :, :, -1] = 0.0
    grams = np.swapaxes(columns, -1, -2) @ columns
    values, vectors = eigen(grams)
    assert values == pytest.approx(np.linalg.eigh(grams)[0], abs=1e-12)
    assert (vectors * values[..., None, :]) @ np.swapaxes(vectors, -1, -2) == pytest.approx(grams, abs=1e-12)
    identity = np.broadcast_to(np.eye(size), grams.shape)
    assert np.swapaxes(vectors, -1, -2) @ vectors == pytest.approx(identity, abs=1e-12)


def test_a_searched_candidate_pays_for_its_search(seen):
    _, visible, _ = seen
    none = np.zeros((len(visible.residual), 0))
    one = visible.candidates[2]
    searched = replace(one, variant=replace(one.variant, tries=10))
    (plain,) = weigh([one], visible.residual, none, visible.degrees_of_freedom)
    (paid,) = weigh([searched], visible.residual, none, visible.degrees_of_freedom)
    assert paid.p_value == pytest.approx(min(1.0, 10 * plain.p_value))
    assert paid.score == pytest.approx(plain.score - 2 * np.log(10))


def test_an_effect_beyond_what_machines_have_stands_at_odds(seen):
    _, visible, _ = seen
    none = np.zeros((len(visible.residual), 0))
    one = visible.candidates[0]
    (plain,) = weigh([one], visible.residual, none, visible.degrees_of_freedom)
    # Found at 4 µm: ten times what is said to be likely here, and a thousand times below.
    (odd,) = weigh([replace(one, largest=4e-4)], visible.residual, none, visible.degrees_of_freedom)
    (void,) = weigh([replace(one, largest=4e-6)], visible.residual, none, visible.degrees_of_freedom)
    assert not plain.too_large
    assert odd.too_large
    assert odd.score == pytest.approx(plain.score - 2 * np.log(400))
    assert odd.likelihood == pytest.approx(plain.likelihood)
    assert void.p_value == 1.0


def test_amplitudes_against_an_exact_refit_with_the_effects_in_the_model(seen):
    now, visible, told = seen
    chosen = visible.candidates[:2]
    found = amplitudes(visible, chosen)
    effects = tuple(one.variant.effect for one in chosen)
    exact = fit(replace(now.problem, added=effects))
    u = np.sqrt(np.diag(found.covariance))
    assert found.estimate == pytest.approx(exact.solution.common, abs=0.02 * u.min())
    assert found.covariance == pytest.approx(exact.solution.common_covariance * exact.scale**2, rel=1e-2)
    truth = np.concatenate([np.atleast_1d(one.coefficients) for one in told["effects"][-2:]])
    assert np.all(np.abs(found.estimate - truth) < 4 * u)


def test_held_out_error_against_brute_force_refits(seen):
    """Each run in turn predicted with the coefficients of the other three, refitted from scratch."""
    now, visible, _ = seen
    chosen = visible.candidates[:2]
    columns = np.concatenate([one.columns for one in chosen], axis=1)
    freedom = visible.degrees_of_freedom
    fast = held_out_rms(visible.residual, columns, visible.run, freedom, 1e-3)
    problem = replace(now.problem, added=tuple(one.variant.effect for one in chosen))
    total = 0.0
    for place, run in enumerate(now.problem.runs):
        out = now.problem.context.run == run
        others = fit(problem, out)
        # The runs' own unknowns of the left-out run are fitted with the coefficients held.
        for_it = fit(problem)
        held = problem.linearise(for_it.solution.local, others.solution.common)
        local = held.local[place]
        step = np.linalg.lstsq(local / np.linalg.norm(local, axis=0), held.residual[place], rcond=1e-9)[0]
        left = held.residual[place] - local / np.linalg.norm(local, axis=0) @ step
        total += float(left @ left)
    assert fast == pytest.approx(1e-3 * np.sqrt(total / freedom), rel=1e-5)


def test_the_error_of_a_version_is_that_of_the_scan(seen):
    now, visible, _ = seen
    chosen = visible.candidates[:2]
    version = version_error(fit(replace(now.problem, added=tuple(one.variant.effect for one in chosen))))
    columns = np.concatenate([one.columns for one in chosen], axis=1)
    scan = held_out_rms(visible.residual, columns, visible.run, visible.degrees_of_freedom, now.sigma)
    assert version.held_out_rms == pytest.approx(scan, rel=1e-4)
    assert version.rms < now.rms


def test_what_acts_in_one_run_only_is_no_prediction(virtual_campaigns):
    """A ball that moved in one run must not spoil the held-out error of the others."""
    sim = simulator()
    loose = sim.Effect("ball:2:moved", coefficients=(0.02, -0.01, 0.0), at=(3, 30))
    campaign, _ = virtual_campaigns.virtual(2, [loose])
    problem = problem_of(campaign)
    moved = parse_effect("ball:2:moved(run 3, sequence 30)", problem.context.chain)
    assert version_error(fit(replace(problem, added=(moved,)))).held_out_rms == pytest.approx(1e-3, rel=0.05)


def test_a_scene_goes_with_its_last_reference(seen):
    """Half a hundred megabytes of columns: in a circle they would stay until Python looks for garbage."""
    _, scene, _ = seen
    again = replace(scene)
    again.remainders.beside([])
    still_there = weakref.ref(again)
    gc.disable()
    try:
        del again
        assert still_there() is None
    finally:
        gc.enable()
