"""How the command is called: help, verbs, options, and where the database is named."""

from __future__ import annotations

import argparse
import importlib
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from monitor import __version__
from monitor.cli.parser import VERBS, Parser


def subverbs(verb: str) -> Iterator[str]:
    parser = Parser(prog=verb)
    importlib.import_module(f"monitor.cli.verbs.{verb}_").options(parser)
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            yield from action.choices


PLACES = [[verb, *more] for verb in VERBS for more in ([], *([sub] for sub in subverbs(verb)))]


@pytest.mark.parametrize("place", PLACES, ids=" ".join)
def test_every_verb_and_subverb_has_help_with_an_example_that_is_a_call_of_it(
    typed: Any, place: list[str]
) -> None:
    answer = typed(*place, "--help")
    assert (answer.status, answer.err) == (0, "")
    assert answer.out.startswith(f"usage: monitor {place[0]}")
    example = re.search(r"\nexamples?:\n  (monitor .*)\n", answer.out)
    assert example is not None, "no example"
    for word in place:
        assert word in example[1].split()


@pytest.mark.parametrize("place", [place for place in PLACES if not list(subverbs(" ".join(place[:1]))) or place[1:]],
                         ids=" ".join)  # fmt: skip
def test_every_verb_and_subverb_takes_json(typed: Any, place: list[str]) -> None:
    assert "--json" in typed(*place, "--help").out


def test_help_lists_every_verb_with_a_few_words(typed: Any) -> None:
    answer = typed("--help")
    assert answer.status == 0
    for verb, words in VERBS.items():
        assert re.search(rf"^  {verb} +{re.escape(words)}$", answer.out, re.MULTILINE)
    assert typed().out == answer.out


def test_json_and_quiet_are_taken_before_the_verb_too(typed: Any) -> None:
    assert typed("--json", "effects", "reversal").out == typed("effects", "reversal", "--json").out != ""
    assert typed("--quiet", "effects", "reversal").out == ""
    refused = typed("--json", "effects", "reversal", "--quiet")
    assert (refused.status, refused.err) == (
        2,
        "monitor: --quiet says nothing and --json says all: choose one\n",
    )


def test_the_package_is_the_command(capfd: pytest.CaptureFixture[str]) -> None:
    """``python -m monitor``, for those who do not have the command on their path."""
    subprocess.run([sys.executable, "-m", "monitor", "--version"], check=True)
    assert capfd.readouterr().out == f"monitor {__version__}\n"


def test_version(typed: Any) -> None:
    assert typed("--version").out == f"monitor {__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["identify", "--run", "eins"], "argument --run: a whole number, such as 3, not 'eins'; "),
        (["explain", "x", "--rate", "5%"], "argument --rate: a number, such as 0.95, not '5%'; "),
        (["bogus"], "there is no verb 'bogus'; there are demo, import"),
        (["CAMPAIGNS"], "there is no verb 'CAMPAIGNS'"),
        (["--db"], "--db: expected one argument"),
        (["--bogus", "campaigns"], "--bogus"),
        (["import"], "required: FOLDER"),
        (["runs"], "required: CAMPAIGN"),
        (["runs", "a", "b"], "unrecognized arguments: b"),
        (["certificate"], "required: issue|show|verify|amend|withdraw"),
        (["certificate", "bogus"], "invalid choice: 'bogus'"),
        (
            ["certificate", "issue", "five-days", "--run", "x", "--laboratory", "y"],
            "a whole number, such as 3, not 'x'",
        ),
        (["model"], "required: list|show|add|remove|use|history"),
        (["model", "add", "EXX:reversal"], "required: --to"),
        (["uncertainty", "five-days", "--seed", "1.5"], "a whole number, such as 3, not '1.5'"),
        (["simulate", "x", "--peak", "much"], "a number, such as 0.95, not 'much'"),
        (["export", "x", "--format", "ods"], "choose from"),
        (["audit", "--last", "x"], "a whole number"),
    ],
    ids=" ".join,
)
def test_bad_usage_is_one_plain_line_with_status_2(typed: Any, arguments: list[str], words: str) -> None:
    answer = typed(*arguments)
    assert (answer.status, answer.out) == (2, "")
    assert words in answer.err
    assert answer.err.count("\n") == 1
    assert answer.err.rstrip().endswith("shows how")


def test_no_verb_after_options_is_bad_usage(typed: Any, filled: Path) -> None:
    assert typed("--db", filled).status == 2


def test_db_stands_before_or_behind_the_verb(typed: Any, filled: Path) -> None:
    before = typed("campaigns", "--json", db=filled)
    assert typed("campaigns", "--json", "--db", filled).out == before.out
    assert typed("model", "list", "--json", "--db", filled).status == 0


def test_monitor_db_names_the_database_and_the_option_wins(
    typed: Any, db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MONITOR_DB", str(db))
    assert len(typed("campaigns", "--json").document["campaigns"]) == 3
    assert (
        "`monitor --db 'a b.duckdb' import FOLDER` makes one" in typed("--db", "a b.duckdb", "campaigns").err
    )
    assert "there is no database other.duckdb" in typed("--db", "other.duckdb", "campaigns").err
    # An empty variable is no name.
    monkeypatch.setenv("MONITOR_DB", "")
    assert "there is no database monitor.duckdb" in typed("campaigns").err
    shutil.copyfile(db, "monitor.duckdb")
    assert len(typed("campaigns", "--json").document["campaigns"]) == 3


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (
            "typo.duckdb",
            "there is no database typo.duckdb; `monitor --db typo.duckdb import FOLDER` makes one",
        ),
        ("missing/x.duckdb", "the folder of missing/x.duckdb does not exist; make it first"),
        ("folder", "folder is a folder; name a file"),
        ("text", "text is not a database of this software"),
        ("", "--db '' names no file"),
        (":memory:", "--db ':memory:' names no file"),
    ],
)
@pytest.mark.parametrize("verb", [["campaigns"], ["verify", "--json"], ["import", "nothing"]], ids="-".join)
def test_a_database_that_cannot_be(typed: Any, verb: list[str], path: str, words: str) -> None:
    if verb[0] == "import" and path == "typo.duckdb":
        # The verb that makes databases; the folder is what is wrong.
        words = "nothing: there is no such folder"
    Path("folder").mkdir()
    Path("text").write_text("hello\n" * 2000)
    answer = typed(*verb, db=Path(path) if path else None) if path else typed("--db", "", *verb)
    assert (answer.status, answer.out) == (2, "")
    assert words in answer.err
    assert Path("text").read_text() == "hello\n" * 2000
    if verb[0] != "import":
        assert not Path("typo.duckdb").exists()


def test_a_name_that_is_not_utf8_is_refused(typed: Any, filled: Path) -> None:
    answer = typed("identify", "\udcff", db=filled)
    assert (answer.status, answer.out) == (2, "")
    assert answer.err == "monitor: '\\udcff' is not UTF-8 text; rename it, or type it in UTF-8\n"


def test_a_fault_of_the_software_is_no_traceback(
    typed: Any, filled: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr("monitor.workflow.intake.campaigns.campaigns", broken)
    answer = typed("campaigns", db=filled)
    assert (answer.status, answer.out) == (3, "")
    assert answer.err.count("\n") == 1
    assert "a fault of the software, please report it: ZeroDivisionError: by zero" in answer.err
    monkeypatch.setenv("MONITOR_DEBUG", "1")
    with pytest.raises(ZeroDivisionError, match="by zero"):
        typed("campaigns", db=filled)


@pytest.mark.parametrize(
    ("words", "option", "second"),
    [
        (["simulate", "OUT", "--effect", "EXX:reversal", "--effect", "EYY:reversal"], "--effect", "EYY:reversal"),
        (["trend", "MILL-1", "--parameter", "EA0B", "--parameter", "EB0C"], "--parameter", "EB0C"),
        (["certificate", "issue", "week-10", "--run", "1", "--run", "2"], "--run", "2"),
        (["--db", "one.duckdb", "--db", "two.duckdb", "campaigns"], "--db", "two.duckdb"),
        (["--db", "one.duckdb", "campaigns", "--db", "two.duckdb"], "--db", "two.duckdb"),
        (["--db", "one.duckdb", "certificate", "show", "K-1", "--db", "two.duckdb"], "--db", "two.duckdb"),
        (["--wait", "3", "runs", "week-10", "--wait", "4.5"], "--wait", "4.5"),
        (["--server-token", "a.txt", "runs", "week-10", "--server-token", "b.txt"], "--server-token", "b.txt"),
    ],
)  # fmt: skip
def test_a_second_value_of_an_option_is_refused_and_not_taken_instead(
    typed: Any, words: list[str], option: str, second: str
) -> None:
    answer = typed(*words)
    assert answer.status == 2
    assert f"argument {option}: one value is taken, a second one was typed" in answer.err
    # It may be a secret.
    assert second not in answer.err


def test_what_was_typed_before_is_forgotten_by_the_same_parser() -> None:
    parser = Parser(prog="monitor stats")
    parser.add_argument("--by")
    assert [parser.parse_args(["--by", by]).by for by in ("day", "run")] == ["day", "run"]
