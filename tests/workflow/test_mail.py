"""The report by e-mail: a real SMTP server on loopback takes it; what servers refuse is said in words."""

from __future__ import annotations

import asyncio
import base64
import email
import email.policy
import re
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from email.message import EmailMessage
from pathlib import Path
from typing import Any

import pytest

from monitor.exceptions import InputError
from monitor.workflow.mail import LARGEST_BYTES, mail_report, message_of, read_mail_settings

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@dataclass
class Inbox:
    """A small SMTP server (RFC 5321, AUTH PLAIN of RFC 4954) and what it took; addresses with 'no' are refused."""

    port: int = 0
    messages: list[bytes] = field(default_factory=list)
    recipients: list[str] = field(default_factory=list)
    logins: list[tuple[str, str]] = field(default_factory=list)

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async def say(text: str) -> None:
            writer.write(text.encode() + b"\r\n")
            await writer.drain()

        await say("220 loopback")
        while line := (await reader.readline()).decode().strip():
            verb = line.upper()
            if verb.startswith("EHLO"):
                await say("250-loopback\r\n250 AUTH PLAIN")
            elif verb.startswith("AUTH PLAIN"):
                _, user, password = base64.b64decode(line.split()[2]).decode().split("\0")
                self.logins.append((user, password))
                await say("235 good" if password == "secret" else "535 wrong password")
            elif verb.startswith("RCPT"):
                address = re.findall("<(.*?)>", line)[0]
                if address.startswith("no"):
                    await say("550 nobody of that name")
                else:
                    self.recipients.append(address)
                    await say("250 ok")
            elif verb == "DATA":
                await say("354 go on")
                lines = []
                while (row := await reader.readline()) != b".\r\n":
                    lines.append(row.removeprefix(b".") if row.startswith(b"..") else row)
                self.messages.append(b"".join(lines))
                await say("250 taken")
            elif verb == "QUIT":
                await say("221 bye")
                break
            else:
                await say("250 ok")
        writer.close()


@pytest.fixture
def inbox() -> Iterator[Inbox]:
    made = Inbox()
    ready, loop = threading.Event(), asyncio.new_event_loop()

    async def run() -> None:
        server = await asyncio.start_server(made.serve, "127.0.0.1", 0)
        made.port = server.sockets[0].getsockname()[1]
        ready.set()
        async with server:
            await stop.wait()

    stop = asyncio.Event()
    thread = threading.Thread(target=lambda: loop.run_until_complete(run()))
    thread.start()
    assert ready.wait(10)
    yield made
    loop.call_soon_threadsafe(stop.set)
    thread.join(10)
    loop.close()


@pytest.fixture
def document(tmp_path: Path) -> Callable[..., dict[str, Any]]:
    def make(alarms: list[str], content: bytes = b"%PDF-1.7 page") -> dict[str, Any]:
        pdf = tmp_path / "health-2026-W10.pdf"
        pdf.write_bytes(content)
        row = {
            "machine": "HU40-T", "state": "changed", "changed": "EB0C stepped by +15 ± 1 µrad",
            "probability_out": 0.12, "next_check": "by 2026-03-20",
        }  # fmt: skip
        return {
            "week": "2026-W10", "from": "2026-03-02", "to": "2026-03-08", "machines": [row], "alarms": alarms,
            "measured": 1,
            "message": "", "files": [str(tmp_path / "health-2026-W10.html"), str(pdf)],
        }  # fmt: skip

    return make


def settings(folder: Path, port: int, **more: str) -> Path:
    path = folder / "mail.toml"
    keys = {
        "server": '"127.0.0.1"', "port": str(port), "security": '"none"', "from": '"monitor@example.org"',
        "to": '["one@example.org", "two@example.org"]', **more,
    }  # fmt: skip
    path.write_text("[mail]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items()))
    return path


def received(inbox: Inbox) -> EmailMessage:
    (raw,) = inbox.messages
    found = email.message_from_bytes(raw, policy=email.policy.default)
    assert isinstance(found, EmailMessage)
    return found


def test_rfc5321_the_server_takes_text_and_attachment_unchanged(
    inbox: Inbox, document: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "password").write_text("secret\n")
    path = settings(tmp_path, inbox.port, user='"monitor"', password_file='"password"')
    content = bytes(range(256)) * 40
    sent = mail_report(path, document(["HU40-T"], content))
    assert sent == inbox.recipients == ["one@example.org", "two@example.org"]
    assert inbox.logins == [("monitor", "secret")]
    message = received(inbox)
    assert message["Subject"] == "Machine health 2026-W10: 1 alarm"
    assert message["Message-ID"].endswith("@example.org>")
    body = message.get_body()
    assert body is not None
    assert "EB0C stepped by +15 ± 1 µrad; next check by 2026-03-20" in body.get_content()
    (attached,) = message.iter_attachments()
    assert attached.get_filename() == "health-2026-W10.pdf"
    assert attached.get_content() == content


def test_without_an_alarm_nothing_is_sent_where_only_alarms_are_wanted(
    inbox: Inbox, document: Callable[..., Any], tmp_path: Path
) -> None:
    path = settings(tmp_path, inbox.port, only_on_alarm="true")
    assert mail_report(path, document([])) == []
    assert inbox.messages == []
    assert len(mail_report(path, document(["HU40-T"]))) == 2
    assert len(inbox.messages) == 1


def test_what_the_server_refuses_is_said(inbox: Inbox, document: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "password").write_text("wrong")
    path = settings(tmp_path, inbox.port, user='"monitor"', password_file='"password"')
    with pytest.raises(InputError, match=r"refused the message: 535 wrong password"):
        mail_report(path, document([]))
    path = settings(tmp_path, inbox.port, to='["no.one@example.org"]')
    with pytest.raises(InputError, match=r"took none of no\.one@example\.org"):
        mail_report(path, document([]))
    path = settings(tmp_path, inbox.port, to='["one@example.org", "no.one@example.org"]')
    with pytest.raises(InputError, match=r"refused no\.one@example\.org; the others have the message"):
        mail_report(path, document([]))
    path = settings(tmp_path, inbox.port, security='"starttls"')
    with pytest.raises(InputError, match="could not be used: STARTTLS extension not supported"):
        mail_report(path, document([]))
    path = settings(tmp_path, 1)
    with pytest.raises(InputError, match=r"127\.0\.0\.1:1 could not be used"):
        mail_report(path, document([]))


def test_a_file_too_large_for_servers_is_named_instead_of_attached(
    document: Callable[..., Any], tmp_path: Path
) -> None:
    found = document([], b"")
    with open(found["files"][1], "wb") as sparse:
        sparse.truncate(LARGEST_BYTES + 1)
    message = message_of(read_mail_settings(settings(tmp_path, 25)), found)
    assert list(message.iter_attachments()) == []
    assert "too large to be attached" in message.get_content()


def test_settings_are_refused_with_every_fault(tmp_path: Path) -> None:
    path = tmp_path / "mail.toml"
    path.write_text(
        '[mail]\nserver = "x"\nsecurity = "maybe"\nto = ["nobody"]\nuser = "u"\ncolour = 1\nport = "25"\n'
    )
    with pytest.raises(InputError, match="was refused") as refused:
        read_mail_settings(path)
    for words in (
        "has no key colour", "lacks from", "security is one of tls, starttls, none", "to is a list of addresses",
        "user and password_file go together", "port must be a int",
    ):  # fmt: skip
        assert words in str(refused.value)
    path.write_text(
        '[mail]\nserver = "x"\nsecurity = "none"\nto = ["a@b"]\nfrom = "a@b"\nuser = "u"\npassword_file = "p"\n'
    )
    with pytest.raises(InputError, match="a password is not sent unencrypted"):
        read_mail_settings(path)
    path.write_text("x = 1\n")
    with pytest.raises(InputError, match=r"has no section \[mail\]"):
        read_mail_settings(path)


def test_the_example_is_a_configuration_and_the_units_type_verbs_that_exist() -> None:
    from monitor.cli.parser import parse

    found = read_mail_settings(EXAMPLES / "mail.toml")
    assert (found.security, found.port) == ("starttls", 587)
    for file in ("systemd/monitor-report.service", "cron/monitor-report"):
        text = (EXAMPLES / file).read_text(encoding="utf-8")
        (line,) = re.findall(r"/bin/monitor (--db .*?--fail-on-alarm)", text)
        options = parse(line.split())
        assert options.fail_on_alarm
        assert str(options.mail) == "/etc/monitor/mail.toml"


def test_no_line_is_slipped_into_the_head_of_the_message(tmp_path: Path) -> None:
    path = tmp_path / "mail.toml"
    path.write_text('[mail]\nserver = " "\nport = 99999\nfrom = "a@b.c"\nto = ["x@y.z\\nBcc: q@r.s"]\n')
    with pytest.raises(InputError, match="was refused") as refused:
        read_mail_settings(path)
    for words in (
        "port is a number from 1 to 65535, not 99999", "server is one line of visible letters, not ' '",
        r"to is one line of visible letters, not 'x@y.z\nBcc: q@r.s'",
    ):  # fmt: skip
        assert words in str(refused.value)


def test_a_week_in_which_nothing_was_measured_is_not_told_as_quiet(
    document: Callable[..., Any], tmp_path: Path
) -> None:
    found = {**document([], b""), "measured": 0}
    message = message_of(read_mail_settings(settings(tmp_path, 25)), found)
    assert message["Subject"] == "Machine health 2026-W10: no machine was measured"


def test_a_server_that_cannot_be_a_name_is_told(document: Callable[..., Any], tmp_path: Path) -> None:
    path = settings(tmp_path, 25)
    path.write_text(re.sub('server = ".*?"', f'server = "{"a" * 300}"', path.read_text()))
    with pytest.raises(InputError, match="could not be used"):
        mail_report(path, document([]))
