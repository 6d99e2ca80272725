"""What all tests share: modules of the tests loaded by path, the independent simulator, how many workers there are."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

# Each worker of pytest-xdist has one core: pools of BLAS threads would only fight for it. numpy reads this when it is
# imported, so it stands before everything else; processes that tests start inherit it.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OMP_NUM_THREADS", "1")

if "by_path" not in sys.modules:
    _spec = importlib.util.spec_from_file_location("by_path", Path(__file__).with_name("by_path.py"))
    assert _spec is not None
    assert _spec.loader is not None
    sys.modules["by_path"] = importlib.util.module_from_spec(_spec)
    _spec.loader.exec_module(sys.modules["by_path"])


def pytest_xdist_auto_num_workers() -> int:
    """Return the number of workers of ``-n auto``: the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@pytest.fixture(scope="session")
def simulator() -> ModuleType:
    """The package tests/simulator."""
    found: ModuleType = sys.modules["by_path"].simulator()
    return found
