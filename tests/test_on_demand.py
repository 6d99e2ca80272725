"""Packages whose names are loaded on demand: what the type checker reads is what there is."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import monitor

PACKAGE = Path(monitor.__file__).parent
PACKAGES = ["statistics", "store"]


def imported_for_types(package: str) -> dict[str, set[str]]:
    """The names by module that a package imports where the type checker reads it."""
    tree = ast.parse((PACKAGE / package / "__init__.py").read_text("utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    assert len(imports) == len(block.body)
    return {str(node.module): {alias.name for alias in node.names} for node in imports}


@pytest.mark.parametrize("package", PACKAGES)
def test_the_names_of_the_types_are_those_that_are_loaded(package: str) -> None:
    loaded = importlib.import_module(f"monitor.{package}")
    for module, names in imported_for_types(package).items():
        for name in names:
            assert getattr(loaded, name) is getattr(importlib.import_module(module), name), name
            # Python would give the package its module under the same name.
            assert not (PACKAGE / package / f"{name}.py").exists()
            assert not (PACKAGE / package / name).is_dir()
    asked = subprocess.run(
        [sys.executable, "-c", f"import monitor.{package} as p; print(*[n for n in dir(p) if n[0] != '_'])"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    every = set().union(*imported_for_types(package).values())
    assert every <= set(asked.stdout.split())


def test_a_name_that_there_is_not_is_refused() -> None:
    with pytest.raises(AttributeError, match=r"^module 'monitor\.store' has no attribute 'load_campaing'$"):
        importlib.import_module("monitor.store").load_campaing  # noqa: B018
    with pytest.raises(ImportError, match=r"cannot import name 'mean' from 'monitor\.statistics'"):
        exec("from monitor.statistics import mean")


def test_a_package_loads_none_of_its_modules_before_a_name_is_asked_for() -> None:
    code = "import sys, monitor.statistics; print([m for m in sys.modules if m.startswith('monitor.statistics.')])"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
