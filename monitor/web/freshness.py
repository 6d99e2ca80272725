"""How fresh an answer is: what was asked before is answered again until something is written that may change it.

An import changes the answers about its machines and about the fleet, and none about other machines or campaigns; so a
page stays quick while somebody imports. Every other write changes everything.
"""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any

from monitor.store import held_bytes

#: Questions that read only, take milliseconds, and stand on pages that many people open.
REMEMBERED = frozenset({"campaigns", "machines", "runs", "values"})
#: Questions that may identify what nobody has identified yet.
IDENTIFYING = frozenset(
    {"compare", "explain", "identify", "report", "residuals", "statistics", "trend", "uncertainty"}
)
#: Their answers are made of identified values.
_OF_VALUES = frozenset({"fleet", "values"})
#: Answers that are held, and their bytes; the one that was not asked for longest is forgotten. The latest is held
#: whatever its size: whoever opens its page again would wait as long.
_MOST, _MOST_BYTES = 256, 256_000_000

Stamp = tuple[int, ...]


def differ_by_imports(earlier: Stamp, later: Stamp) -> bool:
    """Whether nothing but imports was written between two stamps: what they say stands, and lacks the latest."""
    return (*earlier[:1], *earlier[2:]) == (*later[:1], *later[2:])


class Freshness:
    """Counts what was written, and holds answers as long as they are true."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._all = self._imports = self._identified = 0
        self._of_machine: dict[str, int] = {}
        self._answers: OrderedDict[tuple[str, str], tuple[Stamp, Any, int]] = OrderedDict()
        self._bytes = 0

    def stamp(self, question: str, document: Mapping[str, Any]) -> Stamp:
        """Return what changes when the answer to a question may be another."""
        with self._lock:
            identified = self._identified if question in _OF_VALUES else 0
            if isinstance(document.get("campaign"), str):
                return (self._all, 0, identified, 0)
            machine = document.get("machine")
            if isinstance(machine, str):
                return (self._all, 0, identified, self._of_machine.get(machine, 0))
            return (self._all, self._imports, identified, 0)

    def wrote(self, machines: set[str] | None) -> None:
        """Note a write that concerns these machines, or everything (None)."""
        with self._lock:
            self._imports += 1
            if machines is None:
                self._all += 1
            for machine in machines or ():
                self._of_machine[machine] = self._of_machine.get(machine, 0) + 1

    def identified(self) -> None:
        """Note that values may have come that were not there."""
        with self._lock:
            self._identified += 1

    def recall(self, question: str, document: Mapping[str, Any]) -> tuple[tuple[str, str, Stamp], Any]:
        """Return the key of a question now, and its answer where it was asked before (else None)."""
        key = (question, json.dumps(document, sort_keys=True, default=str), self.stamp(question, document))
        with self._lock:
            stamp, answer, _ = self._answers.get(key[:2], ((), None, 0))
            if answer is None or stamp != key[2]:
                return key, None
            self._answers.move_to_end(key[:2])
            return key, answer

    def remember(self, key: tuple[str, str, Stamp], answer: Any) -> None:
        """Hold an answer under the key that its question had before it was asked, in place of the one before."""
        size = held_bytes(answer)
        with self._lock:
            self._bytes += size - self._answers.pop(key[:2], ((), None, 0))[2]
            self._answers[key[:2]] = (key[2], answer, size)
            while len(self._answers) > _MOST or (self._bytes > _MOST_BYTES and len(self._answers) > 1):
                self._bytes -= self._answers.popitem(last=False)[1][2]
