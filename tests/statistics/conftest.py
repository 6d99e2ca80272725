"""Outside references of the statistics tests, read raw, and the binomial yardstick of rates."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

REFERENCES = Path(__file__).resolve().parents[1] / "references"


@pytest.fixture(scope="session")
def certified() -> Callable[[str], dict[str, Any]]:
    """A JSON file of the references by its path below tests/references."""

    def load(name: str) -> dict[str, Any]:
        return dict(json.loads((REFERENCES / name).read_text(encoding="utf-8")))

    return load


@pytest.fixture(scope="session")
def strd() -> Callable[[str], list[list[str]]]:
    """The rows of a NIST StRD file, as printed, where its header says that the data are."""

    def load(name: str) -> list[list[str]]:
        lines = (REFERENCES / "nist-strd" / name).read_text(encoding="latin-1").splitlines()
        stated = [re.search(r"Data\s+\(lines\s+(\d+)\s+to\s+(\d+)", line) for line in lines]
        spans = [(int(found[1]) - 1, int(found[2])) for found in stated if found]
        # The univariate files state no lines: their data follow the last rule of dashes.
        rules = [i + 1 for i, line in enumerate(lines) if line.startswith("-----")]
        first, last = spans[0] if spans else (rules[-1], len(lines))
        return [line.split() for line in lines[first:last] if line.strip()]

    return load


@pytest.fixture(scope="session")
def table() -> Callable[[str, int], np.ndarray]:
    """The numbers of a Dataplot file of tests/references: every line of exactly so many numbers."""

    def load(name: str, columns: int) -> np.ndarray:
        rows = []
        for line in (REFERENCES / name).read_text(encoding="latin-1").splitlines():
            try:
                row = [float(word) for word in line.split()]
            except ValueError:
                continue
            if len(row) == columns:
                rows.append(row)
        return np.array(rows)

    return load


@pytest.fixture(scope="session")
def digits() -> Callable[[float, float | str | Fraction], float]:
    """Number of correct significant digits (NIST's LRE), at most 15."""

    def lre(computed: float, right: float | str | Fraction) -> float:
        exact = Fraction(right)
        error = abs(Fraction(float(computed)) - exact)
        if exact != 0:
            error /= abs(exact)
        return 15.0 if error == 0 else min(15.0, -math.log10(error))

    return lre


@pytest.fixture(scope="session")
def rate_agrees() -> Callable[[int, int, float], bool]:
    """Whether so many alarms in so many trials agree with a nominal rate (exact binomial, 99.9 %)."""

    def agrees(alarms: int, trials: int, nominal: float) -> bool:
        low, high = stats.binom.interval(0.999, trials, nominal)
        return bool(low <= alarms <= high)

    return agrees


@pytest.fixture(scope="session")
def rate_at_most() -> Callable[[int, int, float], bool]:
    """Whether so many alarms in so many trials are no more than a nominal rate allows (exact binomial, 99.9 %)."""

    def agrees(alarms: int, trials: int, nominal: float) -> bool:
        return bool(alarms <= stats.binom.isf(0.001, trials, nominal))

    return agrees
