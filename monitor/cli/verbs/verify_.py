"""Hash everything anew and compare it with the audit: is the database as it was written?"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
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


def run(options: Namespace) -> int:
    with opened(options) as db, output.working("verifying"):
        answer = ask(db, keeping.verify, keeping.VerifyRequest(options.anchor, options.recompute))
    if options.json:
        output.document(answer)
    else:
        for fault in answer.faults:
            output.say(fault)
        if answer.anchored_entry is not None:
            output.say(f"the hash kept elsewhere is that of entry {answer.anchored_entry}")
        if answer.recomputed:
            output.say(f"identifications computed anew from the stored readings: {answer.recomputed}")
        verdict = "as it was written" if answer.ok else "NOT as it was written"
        output.say(
            f"{options.db} is {verdict}: {answer.entries} entries, the last with hash {answer.last_sha256}"
        )
    return 0 if answer.ok else 1
