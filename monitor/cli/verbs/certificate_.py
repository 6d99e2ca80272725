"""Calibration certificates: issue one for a run, show, verify a file, amend, withdraw."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from datetime import date
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common, told
from monitor.exceptions import InputError
from monitor.readers import read_linear_axes
from monitor.workflow import certificate_checks, certificates
from monitor.workflow.conformity import RULES

EXAMPLE = "monitor certificate issue five-days --run 20 --laboratory examples/laboratory.toml"


def options(parser: ArgumentParser) -> None:
    verbs = parser.add_subparsers(dest="what", metavar="issue|show|verify|amend|withdraw", required=True)
    issued = verbs.add_parser("issue", **told("a certificate for one run", EXAMPLE))
    issued.add_argument("campaign", metavar="CAMPAIGN")
    issued.add_argument("--run", type=int, required=True, metavar="N", dest="number_of_run")
    issued.add_argument(
        "--laboratory", type=Path, required=True, metavar="FILE", help="what the laboratory states"
    )
    issued.add_argument("--out", type=Path, metavar="PATH", help="a folder, or a file ending in .pdf")
    issued.add_argument("--number", metavar="NUMBER", help="default: the next of the year")
    issued.add_argument(
        "--date", type=date.fromisoformat, metavar="YYYY-MM-DD", help="of issue; default: today"
    )
    issued.add_argument("--model", metavar="NAME")
    issued.add_argument(
        "--linear-axes", type=Path, metavar="FILE",
        help="errors of the linear axes (TOML), for methods that take these axes as known",
    )  # fmt: skip
    issued.add_argument("--draft", action="store_true", help="a draft, to be looked at")
    issued.add_argument(
        "--conformity",
        choices=RULES,
        help="state conformity with the machine's tolerances by this rule",
    )
    issued.add_argument(
        "--sign", type=Path, metavar="P12", help="sign it with the key of a PKCS#12 file (extra [sign])"
    )
    issued.add_argument(
        "--passphrase-file", type=Path, metavar="FILE", help="its first line opens the PKCS#12 file"
    )
    issued.add_argument(
        "--replaces", metavar="NUMBER", help="the certificate that this one amends; it is marked so"
    )
    issued.add_argument("--reason", default="", help="why it is replaced")
    issued.set_defaults(run=_issue)
    shown = verbs.add_parser("show", **told("one certificate, or all", "monitor certificate show 2026-0001"))
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
    shown.set_defaults(run=_show)
    verified = verbs.add_parser(
        "verify",
        **told(
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
        **told(
            "mark as replaced by another certificate",
            "monitor certificate amend 2026-0001 --by 2026-0002 --reason 'wrong customer'",
        ),
    )
    amended.add_argument("number", metavar="NUMBER")
    amended.add_argument(
        "--by", required=True, metavar="NEW", help="the number of the certificate that replaces it"
    )
    amended.add_argument("--reason", required=True)
    amended.set_defaults(run=_mark)
    withdrawn = verbs.add_parser(
        "withdraw",
        **told("mark as withdrawn", "monitor certificate withdraw 2026-0001 --reason 'the bar was damaged'"),
    )
    withdrawn.add_argument("number", metavar="NUMBER")
    withdrawn.add_argument("--reason", required=True)
    withdrawn.set_defaults(run=_mark, by=None)
    for one in (issued, shown, verified, amended, withdrawn):
        common(one)


def _issue(options: Namespace) -> int:
    with opened(options, threads=1) as db, output.working("issuing"):
        found = certificates.issue(
            db, options.campaign, options.number_of_run, options.laboratory, out=options.out, number=options.number,
            issued_on=options.date, model=options.model, draft=options.draft,
            linear_axes=None if options.linear_axes is None else read_linear_axes(options.linear_axes),
            conformity=options.conformity, key=options.sign, passphrase=_passphrase(options.passphrase_file),
            replaces=options.replaces, reason=options.reason,
        )  # fmt: skip
    if options.json:
        output.document(found)
    else:
        output.say(f"certificate {found['number']} ({found['state']}): {found['file']}")
    return 0


def _passphrase(file: Path | None) -> str | None:
    if file is None:
        return None
    try:
        return (file.read_text(encoding="utf-8").splitlines() or [""])[0]
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"the passphrase file {file} cannot be read: {error}") from error


def _show(options: Namespace) -> int:
    for wish, path in (("--remake", options.remake), ("--dcc", options.dcc)):
        if path is not None and options.number is None:
            raise InputError(
                f"{wish} needs the number of a certificate; `monitor certificate show` lists them"
            )
    if options.remake is not None:
        return _remake(options)
    if options.dcc is not None:
        with opened(options) as db:
            made = certificate_checks.digital(db, options.number, options.dcc)
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
        found = certificate_checks.remake(db, options.number, options.remake)
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


def _mark(options: Namespace) -> int:
    with opened(options) as db:
        found = certificates.withdraw(db, options.number, options.reason, options.by)
    if options.json:
        output.document(found)
    else:
        output.say(f"certificate {found['number']} is {found['state']}")
    return 0
