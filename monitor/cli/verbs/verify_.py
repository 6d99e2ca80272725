"""Hash everything anew and compare it with the audit: is the database as it was written?"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.configuration import configuration
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.workflow import keeping

EXAMPLE = "monitor verify"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "--anchor",
        metavar="SHA256",
        help="a hash of the audit that was kept elsewhere, on paper or a certificate",
    )
    parser.add_argument(
        "--recompute", type=int, default=3, metavar="N",
        help="how many identifications to compute anew from the stored readings (default 3)",
    )  # fmt: skip
    parser.add_argument(
        "--seed",
        type=int,
        metavar="N",
        help="draw these as an earlier verification did that printed its seed",
    )
    parser.add_argument(
        "--trust", type=Path, metavar="FILE",
        help="check the signature of every certificate against these signers: certificates (PEM or DER), or a SHA-256 "
        "fingerprint a line (default: trusted_signers of the configuration)",
    )  # fmt: skip


def run(options: Namespace) -> int:
    with opened(options) as db, output.working("verifying"):
        trusted = options.trust or configuration().trusted_signers
        answer = ask(
            db,
            keeping.verify,
            keeping.VerifyRequest(options.anchor, options.recompute, trusted, options.seed),
        )
    if options.json:
        output.document(answer)
    else:
        for fault in answer.faults:
            output.say(fault)
        for note in answer.notes:
            output.say(note)
        if answer.anchored_entry is not None:
            output.say(f"the hash kept elsewhere is that of entry {answer.anchored_entry}")
        if answer.recomputable or answer.of_other_versions:
            output.say(_recomputed(answer))
        if answer.signed_certificates is not None:
            output.say(
                f"signed certificates: {answer.signed_certificates}, of trusted signers: {answer.trusted_signatures}"
            )
        output.say(
            f"{options.db} {_verdict(answer)}: {answer.entries} entries, the last with hash {answer.last_sha256}"
        )
    return 0 if answer.ok else 1


def _recomputed(answer: keeping.VerifyAnswer) -> str:
    """Say how large the sample was, of this version and of others."""
    drawn = "" if answer.seed is None else f", drawn by --seed {answer.seed}"
    others = (
        f", and {answer.recomputed_of_others} of {answer.of_other_versions} of other versions"
        if answer.of_other_versions
        else ""
    )
    return (
        f"identifications computed anew from the stored readings: {answer.recomputed} of {answer.recomputable}"
        f"{others}{drawn}"
    )


def _verdict(answer: keeping.VerifyAnswer) -> str:
    """Say what was shown: a record that agrees with itself may have been rewritten as a whole."""
    if not answer.ok:
        return "is NOT as it was written"
    if answer.anchored_entry is None:
        return "agrees with its own record (--anchor shows that it was not rewritten as a whole)"
    return f"is as it was written up to entry {answer.anchored_entry}, and agrees with its own record"
