"""The volumetric error at the tool tip over the stroke, with its uncertainty; compensation tables as CSV."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Mapping
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.workflow.volumetric.answer import VolumetricAnswer
from monitor.workflow.volumetric.request import COMPENSATION_FORMATS, POINTS, VolumetricRequest

EXAMPLE = "monitor map five-days --run 20 --figures figures --compensation positioning-csv"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", metavar="CAMPAIGN", help="a campaign of the database (monitor campaigns lists them)"
    )
    parser.add_argument("--run", type=int, metavar="N", dest="number", help="the run (default: the last)")
    add_model(parser)
    parser.add_argument(
        "--points", type=int, default=POINTS, metavar="N", help=f"points along each axis (default {POINTS})"
    )
    parser.add_argument(
        "--absolute",
        action="store_true",
        help="the workpiece is not set to zero in the middle of the strokes; offsets of axes appear whole",
    )
    parser.add_argument(
        "-p", type=float, default=0.95, metavar="P", help="coverage probability (default 0.95)"
    )
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw slices through the workspace")
    parser.add_argument(
        "--compensation", metavar="FORMAT", help=f"write tables: {' or '.join(COMPENSATION_FORMATS)}"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("."), metavar="DIR", help="where the tables go (default: here)"
    )


def run(options: Namespace) -> int:
    request = VolumetricRequest(
        options.campaign,
        options.number,
        model=options.model,
        p=options.p,
        points=options.points,
        absolute=options.absolute,
        figures=options.figures,
        compensation=options.compensation,
        out=options.out,
    )
    # Loaded here: --help maps nothing.
    from monitor.workflow.volumetric.volumetric import volumetric_map

    # One transaction: files that cannot be written leave no result behind.
    with opened(options) as db, output.working("mapping"):
        answer = ask(db, volumetric_map, request)
    if options.json:
        output.document(answer)
    else:
        _say(answer)
    return 0


def _say(answer: VolumetricAnswer) -> None:
    output.copied(answer.copied_readings)
    region, worst = answer.region, answer.worst
    strokes = ", ".join(
        f"{name} {low:.4g} to {high:.4g} mm" for name, (low, high) in region.readings_mm.items()
    )
    poses = f"at {region.rotary_poses} rotary pose{'s' if region.rotary_poses != 1 else ''}"
    if not answer.has_rotary_axes:
        poses = "of a machine without rotary axes"
    output.say(
        f"{answer.campaign}, run {answer.run}, model {answer.model}: volumetric error at {region.points} "
        f"points, {strokes} ({region.origin}), {poses}"
    )
    rows = [
        [
            name,
            output.rounded(length.error_um, length.expanded_um),
            output.two_digits(length.u_um),
            output.rounded(length.expanded_um, length.expanded_um),
        ]
        for name, length in (("worst point", worst), ("mean", answer.mean), ("RMS", answer.rms))
    ]
    output.table(
        "", ["length of the error", "µm", "u / µm", f"U / µm (k = {answer.k:.2f}, p = {answer.p:g})"], rows
    )
    output.say(f"worst at {_place(worst.at)}: {_vector(worst.vector_um)} ({answer.vectors_refer_to})")
    shares = (worst.by_parameter_um or {}).items()
    largest = sorted(shares, key=lambda share: -abs(share[1]))[:4]
    output.say("most of it from " + ", ".join(f"{name} ({share:+.1f} µm)" for name, share in largest))
    output.say(
        "these refer to: " + ", ".join(f"{name}: {answer.refers_to.get(name, '-')}" for name, _ in largest)
    )
    if answer.datum is not None:
        output.say(f"the workpiece's zero is set at {_place(answer.datum)}; --absolute leaves it where it is")
    for line in _in_no_number(answer):
        output.say(line)
    output.say(
        "error motions of axes that the model does not have are in no number and no U; `monitor explain` looks for "
        "those that the readings show"
    )
    for file in (*(answer.figures or ()), *(answer.tables or ())):
        output.say(file)


def _in_no_number(answer: VolumetricAnswer) -> Iterator[str]:
    """What lies between the points of the map, what may lie elsewhere, and what is not in it."""
    yield from (f"{effect} (--points sets more)" for effect in answer.between_points or ())
    yield from map(str, answer.step_places or ())
    yield from (f"not in the map: {omitted.parameter}: {omitted.why}" for omitted in answer.left_out)


def _place(at: Mapping[str, float]) -> str:
    return ", ".join(
        f"{name.split('_')[0].upper()} {value:.4g}{'°' if name.endswith('_deg') else ' mm'}"
        for name, value in at.items()
    )


def _vector(vector: Mapping[str, float]) -> str:
    return ", ".join(f"{axis} {value:+.1f} µm" for axis, value in vector.items())
