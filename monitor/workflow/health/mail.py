"""Sends a report by e-mail through an SMTP server that a configuration file names.

``examples/mail.toml`` shows every key. The password stands in a file of its own, never in the configuration, and
is sent over an encrypted connection only.
"""

from __future__ import annotations

import smtplib
import ssl
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from email.message import EmailMessage
from email.utils import formatdate, make_msgid
from pathlib import Path
from typing import Any

from monitor.bounded import LARGEST_SETTINGS, read_bounded
from monitor.exceptions import InputError
from monitor.reporting.health.letter import not_attached, report_lines, report_subject
from monitor.toml_text import toml_file
from monitor.workflow.health.request import ReportAnswer

#: Port that goes with each kind of security (RFC 8314 section 3.3; RFC 6409; RFC 5321 section 4.5.4.2).
PORTS = {"tls": 465, "starttls": 587, "none": 25}
#: Servers refuse more; a larger file is named in the text instead of attached. Base64 adds a third to it.
LARGEST_BYTES = 15_000_000
TIMEOUT_S = 30.0
_KEYS = {
    "server": str,
    "port": int,
    "security": str,
    "user": str,
    "password_file": str,
    "ca_file": str,
    "from": str,
    "to": list,
    "only_on_alarm": bool,
}
#: The section of the configuration file as TOML has it.
Table = Mapping[str, Any]
_LOOPBACK = ("localhost", "127.0.0.1", "::1")


@dataclass(frozen=True)
class MailSettings:
    """Where and how to send; ``security`` is tls, starttls or none."""

    server: str
    port: int
    security: str
    user: str | None
    password_file: Path | None
    ca_file: Path | None
    sender: str
    recipients: tuple[str, ...]
    only_on_alarm: bool


def read_mail_settings(path: Path) -> MailSettings:
    """The section ``[mail]`` of a TOML file. Raises InputError naming every key that is wrong or missing."""
    table = toml_file(path).get("mail")
    if not isinstance(table, dict):
        raise InputError(f"{path} has no section [mail]")
    faults = _faults(table)
    if faults:
        raise InputError("\n  ".join([f"{path} was refused:", *map(str, faults)]))
    security = table.get("security", "starttls")
    return MailSettings(
        server=table["server"],
        port=table.get("port", PORTS[security]),
        security=security,
        user=table.get("user"),
        password_file=_file_beside(path, table, "password_file"),
        ca_file=_file_beside(path, table, "ca_file"),
        sender=table["from"],
        recipients=tuple(table["to"]),
        only_on_alarm=table.get("only_on_alarm", False),
    )


def _file_beside(path: Path, table: Table, key: str) -> Path | None:
    """A file named in the configuration, which has to be there before the work and not only after it."""
    if key not in table:
        return None
    file = path.parent / str(table[key])
    try:
        read_bounded(file, LARGEST_SETTINGS)
    except OSError as error:
        raise InputError(f"{key} of {path}: {file} cannot be read: {error.strerror or error}") from error
    return file


def _faults(table: Table) -> list[InputError]:
    """Everything that is wrong or missing, each in words."""
    faults = [
        InputError(f"[mail] has no key {key}; it has {', '.join(_KEYS)}") for key in table if key not in _KEYS
    ]
    faults += [InputError(f"[mail] lacks {key}") for key in ("server", "from", "to") if key not in table]
    for key, kind in _KEYS.items():
        if key in table and (not isinstance(table[key], kind) or (kind is int and table[key] is True)):
            faults.append(InputError(f"{key} must be a {kind.__name__}, but is {table[key]!r}"))
    return [*faults, *_faults_of_connection(table), *_faults_of_lines(table), *_faults_of_password(table)]


def _faults_of_connection(table: Table) -> list[InputError]:
    faults = []
    if str(table.get("security", "starttls")) not in PORTS:
        faults.append(InputError(f"security is one of {', '.join(PORTS)}, not {table['security']!r}"))
    if isinstance(table.get("port"), int) and not 1 <= table["port"] <= 65535:
        faults.append(InputError(f"port is a number from 1 to 65535, not {table['port']}"))
    return faults


def _faults_of_lines(table: Table) -> list[InputError]:
    """What is wrong with the texts that stand in the head of a message."""
    addresses = table.get("to")
    lines = [(key, table.get(key)) for key in ("server", "from", "user")]
    lines += [("to", address) for address in addresses] if isinstance(addresses, list) else []
    # A line feed in an address would begin another line of the message's head.
    faults = [
        InputError(f"{key} is one line of visible letters, not {line!r}")
        for key, line in lines
        if isinstance(line, str) and not (line.strip() and line.isprintable())
    ]
    if isinstance(addresses, list) and not (
        addresses and all(isinstance(address, str) and "@" in address for address in addresses)
    ):
        faults.append(InputError('to is a list of addresses, for example ["maintenance@example.org"]'))
    return faults


def _faults_of_password(table: Table) -> list[InputError]:
    faults = []
    if ("user" in table) != ("password_file" in table):
        faults.append(InputError("user and password_file go together"))
    if "user" in table and table.get("security") == "none" and table.get("server") not in _LOOPBACK:
        faults.append(InputError("a password is not sent unencrypted: set security to tls or starttls"))
    return faults


def message_of(settings: MailSettings, report: ReportAnswer) -> EmailMessage:
    """The e-mail of a report's document: the fleet table as text, the PDF files attached."""
    subject = report_subject(report.week, len(report.alarms), report.measured)
    lines = report_lines(report.week, report.from_, report.to, report.machines, report.message)
    return composed(settings, subject, lines, report.files)


def composed(
    settings: MailSettings, subject: str, lines: Sequence[str], files: Sequence[str]
) -> EmailMessage:
    """An e-mail of lines of text with the PDF files among ``files`` attached, as far as servers take them."""
    message = EmailMessage()
    lines = list(lines)
    message["Subject"] = subject
    message["From"] = settings.sender
    message["To"] = ", ".join(settings.recipients)
    message["Date"] = formatdate()
    message["Message-ID"] = make_msgid(domain=settings.sender.rpartition("@")[2].rstrip(">") or None)
    room = LARGEST_BYTES
    attached: list[tuple[str, bytes]] = []
    for file in (Path(name) for name in files if name.endswith(".pdf")):
        size = file.stat().st_size
        if size <= room:
            room -= size
            attached.append((file.name, file.read_bytes()))
        else:
            lines.append(not_attached(file))
    message.set_content("\n".join(lines) + "\n")
    for name, content in attached:
        message.add_attachment(content, maintype="application", subtype="pdf", filename=name)
    return message


def send(settings: MailSettings, message: EmailMessage) -> Sequence[str]:
    """Hand a message to the server; the addresses that it took. Raises InputError saying what the server said."""
    address = f"{settings.server}:{settings.port}"
    try:
        context = ssl.create_default_context(cafile=settings.ca_file)
        if settings.security == "tls":
            server: smtplib.SMTP = smtplib.SMTP_SSL(
                settings.server, settings.port, timeout=TIMEOUT_S, context=context
            )
        else:
            server = smtplib.SMTP(settings.server, settings.port, timeout=TIMEOUT_S)
        with server:
            if settings.security == "starttls":
                server.starttls(context=context)
            if settings.user is not None and settings.password_file is not None:
                server.login(
                    settings.user, read_bounded(settings.password_file, LARGEST_SETTINGS).decode().strip()
                )
            refused = server.send_message(message)
    except smtplib.SMTPResponseException as error:
        reply = (
            error.smtp_error.decode(errors="replace")
            if isinstance(error.smtp_error, bytes)
            else error.smtp_error
        )
        raise InputError(
            f"the mail server {address} refused the message: {error.smtp_code} {reply}"
        ) from error
    except smtplib.SMTPRecipientsRefused as error:
        raise InputError(f"the mail server {address} took none of {', '.join(error.recipients)}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"the password file {settings.password_file} is not UTF-8; save it so") from error
    except (smtplib.SMTPException, OSError, UnicodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"the mail server {address} could not be used: {why}") from error
    if refused:
        raise InputError(
            f"the mail server {address} refused {', '.join(refused)}; the others have the message"
        )
    return settings.recipients


def mail_report(path: Path, report: ReportAnswer) -> tuple[str, ...]:
    """Send a report as a configuration file says; the addresses it went to (none where only alarms are sent)."""
    settings = read_mail_settings(path)
    if settings.only_on_alarm and not report.alarms:
        return ()
    return tuple(send(settings, message_of(settings, report)))
