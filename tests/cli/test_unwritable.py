"""Verbs that only read answer a database that may not be written as any other, and say that nothing was stored."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

UNSTORED = "monitor: the answer was not stored: "
VERBS = (
    ("trend", "HU40-T"),
    ("stats", "cold-cold"),
    ("compare", "cold-cold"),
    ("map", "cold-cold", "--run", "1"),
    ("plan", "cold-cold", "--balls", "3"),
    ("explain", "cold-cold"),
    ("uncertainty", "cold-cold", "--run", "1", "--method", "guf"),
    ("identify", "cold-cold"),
    ("report", "--week", "2026-W08", "--workers", "1"),
)


@pytest.mark.slow
@pytest.mark.parametrize("words", VERBS, ids=lambda words: words[0])
def test_nothing_was_identified_and_everything_is_answered(
    typed: Any, filled_once: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    _answers_alike(typed, filled_once, tmp_path, monkeypatch, words)


@pytest.mark.parametrize("words", [VERBS[1], VERBS[7]], ids=lambda words: words[0])
def test_a_verb_that_identifies_answers(
    typed: Any, filled_once: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    _answers_alike(typed, filled_once, tmp_path, monkeypatch, words)


def _answers_alike(
    typed: Any, filled_once: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    for folder in ("free", "shut"):
        (tmp_path / folder).mkdir()
        shutil.copyfile(filled_once, tmp_path / folder / "shop.duckdb")
    free, shut = tmp_path / "free" / "shop.duckdb", tmp_path / "shut" / "shop.duckdb"
    stored = typed("--json", *words, db=free)
    monkeypatch.setattr("monitor.store.sharing.why_not_written", lambda path: f"{path} may not be written")
    answered = typed("--json", *words, db=shut)
    assert (answered.status, json.loads(answered.out)) == (stored.status, json.loads(stored.out))
    assert [line for line in answered.err.splitlines() if line.startswith("monitor: ")] == [
        f"{UNSTORED}{shut} may not be written"
    ]
    assert UNSTORED not in stored.err
    assert shut.read_bytes() == filled_once.read_bytes()
    assert {path.name for path in shut.parent.iterdir()} <= {"shop.duckdb", "shop.duckdb.lock"}
