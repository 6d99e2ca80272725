"""The walls of the house: who may import whom, read from the syntax tree of every file of the package.

Imports inside functions and under ``TYPE_CHECKING`` count too: a wall with a door in it is no wall.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import re
import sys
import tomllib
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import pytest

import monitor

pytestmark = pytest.mark.usefixtures("unsearched")

PACKAGE = Path(monitor.__file__).parent
CONTRIBUTING = Path(__file__).resolve().parents[1] / "CONTRIBUTING.md"

# What every room may import. `from monitor import __version__` is for everyone: the package itself imports nothing.
# `sources` is read, stored, propagated and printed: four rooms that may not know each other.
GROUND = {
    "__init__",
    "exceptions",
    "units",
    "records",
    "documents",
    "refusal",
    "sources",
    "bounded",
    "stopping",
    "progress",
    "on_demand",
    "formula_cells",
    "group_sums",
    "moments",
    "approach",
    "toml_text",
    "topology_text",
    "row_files",
    "said",
}

# Room -> the rooms that it may import besides the ground and itself, the lowest first.
ROOMS: dict[str, set[str]] = {
    # Each stands on the ground alone: the workflow passes arrays and records from one to the other.
    "machine": set(),
    "readers": set(),
    "statistics": set(),
    "store": set(),
    "reporting": set(),
    "effects": {"machine"},
    "methods": {"machine", "effects"},
    "uncertainty": {"machine", "effects", "methods"},
    "discovery": {"machine", "effects", "methods", "statistics"},
    "workflow": {
        "machine", "readers", "statistics", "store", "reporting", "effects", "methods", "uncertainty", "discovery",
    },
    # Opens the database and hands out answers as tables; it computes nothing.
    "api": {"workflow", "readers", "store"},
    # Opens the database, turns documents and forms into requests and answers into pages; it computes nothing.
    "web": {"readers", "workflow", "store", "reporting"},
    # Opens the database, reads files named by options, says with which key is signed, and starts the server; it
    # computes nothing.
    "cli": {"workflow", "readers", "store", "reporting", "web"},
}  # fmt: skip

# Room -> the parts of monitor that it may import, besides itself.
ALLOWED: dict[str, set[str]] = {
    **dict.fromkeys(GROUND, GROUND),
    "__init__": set(),
    # `python -m monitor`.
    "__main__": {"cli"},
    **{room: GROUND | rooms for room, rooms in ROOMS.items()},
    # Data only: SQL and templates, found through importlib.resources.
    "migrations": set(),
    "reports": set(),
}

# Library -> the only rooms that may know it; of a room that is still to be built, none.
KEEPERS: dict[str, set[str]] = {
    "duckdb": {"store"},
    "jinja2": {"reporting", "web"},
    "weasyprint": {"reporting"},
    "matplotlib": {"reporting"},
    "pyhanko": {"reporting"},
    "pkcs11": {"reporting"},
    "fastapi": {"web"},
    "starlette": {"web"},
    "uvicorn": {"web"},
    "pydantic": {"web"},
    "argon2": {"web"},
    "plotly": {"web"},
    "numba": {"uncertainty"},
    "pandas": {"store", "api"},
    "dask": {"uncertainty"},
    "distributed": {"uncertainty"},
    "rich": {"cli"},
    "shtab": {"cli"},
    "openpyxl": {"store", "readers"},
    "lxml": {"readers"},
}

# Packed folder -> the rooms that may look into it.
RESOURCES: dict[str, set[str]] = {"monitor.migrations": {"store"}, "monitor.reports": {"reporting"}}


def room_of(path: Path, package: Path) -> str:
    """The room of a file: its first folder below the package, or its own name."""
    return path.relative_to(package).parts[0].removesuffix(".py")


@functools.cache
def imported(path: Path, package: Path) -> tuple[tuple[int, str], ...]:
    """Line and dotted name of everything that a file imports; relative imports made absolute."""
    return tuple(_imported(path, package))


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """Every statement below a node: expressions, which are most of a tree, hold none."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.ExceptHandler | ast.match_case):
            yield child
            yield from statements(child)


def _imported(path: Path, package: Path) -> Iterator[tuple[int, str]]:
    relative = path.relative_to(package.parent)
    here = relative.parts[:-1]
    for node in statements(ast.parse(path.read_text(encoding="utf-8"), filename=str(path))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = [*here[: len(here) - node.level + 1]] if node.level else []
            base += node.module.split(".") if node.module else []
            # `from monitor import units` imports a room, `from monitor.units import µm` a name.
            yield from ((node.lineno, ".".join([*base, alias.name])) for alias in node.names)


def named_in_strings(path: Path) -> Iterator[tuple[int, str]]:
    """Line and value of every string that is a dotted name of the package, as ``import_module`` would take it."""
    source = path.read_text(encoding="utf-8")
    if not re.search(r"[\"']monitor\.", source):
        return
    for node in ast.walk(ast.parse(source, filename=str(path))):
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
                keepers = ", ".join(sorted(KEEPERS[library]))
                found.append(
                    f"{where}:{line}: {f'only {keepers}' if keepers else 'no room'} may import {library}"
                )
        for line, name in named_in_strings(path):
            for resource, rooms in RESOURCES.items():
                if (name == resource or name.startswith(resource + ".")) and room not in rooms:
                    found.append(f"{where}:{line}: only {', '.join(sorted(rooms))} may look into {resource}")
    return found


def test_house_every_import_goes_down_or_to_the_ground() -> None:
    assert breaches(PACKAGE) == []


def named(requirement: str) -> tuple[str, frozenset[str]]:
    """The distribution that a requirement names, as in PEP 503, and the extras that it asks for."""
    name, extras = re.match(r"([\w.-]+)\s*(?:\[(.*?)\])?", requirement).groups()  # type: ignore[union-attr]
    return re.sub(r"[-_.]+", "-", name).lower(), frozenset(re.findall(r"[\w-]+", extras or ""))


def installed_with(requirements: list[str]) -> set[str]:
    """The distributions that these need, with all that those need in turn."""
    known: set[tuple[str, frozenset[str]]] = set()
    left = {named(requirement) for requirement in requirements}
    while left:
        known.add(each := left.pop())
        with contextlib.suppress(metadata.PackageNotFoundError):
            for need in metadata.requires(each[0]) or []:
                extra = re.search(r"extra == ['\"]([\w-]+)", need)
                if extra is None or extra[1] in each[1]:
                    left |= {named(need)} - known
    return {name for name, _ in known}


@pytest.mark.skipif(not (PACKAGE.parent / "pyproject.toml").is_file(), reason="reads pyproject.toml")
def test_house_every_library_that_is_imported_is_declared() -> None:
    """Where a function alone imports it too: a wheel without it would fail there, and only there."""
    project = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    for_users = set(extras) - {"release", "fuzz", "challenge", "manual", "dev"}
    declared = [*project["dependencies"], *(need for extra in sorted(for_users) for need in extras[extra])]
    there = installed_with(declared)
    provided = {
        module
        for module, names in metadata.packages_distributions().items()
        if there & {named(name)[0] for name in names}
    }
    libraries = {
        (name.partition(".")[0], str(path.relative_to(PACKAGE.parent)))
        for path in PACKAGE.rglob("*.py")
        for _, name in imported(path, PACKAGE)
    }
    assert (
        sorted(each for each in libraries if each[0] not in provided | sys.stdlib_module_names | {"monitor"})
        == []
    )


def modules(package: Path) -> dict[str, Path]:
    """Every module of the package by its dotted name; a folder has the name of its ``__init__``."""
    names = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def import_circles(package: Path) -> list[list[str]]:
    """The groups of modules that import one another in a circle, by Tarjan's algorithm, each in the order of its names.

    ``from folder import name`` imports the module ``folder.name`` where there is one, else the folder itself. That a
    module inside a folder loads the folder's ``__init__`` first is no import of its own.
    """
    files = modules(package)
    imports: dict[str, set[str]] = {}
    for module, path in files.items():
        imports[module] = set()
        for _, name in imported(path, package):
            target = name if name in files else name.rpartition(".")[0]
            if target in files and target != module:
                imports[module].add(target)
    index: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    circles: list[list[str]] = []

    def visit(module: str) -> None:
        index[module] = lowest[module] = len(index)
        stack.append(module)
        for target in sorted(imports[module]):
            if target not in index:
                visit(target)
                lowest[module] = min(lowest[module], lowest[target])
            elif target in stack:
                lowest[module] = min(lowest[module], index[target])
        if lowest[module] == index[module]:
            group = [stack.pop()]
            while group[-1] != module:
                group.append(stack.pop())
            if len(group) > 1:
                circles.append(sorted(group))

    for module in imports:
        if module not in index:
            visit(module)
    return sorted(circles)


def test_house_no_module_is_imported_in_a_circle() -> None:
    """Imports inside functions and under ``TYPE_CHECKING`` count: late imports are for speed, not to hide a circle."""
    assert import_circles(PACKAGE) == []


@pytest.mark.parametrize(
    ("sources", "circles"),
    [
        ({"a.py": "from monitor import b", "b.py": "import numpy"}, []),
        ({"a.py": "from monitor import b", "b.py": "import monitor.a"}, [["monitor.a", "monitor.b"]]),
        (
            {
                "a.py": "from monitor.b import f",
                "b.py": "def f():\n    from monitor.c import g",
                "c.py": "import monitor.a",
            },
            [["monitor.a", "monitor.b", "monitor.c"]],
        ),
        (
            {"a.py": "if TYPE_CHECKING:\n    from .b import T", "b.py": "from .a import f"},
            [["monitor.a", "monitor.b"]],
        ),
        (
            {
                "room/__init__.py": "from .a import f",
                "room/a.py": "from monitor.room import b",
                "room/b.py": "",
            },
            [],
        ),
        (
            {"room/__init__.py": "from .a import f", "room/a.py": "from monitor.room import f"},
            [["monitor.room", "monitor.room.a"]],
        ),
    ],
)
def test_house_a_circle_is_found(tmp_path: Path, sources: dict[str, str], circles: list[list[str]]) -> None:
    for file, source in {"__init__.py": "", **sources}.items():
        path = tmp_path / "monitor" / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(source, encoding="utf-8")
    assert import_circles(tmp_path / "monitor") == circles


def drawn_rooms(text: str) -> tuple[list[set[str]], set[str]]:
    """The rooms of a drawing, a set a floor from the top, and what lies on the ground."""
    drawing = re.search(r"((?:^    .*\n)+)^    ground: (.*)$", text, re.MULTILINE)
    assert drawing is not None
    # What stands right of a wide gap explains the floor; a room is a word.
    floors = [set(re.split(r"\s{6,}", line.strip())[0].split()) for line in drawing[1].splitlines()]
    return floors, set(drawing[2].split(", "))


@pytest.mark.skipif(not CONTRIBUTING.exists(), reason="the document stays in the checkout")
def test_house_contributing_draws_the_rooms_as_they_are() -> None:
    floors, ground = drawn_rooms(CONTRIBUTING.read_text(encoding="utf-8"))
    assert ground == GROUND - {"__init__"}
    assert set().union(*floors) == set(ROOMS)
    for number, floor in enumerate(floors):
        lower = set().union(*floors[number + 1 :])
        # Of its own floor `cli` alone knows a neighbour: it starts the server.
        for room in floor:
            assert ROOMS[room] - lower <= ({"web"} if room == "cli" else set()), room


def test_house_every_room_starts_with_what_it_is_for() -> None:
    silent = [
        str(path.relative_to(PACKAGE))
        for path in sorted(PACKAGE.rglob("*.py"))
        if not path.read_text(encoding="utf-8").startswith('"""')
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
        ("workflow/pages.py", "from monitor.cli import main", "workflow may not import cli"),
        ("web/pages.py", "from monitor.machine import chain", "web may not import machine"),
        ("workflow/pages.py", "import fastapi", "only web may import fastapi"),
        ("cli/main.py", "from monitor.discovery import search", "cli may not import discovery"),
        ("statistics/pool.py", "from monitor.machine import chain", "statistics may not import machine"),
        ("reporting/page.py", "from monitor.store import Database", "reporting may not import store"),
        ("statistics/pool.py", "import duckdb", "only store may import duckdb"),
        ("workflow.py", "from matplotlib import pyplot", "only reporting may import matplotlib"),
        ("cli/main.py", "import jinja2.sandbox", "only reporting, web may import jinja2"),
        ("cli/main.py", "import weasyprint", "only reporting may import weasyprint"),
        ("cli/main.py", "files('monitor.migrations')", "only store may look into monitor.migrations"),
        ("__init__.py", "from monitor.units import MM", "__init__ may not import units"),
        ("attic/chest.py", "import numpy", "no room 'attic' in the house"),
        ("store/connection.py", "import duckdb\nfrom . import migrations\nfrom monitor.units import MM", ""),
        ("reporting/figures.py", "from monitor.records import Run\nimport matplotlib.pyplot", ""),
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


#: Files of workflow and cli that may hold a query: SQL lives in the store.
# Its example is a query that a user types.
HOLD_A_QUERY = {"cli/verbs/sql_.py"}


def test_house_sql_lives_in_the_store() -> None:
    statement = re.compile(r"\b(SELECT|INSERT INTO|UPDATE|DELETE FROM)\b")
    holding = {
        path.relative_to(PACKAGE).as_posix()
        for room in ("workflow", "cli", "api", "web")
        for path in (PACKAGE / room).rglob("*.py")
        if any(
            isinstance(node, ast.Constant) and isinstance(node.value, str) and statement.search(node.value)
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        )
    }
    assert holding == HOLD_A_QUERY


def modules_imported(package: Path) -> dict[str, set[str]]:
    """Return for every module the modules of the package that it imports, inside functions too.

    The ``__init__`` of a folder only names what is public in it: a name imported from it is that of its module.
    """
    files = {module_of(path, package): path for path in package.rglob("*.py")}
    names = {module: {name for _, name in imported(path, package)} for module, path in files.items()}
    folders = {module for module, path in files.items() if path.name == "__init__.py"}
    public = {
        f"{folder}.{name.rpartition('.')[2]}": name
        for folder in folders
        for name in names[folder]
        if name.startswith(f"{folder}.")
    }

    def module(name: str) -> str:
        while name not in files and name in public:
            name = public[name]
        return name if name in files else name.rpartition(".")[0]

    ends = {start: {module(name) for name in of_module} for start, of_module in names.items()}
    return {
        start: set() if start in folders else {end for end in ends[start] if end in files} - {start}
        for start in files
    }


def module_of(path: Path, package: Path) -> str:
    """Return the dotted name of a file, that of the folder for its ``__init__``."""
    return ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__")


def circles(imports: dict[str, set[str]]) -> list[list[str]]:
    """Return the groups of modules each of which reaches the others."""
    reached: dict[str, set[str]] = {}
    for start in imports:
        seen: set[str] = set()
        waiting = [start]
        while waiting:
            for module in imports[waiting.pop()] - seen:
                seen.add(module)
                waiting.append(module)
        reached[start] = seen
    groups = {
        frozenset(other for other in reached[m] if m in reached[other]) for m in imports if m in reached[m]
    }
    return sorted(sorted(group) for group in groups)


def test_house_no_modules_import_each_other_in_a_circle() -> None:
    # Imports inside functions and under TYPE_CHECKING count: late imports are for speed, not to hide a circle.
    assert circles(modules_imported(PACKAGE)) == []


def test_house_a_circle_is_named(tmp_path: Path) -> None:
    room = tmp_path / "monitor" / "store"
    room.mkdir(parents=True)
    (room / "first.py").write_text("from monitor.store.second import b", encoding="utf-8")
    (room / "second.py").write_text("def b():\n    from monitor.store import first", encoding="utf-8")
    (room / "third.py").write_text("from monitor.store import first", encoding="utf-8")
    assert circles(modules_imported(tmp_path / "monitor")) == [
        ["monitor.store.first", "monitor.store.second"]
    ]
