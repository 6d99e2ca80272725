"""Write a virtual campaign folder, with a hidden effect or without, to rehearse comparison and explanation."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.parser import common
from monitor.workflow.simulation import SimulateRequest, simulate

EXAMPLE = 'monitor simulate rehearsal --effect "EBB:harmonic2" --peak 5 --seed 7'


def options(parser: ArgumentParser) -> None:
    common(parser, database=False)
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


def run(options: Namespace) -> int:
    answer = simulate(
        SimulateRequest(options.out, options.effect, options.peak, options.noise, options.seed, options.robot)
    )
    if options.json:
        output.document(answer)
    else:
        output.say(answer.message)
    return 0
