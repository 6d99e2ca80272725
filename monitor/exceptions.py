"""Errors that a user can act on; each message is a plain sentence that says what would be right."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """Return a hint ("did you mean 'x_mm'? ") where a name that exists is close, else nothing."""
    close = closest(name, names)
    return "" if close is None else f"did you mean '{close}'? "


def closest(name: str, names: Iterable[str]) -> str | None:
    """Return the one of ``names`` that is nearest to a name, None where none is close; case does not count."""
    # Loaded here, on the way to a refusal: every start of the command waits for this file.
    import difflib

    by_folded = {candidate.casefold(): candidate for candidate in names}
    close = difflib.get_close_matches(name[:100].casefold(), list(by_folded), n=1, cutoff=0.7)
    return by_folded[close[0]] if close else None


class MonitorError(Exception):
    """Base of every error that the product raises on purpose."""

    def __str__(self) -> str:
        """Return the message, half characters of what it quotes escaped: it can be printed and sent."""
        return super().__str__().encode("utf-8", "backslashreplace").decode("utf-8")


class InputError(MonitorError):
    """What the user gave is wrong; the message says what would be right (exit status 2)."""


class TopologyError(InputError):
    """A topology string that cannot be parsed."""


class EffectError(InputError):
    """An effect that the language, the machine or the recorded columns do not have."""


class NotFoundError(InputError):
    """A name that is not in the database; the message lists what is there."""


class DataError(InputError):
    """Readings, arrays or groups from which the requested result cannot be computed."""


class MistakenAxesError(DataError):
    """Readings that no machine of the file fits, with the unit, the sign or the exchanged columns of axes that explain
    them: nothing else is to be looked for."""


class TooManyRowsError(DataError):
    """Rows that need more memory at once than there is: no mistake of the readings is to be looked for."""


class TooFewReadingsError(DataError):
    """Fewer readings than unknowns, or as many: any mistake of the readings would fit them, and none is looked for.

    ``by_run`` are the readings of each run that has no more, where the campaign without these has more;
    ``undetermined`` says of those that have more how many unknowns they leave open that other runs determine.
    """

    def __init__(
        self,
        message: str,
        by_run: Mapping[int, int] | None = None,
        undetermined: Mapping[int, int] | None = None,
    ) -> None:
        super().__init__(message)
        self.by_run, self.undetermined = dict(by_run or {}), dict(undetermined or {})


class NotConvergedError(DataError):
    """An adjustment that found no minimum: the readings contradict the file that describes the machine."""


class StoreError(InputError):
    """A database that cannot be opened, is newer than the software, or was altered."""


class TakenNumberError(InputError):
    """The number of a certificate that another one has by now."""


class UnfinishedLogError(StoreError):
    """A log beside the database that only somebody who may write can bring into it."""


class BusyError(StoreError):
    """The database is in use by another process, for longer than one would wait."""


@dataclass(frozen=True)
class Fault:
    """One fault of an input file.

    ``line`` counts from 1 (the header is line 1); ``column`` is the column's or key's name; ``sheet`` is that of a
    workbook with several tables. Each may be None where the fault has none.
    """

    file: str
    line: int | None
    column: str | None
    message: str
    sheet: str | None = None

    def __str__(self) -> str:
        text = self.file
        if self.sheet is not None:
            text += f", sheet '{self.sheet}'"
        if self.line is not None:
            text += f", line {self.line}"
        if self.column is not None:
            text += f", column {self.column}"
        return f"{text}: {self.message}"


class CampaignError(InputError):
    """A campaign folder that was refused as a whole; ``faults`` holds everything that is wrong with it."""

    SHOWN_IN_FULL = 20
    #: More faults of a column whose messages differ in quoted texts and numbers alone are listed once, with how many.
    #: So is any number of one fault in tables of a list (``artefact.balls[1].id``, ``artefact.balls[2].id``).
    ALIKE_IN_FULL = 5
    _PLACE_IN_LIST = re.compile(r"\[[0-9]+\]")
    _OWN_WORDS = re.compile(r"'[^']*'|\"[^\"]*\"|[-+]?[0-9][0-9.,]*")

    def __init__(self, folder: str, faults: Sequence[Fault]) -> None:
        self.folder = folder
        self.faults = tuple(dict.fromkeys(faults))
        count = len(self.faults)
        lines = [f"{folder} was refused, nothing of it was kept: {count} fault{'s' if count != 1 else ''}."]
        alike: dict[tuple[str, str | None, str | None, str], list[Fault]] = {}
        for fault in self.faults:
            kind = self._OWN_WORDS.sub("", fault.message)
            column = fault.column and self._PLACE_IN_LIST.sub("", fault.column)
            alike.setdefault((fault.file, fault.sheet, column, kind), []).append(fault)
        groups: list[list[Fault]] = []
        for group in alike.values():
            groups += [group] if self._are_one(group) else [[fault] for fault in group]
        positions = {fault: position for position, fault in enumerate(self.faults)}
        shown = sorted(groups, key=lambda group: positions[group[0]])[: self.SHOWN_IN_FULL]
        for first, *more in shown:
            last = ""
            if more:
                end = "" if more[-1].line is None else f", to line {more[-1].line}"
                last = f" (and {len(more)} more like it{end})"
            lines.append(f"  {first}{last}")
        remaining = count - sum(len(group) for group in shown)
        if remaining:
            lines.append(f"  ... and {remaining} more.")
        super().__init__("\n".join(lines))

    def _are_one(self, alike: Sequence[Fault]) -> bool:
        """Whether alike faults are listed once."""
        in_a_list = len({fault.column for fault in alike}) == len(alike)
        return len(alike) > self.ALIKE_IN_FULL or (in_a_list and len({fault.message for fault in alike}) == 1)


class RefusedResultError(DataError):
    """A result that refuses itself: it was computed, but must not be used; the message says why."""
