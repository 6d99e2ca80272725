"""The challenge: its campaigns are read, its truth does not move, and its scorer counts what it says."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.discovery import explain, fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.sizes import peak_of, size_of
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of
from monitor.readers import read_campaign

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parents[1] / "examples"
answerer = load("challenge_answer", HERE / "answer.py")
generate = load("challenge_generate", HERE / "generate.py")
scorer = load("challenge_score", HERE / "score.py")


def test_campaigns_are_read_and_the_truth_is_sealed(tmp_path: Path) -> None:
    sealed = generate.write(tmp_path, 2, 2, generate.SEED)
    text = (tmp_path / "truth.json").read_text(encoding="utf-8")
    assert hashlib.sha256(text.encode()).hexdigest() == sealed
    assert (tmp_path / "truth.sha256").read_text(encoding="utf-8").split()[0] == sealed
    truth = json.loads(text)["campaigns"]
    campaign = read_campaign(tmp_path / "campaigns" / "0002")
    assert (campaign.method, len(campaign.runs)) == ("samba", truth[0]["runs"])
    # What was drawn for the second campaign when the challenge was published.
    assert [(effect["effect"], effect["peak_um"]) for effect in truth[0]["effects"]] == [
        ("EZZ:reversal", 5.07),
        ("EXX:poly2", 6.8),
    ]


def hidden(effect: str, peak: float, shape: str | None = None) -> dict[str, object]:
    return {"effect": effect, "shape_outside": shape, "kind": "play", "peak_um": peak}


TRUTH = [
    {"campaign": "0001", "effects": [hidden("EXX:reversal", 5.0), hidden("EZC1:const@warmup", 4.0)]},
    {"campaign": "0002", "effects": [hidden("EYZ", 6.0, "bump"), hidden("EXX:cyclic10mm", 2.0)]},
    {"campaign": "0003", "effects": []},
]


def test_what_is_right_false_and_covered() -> None:
    answers = [
        {
            "campaign": "0001", "seconds": 3.0,
            "effects": [
                # Found, within 2 u; then under a rival's name; then once more, which is false.
                {"effect": "EXX:reversal", "rivals": [], "peak_um": 5.3, "u_um": 0.2},
                {"effect": "EX0C1@warmup", "rivals": ["EZC1:const@warmup38min"], "peak_um": 4.0, "u_um": 0.1},
                {"effect": "EXX:reversal", "rivals": [], "peak_um": 5.0, "u_um": 0.2},
            ],
        },
        # Of a shape outside of the catalogue the term counts; the pitch is compared to the millimetre.
        {
            "campaign": "0002", "seconds": 1.0,
            "effects": [
                {"effect": "EYZ:poly2", "rivals": [], "peak_um": 1.0, "u_um": 0.1},
                {"effect": "EXX:cyclic9.98mm", "rivals": [], "peak_um": 3.0, "u_um": 0.1},
            ],
        },
    ]  # fmt: skip
    result = scorer.score(TRUTH, answers)
    assert (result.campaigns, result.hidden, result.right, result.false, result.clean) == (3, 4, 4, 1, 2)
    assert (result.stated, result.covered, result.seconds) == (2, 1, 4.0)
    assert scorer.smallest(result.by_kind["play"]) == "1.5 (4)"
    assert scorer.smallest([(2.0, False), (5.0, True), (5.5, True), (7.0, True)]) == "3 (3)"
    assert scorer.smallest([(5.0, False)]) == "none (1)"
    (line,) = [row for row in scorer.tables({"one": result}) if row.startswith("| one | 100")]
    assert "0.33" in line
    with pytest.raises(ValueError, match="answers to campaigns that are not in the truth: 0009"):
        scorer.score(TRUTH, [{"campaign": "0009", "effects": []}])


def test_nothing_answered_is_nothing_found() -> None:
    result = scorer.score(TRUTH, [])
    assert (result.right, result.false, result.clean, result.hidden) == (0, 0, 3, 4)


def test_the_peak_of_the_challenge_is_the_products_where_no_straight_line_takes_part() -> None:
    """The challenge tells what an effect causes by itself; the product takes a constant and a line from powers."""
    fitted = fit(problem_of(read_campaign(EXAMPLES / "hidden-reversal-x")))
    texts = ("EXX:reversal", "EBB:harmonic2", "EXX:cyclic30mm", "EXX:poly2")
    variants = [Variant(text, parse_effect(text, fitted.problem.context.chain)) for text in texts]
    scene, parts = scene_of(fitted, variants), {}
    for candidate in scene.candidates:
        sizes = np.arange(1.0, candidate.raw.shape[2] + 1.0) * 1e-3
        raw = size_of(candidate, sizes, np.eye(len(sizes))).raw
        told = peak_of(scene, candidate, raw, sizes)
        parts[candidate.family] = told / answerer.peak_by_itself(fitted, candidate.effect.text, sizes)
    assert parts.pop("EXX:poly2") < 0.9
    assert parts == {text: pytest.approx(1.0, rel=1e-9) for text in texts[:3]}


@pytest.mark.slow
@pytest.mark.parametrize(
    "example", ["hidden-reversal-x", pytest.param("hidden-b-indexing", marks=pytest.mark.all_seeds)]
)
def test_the_peak_that_explain_tells_is_that_of_the_challenge(example: str) -> None:
    campaign = read_campaign(EXAMPLES / example)
    explanation = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))
    (effect,) = explanation.missing
    by_itself = answerer.peak_by_itself(explanation.final, effect.effect, effect.coefficients)
    assert effect.peak == pytest.approx(by_itself, rel=1e-4)
