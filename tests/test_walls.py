"""The walls of the house: who may import whom, read from the syntax tree of every file of the package.

Imports inside functions and under ``TYPE_CHECKING`` count too: a wall with a door in it is no wall.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import monitor

PACKAGE = Path(monitor.__file__).parent

GROUND = {"exceptions", "units", "records", "documents"}
ROW = [
    "machine",
    "effects",
    "methods",
    "uncertainty",
    "statistics",
    "discovery",
    "store",
    "reporting",
    "workflow",
    "web",
    "cli",  # may start the pages (`monitor serve`); the pages know nothing of the command line
]

# `from monitor import __version__` is for everyone: the package itself imports nothing.
VERSION = {"__init__"}

# Room -> the parts of monitor that it may import, besides itself. The row: everything to the left, and the ground.
ALLOWED: dict[str, set[str]] = {
    "__init__": set(),
    **dict.fromkeys(GROUND, GROUND | VERSION),
    "readers": GROUND | VERSION,
    **{room: GROUND | VERSION | set(ROW[:place]) for place, room in enumerate(ROW)},
    # Data only: SQL and templates, found through importlib.resources.
    "migrations": set(),
    "reports": set(),
}
for _room in ("workflow", "web", "cli"):
    ALLOWED[_room] = ALLOWED[_room] | {"readers"}

# Library -> the only rooms that may know it.
KEEPERS: dict[str, set[str]] = {
    "duckdb": {"store"},
    "jinja2": {"reporting"},
    "weasyprint": {"reporting"},
    "matplotlib": {"reporting"},
    "pyhanko": {"reporting"},
    "pkcs11": {"reporting"},
    "fastapi": {"web"},
    "starlette": {"web"},
    "uvicorn": {"web"},
    "dask": {"uncertainty"},
    "distributed": {"uncertainty"},
    "rich": {"cli"},
}

# Packed folder -> the rooms that may look into it.
RESOURCES: dict[str, set[str]] = {"monitor.migrations": {"store"}, "monitor.reports": {"reporting", "web"}}


def room_of(path: Path, package: Path) -> str:
    """The room of a file: its first folder below the package, or its own name."""
    return path.relative_to(package).parts[0].removesuffix(".py")


def imported(path: Path, package: Path) -> Iterator[tuple[int, str]]:
    """Line and dotted name of everything that a file imports; relative imports made absolute."""
    relative = path.relative_to(package.parent)
    here = relative.parts[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), filename=str(path))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = [*here[: len(here) - node.level + 1]] if node.level else []
            base += node.module.split(".") if node.module else []
            # `from monitor import units` imports a room, `from monitor.units import µm` a name.
            yield from ((node.lineno, ".".join([*base, alias.name])) for alias in node.names)


def named_in_strings(path: Path) -> Iterator[tuple[int, str]]:
    """Line and value of every string that is a dotted name of the package, as ``import_module`` would take it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), filename=str(path))):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and node.value.startswith("monitor.")
        ):
            yield node.lineno, node.value


def breaches(package: Path) -> list[str]:
    """Every import that goes through a wall, as ``file:line: what is wrong``."""
    found = []
    for path in sorted(package.rglob("*.py")):
        room = room_of(path, package)
        where = path.relative_to(package.parent)
        if room not in ALLOWED:
            found.append(f"{where}: no room {room!r} in the house; rooms are {', '.join(sorted(ALLOWED))}")
            continue
        for line, name in imported(path, package):
            library, *rest = name.split(".")
            if library == package.name:
                part = rest[0] if rest and rest[0] in ALLOWED else "__init__"
                if part != room and part not in ALLOWED[room]:
                    found.append(f"{where}:{line}: {room} may not import {part}")
            elif room not in KEEPERS.get(library, {room}):
                found.append(
                    f"{where}:{line}: only {', '.join(sorted(KEEPERS[library]))} may import {library}"
                )
        for line, name in named_in_strings(path):
            for resource, rooms in RESOURCES.items():
                if (name == resource or name.startswith(resource + ".")) and room not in rooms:
                    found.append(f"{where}:{line}: only {', '.join(sorted(rooms))} may look into {resource}")
    return found


def test_house_every_import_goes_to_the_left_or_to_the_ground() -> None:
    assert breaches(PACKAGE) == []


def test_house_every_room_starts_with_what_it_is_for() -> None:
    silent = [
        str(path.relative_to(PACKAGE))
        for path in sorted(PACKAGE.rglob("*.py"))
        if not ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert silent == []


@pytest.mark.parametrize(
    ("file", "source", "breach"),
    [
        ("machine/chain.py", "from monitor.effects import Effect", "machine may not import effects"),
        ("machine/chain.py", "from monitor import store", "machine may not import store"),
        ("machine/chain.py", "from ..workflow import run", "machine may not import workflow"),
        ("machine/chain.py", "from .. import reporting", "machine may not import reporting"),
        ("machine/parts/deep.py", "from ...store import open", "machine may not import store"),
        ("readers/folder.py", "import monitor.store.connection", "readers may not import store"),
        ("store/connection.py", "from monitor.readers import folder", "store may not import readers"),
        ("discovery/scan.py", "def scan():\n    import monitor.store", "discovery may not import store"),
        ("units.py", "from monitor.records import Campaign", ""),
        ("units.py", "from monitor.machine import chain", "units may not import machine"),
        ("web/pages.py", "from monitor.cli import main", "web may not import cli"),
        ("statistics/pool.py", "import duckdb", "only store may import duckdb"),
        ("workflow.py", "from matplotlib import pyplot", "only reporting may import matplotlib"),
        ("cli/main.py", "import jinja2.sandbox", "only reporting may import jinja2"),
        ("cli/main.py", "import weasyprint", "only reporting may import weasyprint"),
        ("cli/main.py", "files('monitor.migrations')", "only store may look into monitor.migrations"),
        ("__init__.py", "from monitor.units import MM", "__init__ may not import units"),
        ("attic/chest.py", "import numpy", "no room 'attic' in the house"),
        ("store/connection.py", "import duckdb\nfrom . import migrations\nfrom monitor.units import MM", ""),
        ("reporting/figures.py", "from monitor.store import views\nimport matplotlib.pyplot", ""),
        ("workflow.py", "from monitor.readers import folder\nfrom monitor import store", ""),
    ],
)
def test_house_a_breach_is_named(tmp_path: Path, file: str, source: str, breach: str) -> None:
    path = tmp_path / "monitor" / file
    path.parent.mkdir(parents=True)
    path.write_text(source, encoding="utf-8")
    found = breaches(tmp_path / "monitor")
    assert len(found) == (1 if breach else 0)
    assert breach in "".join(found)


#: Files of the workflow that still hold a query: SQL lives in the store. To be emptied.
HOLD_A_QUERY = {"workflow/keeping.py"}


def test_house_sql_lives_in_the_store() -> None:
    statement = re.compile(r"\b(SELECT|INSERT INTO|UPDATE|DELETE FROM)\b")
    holding = {
        path.relative_to(PACKAGE).as_posix()
        for room in ("workflow", "cli")
        for path in (PACKAGE / room).rglob("*.py")
        if any(
            isinstance(node, ast.Constant) and isinstance(node.value, str) and statement.search(node.value)
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        )
    }
    assert holding == HOLD_A_QUERY
