"""Laser interferometer, text with sections (``.rtl``, ``.rta``, ``.rts``): targets, runs, and a deviation of each.

The layout is that of public readers of such files: sections end in ``::``; ``TARGET DATA::`` has ``Target-count`` and
the positions below ``Targets :``, ``RUNS::`` has ``Run-count``, and below ``Run Target Data:`` of ``DEVIATIONS::`` each
line is run, number of the target, deviation. The file states no units.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from decimal import Decimal

from monitor.readers.export import Export, ExportFile, ExportFormat, Fact
from monitor.readers.faults import Faults, quoted
from monitor.readers.foreign_units import decimal_of
from monitor.readers.tables.foreign_text import decode_foreign

#: Run, number of the target, deviation, line.
Row = tuple[int, int, str, int]
_SECTION = re.compile(r"\s*([A-Za-z][A-Za-z0-9 _-]*?)\s*::\s*")
_FACT = re.compile(r"\s*([A-Za-z][\w /.-]*?)\s*:\s*(.*?)\s*")
#: A line of numbers, as targets and deviations are.
_NUMBERS = re.compile(r"[ \t0-9.+-]+")
_COUNT = re.compile(r"[0-9]{1,6}")
_DATE = "date"


class _Parser:
    """What has been read of a file so far, section by section."""

    def __init__(self, name: str, faults: Faults, decimal: str) -> None:
        self.name, self.faults = name, faults
        #: What a comma is: a point where the file has no other decimal mark, else itself, which no number has.
        self.decimal = decimal
        self.targets: list[str] = []
        self.rows: list[Row] = []
        self.facts: list[Fact] = []
        self.counts: dict[str, tuple[int, int]] = {}
        self.sections: list[str] = []
        self._below = ""

    def line(self, number: int, text: str) -> None:
        """Read one line."""
        if not text.strip():
            return
        if section := _SECTION.fullmatch(text):
            if section[1].upper() == "HEADER" and self.sections:
                self.faults.add(
                    self.name, number, None,
                    "a second measurement begins here (HEADER::); split the file, and give each part its run",
                )  # fmt: skip
            self.sections.append(section[1].upper())
            self._below = ""
        elif not self.sections:
            self.faults.add(
                self.name, number, None, f"{quoted(text)} stands before the first section, such as HEADER::"
            )
        elif self._below == "targets" and _FACT.fullmatch(text) is None:
            self._targets(number, text)
        elif self._below == "deviations" and _FACT.fullmatch(text) is None:
            self._deviation(number, text)
        elif fact := _FACT.fullmatch(text):
            self._fact(number, fact[1], fact[2])

    def _fact(self, number: int, key: str, value: str) -> None:
        folded = key.casefold()
        self._below = {"targets": "targets", "run target data": "deviations"}.get(folded, "")
        if self._below == "targets" and value:
            self._targets(number, value)
        if folded in ("target-count", "run-count"):
            if _COUNT.fullmatch(value):
                self.counts[folded] = (int(value), number)
            else:
                self.faults.add(self.name, number, key, f"{quoted(value)} is no number of targets or runs")
        elif value and not self._below:
            self.facts.append(Fact(key, value, number))

    def _targets(self, number: int, text: str) -> None:
        for cell in text.replace(",", self.decimal).split():
            if decimal_of(cell) is None:
                self.faults.add(
                    self.name, number, "Targets", f"{quoted(cell)} is not a number; export the file again"
                )
            self.targets.append(cell)

    def _deviation(self, number: int, text: str) -> None:
        cells = text.replace(",", self.decimal).split()
        if (
            len(cells) != 3
            or not all(_COUNT.fullmatch(cell) for cell in cells[:2])
            or decimal_of(cells[2]) is None
        ):
            self.faults.add(
                self.name, number, "Run Target Data",
                f"{quoted(text.strip())} is not run, target and deviation; the file is cut or damaged here",
            )  # fmt: skip
            return
        self.rows.append((int(cells[0]), int(cells[1]), cells[2], number))


def read(file: ExportFile, settings: None, faults: Faults) -> Export | None:
    """Read targets, runs and deviations; None with the faults noted."""
    decoded = decode_foreign(file.name, file.content, faults)
    if decoded is None:
        return None
    before = len(faults)
    text_lines = decoded[0].split("\n")
    has_points = any("." in line and _NUMBERS.fullmatch(line) for line in text_lines)
    parser = _Parser(file.name, faults, "," if has_points else ".")
    for number, line in enumerate(text_lines, start=1):
        parser.line(number, line)
        if len(faults) > before + 50 or parser.sections.count("HEADER") > 1:
            break
    if len(faults) == before:
        _complete(parser, file.name, faults)
    if len(faults) > before:
        return None
    rows, notes = _measured(parser.rows)
    runs, numbers, deviations, lines = zip(*rows, strict=True)
    columns = {
        "run": [str(run) for run in runs],
        "target number": [str(number) for number in numbers],
        "position": [parser.targets[number - 1] for number in numbers],
        "deviation": list(deviations),
    }
    started = next((fact.value for fact in parser.facts if fact.key.casefold() == _DATE), None)
    return Export(columns, {}, lines, decoded[1], tuple(parser.facts), started, notes)


def _measured(rows: Sequence[Row]) -> tuple[Sequence[Row], tuple[str, ...]]:
    """Return the rows without runs whose every deviation is exactly zero, and a sentence on these.

    Programs that number each way as a run of its own fill the way back of a one-way measurement with zeros.
    """
    zero = {
        run for run in {row[0] for row in rows}
        if sum(row[0] == run for row in rows) > 2 and not any(Decimal(row[2]) for row in rows if row[0] == run)
    }  # fmt: skip
    measured = [row for row in rows if row[0] not in zero]
    if not zero or not measured:
        return rows, ()
    runs = ", ".join(map(str, sorted(zero)))
    return measured, (
        f"{len(rows) - len(measured)} rows are left out: every deviation of run {runs} is 0, which is the way back "
        "that nobody measured",
    )


def _complete(parser: _Parser, name: str, faults: Faults) -> None:
    """Refuse a file without targets or deviations, and one that has more or fewer than it says."""
    if not parser.targets or not parser.rows:
        lacking = "targets (Targets :)" if not parser.targets else "deviations (Run Target Data:)"
        faults.add(
            name, None, None, f"the file has no {lacking}; it is another format, or cut: export it again"
        )
        return
    for key, what, count in (
        ("target-count", "targets", len(parser.targets)),
        ("run-count", "runs", len({run for run, *_ in parser.rows})),
    ):
        stated = parser.counts.get(key)
        if stated is not None and stated[0] != count:
            faults.add(
                name,
                stated[1],
                key,
                f"{stated[0]} {what} are announced and {count} are there; export the file again",
            )
    _visited(parser, name, faults)


def _visited(parser: _Parser, name: str, faults: Faults) -> None:
    """Refuse targets that there are not, that a run passes a third time, and those that it lacks."""
    visits: dict[tuple[int, int], int] = {}
    for run, number, _, line in parser.rows:
        if not 1 <= number <= len(parser.targets):
            faults.add(
                name, line, "Run Target Data", f"there is no target {number}; there are {len(parser.targets)}"
            )
            continue
        visits[run, number] = visits.get((run, number), 0) + 1
        if visits[run, number] == 3:
            faults.add(
                name, line, "Run Target Data",
                f"run {run} has target {number} a third time; a run passes it once, or once each way",
            )  # fmt: skip
    for run in dict.fromkeys(run for run, *_ in parser.rows):
        missing = [number for number in range(1, len(parser.targets) + 1) if (run, number) not in visits]
        if missing and len(faults) == 0:
            shown = ", ".join(map(str, missing[:5]))
            faults.add(
                name,
                None,
                "Run Target Data",
                f"run {run} lacks target {shown}; the file is cut: export it again",
            )
    if not len(faults):
        _as_often(parser, name, visits, faults)


def _as_often(parser: _Parser, name: str, visits: Mapping[tuple[int, int], int], faults: Faults) -> None:
    """Refuse a run that passes a target less often than another run does, and one that turns back in its midst.

    The targets at the ends may be passed once where all others are passed twice: the axis turns there.
    """
    numbers = range(1, len(parser.targets) + 1)
    passes = {run: tuple(visits[run, number] for number in numbers) for run, *_ in parser.rows}
    usual = max(Counter(passes.values()).items(), key=lambda counted: (sum(counted[0]), counted[1]))[0]
    inner = usual[1:-1] or usual
    for run, counts in passes.items():
        few = [number for number, count, often in zip(numbers, counts, usual, strict=True) if count < often]
        if not few and len(set(inner)) > 1:
            few = [number for number, count in enumerate(inner, start=2) if count < max(inner)]
        if few:
            line = max(line for of_run, _, _, line in parser.rows if of_run == run)
            shown = ", ".join(map(str, few[:5])) + (", ..." if len(few) > 5 else "")
            faults.add(
                name, line, "Run Target Data",
                f"run {run} ends here and has target {shown} once, where others are passed twice: the file is cut; "
                "export it again, or leave this run out and write its Run-count",
            )  # fmt: skip
            return


EXPORT = ExportFormat(
    "laser rtl",
    "laser interferometer, text with sections; columns position, deviation, run, target number",
    read,
    suffixes=(".rtl", ".rta", ".rts"),
)
