"""English sentences are made in reporting and the faces: the workflow carries kinds with numbers.

Read from the syntax tree: no text of four words or more in ``monitor/workflow`` but docstrings, what is raised,
values of enumerations (they are the data), and the named rest.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import monitor

pytestmark = pytest.mark.usefixtures("unsearched")

WORKFLOW = Path(monitor.__file__).parent / "workflow"
#: So many words are prose; names of kinds, questions and columns have fewer.
FEWEST_WORDS = 4
#: Files that may hold prose, and why.
LET_OFF = {
    "certificate/files.py": "what is refused",
    "contract.py": "names of questions",
    "model/change.py": "what is refused",
    "uncertainty/sentences_0_1_0.py": "reads what version 0.1.0 stored",
    "uncertainty/stored.py": "the key of a source in stored results",
    "volumetric/stating.py": "the origin of a map's region, which is stored",
    "models.py": "the note of a method's own model, which is stored",
}

Node = ast.AST


def words_of(node: Node) -> int:
    """Return the number of words of a text, what is filled in aside; 0 for what is no text."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        text = node.value
    elif isinstance(node, ast.JoinedStr):
        text = "".join(
            part.value if isinstance(part, ast.Constant) and isinstance(part.value, str) else " 0 "
            for part in node.values
        )
    else:
        return 0
    return len(re.findall(r"[A-Za-z]{2,}", text)) if " " in text else 0


def is_enumeration(node: Node) -> bool:
    return isinstance(node, ast.ClassDef) and any("Enum" in ast.unparse(base) for base in node.bases)


def let_off(node: Node) -> Iterator[Node]:
    """The parts of a tree whose texts are no data: docstrings, exceptions, values of enumerations."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        yield node.value
    if isinstance(node, ast.Raise) or is_enumeration(node):
        yield from ast.walk(node)
    if isinstance(node, ast.Call) and re.search(r"(Error|Fault)$", ast.unparse(node.func)):
        yield from ast.walk(node)
    if isinstance(node, ast.JoinedStr):
        yield from node.values


def prose(source: str) -> list[tuple[int, str]]:
    """Return line and text of every sentence in the source of a module."""
    tree = ast.parse(source)
    free = {id(part) for node in ast.walk(tree) for part in let_off(node)}
    return [
        (node.lineno, ast.unparse(node))
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant | ast.JoinedStr)
        and id(node) not in free
        and words_of(node) >= FEWEST_WORDS
    ]


def holding() -> dict[str, list[tuple[int, str]]]:
    """Return the sentences of every file of the workflow that has some."""
    files = {path.relative_to(WORKFLOW).as_posix(): path for path in sorted(WORKFLOW.rglob("*.py"))}
    every = {file: prose(path.read_text(encoding="utf-8")) for file, path in files.items()}
    return {file: texts for file, texts in every.items() if texts}


def test_house_the_workflow_words_nothing() -> None:
    assert {file: texts for file, texts in holding().items() if file not in LET_OFF} == {}


def test_house_no_file_is_let_off_in_vain() -> None:
    assert set(LET_OFF) <= set(holding())


@pytest.mark.parametrize(
    ("source", "texts"),
    [
        ("x = 'the tip stands still'", ["'the tip stands still'"]),
        ("x = f'run {n} is far off {m}'", ["f'run {n} is far off {m}'"]),
        ("x = f'run {n}'", []),
        ("'''A docstring of several words.'''\ndef f():\n    '''Another one of several words.'''", []),
        ("raise InputError(f'there is no run {n} here')", []),
        ("faults.append(Fault('there is no run of it'))", []),
        ("class A(StrEnum):\n    B = 'no run of this week'", []),
        ("class A:\n    B = 'no run of this week'", ["'no run of this week'"]),
        ("x = 'model history'", []),
    ],
)
def test_house_a_sentence_is_named(source: str, texts: list[str]) -> None:
    assert [text for _, text in prose(source)] == texts
