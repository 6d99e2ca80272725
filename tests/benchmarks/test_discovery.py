"""How long a scan and an explanation take; run with `pytest tests/benchmarks`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy

from monitor.discovery import explain, fit
from monitor.discovery.machine.noise.correlation import Correlation
from monitor.discovery.machine.noise.rows import Rows
from monitor.discovery.machine.noise.whitening import Whitening
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.discovery.search.scan import scan
from monitor.effects.catalogue import catalogue, drivers_of
from monitor.methods.samba.method import problem_of
from monitor.readers import read_campaign

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_full_scan_of_150_candidates_on_20_runs(benchmark: Any) -> None:
    """The design asks for less than a second for 1240 probings; here from the fit on, projection included."""
    campaign = read_campaign(EXAMPLES / "hidden-reversal-x")
    now = fit(problem_of(campaign))
    problem = now.problem
    base = [effect.text for effect in problem.base]
    effects = catalogue(problem.context.chain, base, drivers_of(problem.context))
    variants = [one for effect in effects for one in variants_of(effect) if one.tries == 1][:150]
    assert len(variants) == 150
    found = benchmark(lambda: scan(scene_of(now, variants)))
    assert [one.candidate.family for one in found.findings] == ["EXX:reversal"]


def test_whole_explanation_with_all_pitches_and_time_constants(benchmark: Any) -> None:
    campaign = read_campaign(EXAMPLES / "hidden-spindle-growth")
    found = benchmark(lambda: explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1)))
    assert [one.effect for one in found.missing] == ["EZC1:const@warmup"]


def test_whitening_of_forty_columns_of_one_long_run(benchmark: Any) -> None:
    """Column by column, each reading a whole triangle, 1 465 readings of instruments took six times as long."""
    rows = Rows(np.ones((1, 1465), dtype=np.bool_), 3, None)
    whitening = Whitening(rows, Correlation(0.9, 0.5))
    columns = np.random.default_rng(1).normal(size=(40, 1, 4395))
    white = benchmark(lambda: whitening(columns))
    covariance = rows.correlated(0, 0.9, 0.5)
    expected = scipy.linalg.solve_triangular(
        np.linalg.cholesky(covariance), columns[7, 0].reshape(1465, 3), lower=True
    )
    np.testing.assert_allclose(white[7, 0], expected.reshape(-1), rtol=1e-9, atol=1e-12)
