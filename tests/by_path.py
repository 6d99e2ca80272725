"""Modules of the tests loaded by their path: tests/ is no package, and pytest imports by path.

``tests/conftest.py`` registers this file, so that test files and helpers may write ``from by_path import load``;
the scripts of ``tests/benchmarks`` put ``tests`` on their path.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

TESTS = Path(__file__).resolve().parent


def load(name: str, path: Path) -> ModuleType:
    """The module of a file, or the package of an ``__init__.py``, registered under a name and executed once."""
    if name not in sys.modules:
        places = [str(path.parent)] if path.name == "__init__.py" else None
        spec = importlib.util.spec_from_file_location(name, path, submodule_search_locations=places)
        assert spec is not None
        assert spec.loader is not None
        sys.modules[name] = module = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
    return sys.modules[name]


def simulator() -> ModuleType:
    """The package tests/simulator, which shares no code with the product; its modules are then ``simulator.robot``."""
    return load("simulator", TESTS / "simulator" / "__init__.py")
