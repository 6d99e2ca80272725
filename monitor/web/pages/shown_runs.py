"""Which runs of a machine its page shows: of a period, a campaign, a method, warm or warming up; all of the page is of
these, the numbers below the chart, the table of all parameters and the file of values too."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, time
from typing import TYPE_CHECKING, Any

from monitor.exceptions import InputError
from monitor.web.days import as_iso

if TYPE_CHECKING:
    from monitor.workflow.history.values import ValuesAnswer

#: Which runs are shown: all, those of a warm machine, those of one that warms up.
WARMTHS = ("", "warm", "warming up")


@dataclass(frozen=True)
class ShownRuns:
    """What chooses the runs; empty: all of them. Days are as ISO 8601 writes them, ``until`` is not shown itself."""

    since: str = ""
    until: str = ""
    campaign: str = ""
    method: str = ""
    warm_up: str = ""

    @classmethod
    def typed(cls, since: str, until: str, campaign: str, method: str, warm_up: str) -> ShownRuns:
        """Return the choice of an address. Raises InputError for what is no day, and no choice of runs."""
        if warm_up not in WARMTHS:
            raise InputError(f"runs are shown {', '.join(word for word in WARMTHS if word)}, not '{warm_up}'")
        return cls(**as_iso(since=since, until=until), campaign=campaign, method=method, warm_up=warm_up)

    @property
    def in_address(self) -> dict[str, str | None]:
        """The choice as an address has it, None for what is not chosen."""
        chosen_by = {
            "since": self.since, "until": self.until, "campaign": self.campaign, "method": self.method,
            "warm_up": self.warm_up,
        }  # fmt: skip
        return {name: text or None for name, text in chosen_by.items()}

    def trend_document(self, machine: str) -> dict[str, Any]:
        """The question for the trend of these runs; of all, that of the machine alone, whose answer is stored."""
        document: dict[str, Any] = {"machine": machine}
        document |= {name: at.isoformat() for name, at in self._ends().items()}
        if self.campaign:
            document["campaigns"] = [self.campaign]
        if self.method:
            document["method"] = self.method
        if self.warm_up:
            document["warm_up"] = self.warm_up == WARMTHS[2]
        return document

    def within(self, values: ValuesAnswer) -> ValuesAnswer:
        """Return the values of the runs from the beginning of a day until the beginning of another."""
        ends = self._ends()
        since, until = ends.get("since"), ends.get("until")
        return _of_rows(
            values,
            [
                row
                for row, at in enumerate(values.started_at)
                if (since is None or at >= since) and (until is None or at < until)
            ],
        )

    def of(self, values: ValuesAnswer) -> ValuesAnswer:
        """Return the values of the chosen runs, with the parameters and conditions that any of them has."""
        values = self.within(values)
        return _of_rows(
            values,
            [
                row
                for row, warming in enumerate(values.warm_up)
                if self.campaign in ("", values.campaign[row])
                and self.method in ("", values.method[row])
                and self.warm_up in ("", WARMTHS[2 if warming else 1])
            ],
        )

    def _ends(self) -> dict[str, datetime]:
        """The ends of the period that are named."""
        days = {"since": self.since, "until": self.until}
        return {
            name: datetime.combine(date.fromisoformat(day), time(), UTC) for name, day in days.items() if day
        }


def _of_rows(values: ValuesAnswer, rows: list[int]) -> ValuesAnswer:
    """Some of the runs, with the parameters and conditions that any of them has."""
    if len(rows) == len(values.run):
        return values

    def taken(column: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(column[row] for row in rows)

    return replace(
        values,
        started_at=taken(values.started_at), campaign=taken(values.campaign), method=taken(values.method),
        run=taken(values.run), day=taken(values.day), warm_up=taken(values.warm_up),
        parameters={
            name: replace(series, values=taken(series.values), u=taken(series.u))
            for name, series in values.parameters.items()
            if any(value is not None for value in taken(series.values))
        },
        conditions={
            name: taken(column)
            for name, column in values.conditions.items()
            if any(value is not None for value in taken(column))
        },
    )  # fmt: skip
