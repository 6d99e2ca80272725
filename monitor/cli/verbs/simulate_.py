"""Write a virtual campaign folder, with a hidden effect or without, to rehearse comparison and explanation.

With --like the plan is that of a campaign of yours, of any method and machine: monthly campaigns of one virtual machine
or several, with drift, steps at events and a hidden effect; OUT is then a folder of campaign folders and of truth.csv.
"""

from __future__ import annotations

import re
from argparse import ArgumentParser, Namespace
from datetime import date
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, check_path, opened
from monitor.cli.moments import moment
from monitor.cli.parser import common
from monitor.exceptions import InputError
from monitor.workflow.likeness import Drift, LikeRequest, Step, simulate_like, simulate_like_stored
from monitor.workflow.simulation import SimulateRequest, simulate

EXAMPLE = 'monitor simulate rehearsal --effect "EBB:harmonic2" --peak 5 --seed 7'
_CHANGE = re.compile(r"(?P<parameter>[^=@]+)=(?P<size>[^=@]+)(@(?P<machine>[^@]+))?")


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "out", type=Path, metavar="OUT", help="the folder to make; its name is the campaign's"
    )
    parser.add_argument("--effect", metavar="EFFECT", help="what is hidden, for example EXX:reversal")
    parser.add_argument("--peak", type=float, metavar="UM", help="its largest displacement (default 5 µm)")
    parser.add_argument(
        "--noise",
        type=float,
        metavar="UM",
        help="standard deviation of the noise of a reading (1 µm; 20 µm of a tracker)",
    )
    parser.add_argument(
        "--robot", action="store_true", help="a robot seen by a tracker instead of a machine tool"
    )
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="seed of the noise (default 1)")
    series = parser.add_argument_group("rehearsal of a plan of yours")
    series.add_argument(
        "--like",
        metavar="CAMPAIGN",
        help="a campaign folder, or a campaign of the database, whose plan is followed",
    )
    series.add_argument(
        "--machine", action="append", default=[], metavar="ID", help="a virtual machine; may be repeated"
    )
    series.add_argument("--start", metavar="DATE", help="the day of the first campaigns")
    series.add_argument("--months", type=int, metavar="N", help="a campaign a month, N of them (default 12)")
    series.add_argument(
        "--drift", action="append", default=[], metavar="P=RATE[@ID]",
        help="a parameter that drifts by so much a month, in its unit, of one machine or all; may be repeated",
    )  # fmt: skip
    series.add_argument(
        "--event", action="append", default=[], metavar="'DATE P=STEP[@ID]'",
        help="a parameter that steps by so much on a day; may be repeated",
    )  # fmt: skip
    series.add_argument("--steady", action="store_true", help="without the scatter of the pattern's days")


def run(options: Namespace) -> int:
    if options.like is not None:
        return _like(options)
    for name in ("machine", "start", "months", "drift", "event", "steady"):
        if getattr(options, name):
            raise InputError(f"--{name} needs --like, the campaign whose plan is followed")
    answer = simulate(
        SimulateRequest(options.out, options.effect, options.peak, options.noise, options.seed, options.robot)
    )
    if options.json:
        output.document(answer)
    else:
        output.say(answer.message)
    return 0


def _like(options: Namespace) -> int:
    if options.robot or options.noise is not None:
        raise InputError("--robot and --noise go without --like: machine and noise are those of the campaign")
    if options.start is None:
        raise InputError("--like needs --start, the day of the first campaigns, such as 2026-01-12")
    request = LikeRequest(
        options.out,
        options.like,
        tuple(options.machine),
        moment(options.start, "--start").date(),
        12 if options.months is None else options.months,
        tuple(_drift(text) for text in options.drift),
        tuple(_step(text) for text in options.event),
        options.effect,
        options.peak,
        options.steady,
        options.seed,
    )
    count = request.months * len(request.machines)
    with output.stepping("simulating", count) as progress:
        if Path(options.like).exists():
            answer = simulate_like(request, progress=progress)
        else:
            check_path(options.db, may_be_new=options.server is not None)
            with opened(options) as db:
                answer = ask(db, simulate_like_stored, request, progress=progress)
    if options.json:
        output.document(answer)
    else:
        output.say(answer.message)
    return 0


def _drift(text: str) -> Drift:
    parameter, size, machine = _change(text, f"--drift {text}", "EXX=0.5, or EXX=0.5@MILL-2 for one machine")
    return Drift(parameter, size, machine)


def _step(text: str) -> Step:
    day, _, change = text.strip().partition(" ")
    on: date = moment(day, f"--event {text!r}:").date()
    return Step(
        on, *_change(change, f"--event {text!r}", "'2026-06-10 EB0C=15', or EB0C=15@MILL-2 for one machine")
    )


def _change(text: str, option: str, example: str) -> tuple[str, float, str | None]:
    match = _CHANGE.fullmatch(text.strip())
    try:
        if match is None:
            raise ValueError(text)
        return match["parameter"].strip(), float(match["size"]), match["machine"]
    except ValueError as error:
        raise InputError(f"{option}: write {example}") from error
