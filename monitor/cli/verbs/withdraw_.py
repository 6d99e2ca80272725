"""Withdraw a campaign that should not have been imported: it no longer counts, and its name is free again."""

from __future__ import annotations

import shlex
from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.workflow.intake.withdrawals import WithdrawRequest, withdraw

EXAMPLE = 'monitor withdraw five-days --reason "balls 3 and 5 were exchanged in the file"'


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", metavar="CAMPAIGN", help="a campaign of the database (monitor campaigns lists them)"
    )
    parser.add_argument("--reason", required=True, metavar="TEXT", help="why, in words; it is kept")


def run(options: Namespace) -> int:
    with opened(options) as db:
        answer = ask(db, withdraw, WithdrawRequest(options.campaign, options.reason))
    if options.json:
        output.document(answer)
        return 0
    output.say(answer.message)
    for number in answer.certificates:
        output.say(
            f"certificate {number} rests on it: `monitor certificate amend {shlex.quote(number)}` or "
            f"`withdraw {shlex.quote(number)}`"
        )
    return 0
