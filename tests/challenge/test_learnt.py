"""Campaigns of the challenge that were once answered wrongly, or not at all, and why they are answered now."""

from __future__ import annotations

from pathlib import Path

import pytest
from by_path import load

HERE = Path(__file__).resolve().parent
generate = load("challenge_generate", HERE / "generate.py")
answer = load("challenge_answer", HERE / "answer.py")
scorer = load("challenge_score", HERE / "score.py")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "right", "false"),
    [
        pytest.param(
            68, 2, 0, id="an axis that stands still at the poses proposed", marks=pytest.mark.all_seeds
        ),
        pytest.param(218, 3, 0, id="three effects that foretell left-out poses only together"),
        pytest.param(
            278,
            1,
            0,
            id="a wave that does not repeat each turn was three harmonics and a remainder",
            marks=pytest.mark.all_seeds,
        ),
    ],
)
def test_what_is_found_in_a_campaign(number: int, right: int, false: int, tmp_path: Path) -> None:
    generate.write(tmp_path, number, 1, generate.SEED)
    truth = scorer.json.loads((tmp_path / "truth.json").read_text(encoding="utf-8"))["campaigns"]
    answers = [answer.answer(tmp_path / "campaigns" / f"{number:04d}", ["ours"])["ours"]]
    scored = scorer.score(truth, answers)
    assert (scored.right, scored.false) == (right, false)
