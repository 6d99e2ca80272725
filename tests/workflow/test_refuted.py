"""Values of a model that the readings refute are followed with a word about it."""

from __future__ import annotations

from pathlib import Path

import pytest

from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.request import ExplainRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize(("example", "is_refuted"), [("hidden-reversal-x", True), ("nothing-hidden", False)])
def test_trend_says_that_the_readings_refute_the_model_where_explain_does(
    tmp_path: Path, example: str, is_refuted: bool
) -> None:
    with Database(tmp_path / "one.duckdb", threads=1) as db:
        import_campaign(db, read_campaign(EXAMPLES / example))
        answer = trend(db, TrendRequest("HU40-T"))
        explained = explain(db, ExplainRequest(example)).explanation
    said = [note for note in answer.notes if "refute the model" in note]
    assert (answer.model_refuted is not None) == is_refuted
    assert len(said) == int(is_refuted)
    assert (explained.comparison.lack_of_fit.p < 1e-3) == is_refuted
    if is_refuted:
        assert answer.model_refuted.campaign == example
        assert answer.model_refuted.p_value < 1e-4
        assert f"type `monitor explain {example}`" in said[0]
