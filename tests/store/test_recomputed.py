"""The sample of identifications that a verification computes anew."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from monitor.store import Database, MadeBy, StoredIdentification
from monitor.workflow import recomputed
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.keeping import VerifyRequest, verify

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def made(count: int, of_others: int = 0) -> list[MadeBy]:
    """``count`` identifications by this version, numbered from 1, and behind them those of others."""
    day = datetime(2026, 11, 24)
    return [MadeBy(k + 1, "0.2.0", day, is_this=k < count) for k in range(count + of_others)]


def test_one_altered_among_a_hundred_is_drawn_as_often_as_chance_says(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three of a hundred are looked at: the altered one in 3 % of verifications, whatever its number."""
    monkeypatch.setattr(recomputed, "identifications_made", lambda _: made(100))
    monkeypatch.setattr(recomputed, "_difference", lambda db, number: "altered" if number == 38 else None)
    faults = [
        len(recomputed.recompute(db, np.random.default_rng(seed), 3).faults) for seed in range(7000, 9000)
    ]
    interval = binomtest(sum(faults), len(faults)).proportion_ci(0.99, "exact")
    assert interval.low <= 0.03 <= interval.high


def test_each_verification_draws_others_and_a_seed_draws_the_same_again(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[int] = []
    monkeypatch.setattr(recomputed, "identifications_made", lambda _: made(1000))
    monkeypatch.setattr(recomputed, "_difference", lambda db, number: drawn.append(number))
    first, second = verify(db, VerifyRequest()), verify(db, VerifyRequest())
    assert first.seed != second.seed
    assert (first.recomputed, first.recomputable) == (3, 1000)
    verify(db, VerifyRequest(seed=first.seed))
    assert drawn[:3] == drawn[6:]
    assert drawn[:3] != drawn[3:6]
    assert verify(db, VerifyRequest(recompute=1000)).seed is None


def test_those_of_other_versions_are_drawn_where_this_one_made_too_few(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[int] = []
    monkeypatch.setattr(recomputed, "identifications_made", lambda _: made(2, of_others=100))
    monkeypatch.setattr(recomputed, "_difference", lambda db, number: drawn.append(number))
    answer = verify(db, VerifyRequest())
    assert (answer.recomputed, answer.recomputable) == (2, 2)
    assert (answer.recomputed_of_others, answer.of_other_versions) == (1, 100)
    assert (drawn[:2], drawn[2] > 2) == ([1, 2], True)
    verify(db, VerifyRequest(seed=answer.seed))
    assert drawn[:3] == drawn[3:]


@pytest.mark.parametrize(
    ("made_by", "is_fault"),
    [
        ("UPDATE identification SET computed_at = computed_at", True),
        ("UPDATE identification SET software_version = '0.1.9'", False),
        # Two states of one version, of which the later one brought a migration.
        ("UPDATE schema_migration SET applied_at = applied_at + INTERVAL 1 DAY WHERE number = 15", False),
    ],
)
def test_what_comes_out_otherwise_is_a_fault_of_the_version_that_computed_it(
    db: Database, monkeypatch: pytest.MonkeyPatch, made_by: str, is_fault: bool
) -> None:
    """`verify` called it a fault where a mended method moved what the version of 24 November had computed."""
    import_folders(db, ImportRequest([EXAMPLES / "r-test"]))
    identify(db, IdentifyRequest("r-test"))
    db.execute(made_by)
    assert verify(db, VerifyRequest()).notes == ()
    estimate = recomputed.identification_by_number

    def moved(db: Database, number: int) -> StoredIdentification:
        stored = estimate(db, number)
        (run,) = stored.runs
        values = run.estimate + 0.02 * np.sqrt(np.diag(run.covariance))
        return replace(stored, runs=(replace(run, estimate=values),))

    monkeypatch.setattr(recomputed, "identification_by_number", moved)
    answer = verify(db, VerifyRequest())
    assert (answer.recomputed, answer.recomputed_of_others) == (int(is_fault), int(not is_fault))
    faults = [fault for fault in answer.faults if "altered" not in fault]
    (sentence,) = faults if is_fault else answer.notes
    assert (len(faults), len(answer.notes)) == (answer.recomputed, answer.recomputed_of_others)
    assert "of r-test differs by 0.02 standard uncertainties" in sentence
    assert ("cannot be reproduced" in sentence) is is_fault
    version = "0.1.9" if "0.1.9" in made_by else "0.2.0"
    assert is_fault or f"was computed by another version of this software ({version}, on 20" in sentence
