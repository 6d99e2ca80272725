"""Who is asking: log-ins of browsers in memory, tokens of programs, and the proof that a form is one of ours."""

from __future__ import annotations

import hmac
import secrets
import time
from dataclasses import dataclass

from monitor.web.users import User, Users

COOKIE = "monitor_session"
#: A log-in ends after a working day without a request.
LIFETIME_S = 12 * 3600.0
#: More log-ins than this are not held: the one that waited longest is forgotten.
MOST = 10_000


@dataclass
class _Entry:
    user: User
    last_seen: float


class Sessions:
    """Log-ins by a random key that only the browser's cookie has.

    With ``users`` None (loopback alone) everybody is ``host_user``, with a key all the same: forms need a proof.
    """

    def __init__(self, users: Users | None, host_user: User) -> None:
        self.users = users
        self.host_user = host_user
        self._secret = secrets.token_bytes(32)
        self._entries: dict[str, _Entry] = {}

    def begin(self, token: str | None = None) -> str | None:
        """Log in and return the key of the new session; None for a token that nobody has."""
        user = self.host_user if self.users is None else self.users.of_token(token or "")
        if user is None:
            return None
        moment = time.monotonic()
        self._forget(moment)
        key = secrets.token_urlsafe(32)
        self._entries[key] = _Entry(user, moment)
        return key

    def user_of(self, key: str | None) -> User | None:
        """Return who a session belongs to; None where it ended or never was."""
        entry = None if key is None else self._entries.get(key)
        moment = time.monotonic()
        if entry is None or moment - entry.last_seen > LIFETIME_S:
            return None
        entry.last_seen = moment
        return entry.user

    def end(self, key: str | None) -> None:
        """Log out."""
        self._entries.pop(key or "", None)

    def proof(self, key: str) -> str:
        """Return what a form of this session carries (CSRF token): another site can send a form, but not know it."""
        return hmac.new(self._secret, key.encode(), "sha256").hexdigest()

    def is_proof(self, key: str, proof: str) -> bool:
        """Whether a form carries the proof of its session."""
        return hmac.compare_digest(self.proof(key).encode(), proof.encode("utf-8", "replace"))

    def _forget(self, moment: float) -> None:
        for key in [key for key, entry in self._entries.items() if moment - entry.last_seen > LIFETIME_S]:
            del self._entries[key]
        while len(self._entries) >= MOST:
            del self._entries[min(self._entries, key=lambda key: self._entries[key].last_seen)]
