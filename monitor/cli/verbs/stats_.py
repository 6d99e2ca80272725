"""Statistics of a campaign's runs: means, standard deviations, pooled by group, Bartlett and ANOVA.

--by takes day, run, warm_up, hours, a recorded condition or channel (cut at its terciles), or the name of a
selection; --select takes the runs of a selection (`monitor select` makes one); --where a condition on the same
columns, such as "hours > 6" or "ambient_degC < 22 and warm_up == 0".
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.store import load_campaign, load_identification
from monitor.workflow.run_statistics.statistics import stats

EXAMPLE = "monitor stats five-days --by day --figures figures"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("campaign", metavar="CAMPAIGN")
    parser.add_argument(
        "--by", default="day", metavar="COLUMN", help="what the runs are grouped by (default day)"
    )
    parser.add_argument("--where", metavar="CONDITION", help="only runs for which it holds")
    parser.add_argument("--select", metavar="NAME", help="only the runs of this stored selection")
    parser.add_argument("--model", metavar="NAME")
    parser.add_argument(
        "--matrices", type=Path, metavar="DIR", help="write covariance and correlation matrices as CSV files"
    )
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw the parameters over the runs")


def run(options: Namespace) -> int:
    # One transaction: figures that cannot be drawn leave no result behind.
    with opened(options, threads=1) as db, output.working("computing"), db.transaction():
        found = stats(
            db, options.campaign, options.by, options.where, options.model, options.select, options.matrices
        )
        if options.figures is not None:
            from monitor.workflow.run_statistics.figures import statistics_figure

            days = {one.run: one.day for one in load_campaign(db, options.campaign).runs}
            found["figures"] = statistics_figure(
                found, load_identification(db, options.campaign), days, options.figures
            )
    if options.json:
        output.document(found)
        return 0
    groups = ", ".join(f"{label}: {count}" for label, count in found["groups"].items())
    rows = [
        [
            name,
            one["unit"],
            output.rounded(one["mean"], one["u_all"]),
            output.two_digits(one["u_all"]),
            output.two_digits(one["u_pooled"]),
            output.probability(one["bartlett_p"]),
            output.probability(one["anova_p"]),
            output.probability(one["anova_q"]),
            output.probability(one["normality_p"]),
        ]
        for name, one in found["parameters"].items()
    ]
    output.table(
        f"{found['campaign']}, runs by {found['by']} ({groups})",
        ["parameter", "unit", "mean", "u all", "u pooled", "Bartlett p", "ANOVA p", "ANOVA q", "normal p"],
        rows,
        text_columns=2,
    )
    moved = [
        name
        for name, one in found["parameters"].items()
        if one["anova_q"] is not None and one["anova_q"] < 0.001
    ]
    if moved:
        output.say(f"the groups differ in {', '.join(moved)} (ANOVA, false discovery rate q below 0.001)")
    for name in ("box_m", "manova"):
        test = found["vector"][name]
        words = "equal covariances" if name == "box_m" else "equal means"
        if test["why"] is None:
            output.say(
                f"all parameters together, {words} ({test['name']}): {output.stated('p', test['p_value'])}"
            )
        else:
            output.say(f"all parameters together, {words}: not tested. {test['why']}")
    for name in found["drift"]["drifts"]:
        one = found["drift"]["parameters"][name]
        output.say(
            f"{name} drifts within the day: {output.rounded(one['per_hour'], one['u'])} {one['unit']} "
            f"(u = {output.two_digits(one['u'])} {one['unit']}, q = {output.probability(one['q_value'])})"
        )
    tested = [p for p in found["coordinates"]["anova_p"] if p is not None]
    if tested:
        below = sum(p < 0.05 for p in tested)
        output.say(f"probed coordinates: {len(tested)}; ANOVA p below 0.05 in {below} of them")
    for file in (*found.get("matrices", []), *found.get("figures", [])):
        output.say(file)
    return 0
