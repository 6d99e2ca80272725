"""Holds what was read of a file until something is written to it, for a process that alone has the file."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any

from monitor.store.held_sizes import held_bytes

#: Answers that are held, two a machine: of some thirty machines that somebody looks at now; and their bytes. The
#: latest is held whatever its size.
MOST, MOST_BYTES = 64, 256_000_000


class Recalled:
    """Answers by key; who asks for one that is being read waits for it instead of reading it a second time."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._writes = 0
        self._entries: OrderedDict[Hashable, _Entry] = OrderedDict()

    def forget(self) -> None:
        """Forget everything, after a write."""
        with self._lock:
            self._writes += 1
            self._entries.clear()

    def answer(self, key: Hashable, read: Callable[[], Any]) -> Any:
        """Return what is held under a key, else what ``read`` returns; that is held unless somebody wrote meanwhile."""
        with self._lock:
            entry = self._entries.setdefault(key, _Entry())
            self._entries.move_to_end(key)
            while len(self._entries) > MOST:
                self._entries.popitem(last=False)
            writes = self._writes
        with entry.lock:
            if not entry.values:
                value = read()
                if writes != self._writes:
                    return value
                entry.values.append(value)
                entry.bytes = held_bytes(value)
                self._forget_oldest()
            return entry.values[0]

    def _forget_oldest(self) -> None:
        with self._lock:
            total = sum(entry.bytes for entry in self._entries.values())
            while total > MOST_BYTES and len(self._entries) > 1:
                total -= self._entries.popitem(last=False)[1].bytes


class _Entry:
    """One answer, once it is read."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.values: list[Any] = []
        self.bytes = 0
