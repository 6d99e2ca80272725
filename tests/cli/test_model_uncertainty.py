"""The budget's line for lack of fit: there where something is missing, switched off on request, never trimmed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

LINE = "lack of fit of the model"


def test_the_line_appears_where_an_effect_is_hidden_and_names_its_probable_cause(
    typed: Any, filled: Path
) -> None:
    found = typed("uncertainty", "hidden-reversal-x", "--method", "guf", "--json", db=filled).document
    budget = found["guf"]["budget"]
    assert found["lack_of_fit_causes"][0]["effect"] == "EXX:reversal"
    assert max(budget[LINE].values()) > 0.3
    for name in found["parameters"]:
        assert sum(line[name] for line in budget.values()) == pytest.approx(1.0)
    prose = typed("uncertainty", "hidden-reversal-x", "--method", "guf", db=filled).out
    assert "the model does not explain all: what effects such as EXX:reversal" in prose


def test_the_line_can_be_switched_off(typed: Any, filled: Path) -> None:
    asked = ("uncertainty", "hidden-reversal-x", "--method", "guf", "--json")
    full = typed(*asked, db=filled).document["guf"]
    bare = typed(*asked, "--no-model-uncertainty", db=filled).document["guf"]
    assert LINE not in bare["budget"]
    assert all(bare["u"][name] <= full["u"][name] for name in full["u"])


def test_no_line_where_nothing_is_hidden(typed: Any, filled: Path) -> None:
    found = typed("uncertainty", "five-days", "--method", "guf", "--json", db=filled).document
    assert LINE not in found["guf"]["budget"]
    assert "lack_of_fit_causes" not in found
