"""How the code is cut: branches, parameters and lines of every function, lines of every file, files of every folder;
names that say what they hold; libraries that nobody patches.

The limits are those of CONTRIBUTING.md. The numba kernels are let off: a call inside a kernel that is compiled anew
for every set of types costs more to read than the branches do.
"""

from __future__ import annotations

import ast
import functools
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

import monitor

pytestmark = pytest.mark.usefixtures("unsearched")

PACKAGE = Path(monitor.__file__).parent
MOST_BRANCHES = 15
MOST_PARAMETERS = 10
#: What is there is within some lines of these: whoever needs more cuts first.
MOST_LINES, MOST_FILE_LINES, MOST_FILES = 75, 450, 42
#: Compiled functions, where every call and every tuple costs.
KERNELS = {"uncertainty/runs/kernel.py"}

#: Words that do not say what a name holds, as a whole name.
VAGUE = {
    "found", "one", "place", "own", "told", "known", "kept", "seen", "chosen", "made", "given", "left", "here", "there",
    "now", "words", "wished", "begun", "done", "thing", "stuff", "item", "data", "obj",
}  # fmt: skip
#: Names that stand in files, stored documents and certificates, where they are read for ever.
KEYS = {
    ("records.py", "known"),
    ("reporting/certificate/completeness.py", "item"),
    ("reporting/certificate/laboratory.py", "place"),
    ("reporting/certificate/record.py", "place"),
    ("reporting/certificate/record.py", "item"),
}

_BRANCHES = (
    ast.If, ast.For, ast.While, ast.IfExp, ast.ExceptHandler, ast.With, ast.Assert, ast.comprehension,
)  # fmt: skip
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
Function = ast.FunctionDef | ast.AsyncFunctionDef


@functools.cache
def parsed(package: Path) -> list[tuple[str, list[ast.AST]]]:
    """Return the path of every file below the package, and the nodes of its syntax tree."""
    return [
        (path.relative_to(package).as_posix(), list(ast.walk(ast.parse(path.read_text(encoding="utf-8")))))
        for path in sorted(package.rglob("*.py"))
    ]


@pytest.fixture(scope="module", autouse=True)
def no_longer_parsed() -> Iterator[None]:
    """Forget the syntax trees: those of the whole package are large, and nobody else asks for them."""
    yield
    parsed.cache_clear()


def functions(package: Path) -> Iterator[tuple[str, Function]]:
    """Yield the file of every function, method and function inside a function, and its node."""
    for file, nodes in parsed(package):
        for node in nodes:
            if isinstance(node, _FUNCTIONS):
                yield file, node


def branches(function: Function) -> int:
    """Return the ways through a function: 1 and one for each decision, without those of functions inside it."""
    total, waiting = 1, list(ast.iter_child_nodes(function))
    while waiting:
        node = waiting.pop()
        if isinstance(node, (*_FUNCTIONS, ast.Lambda)):
            continue
        total += isinstance(node, _BRANCHES)
        total += len(node.values) - 1 if isinstance(node, ast.BoolOp) else 0
        total += len(node.cases) if isinstance(node, ast.Match) else 0
        waiting += ast.iter_child_nodes(node)
    return total


def parameters(function: Function) -> int:
    """Return the number of parameters without self and cls; ``*names`` and ``**names`` count as one each."""
    arguments = function.args
    names = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    named = sum(name.arg not in ("self", "cls") for name in names)
    return named + (arguments.vararg is not None) + (arguments.kwarg is not None)


def lines(function: Function) -> int:
    """Return the number of lines of a function, its decorators aside."""
    return (function.end_lineno or function.lineno) - function.lineno + 1


def too_large(package: Path) -> list[str]:
    """Return every function beyond a limit."""
    faults = []
    for file, function in functions(package):
        if file in KERNELS:
            continue
        name = f"{file}:{function.lineno}: {function.name}"
        if branches(function) > MOST_BRANCHES:
            faults.append(f"{name} has {branches(function)} branches")
        if parameters(function) > MOST_PARAMETERS:
            faults.append(f"{name} has {parameters(function)} parameters")
        if lines(function) > MOST_LINES:
            faults.append(f"{name} has {lines(function)} lines")
    return faults


def too_long(package: Path) -> list[str]:
    """Return every file with too many lines and every folder with too many files."""
    faults = []
    files: Counter[str] = Counter()
    for path in sorted(package.rglob("*.py")):
        file = path.relative_to(package)
        files[file.parent.as_posix()] += 1
        count = len(path.read_text(encoding="utf-8").splitlines())
        if count > MOST_FILE_LINES and file.as_posix() not in KERNELS:
            faults.append(f"{file.as_posix()} has {count} lines")
    return faults + [f"{folder}: {count} files" for folder, count in files.items() if count > MOST_FILES]


def patched(package: Path) -> list[str]:
    """Return every assignment to a name of an imported module that is not ours, and to ``sys.modules``."""
    faults = []
    for file, nodes in parsed(package):
        modules = {
            (name.asname or name.name).partition(".")[0]
            for node in nodes
            if isinstance(node, ast.Import)
            for name in node.names
        }
        for node in nodes:
            targets = node.targets if isinstance(node, ast.Assign) else []
            for target in targets:
                held = target.value if isinstance(target, ast.Attribute | ast.Subscript) else None
                while isinstance(held, ast.Attribute):
                    held = held.value
                if isinstance(held, ast.Name) and held.id in modules:
                    faults.append(f"{file}:{node.lineno}: {ast.unparse(target)}")
    return faults


def vague_names(package: Path) -> list[str]:
    """Return every name of a variable, field or parameter that does not say what it holds."""
    faults = []
    for file, nodes in parsed(package):
        for node in nodes:
            if isinstance(node, ast.arg):
                name = node.arg
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                name = node.id
            else:
                continue
            if name in VAGUE and (file, name) not in KEYS:
                faults.append(f"{file}:{node.lineno}: {name}")
    return faults


def test_house_no_function_is_too_large() -> None:
    assert too_large(PACKAGE) == []


def test_house_no_file_and_no_folder_is_too_long() -> None:
    assert too_long(PACKAGE) == []


def test_house_no_library_is_patched() -> None:
    # The environment of the process is no library.
    assert [fault for fault in patched(PACKAGE) if "os.environ" not in fault] == []


def test_house_a_year_has_one_length() -> None:
    files = [file for file in sorted(PACKAGE.rglob("*.py")) if "365.25" in file.read_text(encoding="utf-8")]
    assert [file.name for file in files] == ["units.py"]


def test_house_names_say_what_they_hold() -> None:
    assert vague_names(PACKAGE) == []


def test_house_every_key_that_is_let_off_is_there() -> None:
    trees = {
        file: ast.parse((PACKAGE / file).read_text(encoding="utf-8"))
        for file in KERNELS | {f for f, _ in KEYS}
    }
    names = {
        (file, node.id)
        for file, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Name)
    }
    assert names >= KEYS
    for file in KERNELS:
        assert any(isinstance(node, _FUNCTIONS) for node in ast.walk(trees[file])), file


@pytest.mark.parametrize(
    ("source", "faults"),
    [
        ("def f(x):\n" + "    if x: pass\n" * 14, []),
        ("def f(x):\n" + "    if x: pass\n" * 15, ["f has 16 branches"]),
        ("def f(x):\n" + "    x = [y for y in x if y or x and y]\n" * 5, ["f has 16 branches"]),
        ("def f(x):\n    def g():\n" + "        if x: pass\n" * 15, ["g has 16 branches"]),
        ("async def f(x):\n    match x:\n" + "        case 1: pass\n" * 15, ["f has 16 branches"]),
        ("def f(self, a, b, c, d, e, f, g, h, i, *j): pass", []),
        ("def f(a, b, c, d, e, /, f, g, *, h, i, j, k): pass", ["f has 11 parameters"]),
        ("def f(a, b, c, d, e, f, g, h, i, *j, **k): pass", ["f has 11 parameters"]),
        ("def f():\n" + "    pass\n" * 75, ["f has 76 lines"]),
    ],
)
def test_house_what_is_too_large_is_named(tmp_path: Path, source: str, faults: list[str]) -> None:
    (tmp_path / "room.py").write_text(source, encoding="utf-8")
    assert [fault.partition(": ")[2] for fault in too_large(tmp_path)] == faults


def test_house_what_is_too_long_is_named(tmp_path: Path) -> None:
    (tmp_path / "room.py").write_text("x = 1\n" * 451, encoding="utf-8")
    for number in range(42):
        (tmp_path / f"room_{number}.py").write_text("", encoding="utf-8")
    assert too_long(tmp_path) == ["room.py has 451 lines", ".: 43 files"]


@pytest.mark.parametrize(
    ("source", "faults"),
    [
        ('import sys\nsys.modules["pandas"] = None', ["sys.modules['pandas']"]),
        ("import ctypes.util\nctypes.util.find_library = print", ["ctypes.util.find_library"]),
        ("import numpy as np\nx.np = np.array\ny = np.pi", []),
    ],
)
def test_house_a_patch_is_named(tmp_path: Path, source: str, faults: list[str]) -> None:
    (tmp_path / "room.py").write_text(source, encoding="utf-8")
    assert [fault.rpartition(": ")[2] for fault in patched(tmp_path)] == faults


@pytest.mark.parametrize(
    ("source", "faults"),
    [
        ("found = 1", ["found"]),
        ("for item in x: pass", ["item"]),
        ("[data for data in x]", ["data"]),
        ("def f(*, own): pass", ["own"]),
        ("class A:\n    words: str", ["words"]),
        ("if (one := f()): pass", ["one"]),
        ("f(place=1)\nx.found = 2\nfound_effects = ones = 3", []),
    ],
)
def test_house_a_vague_name_is_named(tmp_path: Path, source: str, faults: list[str]) -> None:
    (tmp_path / "room.py").write_text(source, encoding="utf-8")
    assert [fault.rpartition(": ")[2] for fault in vague_names(tmp_path)] == faults
