"""What a look at all machines every week notices, and the sentence that says so."""

from __future__ import annotations

from dataclasses import dataclass, field
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
