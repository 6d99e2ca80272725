"""What a look at all machines every week notices, and the sentence that says so."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from enum import Enum

from monitor.documents import OMITTED


class NoticeKind(Enum):
    """One parameter, or all of a machine together, which may show what none of them shows alone."""

    PARAMETER = "parameter"
    VECTOR = "vector"


@dataclass(frozen=True)
class WeeklyNotice:
    """A change that was noticed in ``week``; it probably happened between the values of ``after`` and ``since``.

    ``parameters`` is the one, or those that moved most for their scatter. ``size`` in ``unit`` is the mean since the
    change less the mean before; None for a vector.
    """

    machine: str
    week: str
    kind: NoticeKind
    parameters: tuple[str, ...]
    after: str
    since: str
    size: float | None = field(default=None, metadata=OMITTED)
    unit: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class WeeklyNotices:
    """Every notice up to a week, in the order of time.

    ``expected_false`` of them are false at most, on average, which is kept below ``false_discovery_rate`` of all (or of
    one, before the first). ``weeks`` with runs were looked at, ``series`` (parameters and vectors) in the last of them.
    """

    false_discovery_rate: float
    weeks: int
    machines: int
    series: int
    expected_false: float
    notices: tuple[WeeklyNotice, ...]

    def of_machines(self, machines: Collection[str], week: str | None = None) -> WeeklyNotices:
        """The same with the notices of some machines only, of one week or of all."""
        part = (
            notice for notice in self.notices if notice.machine in machines and week in (None, notice.week)
        )
        return replace(self, notices=tuple(part))


def weekly_sentence(notice: WeeklyNotice) -> str:
    """What is said of a notice, wherever it is printed."""
    when = f"between {notice.after} and {notice.since}"
    if notice.kind is NoticeKind.VECTOR or notice.size is None:
        return (
            f"noticed in {notice.week} under weekly looks: all parameters together changed {when}, "
            f"most of all {', '.join(notice.parameters)}"
        )
    return (
        f"noticed in {notice.week} under weekly looks: {notice.parameters[0]} changed by {notice.size:+.3g} "
        f"{notice.unit} {when}"
    )
