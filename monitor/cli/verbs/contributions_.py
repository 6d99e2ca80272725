"""What each instrument does for each parameter of a machine, and whether the instruments agree."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.cli.screen import on_screen
from monitor.workflow.instruments.answer import InstrumentsAnswer
from monitor.workflow.instruments.instruments import DOUBTFUL, instruments
from monitor.workflow.instruments.request import InstrumentsRequest

SMALLEST_PART = 0.01
EXAMPLE = "monitor contributions four-instruments"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", metavar="CAMPAIGN", help="a campaign of the database (monitor campaigns lists them)"
    )
    parser.add_argument("--run", type=int, metavar="N", dest="number", help="the run (default: the last)")
    add_model(parser)


def run(options: Namespace) -> int:
    request = InstrumentsRequest(options.campaign, options.number, options.model)
    with opened(options) as db, output.working("fitting"):
        answer = ask(db, instruments, request)
    if options.json:
        output.document(answer)
    else:
        _say(on_screen(answer))
    return 0


def _part(part: float, u: float) -> str:
    """A part of u; one below a hundredth adds less than 0.01 % to it."""
    return output.two_digits(part) if part > SMALLEST_PART * u else "-"


def _say(answer: InstrumentsAnswer) -> None:
    output.copied(answer.copied_readings)
    output.say(f"{answer.campaign}, run {answer.run}, model {answer.model}")
    fits = [
        [f"({number})", fit.instrument, ", ".join(fit.setups), str(fit.numbers), f"{fit.rms_in_u:.2f}"]
        for number, fit in enumerate(answer.instruments, start=1)
    ]
    output.table("", ["", "instrument", "setups", "numbers", "RMS / u"], fits)
    output.say(
        "what each adds to u, as a standard uncertainty (u² is the sum of their squares); (0) is known beforehand:"
    )
    numbers = {fit.instrument: f"({number})" for number, fit in enumerate(answer.instruments, start=1)}
    rows = [
        [
            shares.parameter,
            shares.unit,
            shares.refers_to or "",
            output.rounded(shares.value, shares.u),
            output.two_digits(shares.u),
            *(_part(shares.parts[name], shares.u) for name in numbers),
            _part(shares.known_beforehand, shares.u),
        ]
        for shares in answer.parameters
    ]
    output.table(
        "", ["parameter", "unit", "relative to", "value", "u", *numbers.values(), "(0)"], rows, text_columns=3
    )
    alone = [
        [
            shares.parameter,
            shares.unit,
            shares.refers_to or "",
            numbers[value.instrument],
            output.rounded(value.value, value.u),
            output.two_digits(value.u),
        ]
        for shares in answer.parameters
        for value in shares.alone
    ]
    if alone:
        output.table("", ["alone", "unit", "relative to", "by", "value", "u"], alone, text_columns=4)
    _say_agreement(answer)
    if answer.not_determined:
        output.say(
            f"all together do not separate {', '.join(answer.not_determined)}; identify says why, and "
            f"`monitor plan {answer.campaign}` which measurement would"
        )


def _say_agreement(answer: InstrumentsAnswer) -> None:
    """Say which instruments disagree, or by how much the worst of them agree."""
    pairs = [(shares.parameter, pair) for shares in answer.parameters for pair in shares.agreement]
    if not pairs:
        output.say("no parameter is determined by two instruments, each alone: nothing to compare")
        return
    apart = [(parameter, pair) for parameter, pair in pairs if pair.e_n > 1.0]
    for parameter, pair in apart:
        output.say(f"{parameter}: {pair.first} and {pair.second} disagree, E_n = {pair.e_n:.2f}")
    if apart and answer.by_chance is not None and answer.by_chance > DOUBTFUL:
        output.say(
            f"of {len(pairs)} comparisons the least likely comes out so large by chance in up to "
            f"{100 * answer.by_chance:.0f} % of campaigns without fault: measure again before you look for a cause"
        )
    if not apart:
        worst, pair = max(pairs, key=lambda compared: compared[1].e_n)
        output.say(
            f"the instruments agree: largest E_n = {pair.e_n:.2f} ({worst}, {pair.first} and {pair.second}; "
            f"of {len(pairs)})"
        )
