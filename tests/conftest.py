"""What all tests share: modules of the tests loaded by path, and the independent simulator."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

if "by_path" not in sys.modules:
    _spec = importlib.util.spec_from_file_location("by_path", Path(__file__).with_name("by_path.py"))
    assert _spec is not None
    assert _spec.loader is not None
    sys.modules["by_path"] = importlib.util.module_from_spec(_spec)
    _spec.loader.exec_module(sys.modules["by_path"])


@pytest.fixture(scope="session")
def simulator() -> ModuleType:
    """The package tests/simulator."""
    found: ModuleType = sys.modules["by_path"].simulator()
    return found
