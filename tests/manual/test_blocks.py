"""Every block of code of the manual holds: ``make manual`` runs what its pages type, page by page.

The rules are those of the README (``tests/test_readme.py``): a command has to end with status 0, or with the one that
it names, and to print what the page shows. Each page runs in a folder of its own with a copy of the examples. A block
that the comment ``<!-- not run: why -->`` follows is only read; ``NOT_RUN`` lists them all.
"""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from pathlib import Path

import pytest
from by_path import TESTS, load

readme = load("readme_blocks", TESTS / "test_readme.py")

CHECKOUT = TESTS.parent
#: The page that tests/test_readme.py runs, beside the README.
RUN_BY_README = "python.md"
PAGES = sorted((CHECKOUT / "docs").glob("*.md"))
OTHERS = [CHECKOUT / "CONTRIBUTING.md", *sorted(CHECKOUT.glob("examples/*.md")), CHECKOUT / "CHANGELOG.md"]
NOTE = re.compile(r"^```\s*\n\s*\n<!-- not run: (?P<why>.+?) -->$", re.MULTILINE)
#: Page and first line of every block that is not run.
NOT_RUN = {
    ("command-line.md", "$ monitor watch /srv/measured --out reports-out --mail mail.toml"),
    (
        "files-as-they-come.md",
        "$ monitor import week-12/*.csv --mapping shop.toml --campaign week-12 --dry-run",
    ),
    ("howto-shop-floor.md", "$ monitor serve"),
    ("howto-sql-and-python.md", "$ monitor --db shop.duckdb serve"),
    (
        "howto-sql-and-python.md",
        """$ curl -s -H 'Content-Type: application/json' -d '{"campaign": "five-days"}' http://127.0.0.1:8765/api/v1/compare""",
    ),
    ("pages.md", "$ pip install 'machine-health-monitor[web]'"),
    ("pages.md", "$ monitor serve --users users.toml --add-user ada --role engineer"),
    (
        "pages.md",
        """$ curl -s -H 'Content-Type: application/json' -d '{"campaign": "five-days"}' http://127.0.0.1:8765/api/v1/compare""",
    ),
    (
        "command-line.md",
        "$ export MONITOR_SERVER=https://monitor.example MONITOR_SERVER_TOKEN_FILE=~/.config/monitor/token",
    ),
    ("reliability.md", "$ monitor archive /mnt/archive --before 2024-01-01"),
    ("reliability.md", "$ monitor backup backups/2026-03-01.duckdb"),
    ("scale.md", "$ pip install 'machine-health-monitor[lake]'"),
    ("tutorial.md", "$ make demo"),
    ("tutorial.md", "$ . .venv/bin/activate"),
}


def text_of(page: Path) -> str:
    """Return the text of a page; directives of Sphinx are no code, and count as text."""
    return re.sub(r"^```\{[\w-]+\}.*$", "```text", page.read_text(encoding="utf-8"), flags=re.MULTILINE)


def lines_not_run(text: str) -> set[int]:
    """Return the number of the first line of every block that a comment says is not run."""
    begins = [begin for begin, _, _ in readme.fences(text)]
    ends = [text[: note.start()].count("\n") + 1 for note in NOTE.finditer(text)]
    return {max(begin for begin in begins if begin <= end) for end in ends}


def blocks_not_run(page: Path) -> set[tuple[str, str]]:
    """Return page and first line of every block of a page that is not run."""
    text = text_of(page)
    marked = lines_not_run(text)
    return {(page.name, lines[0]) for begin, _, lines in readme.fences(text) if begin in marked}


@pytest.mark.parametrize("page", [*PAGES, CHECKOUT / "README.md"], ids=lambda page: page.name)
def test_every_table_has_its_head(page: Path) -> None:
    lines = re.sub(r"^```.*?^```", "", text_of(page), flags=re.MULTILINE | re.DOTALL).splitlines()
    begins = [
        at for at, line in enumerate(lines) if line.startswith("|") and not lines[at - 1].startswith("|")
    ]
    # An empty line between two rows ends the table: what follows would be shown as text with bars.
    assert [lines[at] for at in begins if not re.match(r"\|( :?-+:? \|)+$", lines[at + 1])] == []


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page.name != RUN_BY_README], ids=lambda page: page.name
)
def test_every_block_of_a_page_holds(page: Path, tmp_path: Path) -> None:
    shutil.copytree(CHECKOUT / "examples", tmp_path / "examples")
    text = text_of(page)
    skipped = {
        number
        for begin, _, lines in readme.fences(text)
        if begin in lines_not_run(text)
        for number in range(begin, begin + len(lines))
    }
    for example in readme.examples(text):
        if example.line in skipped:
            continue
        try:
            readme.try_out(example, tmp_path, in_shell=False)
        except AssertionError as fault:
            pytest.fail(str(fault).replace("README line", f"{page.name}, line"))


@pytest.mark.parametrize("page", [*PAGES, *OTHERS], ids=lambda page: page.name)
def test_every_block_of_settings_can_be_read(page: Path) -> None:
    for begin, language, lines in readme.fences(text_of(page)):
        text = "\n".join(lines)
        if language == "toml":
            assert tomllib.loads(text), f"{page.name}, line {begin}"
        if language == "json":
            assert json.loads(text), f"{page.name}, line {begin}"


def test_only_these_blocks_are_not_run() -> None:
    assert set().union(*(blocks_not_run(page) for page in PAGES)) == NOT_RUN


def test_no_command_hides_in_an_indented_block() -> None:
    for page in PAGES:
        assert (
            re.findall(r"^    (?:\$ )?monitor .*$", page.read_text(encoding="utf-8"), re.MULTILINE) == []
        ), page.name
