"""What `monitor trend` says of calibrated quantities that results of several campaigns have in common."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from monitor.cli import output
from monitor.workflow.history.in_common import RestsOn
from monitor.workflow.trend.answer import TrendAnswer


def named(each: RestsOn) -> str:
    """A calibrated quantity as people call it."""
    certificate = f" ({each.certificate})" if each.certificate else ""
    return f"the {each.quantity} of {each.calibrated}{certificate}"


def left_out(rested_on: Iterable[RestsOn]) -> str:
    """What two compared results have in common, as the end of a sentence."""
    quantities = " and ".join(named(each) for each in rested_on)
    return f"; {quantities} is in both and no part of the difference" if quantities else ""


def levels(answer: TrendAnswer) -> Iterator[str]:
    """Yield a sentence for each quantity that all runs rest on, with what it makes of the levels of each parameter."""
    parts: dict[str, list[str]] = {}
    for name, parameter in answer.parameters.items():
        for each in parameter.rests_on or ():
            u = f"{name} {output.two_digits(each.u)} {parameter.unit}"
            parts.setdefault(named(each), []).append(u)
    for quantity, of_parameters in parts.items():
        yield (
            f"all runs rest on {quantity}: u of levels and of what is foretold holds it "
            f"({', '.join(of_parameters)}), slopes and steps do not"
        )
