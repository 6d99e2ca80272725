"""Words for a cause that cannot be told from the instruments that measured, as ``lacks``."""

from __future__ import annotations

from dataclasses import dataclass

#: So many instruments with their values are named.
NAMED = 4


@dataclass(frozen=True)
class MeasuredAt:
    """What measured, in words, with the least and the greatest value that the cause had in its runs."""

    by: str
    least: float
    greatest: float

    def in_words(self, unit: str) -> str:
        """The instrument and its values."""
        least, greatest = f"{self.least:.3g}", f"{self.greatest:.3g}"
        values = f"at {least}" if least == greatest else f"from {least} to {greatest}"
        return f"by {self.by} {values} {unit}".rstrip()


@dataclass(frozen=True)
class Confounding:
    """A cause is not told from what instruments are off by: each ``measured`` at its own values (in ``unit``), or in so
    few campaigns that what is left beside them says nothing; ``needed`` campaigns more would do."""

    measured: tuple[MeasuredAt, ...]
    unit: str
    needed: int

    def __str__(self) -> str:
        """The sentence, without its subject."""
        each = ", ".join(group.in_words(self.unit) for group in self.measured[:NAMED])
        others = len(self.measured) - NAMED
        each += f" and {others} more" if others > 0 else ""
        widest = max(self.measured, key=lambda group: group.greatest - group.least)
        low, high = (
            min(group.least for group in self.measured), max(group.greatest for group in self.measured),
        )  # fmt: skip
        campaigns = "campaign" if self.needed == 1 else "campaigns"
        return (
            f"the data cannot decide: measured {each}, which may be off by as much; {self.needed} {campaigns} more by "
            f"{widest.by} alone, near {low:.3g} and {high:.3g} {self.unit}".rstrip()
            + ", would decide"
        )


def whether_with_condition(channel: str, why_not: object) -> str:
    """Return that it is not decided whether something goes with a recorded condition."""
    return f"whether it goes with {channel}: {why_not}"


def whether_with_cycle(cycle: str, why_not: object) -> str:
    """Return that it is not decided whether something goes with the hour of the day or the season."""
    return f"whether it goes with the {'season' if cycle == 'year' else f'hour of the {cycle}'}: {why_not}"


def charted(measured_by: str | None, several: bool | None) -> str:
    """Return whose points charts are of, behind their number; nothing where all were measured by the same."""
    if measured_by is not None:
        return f", those by {measured_by} alone"
    return ", by several instruments, each of which may be off by its own amount" if several else ""
