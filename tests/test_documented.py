"""Every verb and every option is documented, and every public name of the package says in its docstring what it is.

The documentation of the command line is compared with the live parsers, in both directions. Docstrings are read from
the syntax tree: a function, method or class without a leading underscore needs one whose first sentence begins with a
capital letter (or a name in double backticks) and ends with a period.
"""

from __future__ import annotations

import argparse
import ast
import functools
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import monitor
from monitor.cli.parser import VERBS, verb_parser

pytestmark = pytest.mark.usefixtures("unsearched")

PACKAGE = Path(monitor.__file__).parent
COMMAND_LINE = Path(__file__).resolve().parents[1] / "docs" / "command-line.md"
#: Options that all verbs have; the document says so once.
COMMON = {"-h", "--help", "--db", "--json", "--quiet", "--wait", "--server", "--server-token"}

#: Functions of a verb's file: what they do is the same in each, and the file's docstring is the verb's help.
VERB_FUNCTIONS = {"options", "run"}

#: Methods of a library's class that a class of ours overrides; the library documents them.
LIBRARY_METHODS = {"error"}


def leaves(path: str, parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield a verb that has no verbs of its own with its parser, or each of its subverbs with theirs."""
    subverbs = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if not subverbs:
        yield path, parser
    for action in subverbs:
        for name, subparser in action.choices.items():
            yield from leaves(f"{path} {name}", subparser)


@functools.cache
def parsers() -> dict[str, argparse.ArgumentParser]:
    """Return the parser of every verb and subverb."""
    return {path: parser for verb in VERBS for path, parser in leaves(verb, verb_parser(verb)[0])}


def live_options() -> dict[str, set[str]]:
    """Return the options of every verb and subverb, as the parsers have them."""
    return {
        path: {name for action in parser._actions for name in action.option_strings} - COMMON
        for path, parser in parsers().items()
    }


def documented_options() -> dict[str, set[str]]:
    """Return the options of every verb and subverb, as the table of the document has them."""
    section = COMMAND_LINE.read_text(encoding="utf-8").split("## Options\n")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `([a-z ]+?)(?: [\[A-Z][^`]*)?` \|(.*)\|$", section, re.MULTILINE)
    return {verb: set(re.findall(r"`(--?[a-z][a-z-]*)", text)) for verb, text in rows}


def test_every_verb_and_option_is_documented_and_no_other() -> None:
    assert documented_options() == live_options()


def test_the_first_table_has_every_verb_and_no_other() -> None:
    text = COMMAND_LINE.read_text(encoding="utf-8").split("## Options\n")[0]
    cells = re.findall(r"^\| (\[?`[a-z].*?) \| ", text, re.MULTILINE)
    assert {verb for cell in cells for verb in re.findall(r"(?:^\[?|, )`([a-z]+)", cell)} == set(VERBS)


def test_every_argument_has_a_help() -> None:
    silent = {
        f"{path} {(*action.option_strings, action.metavar)[0]}"
        for path, parser in parsers().items()
        for action in parser._actions
        if not action.help
    }
    assert silent == set()


Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


def public_definitions(tree: ast.AST, within: str = "") -> Iterator[tuple[str, Definition]]:
    """Yield name and node of every public class, function and method; not of functions inside functions."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)) and node.name[0] != "_":
            yield f"{within}{node.name}", node
            if isinstance(node, ast.ClassDef):
                yield from public_definitions(node, f"{node.name}.")


def fault_of(docstring: str | None) -> str | None:
    """Return what is wrong with a docstring; None where nothing is."""
    if not docstring:
        return "has no docstring"
    first, *_ = re.split(r"\n\s*\n", docstring)
    sentence = " ".join(first.split())
    if not (sentence[0].isupper() or sentence.startswith("``") or not sentence[0].isascii()):
        return f"begins with a small letter: {sentence[:40]}"
    if not re.search(r"[.?](\)|\s|$)", sentence):
        return f"has no first sentence that ends with a period: {sentence[:40]}"
    return None


@functools.cache
def class_definitions() -> dict[str, list[ast.ClassDef]]:
    """Return the classes of the package by name. It takes seconds: asked for by tests alone, not to collect them."""
    classes: dict[str, list[ast.ClassDef]] = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                classes.setdefault(node.name, []).append(node)
    return classes


def members_of(node: ast.ClassDef) -> set[str]:
    """Return the documented members of a class and of its bases: a class that overrides one need not repeat what it is.

    Fields that a class names in its own docstring are documented there.
    """
    own = {
        member.name
        for member in node.body
        if isinstance(member, ast.FunctionDef) and ast.get_docstring(member)
    }
    own |= set(re.findall(r"``([a-z_]+)``", ast.get_docstring(node) or ""))
    bases = {ast.unparse(base).split("[")[0] for base in node.bases}
    return own.union(*(members_of(base) for name in bases for base in class_definitions().get(name, [])))


@functools.cache
def members_of_protocols() -> set[str]:
    """Return the documented members of the protocols, which a class has without naming the protocol among its bases."""
    return set().union(
        *(
            members_of(node)
            for nodes in class_definitions().values()
            for node in nodes
            if any("Protocol" in ast.unparse(base) for base in node.bases)
        )
    )


def faults(path: Path) -> list[str]:
    """Return every public name of a file whose docstring is missing or no sentence."""
    tree = ast.parse(path.read_text(encoding="utf-8"), filename=str(path))
    exempt = VERB_FUNCTIONS if path.parent.name == "verbs" else set()
    classes = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
    messages = []
    for name, node in public_definitions(tree):
        of_class, _, member = name.rpartition(".")
        if name in exempt or any(ast.unparse(decorator) == "overload" for decorator in node.decorator_list):
            continue
        documented = (
            members_of(classes[of_class]) | members_of_protocols() | LIBRARY_METHODS
            if of_class in classes
            else set()
        )
        if member in documented and not ast.get_docstring(node):
            continue
        fault = fault_of(ast.get_docstring(node))
        messages += [f"{name} {fault}"] if fault else []
    return messages


FILES = sorted(str(path.relative_to(PACKAGE)) for path in PACKAGE.rglob("*.py"))


@pytest.mark.parametrize("file", FILES)
def test_every_public_name_says_what_it_is(file: str) -> None:
    assert faults(PACKAGE / file) == []
