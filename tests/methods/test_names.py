"""Nobody outside a method's own folder asks for its name: what a method can do is asked of its fields."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import monitor
from monitor.methods import methods

PACKAGE = Path(monitor.__file__).parent
# A method's own files: its folder, and its rules and format among the readers, which may not import methods.
OWN = ("methods/{folder}/", "readers/methods/{folder}.py", "readers/formats/{folder}_1.py")
# The word is no method there: the head of the effects of a tracker's frame.
OTHER_MEANING = {("effects/effect.py", "tracker")}


def constants(tree: ast.AST) -> dict[str, str]:
    """Names that a module binds to a string."""
    return {
        target.id: node.value.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
        for target in node.targets
        if isinstance(target, ast.Name)
    }


def bound(tree: ast.AST, modules: dict[str, dict[str, str]]) -> dict[str, str]:
    """Names of a module that stand for a string: its own constants and those that it imports."""
    names = constants(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                text = modules.get(node.module or "", {}).get(alias.name)
                if text is not None:
                    names[alias.asname or alias.name] = text
    return names


def strings(node: ast.AST, names: dict[str, str]) -> Iterator[str]:
    """The strings that an expression is or holds: constants, names of constants, tuples, lists, sets."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.Name) and node.id in names:
        yield names[node.id]
    elif isinstance(node, ast.Tuple | ast.List | ast.Set):
        for element in node.elts:
            yield from strings(element, names)


def asked(tree: ast.AST, names: dict[str, str]) -> Iterator[tuple[int, str]]:
    """Line and string of every comparison, of every key of a dictionary, and of every case of a match."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            for side in (node.left, *node.comparators):
                yield from ((node.lineno, text) for text in strings(side, names))
        elif isinstance(node, ast.Dict):
            yield from ((node.lineno, text) for key in node.keys if key for text in strings(key, names))
        elif isinstance(node, ast.MatchValue):
            yield from ((node.lineno, text) for text in strings(node.value, names))
        elif isinstance(node, ast.Attribute) and node.attr == "NAME":
            yield node.lineno, "NAME"


def breaches(package: Path) -> list[str]:
    """Every place that asks for a method's name, as ``file:line: name``."""
    sources = {path: path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))}
    names_of_methods = set(methods())
    spelt = re.compile(rf"\.NAME\b|[\"'](?:{'|'.join(map(re.escape, sorted(names_of_methods)))})[\"']")
    trees = {path: ast.parse(source) for path, source in sources.items() if spelt.search(source)}
    modules = {
        ".".join(path.relative_to(package.parent).with_suffix("").parts): constants(tree)
        for path, tree in trees.items()
    }
    # Of the others those that import a constant which is a method's name.
    stand_for = {
        name for names in modules.values() for name, text in names.items() if text in names_of_methods
    }
    imported = re.compile(rf"\b(?:{'|'.join(map(re.escape, sorted(stand_for)))})\b")
    faults = []
    for path, source in sources.items():
        if path not in trees and not (stand_for and imported.search(source)):
            continue
        tree = trees.get(path) or ast.parse(source)
        names = bound(tree, modules)
        if path not in trees and names_of_methods.isdisjoint(names.values()):
            continue
        file = path.relative_to(package).as_posix()
        for line, text in asked(tree, names):
            if text not in names_of_methods and text != "NAME":
                continue
            folders = tuple(part.format(folder=text.replace("-", "_")) for part in OWN)
            if not file.startswith(folders) and (file, text) not in OTHER_MEANING:
                faults.append(f"{file}:{line}: {text}")
    return faults


def test_nobody_outside_its_folder_asks_for_the_name_of_a_method() -> None:
    assert breaches(PACKAGE) == []


@pytest.mark.parametrize(
    ("file", "source"),
    [
        ("workflow/plan.py", 'if campaign.method == "free-form": pass'),
        ("workflow/plan.py", 'if campaign.method in ("samba", "other"): pass'),
        ("workflow/plan.py", 'words = {"tracker": "reflector"}'),
        ("workflow/plan.py", 'CURVE = "curve"\nif method != CURVE: pass'),
        ("workflow/plan.py", "from monitor.names import CURVE as OURS\nif method == OURS: pass"),
        ("workflow/plan.py", "if campaign.method == tracker.NAME: pass"),
        ("cli/plan.py", 'match method:\n    case "l-shape":\n        pass'),
        ("methods/chain/problem.py", 'if campaign.method == "samba": pass'),
        ("methods/tracker/method.py", 'if campaign.method == "samba": pass'),
    ],
)
def test_a_name_that_is_asked_for_is_seen(tmp_path: Path, file: str, source: str) -> None:
    package = tmp_path / "monitor"
    path = package / file
    path.parent.mkdir(parents=True)
    path.write_text(source, encoding="utf-8")
    (package / "names.py").write_text('CURVE = "curve"', encoding="utf-8")
    assert len(breaches(package)) == 1


def test_a_method_may_ask_for_its_own_name(tmp_path: Path) -> None:
    path = tmp_path / "monitor" / "methods" / "l_shape" / "method.py"
    path.parent.mkdir(parents=True)
    path.write_text('if campaign.method == "l-shape": pass', encoding="utf-8")
    assert breaches(tmp_path / "monitor") == []
