"""What the forms that were sent last led to, shown by an address of its own.

A browser does not show the answer to a form again when somebody goes back to it, or only by sending the form once more:
Chromium says ERR_CACHE_MISS. So a form is answered with the address of its outcome (303), which can be reloaded, left
and opened again.
"""

from __future__ import annotations

import secrets
from collections import OrderedDict
from threading import Lock
from typing import Any

#: Outcomes that are held, of all users; the oldest is forgotten. A long form has some 20 kB of texts.
MOST = 200
#: Of one user, so that nobody pushes out what others go back to.
MOST_OF_USER = 40


class Outcomes:
    """Holds what forms led to until the server ends."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._held: OrderedDict[str, tuple[str, Any]] = OrderedDict()

    def hold(self, user_name: str, outcome: Any) -> str:
        """Hold what a form of a user led to; return its key, which nobody guesses."""
        key = secrets.token_urlsafe(12)
        with self._lock:
            of_user = [other for other, (name, _) in self._held.items() if name == user_name]
            for other in of_user[: max(len(of_user) - MOST_OF_USER + 1, 0)]:
                del self._held[other]
            self._held[key] = (user_name, outcome)
            while len(self._held) > MOST:
                self._held.popitem(last=False)
        return key

    def outcome_of(self, user_name: str, key: str) -> Any:
        """Return what a form led to; None where it is gone or was somebody else's."""
        with self._lock:
            name, outcome = self._held.get(key, ("", None))
        return outcome if name == user_name else None
