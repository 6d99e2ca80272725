"""Scripts that only make runs by hand still find what they import: a move of a module breaks none of them unseen."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]
FOLDERS = ("soak", "fuzz", "benchmarks", "challenge", "setup", "curves")
SCRIPTS = sorted(
    path for folder in FOLDERS for path in (TESTS / folder).glob("*.py") if not path.name.startswith("test_")
)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: f"{script.parent.name}/{script.name}")
def test_what_a_script_imports_of_the_package_is_there(script: Path) -> None:
    missing = []
    for node in ast.walk(ast.parse(script.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "monitor":
            module = importlib.import_module(str(node.module))
            for name in node.names:
                if not hasattr(module, name.name) and not _is_module(f"{node.module}.{name.name}"):
                    missing.append(f"{node.module}.{name.name}")
    assert missing == []


def _is_module(name: str) -> bool:
    try:
        importlib.import_module(name)
    except ImportError:
        return False
    return True
