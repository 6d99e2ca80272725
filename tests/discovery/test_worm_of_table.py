"""The worm of a rotary table before an autocollimator; rates are in tests/benchmarks/trial_worms.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from by_path import load


@pytest.fixture(scope="module")
def trial() -> Any:
    return load("trial_worms", Path(__file__).resolve().parents[1] / "benchmarks" / "trial_worms.py")


def test_a_worm_is_named_at_some_dozens_of_indexations(trial: Any, tmp_path: Path) -> None:
    """It was told as a free shape, with good readings called bad: orders were looked at from 100 positions on."""
    assert trial.told(np.random.default_rng(2), 9, 0.0, "white", tmp_path) == ["ECC:harmonic9"]


def test_without_a_worm_no_order_is_named(trial: Any, tmp_path: Path) -> None:
    assert trial.told(np.random.default_rng(2), None, 0.0, "white", tmp_path) == []
