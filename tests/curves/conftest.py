"""What the search says of every measured series, found once for all tests."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest


def _script() -> Any:
    path = Path(__file__).with_name("real_data.py")
    spec = importlib.util.spec_from_file_location("real_data", path)
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    sys.modules["real_data"] = found
    spec.loader.exec_module(found)
    return found


@pytest.fixture(scope="session")
def script() -> Any:
    """The script that writes docs/real-data.md."""
    return _script()


#: The series of the tests that ``make test`` runs; ``make slow`` has all.
QUICK = ("enso", "mpc61", "mpc62", "mpc633", "randn", "randu", "soulen", "zarr13")


@pytest.fixture(scope="session")
def told(script: Any, thorough: bool) -> dict[str, Any]:
    """Explain and history of every series, or of ``QUICK``, all the way from a folder to the database."""
    return script.tell(None if thorough else QUICK)
