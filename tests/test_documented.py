"""Every verb and every option is documented, and every public name of the package says in its docstring what it is.

The documentation of the command line is compared with the live parsers, in both directions. Docstrings are read from
the syntax tree: a function, method or class without a leading underscore needs one whose first sentence begins with a
capital letter (or a name in double backticks) and ends with a period.
"""

from __future__ import annotations

import argparse
import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import monitor
from monitor.cli.parser import VERBS, verb_parser

PACKAGE = Path(monitor.__file__).parent
COMMAND_LINE = Path(__file__).resolve().parents[1] / "docs" / "command-line.md"
#: Options that all verbs have; the document says so once.
COMMON = {"-h", "--help", "--db", "--json"}

#: Options without a help besides --model, to be emptied.
WITHOUT_HELP = {
    "certificate withdraw --reason",
    "simulate --seed",
}

#: Functions of a verb's file: what they do is the same in each, and the file's docstring is the verb's help.
VERB_FUNCTIONS = {"options", "run"}

#: Methods of a library's class that a class of ours overrides; the library documents them.
LIBRARY_METHODS = {"error"}

#: Files with public names that lack such a docstring, to be emptied.
LACKING: set[str] = {
    "discovery/curve/noise_evidence.py",
    "discovery/machine/poses.py",
    "discovery/machine/run_evidence.py",
    "discovery/search/comparison.py",
    "effects/artefact/ball.py",
    "effects/context.py",
    "effects/curve/shapes/exp.py",
    "effects/curve/shapes/step.py",
    "effects/driver.py",
    "effects/drivers/channel.py",
    "effects/drivers/each_run.py",
    "effects/drivers/gravity.py",
    "effects/drivers/run_time.py",
    "effects/drivers/sequence.py",
    "effects/drivers/warmup.py",
    "effects/shapes/compliance.py",
    "effects/shapes/cyclic.py",
    "effects/shapes/formula.py",
    "effects/shapes/harmonic.py",
    "effects/shapes/lag.py",
    "effects/shapes/nodes.py",
    "effects/shapes/poly.py",
    "effects/shapes/reversal.py",
    "effects/shapes/table.py",
    "effects/weight.py",
    "methods/curve/solver.py",
    "methods/l_shape/problem.py",
    "methods/method.py",
    "methods/registry.py",
    "readers/toml_table.py",
    "reporting/texts.py",
    "store/history.py",
    "uncertainty/coverage.py",
    "uncertainty/marginals.py",
    "uncertainty/tolerance.py",
    "uncertainty/volumetric.py",
    "workflow/certificate/files.py",
    "workflow/explain/compare_answer.py",
    "workflow/explain/version_answer.py",
    "workflow/health/forecast.py",
    "workflow/run_statistics/tests.py",
}


def leaves(path: str, parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield a verb that has no verbs of its own with its parser, or each of its subverbs with theirs."""
    subverbs = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if not subverbs:
        yield path, parser
    for action in subverbs:
        for name, subparser in action.choices.items():
            yield from leaves(f"{path} {name}", subparser)


PARSERS = {path: parser for verb in VERBS for path, parser in leaves(verb, verb_parser(verb)[0])}


def live_options() -> dict[str, set[str]]:
    """Return the options of every verb and subverb, as the parsers have them."""
    return {
        path: {name for action in parser._actions for name in action.option_strings} - COMMON
        for path, parser in PARSERS.items()
    }


def documented_options() -> dict[str, set[str]]:
    """Return the options of every verb and subverb, as the table of the document has them."""
    section = COMMAND_LINE.read_text(encoding="utf-8").split("## Options\n")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `([a-z ]+?)(?: [\[A-Z][^`]*)?` \|(.*)\|$", section, re.MULTILINE)
    return {verb: set(re.findall(r"`(--?[a-z][a-z-]*)", text)) for verb, text in rows}


def test_every_verb_and_option_is_documented_and_no_other() -> None:
    assert documented_options() == live_options()


def test_every_option_has_a_help() -> None:
    silent = {
        f"{path} {action.option_strings[0]}"
        for path, parser in PARSERS.items()
        for action in parser._actions
        if action.option_strings and not action.help
    }
    assert {name for name in silent if not name.endswith(" --model")} == WITHOUT_HELP


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


def protocol_members() -> set[str]:
    """Return the documented methods of all protocols: a class that has them need not repeat what they are."""
    members: set[str] = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and any("Protocol" in ast.unparse(base) for base in node.bases):
                members |= {
                    member.name
                    for member in node.body
                    if isinstance(member, ast.FunctionDef) and ast.get_docstring(member)
                }
    return members


MEMBERS = protocol_members()


def faults(path: Path) -> list[str]:
    """Return every public name of a file whose docstring is missing or no sentence."""
    tree = ast.parse(path.read_text(encoding="utf-8"), filename=str(path))
    exempt = VERB_FUNCTIONS if path.parent.name == "verbs" else set()
    messages = []
    for name, node in public_definitions(tree):
        of_class, _, member = name.rpartition(".")
        inherited = bool(of_class) and member in MEMBERS | LIBRARY_METHODS
        if name in exempt or (inherited and not ast.get_docstring(node)):
            continue
        fault = fault_of(ast.get_docstring(node))
        messages += [f"{name} {fault}"] if fault else []
    return messages


FILES = sorted(str(path.relative_to(PACKAGE)) for path in PACKAGE.rglob("*.py"))


@pytest.mark.parametrize("file", [file for file in FILES if file not in LACKING])
def test_every_public_name_says_what_it_is(file: str) -> None:
    assert faults(PACKAGE / file) == []


def test_a_file_that_was_mended_left_the_list() -> None:
    mended = [file for file in sorted(LACKING) if not (PACKAGE / file).exists() or not faults(PACKAGE / file)]
    assert mended == [], "take these out of LACKING"
