"""Who may come in: a TOML file of users with a role each and the hash of a token, never the token itself.

A token has 256 random bits, so that a plain SHA-256 of it cannot be turned round by guessing; a slow hash (argon2) is
for passwords that people think of, and there are none here.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import secrets
import tomllib
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from monitor.exceptions import InputError

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
    """The users of a file by the SHA-256 (hexadecimal) of their tokens."""

    by_hash: dict[str, User]

    def looking_only(self) -> Users:
        """Return the same users, each as a viewer."""
        return Users({digest: User(user.name, Role.VIEWER) for digest, user in self.by_hash.items()})

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
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path} cannot be read as TOML: {error}") from error
    users: dict[str, User] = {}
    for name, entry in document.get("users", {}).items():
        role, digest = (entry.get("role"), entry.get("sha256")) if isinstance(entry, dict) else (None, None)
        if role not in ROLES:
            raise InputError(f"{path}: the role of {name} must be one of {', '.join(ROLES)}")
        if not isinstance(digest, str) or re.fullmatch("[0-9a-f]{64}", digest) is None:
            raise InputError(f"{path}: sha256 of {name} must be 64 hexadecimal digits; add the user again")
        users[digest] = User(name, ROLES[role])
    if not users:
        raise InputError(f"{path} names no user; `monitor serve --add-user NAME --users {path}` adds one")
    return Users(users)


def add_user(path: Path, name: str, role: str) -> str:
    """Add a user to the file (made where there is none, for its owner alone) and return the token, shown this once.

    Raises InputError for a name that is there already or cannot be one, and for a role that there is not.
    """
    if _NAME.fullmatch(name) is None:
        raise InputError(f"--add-user '{name}': letters, digits, spaces and . @ _ - make a name, 60 at most")
    if role not in ROLES:
        raise InputError(f"--role {role}: there are {', '.join(ROLES)}")
    if path.exists() and name in {user.name for user in read_users(path).by_hash.values()}:
        raise InputError(f"{path} has a user {name} already; take the entry out first")
    token = secrets.token_urlsafe(32)
    entry = f'[users."{name}"]\nrole = "{role}"\nsha256 = "{_digest(token)}"\n\n'
    try:
        with os.fdopen(
            os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600), "a", encoding="utf-8"
        ) as file:
            file.write(entry)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from error
    return token
