"""Serve the pages and the HTTP interface: look, compare, add what is missing, in a browser.

On this computer alone, unless users are named with their tokens and the way is encrypted. The process holds the
database: other verbs of the same account ask it, those of others wait until it is stopped.
"""

from __future__ import annotations

import getpass
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.configuration import configuration
from monitor.cli.garbage import collect_as_usual
from monitor.cli.parser import common
from monitor.exceptions import InputError

EXAMPLE = "monitor serve --port 8765"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "--host", default="127.0.0.1", metavar="ADDRESS", help="where to listen (default 127.0.0.1)"
    )
    parser.add_argument(
        "--port", type=int, default=8765, metavar="N", help="port (default 8765; 0: any free one)"
    )
    parser.add_argument(
        "--users", type=Path, metavar="FILE", help="users with their roles, tokens or passwords (TOML)"
    )
    parser.add_argument("--certificate", type=Path, metavar="FILE", help="certificate of TLS (PEM)")
    parser.add_argument("--key", type=Path, metavar="FILE", help="key of TLS (PEM)")
    parser.add_argument(
        "--behind-proxy", metavar="NAME", help="host name under which a proxy that does TLS hands requests on"
    )
    parser.add_argument("--read-only", action="store_true", help="nobody can change anything")
    parser.add_argument(
        "--add-user", metavar="NAME", help="add a user to the file of --users and print the token"
    )
    parser.add_argument(
        "--password", action="store_true",
        help="the user to add logs in with a password, which is asked for (else read from standard input), not a token",
    )  # fmt: skip
    parser.add_argument(
        "--role", default="engineer", metavar="ROLE",
        help="of the user to add: viewer, engineer (imports, models) or approver (certificates) (default engineer)",
    )  # fmt: skip


def run(options: Namespace) -> int:
    if options.add_user is not None:
        return _add_user(options)
    try:
        # Loaded here: the server is an extra, and takes half a second to load.
        from monitor.web.server import serve
        from monitor.web.settings import ServerSettings
    except ModuleNotFoundError as error:
        raise InputError(
            f"the pages need {error.name}, which is not installed: pip install 'machine-health-monitor[web]'"
        ) from error
    settings = ServerSettings(
        database=Path(options.db), host=options.host, port=options.port, users=options.users,
        certificate=options.certificate, key=options.key, proxy=options.behind_proxy, reading_only=options.read_only,
        tolerances=configuration().tolerances or {}, trusted_signers=configuration().trusted_signers,
    )  # fmt: skip
    collect_as_usual()
    serve(settings, lambda text: print(text, flush=True))
    return 0


def _add_user(options: Namespace) -> int:
    from monitor.web.users import add_user

    if options.users is None:
        raise InputError("name the file of users: --users FILE (it is made where there is none)")
    password = _password() if options.password else None
    token = add_user(options.users, options.add_user, options.role, password)
    if token is None:
        output.say(f"{options.add_user} ({options.role}) was added to {options.users} with the password")
        return 0
    output.say(
        f"{options.add_user} ({options.role}) was added to {options.users}; the token, shown this once:"
    )
    output.say(token)
    return 0


def _password() -> str:
    """Ask for a password twice; a pipe gives it in its first line. An argument could be seen by others."""
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\r\n")
    first = getpass.getpass("password: ")
    if getpass.getpass("once more: ") != first:
        raise InputError("the two are not the same; type the password again")
    return first
