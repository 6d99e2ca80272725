"""Uncertainty of a run's geometric errors after JCGM 102:2011: GUM framework, adaptive Monte Carlo, validation."""

from __future__ import annotations

import math
from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.behind import add_behind, further_sources
from monitor.cli.budget_output import behind
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.cli.screen import on_screen
from monitor.readers import read_linear_axes
from monitor.reporting.certificate.grounds import ground_sentence
from monitor.reporting.factor_sampling import FactorSampling
from monitor.reporting.frames import frame_words, sum_words
from monitor.reporting.numbers import written_factor
from monitor.reporting.texts import texts_of
from monitor.workflow.uncertainty.answer import MonteCarloAnswer, UncertaintyAnswer, ValidationAnswer
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest

EXAMPLE = "monitor uncertainty five-days --run 20 --method guf"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", metavar="CAMPAIGN", help="a campaign of the database (monitor campaigns lists them)"
    )
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
    add_model(parser)
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
    add_behind(parser)
    parser.add_argument("--workers", type=int, metavar="N", help="spread the trials over N processes")
    parser.add_argument(
        "--cluster", metavar="ADDRESS", help="spread them over a Dask cluster, such as tcp://host:8786"
    )


def run(options: Namespace) -> int:
    request = UncertaintyRequest(
        options.campaign,
        options.number,
        model=options.model,
        method=options.method,
        digits=options.digits,
        seed=options.seed,
        p=options.p,
        select=options.select,
        model_uncertainty=not options.no_model_uncertainty,
        workers=options.workers,
        cluster=options.cluster,
        linear_axes=None if options.linear_axes is None else read_linear_axes(options.linear_axes),
        sources=further_sources(options.sources),
        holds_for=options.holds_for,
    )
    with opened(options) as db, output.working("propagating"):
        answer = ask(db, uncertainty, request)
    if options.json:
        output.document(answer)
        return 0
    answer = on_screen(answer)
    output.copied(answer.copied_readings)
    _parameters(answer)
    _machine_frame(answer)
    _coverage(answer)
    behind(answer)
    if answer.mcm is not None:
        _monte_carlo(answer.mcm)
    if answer.validation is not None:
        _validation(answer.validation)
    if answer.lack_of_fit_causes is not None:
        causes = ", ".join(cause.effect for cause in answer.lack_of_fit_causes[:3])
        output.say(
            f"the model does not explain all: what effects such as {causes} would do to the parameters, none of them "
            f"confirmed, is a line of the budget; `monitor explain {answer.campaign}` tests which one is missing"
        )
    for refusal in answer.refused:
        output.say(f"no number: {refusal.why}")
    for ground in answer.grounds or ():
        output.say(f"speaks against a certificate ({ground.kind}): {ground_sentence(ground, texts_of())}")
    return 0


def _parameters(answer: UncertaintyAnswer) -> None:
    """The table of the parameters."""
    framework, sampled = answer.guf, answer.mcm
    of_sampled = ["u (Monte Carlo)"] if sampled is not None else []
    columns = ["parameter", "unit", "relative to", "estimate", "u (GUF)", *of_sampled, "U = k_q u"]
    frames = answer.frames or {}
    rows = []
    for name in answer.parameters:
        expanded = framework.expanded[name]
        rows.append(
            [
                name,
                answer.units[name],
                frame_words(frames.get(name)),
                output.rounded(framework.estimate[name], expanded),
                output.two_digits(framework.u[name]),
                *([output.two_digits(sampled.u[name])] if sampled is not None else []),
                output.rounded(expanded, expanded),
            ]
        )
    output.table(f"{answer.campaign}, run {answer.run}, model {answer.model}", columns, rows, text_columns=3)


def _machine_frame(answer: UncertaintyAnswer) -> None:
    """The location errors whose value in the machine frame is another than relative to the axis before."""
    frame = answer.machine_frame
    if frame is None or not frame.parameters:
        return
    if not frame.moved:
        output.say("in the machine frame all location errors have these values")
        return
    columns = ["in the machine frame", "unit", "sum of", "value", "u"]
    rows = [
        [
            name,
            frame.units[name],
            sum_words(frame.sums[name]),
            output.rounded(frame.estimate[name], frame.u[name]),
            output.two_digits(frame.u[name]),
        ]
        for name in frame.moved
    ]
    output.table("", columns, rows, text_columns=3)
    output.say(
        "the other location errors have the values above in the machine frame, too; --json has the covariance"
    )


def _coverage(answer: UncertaintyAnswer) -> None:
    """Where the readings' covariance is from, and the factors for all parameters together."""
    framework, count = answer.guf, len(answer.parameters)
    output.say(f"readings: {answer.input_covariance}")
    sampling = framework.coverage_sampling or FactorSampling(0, 0, 0.0, 0.0)
    k_q = written_factor(
        framework.k_q_with_degrees_of_freedom or math.inf, standard_error=sampling.k_q_standard_error
    )
    k_p = framework.k_p_with_degrees_of_freedom
    ellipsoid = (
        "no ellipsoid, whose covariance would need more degrees of freedom than parameters"
        if k_p is None
        else f"ellipsoid k_p = {written_factor(k_p, standard_error=sampling.k_p_standard_error)}"
    )
    output.say(
        f"all {count} together with p = {answer.p:g}: intervals U = {k_q} u (k_q), {ellipsoid}; for a known covariance "
        f"(JCGM 102) k_q = {framework.k_q:.2f}, k_p = {framework.k_p:.2f}"
    )
    if framework.joint_coverage_of_k_2_each is not None:
        output.say(
            f"k = 2 each would hold all {count} with only {100 * framework.joint_coverage_of_k_2_each:.0f} %"
        )


def _monte_carlo(sampled: MonteCarloAnswer) -> None:
    output.say(
        f"Monte Carlo: {sampled.trials} trials in {sampled.seconds:.1f} s, {sampled.not_converged} not converged, "
        f"{'stable' if sampled.stable else 'not stable yet'}; k_q = {sampled.k_q:.2f}, k_p = {sampled.k_p:.2f}"
    )


def _validation(validation: ValidationAnswer) -> None:
    if validation.passed:
        output.say(
            "validation of the framework by Monte Carlo (JCGM 102, 8): passed; "
            f"{', '.join(validation.confirmed)} of a known covariance agree, so that the linearisation is confirmed"
        )
        return
    failed = ", ".join(validation.failed) or "undecided within the scatter of the Monte Carlo"
    output.say(
        f"validation of the framework by Monte Carlo (JCGM 102, 8): not passed: {failed}; confirmed: "
        f"{', '.join(validation.confirmed) or 'nothing'}"
    )
