"""What a verb that only reads does not load: libraries that take longer than its answer."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from monitor.cli import main

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

READING = """
import contextlib, io, sys
from monitor.cli import main
with contextlib.redirect_stdout(io.StringIO()) as out:
    status = main(sys.argv[1:])
assert status == 0, out.getvalue()
assert out.getvalue().strip()
print(sorted({"pandas", "matplotlib", "weasyprint"} & set(sys.modules)))
"""


@pytest.fixture(scope="module")
def reading_database(made_once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A database with one campaign, identified."""

    def fill(folder: Path) -> None:
        for words in (["import", str(EXAMPLES / "five-days")], ["identify", "five-days"]):
            assert main(["--db", str(folder / "read.duckdb"), *words]) == 0

    return made_once("identified-five-days", fill) / "read.duckdb"


@pytest.mark.parametrize("verb", [["runs", "five-days"], ["trend", "HU40-T"], ["fleet"]], ids=" ".join)
def test_a_verb_that_reads_does_not_load_pandas(reading_database: Path, verb: list[str]) -> None:
    command = [sys.executable, "-c", READING, "--db", str(reading_database), *verb]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (answer.stdout.strip(), answer.stderr) == ("[]", "")
