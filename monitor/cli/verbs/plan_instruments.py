"""What ``monitor plan`` prints for a campaign of instruments."""

from __future__ import annotations

from monitor.cli import output
from monitor.cli.measurement_output import test_name, where
from monitor.workflow.plan.answer import InstrumentPlanAnswer
from monitor.workflow.plan.test_answer import TestAnswer


def tables(answer: InstrumentPlanAnswer) -> None:
    """Which instrument next, and where; the proposed tests in turn; what would see what has no number yet."""
    shown = answer.asked[:4]
    columns = ["test", *(f"u {name}" for name in shown), "where"]
    as_measured = ["as measured", *(_u(answer.present.get(name)) for name in shown), ""]
    rows = [
        [test_name(test), *(_u(test.u.get(name)) for name in shown), where(test)] for test in answer.tests
    ]
    units = ", ".join(f"{name} in {answer.units[name]}" for name in shown)
    further = len(answer.asked) - len(shown)
    more = f", ranked for {further} more parameters (--json has them)" if further else ""
    output.table(
        f"{answer.campaign}, run {answer.run}: u with one more test ({units}{more})",
        columns,
        [as_measured, *rows],
        text_columns=1,
    )
    if any(not test.available for test in answer.tests):
        output.say("(usual): an instrument that the campaign does not have, with its usual uncertainty")
    for number, test in enumerate(answer.proposed, 1):
        u = ", ".join(f"{name} {_u(test.u.get(name))} {answer.units[name]}" for name in shown)
        output.say(f"{number}. {test_name(test)}: {where(test)}; then u of {u}")
    if answer.tests:
        output.say("--json has every pose of these tests (axes_by_pose)")
    _remarks(answer)


def _remarks(answer: InstrumentPlanAnswer) -> None:
    """What no test moves, what no test sees, and what would see what has no number yet."""
    for axis in answer.standing:
        output.say(
            f"{axis} stood still and has no stroke in the machine file, so no test moves it; state its stroke_mm"
        )
    for axis in answer.not_turned:
        output.say(
            f"no R-test and no bar around {axis}: the linear axes would have to travel further than they did; state "
            "stroke_mm of those that can"
        )
    for name in answer.asked:
        if all(u.get(name) is None for u in (answer.present, *(test.u for test in answer.tests))):
            output.say(f"no single test gives {name} a number; {_pair(answer.pairs.get(name))}")
    for parameter in answer.unseen:
        output.say(
            f"{parameter.parameter} has no number yet: {test_name(parameter.test)} would give it u = {parameter.u:.2g} "
            f"{parameter.unit} ({where(parameter.test)})"
        )


def _pair(tests: tuple[TestAnswer, ...] | None) -> str:
    """Two tests that do together what no single one does."""
    if tests is None:
        return "`monitor identify` says why it has none"
    if not tests:
        return "nor do any two of them; `monitor identify` says why it has none"
    return "together these do: " + " and ".join(f"{test_name(test)} ({where(test)})" for test in tests)


def _u(value: float | None) -> str:
    return "none" if value is None else f"{value:.2g}"
