"""What the demo uses: the example campaigns and a database of its own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import monitor
from monitor.exceptions import InputError

MAIN, RUN = "five-days", 20
WEEK = "2026-W10"
HIDDEN = "hidden-spindle-growth"
FOUND_EFFECT = "EZC1:const@warmup"
EXAMPLES = (MAIN, "cold-cold", "hot-cold", HIDDEN)


@dataclass(frozen=True)
class DemoStep:
    """A step of the demo: what it shows, and the verb with its arguments."""

    step: str
    verb: str
    arguments: tuple[str, ...]


@dataclass(frozen=True)
class DemoAnswer:
    """The folder of the demo, its steps, and the files that they wrote."""

    out: Path
    steps: tuple[DemoStep, ...]
    files: tuple[str, ...]


def examples_folder() -> Path:
    """The folder ``examples``: of the checkout, or of the working directory. Raises InputError where there is none."""
    for folder in (Path(monitor.__file__).parent.parent / "examples", Path("examples")):
        if all((folder / name / "campaign.toml").is_file() for name in EXAMPLES):
            return folder
    raise InputError(
        "the example campaigns are not here; they come with the source: run `monitor demo` in a folder that holds "
        f"examples/ with {', '.join(EXAMPLES)}"
    )


def fresh_database(out: Path) -> Path:
    """The path of the demo's own database in ``out``; one of an earlier demo is removed."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name in ("demo.duckdb", "demo.duckdb.wal"):
            (out / name).unlink(missing_ok=True)
        for pattern in ("certificate-*.pdf", "health-*.html", "health-*.pdf"):
            for old in out.glob(pattern):
                old.unlink()
    except OSError as error:
        raise InputError(f"the folder {out} cannot be used: {error.strerror or error}") from error
    return out / "demo.duckdb"
