"""Who may come in: a TOML file of users with a role each and the hash of a token or password, never these themselves.

A token has 256 random bits, so that a plain SHA-256 of it cannot be turned round by guessing; passwords, which people
think of, have a slow hash (``passwords``).
"""

from __future__ import annotations

import hashlib
import hmac
import logging
import os
import re
import secrets
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

from monitor.exceptions import InputError
from monitor.toml_text import toml_file
from monitor.web.passwords import check_hash, hashed, matches

_log = logging.getLogger("monitor.web")
_NAME = re.compile(r"[\w.@ -]{1,60}")


class Role(IntEnum):
    """What a user may do; a higher role may do all that a lower one may."""

    VIEWER = 1
    ENGINEER = 2
    APPROVER = 3

    @property
    def word(self) -> str:
        """The name as the file and the pages have it."""
        return self.name.lower()


ROLES = {role.word: role for role in Role}


@dataclass(frozen=True)
class User:
    """A user by ``name``, with what the user may do."""

    name: str
    role: Role


@dataclass(frozen=True)
class Users:
    """The users of a file by name; ``by_hash`` by the SHA-256 (hexadecimal) of their tokens, ``passwords`` hashed."""

    by_name: dict[str, User]
    by_hash: dict[str, User]
    passwords: dict[str, str] = field(default_factory=dict)

    def looking_only(self) -> Users:
        """Return the same users, each as a viewer."""
        viewers = {name: User(name, Role.VIEWER) for name in self.by_name}
        return Users(
            viewers, {digest: viewers[user.name] for digest, user in self.by_hash.items()}, self.passwords
        )

    def of_password(self, name: str, password: str) -> User | None:
        """Return the user of this name and password; it takes as long for a name that nobody has."""
        if not self.passwords:
            return None
        stored = self.passwords.get(name)
        return self.by_name[name] if matches(stored, password) else None

    def of_token(self, token: str) -> User | None:
        """Return the user whose token this is; every hash is compared, in constant time."""
        digest = _digest(token)
        match = None
        for stored, user in self.by_hash.items():
            if hmac.compare_digest(stored, digest):
                match = user
        return match


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()


def read_users(path: Path) -> Users:
    """Read a file of users. Raises InputError that names the user and the rule."""
    document = toml_file(path)
    users = Users({}, {}, {})
    entries = document.get("users", {})
    for name, entry in entries.items() if isinstance(entries, dict) else ():
        role = entry.get("role") if isinstance(entry, dict) else None
        if not isinstance(role, str) or role not in ROLES:
            raise InputError(f"{path}: the role of {name} must be one of {', '.join(ROLES)}")
        users.by_name[name] = User(name, ROLES[role])
        digest, password = entry.get("sha256"), entry.get("argon2")
        if isinstance(password, str):
            try:
                check_hash(password)
            except InputError as error:
                raise InputError(f"{path}, {name}: {error}") from error
            users.passwords[name] = password
        if digest is None and name in users.passwords:
            continue
        if not isinstance(digest, str) or re.fullmatch("[0-9a-f]{64}", digest) is None:
            raise InputError(f"{path}: sha256 of {name} must be 64 hexadecimal digits; add the user again")
        users.by_hash[digest] = users.by_name[name]
    if not users.by_name:
        raise InputError(f"{path} names no user; `monitor serve --add-user NAME --users {path}` adds one")
    return users


class UserFile:
    """The users of a file as it is now: who is taken out, or gets another role, is so from the next request on."""

    def __init__(self, path: Path, *, looking_only: bool) -> None:
        self._path = path
        self._looking_only = looking_only
        self._stamp: tuple[int, ...] = ()
        self._users = self._read(self._seen())

    @property
    def users(self) -> Users:
        """The users; nobody where the file cannot be read any more."""
        stamp = self._seen()
        if stamp != self._stamp:
            try:
                self._users = self._read(stamp)
            except InputError as error:
                self._users, self._stamp = Users({}, {}), stamp
                _log.error("nobody is let in any more: %s", error)
        return self._users

    def _seen(self) -> tuple[int, ...]:
        try:
            status = os.stat(self._path)
        except OSError:
            return ()
        return status.st_mtime_ns, status.st_size, status.st_ino

    def _read(self, stamp: tuple[int, ...]) -> Users:
        users = read_users(self._path)
        self._stamp = stamp
        return users.looking_only() if self._looking_only else users


def add_user(path: Path, name: str, role: str, password: str | None = None) -> str | None:
    """Add a user to the file (made where there is none, for its owner alone) and return the token, shown this once.

    With a ``password`` there is no token, and None is returned.

    Raises InputError for a name that is there already or cannot be one, and for a role that there is not.
    """
    if _NAME.fullmatch(name) is None:
        raise InputError(f"--add-user '{name}': letters, digits, spaces and . @ _ - make a name, 60 at most")
    if role not in ROLES:
        raise InputError(f"--role {role}: there are {', '.join(ROLES)}")
    if path.exists() and name in read_users(path).by_name:
        raise InputError(f"{path} has a user {name} already; take the entry out first")
    token = secrets.token_urlsafe(32) if password is None else None
    proof = f'sha256 = "{_digest(token)}"' if token is not None else f'argon2 = "{hashed(password or "")}"'
    entry = f'[users."{name}"]\nrole = "{role}"\n{proof}\n\n'
    try:
        with os.fdopen(
            os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600), "a", encoding="utf-8"
        ) as file:
            file.write(entry)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from error
    return token
