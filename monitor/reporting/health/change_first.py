"""What changed on a machine in the week, with which its advice begins: what a crash did comes before an adjustment."""

from __future__ import annotations

from monitor.documents import Said
from monitor.reporting.health.news import EventNoted, SteppedAtEvent
from monitor.reporting.health.records import ChangeKind, MachineHealth, State

#: Changes that are named; of more, their number.
_NAMED = 2
#: The kind of event that asks for a look at the machine, whatever its parameters show.
CRASH = "crash"


def change_first(health: MachineHealth, action: str) -> str:
    """Return an ``action`` begun with what changed in the week; alone where nothing did, or where it is of that."""
    if health.state is State.CHANGED:
        return action
    detected = [change.now for change in health.changes if change.counts]
    steps = [_at_event(what) for what in _of_week(health, ChangeKind.EVENT_STEP)]
    noted = [what for what in _of_week(health, ChangeKind.EVENT) if isinstance(what, EventNoted)]
    crashes = [str(what) for what in noted if what.kind == CRASH]
    changed = [*map(str, detected), *steps] or crashes
    if not changed:
        return action
    more = len(changed) - _NAMED
    named = "; ".join(changed[:_NAMED]) + (f"; and {more} more" if more > 0 else "")
    look = "look at what that did to the machine"
    if detected and not noted:
        look = "find out what was done or happened then and record it as an event"
    return f"{named}: {look}, then {action}"


def _of_week(health: MachineHealth, kind: ChangeKind) -> list[Said]:
    """What changed in the week, of a kind."""
    return [change.what for change in health.changes if change.this_week and change.kind is kind]


def _at_event(what: Said) -> str:
    """A step at an event; without the reasons where it is not decided, which stand on the machine's page."""
    if not isinstance(what, SteppedAtEvent) or what.undecided is None:
        return str(what)
    return f"{what.brief} at the event '{what.event}'"
