"""The reference of the verbs, from the live parsers: every verb, every option."""

# ruff: noqa: E501 -- prose of pages
from __future__ import annotations

import argparse
from collections.abc import Iterator

from markdown import cell, code, table

from monitor.cli.parser import VERBS, verb_parser

#: Options that every verb has; the page says so once.
COMMON = {"--help", "--db", "--wait", "--server", "--server-token", "--json", "--quiet"}
HEAD = """# Verbs and options

Made from the program's own parsers. `monitor VERB --help` prints the same. What the answers mean, exit statuses and the documents of
`--json`: [the command line](../command-line.md), [documents](documents.md).

Every verb takes `--db PATH` (the database file), `--wait SECONDS` (how long to wait for another process that has it), `--json` (one document on
standard output), `--quiet` and `--help`; every verb that a server answers takes `--server URL` and `--server-token FILE` in place of `--db`
([asking a server](../command-line.md#asking-a-server)).
"""


def page() -> str:
    """Return the page."""
    parts = [HEAD]
    for verb, summary in VERBS.items():
        parser, _ = verb_parser(verb)
        parts.append(f"## {verb}\n\n{_sentence(summary)}\n")
        for path, leaf in _leaves(verb, parser):
            parts += [f"### {path}\n"] if path != verb else []
            parts += list(_described(leaf))
    return "\n".join(parts)


def _leaves(path: str, parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    subverbs = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if not subverbs:
        yield path, parser
    for action in subverbs:
        for name, subparser in action.choices.items():
            yield from _leaves(f"{path} {name}", subparser)


def _described(parser: argparse.ArgumentParser) -> Iterator[str]:
    yield _paragraphs(parser.description or "")
    yield f"```text\n{_usage(parser)}\n```\n"
    rows = [(_name(action), _help(action)) for action in parser._actions if not _is_common(action)]
    if rows:
        yield table(("argument", "meaning"), rows)
    if parser.epilog:
        example = parser.epilog.partition("example:\n")[2]
        yield f"Example:\n\n```text\n{example.strip()}\n```\n"


def _usage(parser: argparse.ArgumentParser) -> str:
    words = [parser.prog]
    for action in parser._actions:
        if _is_common(action):
            continue
        word = action.option_strings[-1] if action.option_strings else ""
        word = " ".join(part for part in (word, _metavar(action)) if part)
        optional = (
            not action.required if action.option_strings else action.nargs in ("?", "*", argparse.REMAINDER)
        )
        repeated = " ..." if action.nargs in ("+", "*") or isinstance(action, argparse._AppendAction) else ""
        words.append(f"[{word}]{repeated}" if optional else word + repeated)
    return " ".join(words)


def _is_common(action: argparse.Action) -> bool:
    return bool(COMMON & set(action.option_strings))


def _metavar(action: argparse.Action) -> str:
    if action.nargs == 0:
        return ""
    if action.choices is not None and action.metavar is None:
        return "{" + ",".join(str(choice) for choice in action.choices) + "}"
    metavar = action.metavar if action.metavar is not None else action.dest.upper()
    word = " ".join(metavar) if isinstance(metavar, tuple) else metavar
    return f"[{word}]" if action.nargs == "?" and action.option_strings else word


def _name(action: argparse.Action) -> str:
    metavar = _metavar(action)
    if not action.option_strings:
        return code(metavar)
    return ", ".join(code(f"{option} {metavar}".strip()) for option in action.option_strings)


def _help(action: argparse.Action) -> str:
    words = (action.help or "").replace("%%", "%")
    if "%(default)" in words:
        words = words % {"default": action.default}
    needed = " (required)" if action.option_strings and action.required else ""
    return cell(words.replace("[[sources]]", "`[[sources]]`").replace("*", r"\*")) + needed


def _paragraphs(text: str) -> str:
    return "\n\n".join(" ".join(block.split()) for block in text.strip().split("\n\n")) + "\n"


def _sentence(words: str) -> str:
    return words[0].upper() + words[1:] + "."
