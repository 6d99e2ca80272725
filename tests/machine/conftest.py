"""The independent simulator, loaded by path: the tests import by path and tests/ is no package."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

SIMULATOR = Path(__file__).resolve().parents[1] / "simulator"


@pytest.fixture(scope="session")
def simulator() -> ModuleType:
    """The package tests/simulator."""
    if "simulator" not in sys.modules:
        spec = importlib.util.spec_from_file_location(
            "simulator", SIMULATOR / "__init__.py", submodule_search_locations=[str(SIMULATOR)]
        )
        assert spec is not None
        assert spec.loader is not None
        sys.modules["simulator"] = module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return sys.modules["simulator"]
