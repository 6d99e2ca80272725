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
