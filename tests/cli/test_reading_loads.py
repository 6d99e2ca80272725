"""What a verb that only reads does not load: libraries and rooms that take longer to load than its answer.

How long each verb takes: ``tests/benchmarks/starting.py``.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from monitor.cli import main

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

# One process asks all of them, one after the other: what one loads is loaded for the next.
READING = """
import contextlib, io, sys
from monitor.cli import main
loaded = {}
for line in sys.argv[2:]:
    before = set(sys.modules)
    with contextlib.redirect_stdout(io.StringIO()) as out:
        status = main(["--db", sys.argv[1], *line.split("|")])
    assert status == 0 and out.getvalue().strip(), line
    new = set(sys.modules) - before
    loaded[line] = sorted({".".join(name.split(".")[:2]) for name in new})
print(loaded)
"""
#: What each verb loads first, in this order, of all that is watched; nothing else of it is loaded by any of them.
LOADED = {
    "audit": set(),
    "campaigns": set(),
    "runs|five-days": set(),
    "sql|FROM v_machines": set(),
    "config|show": set(),
    "certificate|template": set(),
    "fleet": {"scipy.special"},
    "trend|HU40-T": set(),
    "model|list": {"monitor.methods", "monitor.effects", "monitor.machine"},
    "stats|five-days": set(),
    "stats|five-days|--json": set(),
    "trend|HU40-T|--parameter|EC0Y": set(),
    "export|tables": set(),
}
WATCHED = {
    *(
        "pandas",
        "statsmodels",
        "numba",
        "matplotlib",
        "jinja2",
        "weasyprint",
        "openpyxl",
        "fastapi",
        "sqlite3",
    ),
    *("scipy.special", "scipy.stats", "scipy.linalg", "scipy.optimize", "scipy.sparse", "scipy.signal"),
    *("monitor.methods", "monitor.effects", "monitor.machine", "monitor.discovery", "monitor.uncertainty"),
    "monitor.web",
}


@pytest.fixture(scope="module")
def reading_database(made_once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A database with one campaign, identified."""

    def fill(folder: Path) -> None:
        for words in (["import", str(EXAMPLES / "five-days")], ["identify", "five-days"], ["model", "list"]):
            assert main(["--db", str(folder / "read.duckdb"), *words]) == 0

    return made_once("identified-with-models", fill) / "read.duckdb"


def test_verbs_that_read_load_only_what_they_need(reading_database: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-c", READING, str(reading_database), *LOADED]
    answer = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert answer.stderr == ""
    loaded = {
        line: {name for name in names if name in WATCHED or name.partition(".")[0] in WATCHED}
        for line, names in ast.literal_eval(answer.stdout).items()
    }
    assert loaded == LOADED


def test_the_version_is_said_without_numpy_and_the_database() -> None:
    code = (
        "import sys\nfrom monitor.cli import main\ntry: main(['--version'])\nexcept SystemExit: pass\n"
        "print(sorted({'numpy', 'duckdb', 'rich'} & set(sys.modules)))"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.splitlines()[1] == "[]"
