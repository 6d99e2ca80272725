"""The notebooks of the examples run from the first cell to the last, and are kept without outputs."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NOTEBOOKS = sorted((EXAMPLES / "notebooks").glob("*.ipynb"))


def code_cells(notebook: Path) -> list[dict[str, Any]]:
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


def shown(source: str, name: str, namespace: dict[str, Any]) -> str:
    """Run a cell; what a notebook would show of its last expression."""
    tree = ast.parse(source, name)
    last = tree.body[-1]
    if not isinstance(last, ast.Expr):
        exec(compile(tree, name, "exec"), namespace)
        return ""
    exec(compile(ast.Module(tree.body[:-1], []), name, "exec"), namespace)
    value = eval(compile(ast.Expression(last.value), name, "eval"), namespace)
    html = getattr(value, "_repr_html_", None)
    return "" if value is None else str(html() if html is not None else repr(value))


def test_there_are_three() -> None:
    assert [path.stem for path in NOTEBOOKS] == [
        "find-the-missing-effect",
        "first-campaign",
        "fleet-with-sql",
    ]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs(notebook: Path) -> None:
    for cell in code_cells(notebook):
        assert (cell["outputs"], cell["execution_count"]) == ([], None)


@pytest.mark.parametrize(
    "notebook",
    [
        pytest.param(
            path, marks=pytest.mark.slow if path.stem == "find-the-missing-effect" else (), id=path.stem
        )
        for path in NOTEBOOKS
    ],
)
@pytest.mark.slow
def test_a_notebook_runs(notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "examples").symlink_to(EXAMPLES, target_is_directory=True)
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, Any] = {}
    tables = 0
    for number, cell in enumerate(code_cells(notebook), start=1):
        text = shown("".join(cell["source"]), f"{notebook.name}, code cell {number}", namespace)
        tables += "<table" in text
    assert tables >= 2


def test_a_database_opens_in_a_notebook_without_widgets(tmp_path: Path) -> None:
    """DuckDB refuses every setting of its bar there. It takes a process without a main file, with a kernel for one."""
    code = (
        "import sys, types\n"
        "shell = types.SimpleNamespace(config={'IPKernelApp': {}})\n"
        "sys.modules['IPython'] = types.SimpleNamespace(get_ipython=lambda: shell)\n"
        "sys.modules['ipywidgets'] = None\n"
        "import duckdb\n"
        "try:\n    duckdb.connect().execute('SET enable_progress_bar = false')\n"
        "except duckdb.InvalidInputException as fault:\n    print('ipywidgets' in str(fault))\n"
        "import monitor as mm\n"
        "with mm.open('shop.duckdb', new=True) as db:\n    print(len(db.machines()))"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert answer.stderr == ""
    assert answer.stdout.splitlines() == ["True", "0"]
