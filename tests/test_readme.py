"""The README tells the truth: what it types is run, what it shows is compared.

- Fenced ``console`` blocks: every line that starts with ``$ `` is a command, the lines below it are what it prints.
  ``...`` stands for anything, white space may differ, no lines means any output. The exit status has to be 0 unless the
  command ends in ``# exit status 1``.
- Fenced ``python`` blocks are run as scripts.

All run in document order in one folder that holds a copy of ``examples/``, as a reader would do it. The first command
is typed into a shell; what only calls ``monitor`` after it, and scripts, run in this process, which saves a second of
loading each and what was computed before. ``make demo`` of continuous integration is the demo in a process of its own.
"""

from __future__ import annotations

import contextlib
import doctest
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from monitor.cli import main

CHECKOUT = Path(__file__).resolve().parents[1]
README = CHECKOUT / "README.md"

LOOSELY = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
# Set-up and what never ends by itself; everything else is run. The make targets have to exist.
NOT_RUN = ("cd ", "git ", "make ", "sudo ", "monitor serve")
# What a make target does once the set-up is there.
MAKE = {"make demo": "monitor demo --out demo-output"}
LANGUAGES = {"console", "python", "text", "toml", "csv", "sql", "json"}


@dataclass(frozen=True)
class Example:
    """One thing to run: its line in the README, its language, its text, what it shows (may be empty)."""

    line: int
    language: str
    source: str
    shown: str


def fences(text: str) -> Iterator[tuple[int, str, list[str]]]:
    """Line of the first line inside, language and lines of every fenced block."""
    language, begin = "", 0
    inside: list[str] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if fence := re.match(r"```(\S*)\s*$", line):
            if begin:
                yield begin, language, inside
                begin = 0
            else:
                language, begin, inside = fence[1], number + 1, []
        elif begin:
            inside.append(line)
    assert not begin, f"the block that begins at line {begin} of the README is not closed"


def examples(text: str) -> list[Example]:
    """Everything that the README asks to type, in order."""
    found: list[Example] = []
    for begin, language, lines in fences(text):
        assert language in LANGUAGES, (
            f"README line {begin - 1}: a block of {language!r}; known are {', '.join(sorted(LANGUAGES))}"
        )
        if language == "python":
            found.append(Example(begin, language, "\n".join(lines), ""))
        if language == "console":
            assert lines, f"README line {begin}: an empty console block"
            assert lines[0].startswith("$ "), f"README line {begin}: a console block begins with '$ '"
            prompts = [i for i, line in enumerate(lines) if line.startswith("$ ")]
            for i, following in zip(prompts, [*prompts[1:], len(lines)], strict=True):
                shown = "\n".join(lines[i + 1 : following]).strip()
                found.append(Example(begin + i, language, lines[i][2:].strip(), shown))
    return found


def reader_environment() -> dict[str, str]:
    """A reader's shell: this environment's commands first, no colours, a line of 100 columns."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("MONITOR_", "PYTHON"))}
    path = f"{Path(sys.executable).parent}{os.pathsep}{kept.get('PATH', '')}"
    return kept | {"PATH": path, "COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb"}


def run_in_shell(example: Example, source: str, folder: Path) -> tuple[int, str]:
    """Run an example in a process of its own; its exit status and what it prints."""
    command = [sys.executable, "-c", source] if example.language == "python" else ["bash", "-c", source]
    done = subprocess.run(
        command,
        cwd=folder,
        env=reader_environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
        text=True,
        timeout=600,
    )
    return done.returncode, done.stdout


def run_script(source: str) -> int:
    """Run a script in this process; its exit status."""
    try:
        exec(compile(source, "<example>", "exec", dont_inherit=True), {"__name__": "__main__"})
    except SystemExit as ended:
        return int(ended.code or 0)
    except Exception:
        traceback.print_exc()
        return 1
    return 0


def run_here(language: str, source: str, folder: Path) -> tuple[int, str]:
    """Run a script or a command of ``monitor`` in this process; its exit status and what it prints."""
    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for name in [name for name in os.environ if name.startswith("MONITOR_")]:
            patch.delenv(name)
        for name in ("COLUMNS", "NO_COLOR", "TERM"):
            patch.setenv(name, reader_environment()[name])
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            status = (
                run_script(source) if language == "python" else main(shlex.split(source, comments=True)[1:])
            )
    return status, printed.getvalue()


def try_out(example: Example, folder: Path, *, in_shell: bool = True) -> str:
    """Run one example in ``folder`` and return what it prints (nothing where it is not run).

    Without ``in_shell`` a script, or a command of ``monitor`` that needs no shell, runs in this process. Raises
    AssertionError where it ends or prints otherwise than the README says.
    """
    source = MAKE.get(example.source, example.source)
    if example.language == "console" and source.startswith(NOT_RUN):
        return ""
    wanted = re.search(r"# exit status (\d+)$", source)
    plain = example.language == "python" or (
        source.startswith("monitor ") and not re.search(r"[|&;<>$`*?~]", source)
    )
    status, printed = (
        run_here(example.language, source, folder)
        if plain and not in_shell
        else run_in_shell(example, source, folder)
    )
    line = f"README line {example.line}: {source}\n"
    expected = int(wanted[1]) if wanted else 0
    assert status == expected, f"{line}ended with status {status}, not {expected}:\n{printed}"
    same = doctest.OutputChecker().check_output(example.shown + "\n", printed, LOOSELY)
    if example.shown and not same:
        raise AssertionError(f"{line}shows\n{example.shown}\nbut prints\n{printed}")
    return printed


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the examples, as a reader has it."""
    if (CHECKOUT / "examples").is_dir():
        shutil.copytree(CHECKOUT / "examples", tmp_path / "examples")
    return tmp_path


@pytest.mark.slow
def test_readme_examples_do_what_it_says(folder: Path) -> None:
    typed = examples(README.read_text(encoding="utf-8"))
    assert any(example.language == "console" for example in typed)
    first = next(example for example in typed if example.source.startswith("monitor "))
    for example in typed:
        if example.source not in MAKE:
            try_out(example, folder, in_shell=example == first)


@pytest.mark.slow
def test_the_demo_does_the_main_job_and_prints_what_the_readme_shows(folder: Path) -> None:
    typed = examples(README.read_text(encoding="utf-8"))
    (example,) = (example for example in typed if example.source == "make demo")
    demo = try_out(example, folder, in_shell=False)
    assert "five-days: imported, 20 runs, 1240 probings\n" in demo
    assert "U = k_q u" in demo
    step = next(line for line in demo.splitlines() if line.startswith("EB0C ") and "< 0.0001" in line)
    assert "µrad" in step
    assert "EZC1:const@warmup" in demo
    assert len(list((folder / "demo-output").glob("certificate-*.pdf"))) == 1
    assert (folder / "demo-output/demo.duckdb").is_file()
    # What it shows is typed below it, and every command may be copied.
    assert "$ monitor --db demo-output/demo.duckdb import " in demo


@pytest.mark.slow
def test_the_python_of_the_documents_runs(tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(CHECKOUT / "examples")
    typed = examples((CHECKOUT / "docs/python.md").read_text(encoding="utf-8"))
    assert len(typed) == 3
    printed = [try_out(example, tmp_path, in_shell=example == typed[-1]) for example in typed]
    assert "EZC1:const@warmup" in printed[0]
    assert "EC0A" in printed[2]
    assert (tmp_path / "figures/missing-effects.svg").is_file()


def test_readme_make_targets_exist_and_do_what_the_examples_run() -> None:
    makefile = (CHECKOUT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z]+):", makefile, flags=re.MULTILINE))
    typed = re.findall(r"^\$ make ([a-z]+)", README.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert sorted(set(typed) - targets) == []
    assert all(command in makefile for command in MAKE.values())


@pytest.mark.skipif(not (CHECKOUT / "monitor").is_dir(), reason="the README points into the checkout")
def test_readme_pictures_and_links_lead_somewhere() -> None:
    links = re.findall(r"\]\(([^)#\s]+)", README.read_text(encoding="utf-8"))
    local = [link for link in links if "://" not in link and not link.startswith("mailto:")]
    assert [link for link in local if not (CHECKOUT / link).exists()] == []


def test_examples_are_read_with_their_lines() -> None:
    text = "# T\n```console\n$ one\nout\n...\n$ two\n```\nprose\n```python\nx = 1\n```\n```toml\na = 1\n```\n"
    assert examples(text) == [
        Example(3, "console", "one", "out\n..."),
        Example(6, "console", "two", ""),
        Example(10, "python", "x = 1", ""),
    ]


@pytest.mark.parametrize(
    ("source", "shown"),
    [
        ("echo 'EC0B   1.7 µrad'; echo more", "EC0B 1.7 µrad\n..."),
        ("echo EC0B 1.7 µrad", "EC0B ... µrad"),
        ("echo anything", ""),
        ("exit 1  # exit status 1", ""),
    ],
)
def test_example_that_holds(tmp_path: Path, source: str, shown: str) -> None:
    try_out(Example(1, "console", source, shown), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_script_runs_in_this_process_as_in_one_of_its_own(tmp_path: Path) -> None:
    written = Example(1, "python", "from pathlib import Path\nPath('x').touch()\nprint(__name__)", "__main__")
    for in_shell in (True, False):
        try_out(written, tmp_path, in_shell=in_shell)
        (tmp_path / "x").unlink()
        for source in ("raise SystemExit(3)", "1 / 0"):
            with pytest.raises(AssertionError, match=r"ended with status [13], not 0"):
                try_out(Example(1, "python", source, ""), tmp_path, in_shell=in_shell)


@pytest.mark.parametrize(
    ("language", "source", "shown", "why"),
    [
        ("console", "echo EC0B 1.8 µrad", "EC0B 1.7 µrad", "shows\nEC0B 1.7 µrad\nbut prints\nEC0B 1.8 µrad"),
        ("console", "exit 2", "", "ended with status 2, not 0"),
        ("console", "true  # exit status 1", "", "ended with status 0, not 1"),
        ("python", "raise SystemExit(3)", "", "ended with status 3, not 0"),
    ],
)
def test_example_that_does_not_hold(tmp_path: Path, language: str, source: str, shown: str, why: str) -> None:
    with pytest.raises(AssertionError, match=re.escape(why)):
        try_out(Example(1, language, source, shown), tmp_path)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("```bash\nmonitor demo\n```\n", "a block of 'bash'"),
        ("```console\nmonitor demo\n```\n", "a console block begins with"),
        ("```console\n$ monitor demo\n", "is not closed"),
    ],
)
def test_block_that_would_not_be_run_is_refused(text: str, why: str) -> None:
    with pytest.raises(AssertionError, match=why):
        examples(text)
