"""Statistics of a campaign's runs: means, standard deviations, pooled by group, Bartlett and ANOVA.

--by takes day, run, warm_up, hours, a recorded condition or channel (cut at its terciles), or the name of a
selection; --select takes the runs of a selection (`monitor select` makes one); --where a condition on the same
columns, such as "hours > 6" or "ambient_degC < 22 and warm_up == 0".
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.cli.screen import on_screen
from monitor.workflow.run_statistics.answer import DIFFERENT, NoVectorTest, StatisticsAnswer, VectorTestAnswer
from monitor.workflow.run_statistics.request import StatisticsRequest
from monitor.workflow.run_statistics.statistics import stats

EXAMPLE = "monitor stats five-days --by day --figures figures"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", metavar="CAMPAIGN", help="a campaign of the database (monitor campaigns lists them)"
    )
    parser.add_argument(
        "--by", default="day", metavar="COLUMN", help="what the runs are grouped by (default day)"
    )
    parser.add_argument("--where", metavar="CONDITION", help="only runs for which it holds")
    parser.add_argument("--select", metavar="NAME", help="only the runs of this stored selection")
    add_model(parser)
    parser.add_argument(
        "--matrices", type=Path, metavar="DIR", help="write covariance and correlation matrices as CSV files"
    )
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw the parameters over the runs")


def run(options: Namespace) -> int:
    request = StatisticsRequest(
        options.campaign,
        by=options.by,
        where=options.where,
        model=options.model,
        select=options.select,
        matrices=options.matrices,
        figures=options.figures,
    )
    # One transaction: figures that cannot be drawn leave no result behind.
    with opened(options, threads=1) as db, output.working("computing"):
        answer = ask(db, stats, request)
    if options.json:
        output.document(answer)
        return 0
    answer = on_screen(answer)
    output.copied(answer.copied_readings)
    _parameters(answer)
    if answer.moved:
        output.say(
            f"the groups differ in {', '.join(answer.moved)} (means, whatever the scatter of each; false "
            f"discovery rate q below {DIFFERENT:g})"
        )
    _vector("equal covariances", answer.vector.box_m)
    _vector("equal means", answer.vector.manova)
    for name in answer.drift.drifts:
        drift = answer.drift.parameters[name]
        output.say(
            f"{name} drifts within the day: {output.rounded(drift.per_hour, drift.u)} {drift.unit} "
            f"(u = {output.two_digits(drift.u)} {drift.unit}, {output.stated('q', drift.q_value)})"
        )
    tested = [p for p in answer.coordinates.anova_p if p is not None]
    if tested:
        below = sum(p < 0.05 for p in tested)
        output.say(f"probed coordinates: {len(tested)}; ANOVA p below 0.05 in {below} of them")
    for file in (*(answer.matrices or ()), *(answer.figures or ())):
        output.say(file)
    return 0


def _parameters(answer: StatisticsAnswer) -> None:
    """The table of the parameters."""
    groups = ", ".join(f"{label}: {count}" for label, count in answer.groups.items())
    rows = [
        [
            name,
            parameter.unit,
            answer.refers_to.get(name, ""),
            output.rounded(parameter.mean, parameter.u_all),
            output.two_digits(parameter.u_all),
            output.two_digits(parameter.u_pooled),
            output.probability(parameter.bartlett_p),
            output.probability(parameter.anova_p),
            output.probability(parameter.anova_q),
            output.probability(parameter.normality_p),
        ]
        for name, parameter in answer.parameters.items()
    ]
    output.table(
        f"{answer.campaign}, runs by {answer.by} ({groups})",
        [
            "parameter",
            "unit",
            "relative to",
            "mean",
            "u all",
            "u pooled",
            "Bartlett p",
            "ANOVA p",
            "ANOVA q",
            "normal p",
        ],
        rows,
        text_columns=3,
    )


def _vector(hypothesis: str, test: VectorTestAnswer | NoVectorTest) -> None:
    if isinstance(test, NoVectorTest):
        output.say(f"all parameters together, {hypothesis}: not tested. {test.why}")
    else:
        output.say(f"all parameters together, {hypothesis} ({test.name}): {output.stated('p', test.p_value)}")
