"""What the verbs print: one JSON document, or tables and sentences for people."""

from __future__ import annotations

import io
import itertools
import json
import math
import re
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import is_dataclass
from typing import Any

from rich.cells import cell_len
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from monitor.documents import Said, to_document
from monitor.formula_cells import FORMULA

# A table that goes to a file or a pipe is as wide as it needs: one line a row, whatever the window.
PIPE_WIDTH = 10_000
# Words longer than this may be broken over lines in a narrow window; numbers and names never are.
LONGEST_UNBROKEN = 24
_MOMENT = re.compile(r"(\d{4}-\d\d-\d\d)T(\d\d:\d\d:\d\d)(?:\.\d+)?(Z?)")


def document(answer: object) -> None:
    """Write an answer, or a sequence of answers, as one JSON document on standard output, complete or not at all."""
    unicode = (sys.stdout.encoding or "utf-8").lower().replace("-", "") == "utf8"
    text = json.dumps(_plain(answer), ensure_ascii=not unicode, allow_nan=False, indent=2)
    sys.stdout.write(text + "\n")


def checked(answer: object, message: str, faults: Sequence[object], *, as_json: bool) -> int:
    """Write an answer that may have faults, as JSON or as its message with them; return the exit status."""
    if as_json:
        document(answer)
    else:
        say(message)
        for fault in faults:
            say(f"  {fault}")
    return 1 if faults else 0


def _plain(answer: object) -> Any:
    """Return an answer as JSON has it."""
    if isinstance(answer, (list, tuple)):
        return [_plain(element) for element in answer]
    return to_document(answer) if is_dataclass(answer) else answer


def csv_cell(cell: object) -> object:
    """Return a cell as CSV has it: a text that a spreadsheet would run as a formula begins with an apostrophe."""
    return f"'{cell}" if isinstance(cell, str) and re.match(FORMULA, cell) else cell


def copied(sentences: Sequence[Said] | None) -> None:
    """Say before any number which readings it rests on are copies."""
    for sentence in sentences or ():
        say(str(sentence))


def say(text: str = "") -> None:
    """Print a sentence on one line: the terminal breaks it, and a path in it can be copied."""
    print(text)


def table(
    title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], *, text_columns: int = 1
) -> None:
    """Print a table; the first ``text_columns`` columns hold text, the others numbers. Colour only on a terminal."""
    if title:
        say(title)
    rich_table = Table(box=None, pad_edge=False, header_style="bold")
    for index, name in enumerate(columns):
        longest = max(cell_len(text) for text in (name, *(row[index] for row in rows)))
        is_text = index < text_columns
        whole = not is_text or longest <= LONGEST_UNBROKEN
        rich_table.add_column(
            Text(name),
            justify="left" if is_text else "right",
            overflow="fold",
            no_wrap=whole,
            min_width=longest if whole else None,
        )
    for row in rows:
        rich_table.add_row(*(Text(cell) for cell in row))
    terminal = sys.stdout.isatty()
    drawn = io.StringIO()
    console = Console(
        file=drawn,
        width=shutil.get_terminal_size().columns if terminal else PIPE_WIDTH,
        force_terminal=terminal,
        color_system="auto" if terminal else None,
        highlight=False,
    )
    # Where the window is too narrow for the numbers the terminal breaks the lines; no digit is dropped.
    unbounded = console.options.update(width=PIPE_WIDTH)
    console.width = max(console.width, Measurement.get(console, unbounded, rich_table).minimum)
    console.print(rich_table)
    sys.stdout.write("".join(f"{line.rstrip()}\n" for line in drawn.getvalue().splitlines()))


def rounded(value: float | None, u: float | None) -> str:
    """Round a value to the place of the second digit of its uncertainty (GUM 7.2.6)."""
    if value is None:
        return "-"
    if u is None or not math.isfinite(u) or u <= 0.0:
        return f"{value:.3g}"
    return f"{value:.{places(u)}f}"


def places(u: float) -> int:
    """Return the decimal places that show two digits of an uncertainty."""
    return max(0, 1 - math.floor(math.log10(float(f"{u:.1e}"))))


def two_digits(u: float | None) -> str:
    """Write an uncertainty with two significant digits, 2.0 and 0.70 too (GUM 7.2.6)."""
    return rounded(u, u)


def probability(p: float | None) -> str:
    """Write a p-value as people read it."""
    if p is None:
        return "-"
    return "< 0.0001" if p < 1e-4 else f"{p:.4f}"


def stated(symbol: str, p: float | None) -> str:
    """Write a p-value in a sentence: ``p = 0.0312``, ``p < 0.0001``."""
    text = probability(p)
    return f"{symbol} {text}" if text.startswith("<") else f"{symbol} = {text}"


def micrometres(value: float | None) -> str:
    """Write a length in µm with two decimals."""
    return "-" if value is None else f"{value:.2f}"


def flat(value: Any) -> str:
    """Write a cell of a listing; moments to the second."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {flat(inner)}" for key, inner in value.items())
    if isinstance(value, list):
        return ", ".join(flat(inner) for inner in value)
    if isinstance(value, float):
        return f"{value:.10g}"
    return _MOMENT.sub(r"\1 \2\3", str(value))


def listing(records: Sequence[object], empty: str, columns: Sequence[str] | None = None) -> None:
    """Print records as a table: all their columns, or those named; ``empty`` where there is no record."""
    if not records:
        say(empty)
        return
    rows = _plain(records)
    names = list(rows[0]) if columns is None else list(columns)
    table("", names, [[flat(row[name]) for name in names] for row in rows], text_columns=len(names))


_QUIET: ContextVar[bool] = ContextVar("quiet", default=False)


@contextmanager
def without_progress() -> Iterator[None]:
    """Show no progress within the block, whatever the terminal."""
    token = _QUIET.set(True)
    try:
        yield
    finally:
        _QUIET.reset(token)


def _shows_progress() -> bool:
    return sys.stderr.isatty() and not _QUIET.get()


@contextmanager
def working(activity: str) -> Iterator[None]:
    """Show a sign of life on a terminal, with a bar and the time left once the work tells how far it is; nothing
    elsewhere."""
    if not _shows_progress():
        yield
        return
    # Loaded on a terminal alone: a verb in a pipe or a job shows no progress.
    from rich.progress import (
        BarColumn,
        Progress,
        SpinnerColumn,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
    )

    from monitor.cli.time_left import TimeLeft
    from monitor.progress import listening

    with Progress(
        SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(),
        console=Console(stderr=True), transient=True,
    ) as progress:  # fmt: skip
        task = progress.add_task(activity, total=None)
        time_left = TimeLeft()

        def tell(share: float) -> None:
            progress.columns = (
                TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(),
                time_left,
            )  # fmt: skip
            progress.update(task, total=1.0, completed=share)

        def say(doing: str) -> None:
            progress.update(task, description=f"{activity}; {doing}" if doing else activity)

        with listening(tell, say):
            yield


@contextmanager
def stepping(
    activity: str, total: int, *, behind: bool = False, afterwards: str = ""
) -> Iterator[Callable[[str], None]]:
    """Show a bar on a terminal for work of ``total`` pieces; call what it yields with a piece's name before each, or
    behind each (``behind``), so that the last call fills the bar. What is done ``afterwards`` is shown as a sign of
    life: nobody knows how long it takes, and a full bar that stands still looks as if it hung."""
    if not _shows_progress():
        yield lambda name: None
        return
    from rich.markup import escape
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        SpinnerColumn,
        TextColumn,
        TimeElapsedColumn,
    )

    from monitor.cli.time_left import TimeLeft

    counted = itertools.count(int(behind))
    with Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeLeft(),
        console=Console(stderr=True), transient=True,
    ) as progress:  # fmt: skip
        task = progress.add_task(activity, total=total)
        description = f"{activity}, {{}} done" if behind else f"{activity} {{}}"

        def tell(name: str) -> None:
            count = next(counted)
            if afterwards and count == total:
                progress.columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
                progress.update(task, description=afterwards, total=None)
            else:
                progress.update(task, description=description.format(escape(name)), completed=count)

        yield tell


def with_u(value: float, u: float, unit: str) -> str:
    """A value with its standard uncertainty, both in their unit."""
    return f"{rounded(value, u)} {unit} (u = {two_digits(u)} {unit})"
