"""Draws the pictures of the tutorial with the program itself, from the example campaigns."""

from __future__ import annotations

import contextlib
import io
import shutil
import tempfile
from pathlib import Path

from sources import CHECKOUT

from monitor.cli import main

#: The verbs that draw, and the figure of each that the tutorial shows under another name.
EFFECT = "EZC1:const@warmup"
DRAWN = {
    ("stats", "five-days", "--by", "day"): ("parameters-by-run.png", "tutorial-parameters.png"),
    ("explain", "hidden-spindle-growth"): ("missing-effect-before-after.png", "tutorial-before-after.png"),
    ("model", "history", "samba-warm", "--campaign", "hidden-spindle-growth"): (
        "error-falling.png",
        "tutorial-error-falling.png",
    ),
}


def draw(out: Path) -> None:
    """Draw the pictures into a folder. Raises RuntimeError where a verb fails."""
    with tempfile.TemporaryDirectory() as folder:
        database = str(Path(folder, "first.duckdb"))
        examples = [str(CHECKOUT / "examples" / name) for name in ("five-days", "hidden-spindle-growth")]
        _run("--db", database, "import", *examples)
        _run("--db", database, "identify", "five-days")
        _run("--db", database, "model", "add", EFFECT, "--to", "samba", "--as", "samba-warm",
             "--campaign", "hidden-spindle-growth")  # fmt: skip
        for words, (figure, name) in DRAWN.items():
            figures = Path(folder, name).with_suffix("")
            _run("--db", database, *words, "--figures", str(figures))
            shutil.copy(figures / figure, out / name)


def _run(*words: str) -> None:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        status = main(list(words))
    if status:
        raise RuntimeError(f"monitor {' '.join(words)} ended with status {status}:\n{printed.getvalue()}")
