"""The report by e-mail: a real SMTP server on loopback takes it; what servers refuse is said in words."""

from __future__ import annotations

import asyncio
import base64
import email
import email.policy
import ipaddress
import re
import ssl
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from email.message import EmailMessage
from pathlib import Path
from typing import Any

import pytest

from monitor.exceptions import InputError
from monitor.reporting.health.records import FleetRow
from monitor.reporting.weekly_notice import WeeklyNotices
from monitor.workflow.health.mail import LARGEST_BYTES, mail_report, message_of, read_mail_settings
from monitor.workflow.health.request import ReportAnswer

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@dataclass
class Inbox:
    """A small SMTP server (RFC 5321, AUTH PLAIN of RFC 4954, STARTTLS of RFC 3207) and what it took.

    Addresses with 'no' are refused. ``context`` is its key and certificate, ``hidden`` says of every login whether the
    line was encrypted by then; one that ``breaks`` hangs up in the middle of a message.
    """

    port: int = 0
    messages: list[bytes] = field(default_factory=list)
    recipients: list[str] = field(default_factory=list)
    logins: list[tuple[str, str]] = field(default_factory=list)
    context: ssl.SSLContext | None = None
    at_once: bool = False
    breaks: bool = False
    hidden: list[bool] = field(default_factory=list)

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async def say(text: str) -> None:
            writer.write(text.encode() + b"\r\n")
            await writer.drain()

        await say("220 loopback")
        while line := (await reader.readline()).decode().strip():
            verb = line.upper()
            if verb.startswith("EHLO"):
                plain = self.context is not None and writer.get_extra_info("ssl_object") is None
                await say("250-loopback\r\n" + ("250-STARTTLS\r\n" if plain else "") + "250 AUTH PLAIN")
            elif verb == "STARTTLS":
                await say("220 go on")
                assert self.context is not None
                try:
                    await writer.start_tls(self.context)
                except (OSError, ssl.SSLError):
                    return  # the other side did not like what it saw
            elif verb.startswith("AUTH PLAIN"):
                _, user, password = base64.b64decode(line.split()[2]).decode().split("\0")
                self.logins.append((user, password))
                self.hidden.append(writer.get_extra_info("ssl_object") is not None)
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
                if self.breaks:
                    break
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


@contextmanager
def opened(made: Inbox) -> Iterator[Inbox]:
    """The server at work in a thread, on a port of its own."""
    ready, loop = threading.Event(), asyncio.new_event_loop()

    async def run() -> None:
        server = await asyncio.start_server(
            made.serve, "127.0.0.1", 0, ssl=made.context if made.at_once else None
        )
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
def inbox() -> Iterator[Inbox]:
    with opened(Inbox()) as made:
        yield made


@pytest.fixture(scope="module")
def server_key(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Key and certificate of a server at an address, in one PEM file that is its own authority."""
    pytest.importorskip("cryptography", reason="the extra [sign] is not installed")
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

    def make(address: str) -> Path:
        key, now = ec.generate_private_key(ec.SECP256R1()), datetime.now(UTC)
        name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "made-up mail server")])
        alternative = x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address(address))])
        made = (
            x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(key.public_key()).serial_number(1)
            .not_valid_before(now - timedelta(days=1)).not_valid_after(now + timedelta(days=9))
            .add_extension(alternative, critical=False)
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .sign(key, hashes.SHA256())
        )  # fmt: skip
        file = tmp_path_factory.mktemp("server") / "server.pem"
        file.write_bytes(
            key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
            + made.public_bytes(Encoding.PEM)
        )
        return file

    return make


def with_key(file: Path, at_once: bool) -> Inbox:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(file)
    return Inbox(context=context, at_once=at_once)


@pytest.fixture
def document(tmp_path: Path) -> Callable[..., ReportAnswer]:
    def make(alarms: list[str], content: bytes = b"%PDF-1.7 page") -> ReportAnswer:
        pdf = tmp_path / "health-2026-W10.pdf"
        pdf.write_bytes(content)
        row = FleetRow("HU40-T", "", "changed", "EB0C stepped by +15 ± 1 µrad", None, 0.12, "by 2026-03-20")
        return ReportAnswer(
            week="2026-W10", from_="2026-03-02", to="2026-03-08", machines=(row,), measured=1, ended=True,
            alarms=tuple(alarms), refused_imports=(), message="", answers=(),
            weekly_looks=WeeklyNotices(0.05, 0, 1, 0, 0.0, ()),
            files=(str(tmp_path / "health-2026-W10.html"), str(pdf)),
        )  # fmt: skip

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
    assert list(sent) == inbox.recipients == ["one@example.org", "two@example.org"]
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
    assert mail_report(path, document([])) == ()
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


@pytest.mark.parametrize("security", ["tls", "starttls"])
def test_rfc3207_and_8314_password_and_message_go_encrypted_to_a_server_that_is_who_it_says(
    security: str, server_key: Callable[[str], Path], document: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "password").write_text("secret\n")
    own, other = server_key("127.0.0.1"), server_key("127.0.0.2")
    login = {"security": f'"{security}"', "user": '"monitor"', "password_file": '"password"'}
    with opened(with_key(own, security == "tls")) as inbox:
        mail_report(settings(tmp_path, inbox.port, ca_file=f'"{own}"', **login), document(["HU40-T"]))
        assert (inbox.logins, inbox.hidden, len(inbox.messages)) == ([("monitor", "secret")], [True], 1)
        # An authority that nobody named, and another's: nothing is told to the server.
        for more in ({}, {"ca_file": f'"{other}"'}):
            with pytest.raises(InputError, match=r"could not be used: .*certificate verify failed"):
                mail_report(settings(tmp_path, inbox.port, **login, **more), document([]))
        assert len(inbox.logins) == 1
    with opened(with_key(other, security == "tls")) as inbox:
        with pytest.raises(
            InputError, match=r"could not be used: .*certificate is not valid for '127\.0\.0\.1'"
        ):
            mail_report(settings(tmp_path, inbox.port, ca_file=f'"{other}"', **login), document([]))
        assert inbox.logins == []


@pytest.mark.parametrize("key", ["password_file", "ca_file"])
def test_a_file_of_the_configuration_that_is_not_there_is_told_before_the_work(
    tmp_path: Path, key: str
) -> None:
    (tmp_path / "password").write_text("secret")
    names = {"user": '"monitor"', "password_file": '"password"', key: '"nowhere"'}
    with pytest.raises(InputError, match=rf"{key} of .*mail\.toml: .*nowhere cannot be read: No such file"):
        read_mail_settings(settings(tmp_path, 25, **names))


def test_a_server_that_hangs_up_in_the_middle_is_told(document: Callable[..., Any], tmp_path: Path) -> None:
    with opened(Inbox(breaks=True)) as inbox:
        with pytest.raises(
            InputError, match=rf"the mail server 127\.0\.0\.1:{inbox.port} could not be used: "
        ):
            mail_report(settings(tmp_path, inbox.port), document([]))
        assert inbox.messages == []


def test_a_file_too_large_for_servers_is_named_instead_of_attached(
    document: Callable[..., Any], tmp_path: Path
) -> None:
    found = document([], b"")
    with open(found.files[1], "wb") as sparse:
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


def test_the_example_is_a_configuration_and_the_units_type_verbs_that_exist(tmp_path: Path) -> None:
    from monitor.cli.parser import parse

    example = tmp_path / "mail.toml"
    example.write_bytes((EXAMPLES / "mail.toml").read_bytes())
    (tmp_path / "mail-password").write_text("secret")
    found = read_mail_settings(example)
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
    found = replace(document([], b""), measured=0)
    message = message_of(read_mail_settings(settings(tmp_path, 25)), found)
    assert message["Subject"] == "Machine health 2026-W10: no machine was measured"


def test_a_server_that_cannot_be_a_name_is_told(document: Callable[..., Any], tmp_path: Path) -> None:
    path = settings(tmp_path, 25)
    path.write_text(re.sub('server = ".*?"', f'server = "{"a" * 300}"', path.read_text()))
    with pytest.raises(InputError, match="could not be used"):
        mail_report(path, document([]))
