"""Calibration certificates: issue one for a run, show, verify a file, amend, withdraw, the laboratory's template."""

from __future__ import annotations

import contextlib
import dataclasses
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path

from monitor.cli import output
from monitor.cli.configuration import configuration
from monitor.cli.database import ask, opened
from monitor.cli.issuing import add_fonts, add_issuing, issuing
from monitor.cli.parser import common, described
from monitor.exceptions import InputError
from monitor.reporting.pdf.beside import layout_beside
from monitor.reporting.signature.long_term import LongTermMaterial
from monitor.workflow.certificate.answer import (
    CertificateFileAnswer,
    CertificatesAnswer,
    CertificateShowAnswer,
    Verdict,
    VerificationAnswer,
)
from monitor.workflow.certificate.request import (
    AmendmentRequest,
    CertificateFileRequest,
    CertificateRequest,
    CertificateShowRequest,
    CertificatesRequest,
    RemakeRequest,
    VerificationRequest,
    WithdrawalRequest,
)

EXAMPLE = "monitor certificate issue five-days --run 20 --laboratory examples/laboratory.toml"


def options(parser: ArgumentParser) -> None:
    verbs = parser.add_subparsers(
        dest="what", metavar="issue|show|verify|amend|withdraw|template", required=True
    )
    for name, (add, says, example) in _VERBS.items():
        verb = verbs.add_parser(name, **described(says, example))
        add(verb)
        common(verb, database=name != "template")


def _issue_options(issued: ArgumentParser) -> None:
    issued.add_argument("campaign", metavar="CAMPAIGN", help="the campaign whose run is certified")
    issued.add_argument(
        "--run", type=int, metavar="N", dest="number_of_run",
        help="the machine as found; needed where the campaign has several runs",
    )  # fmt: skip
    add_issuing(issued)
    issued.add_argument("--draft", action="store_true", help="a draft, to be looked at")
    issued.add_argument(
        "--replaces", metavar="NUMBER", help="the certificate that this one amends; it is marked so"
    )
    issued.add_argument("--reason", default="", help="why it is replaced")
    issued.set_defaults(run=_issue)


def _show_options(shown: ArgumentParser) -> None:
    shown.add_argument(
        "number", nargs="?", metavar="NUMBER", help="the number of a certificate (default: a list of all)"
    )
    shown.add_argument(
        "--remake", type=Path, metavar="PATH",
        help="make it again from its stored record (a folder, or a file ending in .pdf); exit status 1 unless the "
        "same to the last byte",
    )  # fmt: skip
    shown.add_argument(
        "--dcc", type=Path, metavar="PATH",
        help="write the digital certificate, PTB DCC (a folder, or a file ending in .xml)",
    )  # fmt: skip
    shown.add_argument(
        "--dcc-html", type=Path, metavar="PATH",
        help="write what the digital certificate says as a page to read (a folder, or a file ending in .html)",
    )  # fmt: skip
    shown.add_argument(
        "--pdf", type=Path, metavar="PATH",
        help="write the document as it was issued (a folder, or a file ending in .pdf)",
    )  # fmt: skip
    add_fonts(shown)
    shown.set_defaults(run=_show)


def _verify_options(verified: ArgumentParser) -> None:
    verified.add_argument("file", type=Path, metavar="FILE", help="the certificate as it was issued, a PDF")
    verified.add_argument(
        "--trust", type=Path, metavar="FILE",
        help="trusted signers: certificates that the signer's has to lead to (PEM or DER), or a SHA-256 fingerprint a "
        "line (default: trusted_signers of the configuration)",
    )  # fmt: skip
    verified.add_argument(
        "--expect", metavar="SHA256", help="the hash of the file as it was noted elsewhere when it was issued"
    )
    verified.set_defaults(run=_verify)


def _amend_options(amended: ArgumentParser) -> None:
    amended.add_argument("replaces", metavar="NUMBER", help="the number of the certificate that is replaced")
    amended.add_argument("--reason", required=True, help="why it is replaced, as printed")
    amended.add_argument("--campaign", metavar="CAMPAIGN", help="default: that of the old certificate")
    amended.add_argument(
        "--run", type=int, metavar="N", dest="number_of_run", help="default: that of the old certificate"
    )
    add_issuing(amended)
    amended.set_defaults(run=_amend)


def _withdraw_options(withdrawn: ArgumentParser) -> None:
    withdrawn.add_argument("number", metavar="NUMBER", help="the number of the certificate")
    withdrawn.add_argument("--reason", required=True, help="why it is withdrawn")
    withdrawn.set_defaults(run=_withdraw)


def _template_options(templated: ArgumentParser) -> None:
    templated.add_argument(
        "--language", metavar="de|en", help="of the file (default: that of the configuration, else en)"
    )
    templated.add_argument(
        "--out", type=Path, default=Path("laboratory.toml"), metavar="FILE", help="default: laboratory.toml"
    )
    templated.set_defaults(run=_template)


#: The verbs: options, what each does, an example.
_VERBS = {
    "issue": (_issue_options, "a certificate for one run", EXAMPLE),
    "show": (_show_options, "one certificate, or all", "monitor certificate show 2026-0001"),
    "verify": (
        _verify_options,
        "is a file an unaltered certificate of this database?",
        "monitor certificate verify certificate-2026-0001.pdf",
    ),
    "amend": (
        _amend_options,
        "a new certificate that replaces another and says so; the old one is marked",
        "monitor certificate amend 2026-0001 --laboratory laboratory.toml --reason 'wrong customer'",
    ),
    "withdraw": (
        _withdraw_options,
        "mark as withdrawn",
        "monitor certificate withdraw 2026-0001 --reason 'the bar was damaged'",
    ),
    "template": (
        _template_options,
        "the file that a laboratory fills in, with every key and no answer yet",
        "monitor certificate template --language de --out laboratory.toml",
    ),
}


def _issue(options: Namespace) -> int:
    request = CertificateRequest(
        options.campaign, options.number_of_run, options.replaces, options.reason, draft=options.draft,
        **issuing(options),
    )  # fmt: skip
    with _layout(options):
        # What issues takes longer to load than a list of certificates to read.
        from monitor.workflow.certificate.issue import issue

        with opened(options, threads=1) as db, output.working("issuing"):
            answer = ask(db, issue, request)
    return _issued(answer, options.json)


def _amend(options: Namespace) -> int:
    request = AmendmentRequest(
        options.replaces, options.reason, options.campaign, options.number_of_run, **issuing(options)
    )
    with _layout(options):
        from monitor.workflow.certificate.issue import amend

        with opened(options, threads=1) as db, output.working("issuing"):
            answer = ask(db, amend, request)
    return _issued(answer, options.json)


def _layout(options: Namespace) -> contextlib.AbstractContextManager[None]:
    """The process that lays pages out while this one reads, where a command has one to itself and no server issues.

    The database engine is not loaded yet: it has threads of its own, beside which no process is forked.
    """
    return layout_beside() if options.alone and options.server is None else contextlib.nullcontext()


def _issued(answer: CertificateFileAnswer, as_json: bool) -> int:
    if as_json:
        output.document(answer)
    else:
        for note in answer.notes or ():
            output.say(f"note: {note}")
        output.say(f"certificate {answer.certificate.number} ({answer.certificate.state}): {answer.file}")
    return 0


def _writer(option: str) -> Callable[..., CertificateFileAnswer]:
    """What writes the file of an option; who verifies or lists certificates waits for no digital one."""
    if option == "--pdf":
        from monitor.workflow.certificate.states import write_issued

        return write_issued
    from monitor.workflow.certificate.digital import write_digital, write_digital_page

    return write_digital if option == "--dcc" else write_digital_page


def _show(options: Namespace) -> int:
    files = (
        ("--dcc", options.dcc),
        ("--dcc-html", options.dcc_html),
        ("--pdf", options.pdf),
    )
    for option, path in (("--remake", options.remake), *files):
        if path is not None and options.number is None:
            raise InputError(
                f"{option} needs the number of a certificate; `monitor certificate show` lists them"
            )
    if options.remake is not None:
        return _remake(options)
    for option, path in files:
        if path is not None:
            with opened(options) as db:
                written = ask(db, _writer(option), CertificateFileRequest(options.number, path))
            output.document(written) if options.json else output.say(written.file)
            return 0
    from monitor.workflow.certificate.states import list_certificates, show_certificate

    with opened(options) as db:
        answer: CertificateShowAnswer | CertificatesAnswer = (
            ask(db, list_certificates, CertificatesRequest())
            if options.number is None
            else ask(db, show_certificate, CertificateShowRequest(options.number))
        )
    if options.json:
        output.document(answer)
        return 0
    states = (answer.certificate,) if isinstance(answer, CertificateShowAnswer) else answer.certificates
    output.listing(states, "no certificate was made yet")
    return 0


def _remake(options: Namespace) -> int:
    request = RemakeRequest(options.number, options.remake, tuple(options.font))
    from monitor.workflow.certificate.remaking import remake

    with opened(options) as db, output.working("making it again"):
        answer = ask(db, remake, request)
    if options.json:
        output.document(answer)
    else:
        output.say(
            f"certificate {answer.certificate.number} made again: {answer.file}, "
            + ("the same to the last byte" if answer.identical else f"NOT the same: {answer.why}")
        )
    return 0 if answer.identical else 1


def _verify(options: Namespace) -> int:
    from monitor.workflow.certificate.verification import verify_file

    with opened(options) as db, output.working("verifying"):
        trusted = options.trust or configuration().trusted_signers
        answer = ask(db, verify_file, VerificationRequest(options.file, trusted, options.expect))
    if options.json:
        output.document(answer)
        return 0 if answer.ok else 1
    _say_checks(answer)
    if answer.signer is not None:
        output.say(f"signed by {answer.signer}")
        output.say(f"           its certificate has the SHA-256 {answer.signer_sha256}")
    if answer.stamped_at is not None:
        output.say(f"           time stamp of {answer.stamped_at:%Y-%m-%d %H:%M:%S %Z}")
    if answer.long_term is not None:
        output.say(f"           {_long_term(answer.long_term)}")
    if answer.judged_until is not None:
        output.say(f"           can be judged by the file alone until {answer.judged_until:%Y-%m-%d}")
    for fault in answer.faults:
        output.say(f"  {fault}")
    name = options.file if answer.number is None else f"certificate {answer.number}"
    output.say(f"{name} {_VERDICTS[answer.verdict]}")
    if answer.verdict is Verdict.SIGNER_NOT_TRUSTED:
        output.say(f"signature intact, signer not trusted: fingerprint {answer.signer_sha256}")
    return 0 if answer.ok else 1


def _long_term(material: LongTermMaterial) -> str:
    """Say what a file carries for its later validation, and whether it suffices."""
    counted = (
        f"long-term material: {material.certificates} certificates, {material.revocation_lists} revocation lists, "
        f"{material.answers} answers (OCSP)"
    )
    if material.complete is None:
        return f"{counted}; not judged: --trust names no certificates"
    if not material.complete:
        return f"{counted}; it does NOT suffice: {material.why_not}"
    return f"{counted}; by these alone signer and time stamp lead to trusted certificates in force then"


#: What is said of a file. The database may have been rewritten as a whole, and anybody can make a key: neither
#: a record that matches nor an intact signature says by itself who it is from.
_VERDICTS = {
    Verdict.GENUINE: "is genuine and valid",
    Verdict.NOT_SIGNED: "matches this database's record and is in force; not signed",
    Verdict.SIGNER_NOT_TRUSTED: "matches this database's record and is in force; its signer is not trusted",
    Verdict.NOT_CONFIRMED: "is NOT confirmed",
}


def _say_checks(answer: VerificationAnswer) -> None:
    """Say what was checked; that nothing was expected of the anchor is no check."""
    for name, passed in dataclasses.asdict(answer.checks).items():
        if name == "expected" and passed is None:
            continue
        word = "not signed" if passed is None else "good" if passed else "FAILED"
        if name == "signature" and passed and answer.verdict is not Verdict.GENUINE:
            word = "intact"
        output.say(f"{name:<10} {word}")


def _template(options: Namespace) -> int:
    from monitor.workflow.certificate.template import TemplateRequest, write_template

    answer = write_template(
        TemplateRequest(options.out, options.language or configuration().language or "en")
    )
    if options.json:
        output.document(answer)
    else:
        output.say(f"{answer.file}: write your answers between the quotes")
    return 0


def _withdraw(options: Namespace) -> int:
    from monitor.workflow.certificate.issue import withdraw

    with opened(options) as db:
        answer = ask(db, withdraw, WithdrawalRequest(options.number, options.reason))
    if options.json:
        output.document(answer)
    else:
        output.say(f"certificate {answer.number} is {answer.state}")
    return 0
