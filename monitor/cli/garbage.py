"""How often Python looks for objects that only name each other: rarely in a verb, as usual in what runs for weeks."""

from __future__ import annotations

import atexit
import gc

#: Objects made before Python looks for cycles among them (700). While modules are loaded it finds none, and looking
#: takes a tenth of the time of a verb that reads; arrays are freed without it.
_OF_A_VERB = 100_000
#: Python's own, which its versions change. With that of a verb the oldest objects are looked at once in ten million: a
#: server kept every answer that was part of a cycle, 1.9 GB after 20 minutes.
_USUAL = gc.get_threshold()


def collect_rarely() -> None:
    """Look for cycles as rarely as a verb of a second needs it, and not at all when the process ends.

    Python would look through everything once more to take it apart, a sixth of the time of a verb that reads; the
    system takes the memory back at once. Registered before anything else is loaded, so it is the last to be called:
    what others close at the end is closed.
    """
    gc.set_threshold(_OF_A_VERB, *_USUAL[1:])
    atexit.register(gc.freeze)


def collect_as_usual() -> None:
    """Look for cycles as often as Python does, for a process that stays: its modules are loaded."""
    gc.set_threshold(*_USUAL)
