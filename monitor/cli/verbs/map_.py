"""The volumetric error at the tool tip over the stroke, with its uncertainty; compensation tables as CSV."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.workflow.volumetric.compensation import FORMATS, write_tables
from monitor.workflow.volumetric.volumetric import POINTS, map_figures, volumetric_map

EXAMPLE = "monitor map five-days --run 20 --figures figures --compensation positioning-csv"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("campaign", metavar="CAMPAIGN")
    parser.add_argument("--run", type=int, metavar="N", dest="number", help="the run (default: the last)")
    parser.add_argument("--model", metavar="NAME")
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
    parser.add_argument("--compensation", metavar="FORMAT", help=f"write tables: {' or '.join(FORMATS)}")
    parser.add_argument(
        "--out", type=Path, default=Path("."), metavar="DIR", help="where the tables go (default: here)"
    )


def run(options: Namespace) -> int:
    # One transaction: files that cannot be written leave no result behind.
    with opened(options) as db, output.working("mapping"), db.transaction():
        found, mapped = volumetric_map(
            db, options.campaign, options.number, model=options.model, p=options.p, points=options.points,
            absolute=options.absolute,
        )  # fmt: skip
        if options.figures is not None:
            found["figures"] = map_figures(found, mapped, options.figures)
        if options.compensation is not None:
            found["tables"] = write_tables(mapped, options.compensation, options.out)
    if options.json:
        output.document(found)
        return 0
    region, worst = found["region"], found["worst"]
    strokes = ", ".join(
        f"{name} {low:.4g} to {high:.4g} mm" for name, (low, high) in region["readings_mm"].items()
    )
    output.say(
        f"{found['campaign']}, run {found['run']}, model {found['model']}: volumetric error at {region['points']} "
        f"points, {strokes} ({region['from']}), at {region['rotary_poses']} rotary "
        f"pose{'s' if region['rotary_poses'] != 1 else ''}"
    )
    rows = [
        [name, output.rounded(part["error_um"], part["expanded_um"]), output.two_digits(part['u_um']),
         output.rounded(part["expanded_um"], part["expanded_um"])]
        for name, part in (("worst point", worst), ("mean", found["mean"]), ("RMS", found["rms"]))
    ]  # fmt: skip
    output.table(
        "",
        ["length of the error", "µm", "u / µm", f"U / µm (k = {found['k']:.2f}, p = {found['p']:g})"],
        rows,
    )
    output.say(f"worst at {_place(worst['at'])}: {_vector(worst['vector_um'])}")
    largest = sorted(worst["by_parameter_um"].items(), key=lambda item: -abs(item[1]))[:4]
    output.say("most of it from " + ", ".join(f"{name} ({value:+.1f} µm)" for name, value in largest))
    if found["datum"] is not None:
        output.say(
            f"the workpiece's zero is set at {_place(found['datum'])}; --absolute leaves it where it is"
        )
    for one in found["left_out"]:
        output.say(f"not in the map: {one['parameter']}: {one['why']}")
    for file in (*found.get("figures", []), *found.get("tables", [])):
        output.say(file)
    return 0


def _place(at: dict[str, float]) -> str:
    return ", ".join(
        f"{name.split('_')[0].upper()} {value:.4g}{'°' if name.endswith('_deg') else ' mm'}"
        for name, value in at.items()
    )


def _vector(vector: dict[str, float]) -> str:
    return ", ".join(f"{axis} {value:+.1f} µm" for axis, value in vector.items())
