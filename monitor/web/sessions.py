"""Who is asking: log-ins of browsers in memory, tokens of programs, and the proof that a form is one of ours."""

from __future__ import annotations

import hmac
import secrets
import time
from dataclasses import dataclass

from monitor.web.passwords import Attempts
from monitor.web.users import User, UserFile, Users

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

    def __init__(self, users: UserFile | None, host_user: User) -> None:
        self._file = users
        self.host_user = host_user
        self.attempts = Attempts()
        self._secret = secrets.token_bytes(32)
        #: What lets the account of the server in: only its note beside the database says it.
        self.owner_secret = secrets.token_urlsafe(32)
        self._entries: dict[str, _Entry] = {}

    @property
    def users(self) -> Users | None:
        """The users as their file has them now; None where nobody logs in."""
        return None if self._file is None else self._file.users

    def begin(self, token: str | None = None, name: str = "") -> str | None:
        """Log in and return the key of the new session; None for a token, or name and password, that nobody has."""
        users = self.users
        if users is None:
            user: User | None = self.host_user
        elif name:
            user = users.of_password(name, token or "")
            self.attempts.note(name, right=user is not None)
        else:
            user = users.of_token(token or "")
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
        users = self.users
        if users is not None and users.by_name.get(entry.user.name) != entry.user:
            return None  # taken out of the file, or another role: log in again
        entry.last_seen = moment
        return entry.user

    def of_bearer(self, token: str) -> User | None:
        """Return whom a program's token belongs to: the account of the server, or a user."""
        if hmac.compare_digest(self.owner_secret.encode(), token.encode("utf-8", "surrogatepass")):
            return self.host_user
        users = self.users
        return None if users is None else users.of_token(token)

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
