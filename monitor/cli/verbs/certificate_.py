"""Calibration certificates: issue one for a run, show, verify a file, amend, withdraw."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.issuing import add_fonts, add_issuing, issuing
from monitor.cli.parser import common, described
from monitor.exceptions import InputError
from monitor.workflow.certificate import checks as certificate_checks
from monitor.workflow.certificate import issue as certificates

EXAMPLE = "monitor certificate issue five-days --run 20 --laboratory examples/laboratory.toml"


def options(parser: ArgumentParser) -> None:
    verbs = parser.add_subparsers(dest="what", metavar="issue|show|verify|amend|withdraw", required=True)
    issued = verbs.add_parser("issue", **described("a certificate for one run", EXAMPLE))
    issued.add_argument("campaign", metavar="CAMPAIGN")
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
    shown = verbs.add_parser(
        "show", **described("one certificate, or all", "monitor certificate show 2026-0001")
    )
    shown.add_argument("number", nargs="?", metavar="NUMBER")
    shown.add_argument(
        "--remake", type=Path, metavar="PATH",
        help="make it again from its stored record (a folder, or a file ending in .pdf); exit status 1 unless the "
        "same to the last byte",
    )  # fmt: skip
    shown.add_argument(
        "--dcc", type=Path, metavar="PATH",
        help="write the digital certificate, PTB DCC 3.2.1 (a folder, or a file ending in .xml)",
    )  # fmt: skip
    shown.add_argument(
        "--pdf", type=Path, metavar="PATH",
        help="write the document as it was issued (a folder, or a file ending in .pdf)",
    )  # fmt: skip
    add_fonts(shown)
    shown.set_defaults(run=_show)
    verified = verbs.add_parser(
        "verify",
        **described(
            "is a file an unaltered certificate of this database?",
            "monitor certificate verify certificate-2026-0001.pdf",
        ),
    )
    verified.add_argument("file", type=Path, metavar="FILE")
    verified.add_argument(
        "--trust", type=Path, metavar="PEM", help="certificates that the signer's has to lead to"
    )
    verified.set_defaults(run=_verify)
    amended = verbs.add_parser(
        "amend",
        **described(
            "a new certificate that replaces another and says so; the old one is marked",
            "monitor certificate amend 2026-0001 --laboratory laboratory.toml --reason 'wrong customer'",
        ),
    )
    amended.add_argument("replaces", metavar="NUMBER")
    amended.add_argument("--reason", required=True, help="why it is replaced, as printed")
    amended.add_argument("--campaign", metavar="CAMPAIGN", help="default: that of the old certificate")
    amended.add_argument(
        "--run", type=int, metavar="N", dest="number_of_run", help="default: that of the old certificate"
    )
    add_issuing(amended)
    amended.set_defaults(run=_amend)
    withdrawn = verbs.add_parser(
        "withdraw",
        **described(
            "mark as withdrawn", "monitor certificate withdraw 2026-0001 --reason 'the bar was damaged'"
        ),
    )
    withdrawn.add_argument("number", metavar="NUMBER")
    withdrawn.add_argument("--reason", required=True)
    withdrawn.set_defaults(run=_withdraw)
    for one in (issued, shown, verified, amended, withdrawn):
        common(one)


def _issue(options: Namespace) -> int:
    with opened(options, threads=1) as db, output.working("issuing"):
        found = certificates.issue(
            db, options.campaign, options.number_of_run, options.laboratory, draft=options.draft,
            replaces=options.replaces, reason=options.reason, **issuing(options),
        )  # fmt: skip
    return _issued(found, options.json)


def _amend(options: Namespace) -> int:
    with opened(options, threads=1) as db, output.working("issuing"):
        found = certificates.amend(
            db, options.replaces, options.laboratory, options.reason, campaign=options.campaign,
            run=options.number_of_run, **issuing(options),
        )  # fmt: skip
    return _issued(found, options.json)


def _issued(found: dict[str, Any], as_json: bool) -> int:
    if as_json:
        output.document(found)
    else:
        output.say(f"certificate {found['number']} ({found['state']}): {found['file']}")
    return 0


def _show(options: Namespace) -> int:
    for wish, path in (("--remake", options.remake), ("--dcc", options.dcc), ("--pdf", options.pdf)):
        if path is not None and options.number is None:
            raise InputError(
                f"{wish} needs the number of a certificate; `monitor certificate show` lists them"
            )
    if options.remake is not None:
        return _remake(options)
    for path, write in (
        (options.dcc, certificate_checks.digital),
        (options.pdf, certificate_checks.stored_file),
    ):
        if path is not None:
            with opened(options) as db:
                made = write(db, options.number, path)
            output.document(made) if options.json else output.say(made["file"])
            return 0
    with opened(options) as db:
        found = certificate_checks.show(db, options.number)
    if options.json:
        output.document(found)
        return 0
    rows = [found] if options.number else found["certificates"]
    plain = [{key: value for key, value in row.items() if key != "record"} for row in rows]
    output.listing(plain, "no certificate was made yet")
    return 0


def _remake(options: Namespace) -> int:
    with opened(options) as db, output.working("making it again"):
        found = certificate_checks.remake(db, options.number, options.remake, options.font)
    if options.json:
        output.document(found)
    else:
        output.say(
            f"certificate {found['number']} made again: {found['file']}, "
            + ("the same to the last byte" if found["identical"] else f"NOT the same: {found['why']}")
        )
    return 0 if found["identical"] else 1


def _verify(options: Namespace) -> int:
    with opened(options) as db, output.working("verifying"):
        found = certificate_checks.verify(db, options.file, options.trust)
    if options.json:
        output.document(found)
    else:
        for name, value in found["checks"].items():
            output.say(f"{name:<10} {'not signed' if value is None else 'good' if value else 'FAILED'}")
        if found["signer"] is not None:
            output.say(
                f"signed by {found['signer']}{'' if options.trust else ' (not checked against --trust)'}"
            )
        for fault in found["faults"]:
            output.say(f"  {fault}")
        name = options.file if found["number"] is None else f"certificate {found['number']}"
        output.say(f"{name} is {'genuine and valid' if found['ok'] else 'NOT confirmed'}")
    return 0 if found["ok"] else 1


def _withdraw(options: Namespace) -> int:
    with opened(options) as db:
        found = certificates.withdraw(db, options.number, options.reason)
    if options.json:
        output.document(found)
    else:
        output.say(f"certificate {found['number']} is {found['state']}")
    return 0
