"""The configuration of this place: show what holds, check a file, write one to begin with."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import asdict, dataclass
from pathlib import Path

from monitor.cli import output
from monitor.cli.configuration import NAME, TEMPLATE, Configuration, configuration, read
from monitor.cli.parser import common, described
from monitor.exceptions import InputError

EXAMPLE = "monitor config init"


@dataclass(frozen=True)
class InitAnswer:
    """The file that was written."""

    file: Path


def options(parser: ArgumentParser) -> None:
    verbs = parser.add_subparsers(dest="what", metavar="show|check|init", required=True)
    shown = verbs.add_parser(
        "show", **described("what holds here, and from which file", "monitor config show")
    )
    shown.set_defaults(run=_show)
    checked = verbs.add_parser(
        "check", **described("can the file be read?", "monitor config check monitor.toml")
    )
    checked.add_argument(
        "file", nargs="?", type=Path, metavar="FILE", help="default: the one that holds here"
    )
    checked.set_defaults(run=_check)
    init = verbs.add_parser("init", **described("a file with every key, to begin with", EXAMPLE))
    init.add_argument("--out", type=Path, default=Path(NAME), metavar="FILE", help=f"default: {NAME}")
    init.set_defaults(run=_init)
    for verb in (shown, checked, init):
        common(verb, database=False)


def _show(options: Namespace) -> int:
    return _said(configuration(), options.json)


def _check(options: Namespace) -> int:
    answer = configuration() if options.file is None else read(options.file.absolute())
    if answer.file is None:
        raise InputError(f"there is no configuration here; `monitor config init` writes {NAME}")
    return _said(answer, options.json)


def _said(answer: Configuration, as_json: bool) -> int:
    if as_json:
        output.document(answer)
        return 0
    for key, value in asdict(answer).items():
        if key == "tolerances" and value is not None:
            for name, limits in value.items():
                stated = ", ".join(f"{term} {limit:g}" for term, limit in limits.items())
                output.say(f"{key:<15} {name}: {stated}")
            continue
        output.say(f"{key:<15} {'-' if value is None else value}")
    return 0


def _init(options: Namespace) -> int:
    if options.out.exists():
        raise InputError(
            f"{options.out} is there already and is not written over; name another file with --out"
        )
    try:
        options.out.write_text(TEMPLATE, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{options.out} cannot be written: {error.strerror or error}") from error
    if options.json:
        output.document(InitAnswer(options.out))
    else:
        output.say(f"{options.out}: take the # away from what you need")
    return 0
