"""The sample of identifications that a verification computes anew."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from monitor.records import Campaign
from monitor.store import Database, StoredIdentification, import_campaign, save_identification, save_model
from monitor.workflow import recomputed
from monitor.workflow.keeping import VerifyRequest, verify


def test_one_altered_among_a_hundred_is_drawn_as_often_as_chance_says(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three of a hundred are looked at: the altered one in 3 % of verifications, whatever its number."""
    monkeypatch.setattr(recomputed, "identification_numbers", lambda *_: list(range(1, 101)))
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
    monkeypatch.setattr(recomputed, "identification_numbers", lambda *_: list(range(1, 1001)))
    monkeypatch.setattr(recomputed, "_difference", lambda db, number: drawn.append(number))
    first, second = verify(db, VerifyRequest()), verify(db, VerifyRequest())
    assert first.seed != second.seed
    assert (first.recomputed, first.recomputable) == (3, 1000)
    verify(db, VerifyRequest(seed=first.seed))
    assert drawn[:3] == drawn[6:]
    assert drawn[:3] != drawn[3:6]
    assert verify(db, VerifyRequest(recompute=1000)).seed is None


def test_what_another_version_made_is_counted_and_not_computed_anew(
    tmp_path: Path,
    make_campaign: Callable[..., Campaign],
    make_identification: Callable[..., StoredIdentification],
) -> None:
    """Somebody who alters an identification and gives it another version changes a number that is printed."""
    campaign = make_campaign("one")
    with Database(tmp_path / "shop.duckdb") as db:
        import_campaign(db, campaign)
        save_model(db, "samba", ())
        save_identification(db, make_identification(campaign))
        db.execute("UPDATE identification SET software_version = '0.1.9'")
        answer = verify(db, VerifyRequest())
        assert (answer.recomputed, answer.recomputable, answer.of_other_versions) == (0, 0, 1)
