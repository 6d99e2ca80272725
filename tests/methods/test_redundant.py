"""Coefficients that do the same: the numbers that remain against a least squares of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.methods.chain.problem import solve_problem
from monitor.methods.model import Model
from monitor.methods.tracker.method import METHOD
from monitor.readers import read_campaign
from monitor.refusal import ReasonKind
from monitor.reporting.refused import refusal_sentence
from monitor.reporting.texts import texts_of
from tests.simulator import robot_campaign as robots

WEIGHTS, LOAD = "EBJ2:compliance@link_weights", "EBJ2:compliance@gravity"


@pytest.fixture(scope="module")
def campaign_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    track = robots.track(np.random.default_rng(5), robots.Hidden(compliance={"J2": 2e-4}), poses=120)
    return robots.write_tracked(tmp_path_factory.mktemp("redundant") / "robot", track)


def test_weights_of_all_links_contain_the_load_at_the_flange(campaign_folder: Path) -> None:
    """With both in a model the load is held at zero, every weight has its number, as without the load."""
    campaign = read_campaign(campaign_folder)
    alone = METHOD.identify(campaign, Model("weights", added=(WEIGHTS,)))
    both = METHOD.identify(campaign, Model("both", added=(WEIGHTS, LOAD)))
    assert [(refusal.parameters, refusal.reason.kind) for refusal in both.added_refused] == [
        ((LOAD,), ReasonKind.HELD_AT_ZERO)
    ]
    np.testing.assert_allclose(both.added_estimate[:-1], alone.added_estimate, rtol=1e-6, atol=1e-12)
    sentence = refusal_sentence(both.added_refused[0])
    assert sentence.startswith(f"held at zero, because {WEIGHTS}.")
    assert "bei null festgehalten" in refusal_sentence(both.added_refused[0], texts_of("de"))


def test_the_order_of_the_model_says_what_is_held(campaign_folder: Path) -> None:
    """Behind the load one coefficient of the weights is held, and the fit is the same to rounding."""
    campaign = read_campaign(campaign_folder)
    solutions = [
        solve_problem(METHOD.problem_of(campaign, Model("both", added=effects)))
        for effects in ((WEIGHTS, LOAD), (LOAD, WEIGHTS), (WEIGHTS,))
    ]
    squares = [float(np.sum(solution.last.residual**2)) for solution in solutions]
    np.testing.assert_allclose(squares, squares[0], rtol=1e-9)
    assert [int(solution.common_held.sum()) for solution in solutions] == [1, 1, 0]
    # What is left determines as many numbers as numpy counts in the columns that the run's own unknowns leave.
    at = METHOD.problem_of(campaign, Model("both", added=(WEIGHTS, LOAD))).linearise(
        solutions[0].local, solutions[0].common
    )
    own, _ = np.linalg.qr(at.local[0] @ np.linalg.svd(at.local[0], full_matrices=False)[2].T[:, :30])
    left = at.common[0] - own @ (own.T @ at.common[0])
    rank = np.linalg.matrix_rank(left / np.linalg.norm(at.common[0], axis=0), tol=1e-3)
    assert rank == int(solutions[0].common_free.sum())


def test_effects_of_different_errors_that_do_the_same_get_no_number(campaign_folder: Path) -> None:
    """Gravity along X of J6 moves the flange as that along X of J5 does: a guess which of them it is would be none."""
    campaign = read_campaign(campaign_folder)
    model = Model("cancelling", added=("EXJ6:const@gravity", "EXJ5:const@gravity"))
    refused = METHOD.identify(campaign, model).added_refused
    assert {refusal.reason.kind for refusal in refused} == {ReasonKind.UNSEEN}
    assert len(refused) == 2
