"""Uncertainty of a run's geometric errors after JCGM 102:2011: GUM framework, adaptive Monte Carlo, validation."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.readers import read_linear_axes
from monitor.workflow.uncertainty.evaluation import uncertainty

EXAMPLE = "monitor uncertainty five-days --run 20 --method guf"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("campaign", metavar="CAMPAIGN")
    parser.add_argument("--run", type=int, metavar="N", dest="number", help="the run (default: the last)")
    parser.add_argument(
        "--method", default="both", help="guf, mcm or both (default both, with the validation)"
    )
    parser.add_argument(
        "--digits", type=int, default=2, metavar="N", help="significant digits wanted of u (default 2)"
    )
    parser.add_argument(
        "--seed", type=int, default=1, metavar="S", help="seed of the Monte Carlo (default 1)"
    )
    parser.add_argument(
        "-p", type=float, default=0.95, metavar="P", help="coverage probability (default 0.95)"
    )
    parser.add_argument("--model", metavar="NAME")
    parser.add_argument(
        "--select", metavar="NAME",
        help="covariance of the readings from the runs of this selection, or of a campaign of the same plan",
    )  # fmt: skip
    parser.add_argument(
        "--no-model-uncertainty", action="store_true", help="leave the budget's line for lack of fit out"
    )
    parser.add_argument(
        "--linear-axes", type=Path, metavar="FILE",
        help="errors of the linear axes as standard uncertainties (TOML), for methods that take these axes as known",
    )  # fmt: skip
    parser.add_argument("--workers", type=int, metavar="N", help="spread the trials over N processes")
    parser.add_argument(
        "--cluster", metavar="ADDRESS", help="spread them over a Dask cluster, such as tcp://host:8786"
    )


def run(options: Namespace) -> int:
    with opened(options) as db, output.working("propagating"):
        found = uncertainty(
            db, options.campaign, options.number, model=options.model, method=options.method, digits=options.digits,
            seed=options.seed, p=options.p, select=options.select, model_uncertainty=not options.no_model_uncertainty,
            workers=options.workers, cluster=options.cluster,
            linear_axes=None if options.linear_axes is None else read_linear_axes(options.linear_axes),
        )  # fmt: skip
    if options.json:
        output.document(found)
        return 0
    guf, mcm = found["guf"], found.get("mcm")
    columns = ["parameter", "unit", "estimate", "u (GUF)", *(["u (Monte Carlo)"] if mcm else []), "U = k_q u"]
    rows = []
    for name in found["parameters"]:
        u, expanded = guf["u"][name], guf["expanded"][name]
        more = [output.two_digits(mcm["u"][name])] if mcm else []
        rows.append(
            [name, found["units"][name], output.rounded(guf["estimate"][name], expanded), output.two_digits(u), *more,
             output.rounded(expanded, expanded)]
        )  # fmt: skip
    output.table(
        f"{found['campaign']}, run {found['run']}, model {found['model']}", columns, rows, text_columns=2
    )
    count, p = len(found["parameters"]), found["p"]
    output.say(f"readings: {found['input_covariance']}")
    output.say(
        f"all {count} together with p = {p:g}: intervals U = {guf['k_q_with_degrees_of_freedom']:.2f} u (k_q), "
        f"ellipsoid k_p = {guf['k_p_with_degrees_of_freedom'] or float('inf'):.2f}; for a known covariance (JCGM 102) "
        f"k_q = {guf['k_q']:.2f}, k_p = {guf['k_p']:.2f}"
    )
    output.say(f"k = 2 each would hold all {count} with only {100 * guf['joint_coverage_of_k_2_each']:.0f} %")
    if mcm:
        output.say(
            f"Monte Carlo: {mcm['trials']} trials in {mcm['seconds']:.1f} s, {mcm['not_converged']} not converged, "
            f"{'stable' if mcm['stable'] else 'not stable yet'}; k_q = {mcm['k_q']:.2f}, k_p = {mcm['k_p']:.2f}"
        )
    if "validation" in found:
        failed = [
            name for name, value in found["validation"]["differences"].items()
            if abs(value) > found["validation"]["tolerances"][name]
        ]  # fmt: skip
        verdict = (
            "passed" if found["validation"]["passed"] else f"not passed: {', '.join(failed) or 'undecided'}"
        )
        output.say(f"validation of the framework by Monte Carlo (JCGM 102, 8): {verdict}")
        if failed == ["k_q"] and mcm is not None and guf["k_q"] > mcm["k_q"]:
            output.say(
                f"   the framework's k_q = {guf['k_q']:.2f} holds whatever the correlations (Bonferroni); these would "
                f"allow {mcm['k_q']:.2f}, so its intervals are on the safe side"
            )
    if "lack_of_fit_causes" in found:
        causes = ", ".join(one["effect"] for one in found["lack_of_fit_causes"][:3])
        output.say(
            f"the model does not explain all: what effects such as {causes} would do to the parameters, none of them "
            f"confirmed, is a line of the budget; `monitor explain {found['campaign']}` tests which one is missing"
        )
    for refusal in found["refused"]:
        output.say(f"no number: {refusal['why']}")
    return 0
