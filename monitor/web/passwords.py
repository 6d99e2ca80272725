"""Passwords that people think of, hashed by argon2id so that a stolen file of users says none (RFC 9106).

The parameters are those of argon2-cffi (RFC 9106, section 4, second choice: 64 MiB, three passes); the hash names them,
so that what was stored with others is still understood. Two are computed at a time: many log-ins at once must not take
the memory.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import cache
from typing import Any

from monitor.exceptions import InputError

#: NIST SP 800-63B-4, 3.1.1.2: a password that is the only factor has at least 15 characters, and no rule of signs.
SHORTEST, LONGEST = 15, 256
_AT_ONCE = threading.BoundedSemaphore(2)
#: After so many wrong passwords in a row a name waits before the next try, twice as long each time, in s.
_FREE_TRIES, _FIRST_WAIT_S, _LONGEST_WAIT_S = 5, 1.0, 300.0
_MOST_NAMES = 10_000


@cache
def _hasher() -> Any:
    try:
        # Loaded here: it is a part of the extra, and tokens do without it.
        from argon2 import PasswordHasher
    except ModuleNotFoundError as error:
        raise InputError(
            "passwords need argon2-cffi, which is not installed: pip install 'machine-health-monitor[web]'"
        ) from error
    return PasswordHasher()


def hashed(password: str) -> str:
    """Return the hash of a password with its salt and parameters. Raises InputError for one that cannot be used."""
    if not SHORTEST <= len(password) <= LONGEST:
        raise InputError(
            f"a password has {SHORTEST} to {LONGEST} characters, this one {len(password)}; some words in a row are "
            "easy to remember"
        )
    with _AT_ONCE:
        return str(_hasher().hash(password))


def check_hash(text: str) -> None:
    """Raise InputError for what is no hash of argon2id, and where the library is not installed."""
    if not text.startswith("$argon2id$"):
        raise InputError("argon2 must begin with $argon2id$; add the user again")
    _hasher()


@cache
def _nobody() -> str:
    return str(_hasher().hash("nobody has this password"))


def matches(stored: str | None, password: str) -> bool:
    """Whether a password is that of a hash; it takes as long where there is no such user (None)."""
    from argon2.exceptions import Argon2Error, InvalidHashError

    with _AT_ONCE:
        try:
            _hasher().verify(_nobody() if stored is None else stored, password[: LONGEST + 1])
        except (Argon2Error, InvalidHashError):
            return False
    return stored is not None and len(password) <= LONGEST


class Attempts:
    """Counts wrong passwords by name, so that nobody tries thousands; a right one begins anew."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._wrong: dict[str, tuple[int, float]] = {}
        self._lock = threading.Lock()

    def wait_s(self, name: str) -> float:
        """Return how long a name has to wait before the next try; 0 where it may try now."""
        with self._lock:
            count, last = self._wrong.get(name, (0, 0.0))
        if count < _FREE_TRIES:
            return 0.0
        pause = min(_FIRST_WAIT_S * 2.0 ** min(count - _FREE_TRIES, 30), _LONGEST_WAIT_S)
        return max(last + pause - self._clock(), 0.0)

    def note(self, name: str, *, right: bool) -> None:
        """Count a try."""
        with self._lock:
            count, _ = self._wrong.pop(name, (0, 0.0))
            if not right:
                self._wrong[name] = (count + 1, self._clock())
            while len(self._wrong) > _MOST_NAMES:
                del self._wrong[next(iter(self._wrong))]
