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


@pytest.mark.parametrize("verb", ["identify", "explain", "map", "report"])
def test_a_help_loads_nothing_that_solves_or_draws(verb: str) -> None:
    code = (
        f"import sys\nfrom monitor.cli import main\ntry: main([{verb!r}, '--help'])\nexcept SystemExit: pass\n"
        "watched = {'scipy.special', 'scipy.linalg', 'matplotlib', 'monitor.discovery'}\n"
        "print(sorted(watched & set(sys.modules)))"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.splitlines()[-1] == "[]"


def test_the_lists_of_models_load_no_distributions(reading_database: Path) -> None:
    """What a contrast of instruments asks of scipy is asked when there is one."""
    code = (
        f"import sys\nfrom monitor.cli import main\nmain(['--db', {str(reading_database)!r}, 'model', 'list'])\n"
        "print('scipy.special' in sys.modules)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.splitlines()[-1] == "False"


def test_a_verb_that_ends_is_not_looked_through_for_cycles(reading_database: Path) -> None:
    # Registered before the verb's own, so called after it.
    code = (
        "import atexit, gc, sys\natexit.register(lambda: print(gc.get_freeze_count() > 10_000, gc.get_count()[0]))\n"
        f"sys.argv[1:] = ['--db', {str(reading_database)!r}, '--quiet', 'campaigns']\n"
        "from monitor.cli import main\nsys.exit(main())"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.split()[-2] == "True"
    assert answer.stderr == ""


def test_statistics_alone_load_no_solver_of_curves_and_no_notes(reading_database: Path) -> None:
    # One process asks all, those first of whose rooms the others need more.
    lines = {
        "fleet": ["monitor.reporting.run_notes", "monitor.store.results", "monitor.methods"],
        "trend|HU40-T": ["monitor.reporting.run_notes", "monitor.store.results", "monitor.methods"],
        "stats|five-days": [
            *(
                "monitor.methods.chain.gross",
                "monitor.methods.chain.results",
                "monitor.methods.curve.problem",
            ),
            *("monitor.methods.standard_test", "monitor.reporting.run_notes", "monitor.discovery"),
        ],
    }
    code = (
        "import sys\nfrom monitor.cli import main\n"
        f"for line, unneeded in {lines!r}.items():\n"
        f"    main(['--db', {str(reading_database)!r}, '--quiet', *line.split('|')])\n"
        "    print(line, sorted(set(unneeded) & set(sys.modules)))"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert [line for line in answer.stdout.splitlines() if line.endswith("]")][-3:] == [
        f"{line} []" for line in lines
    ]
