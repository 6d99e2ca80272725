"""What `monitor trend` says of calibrated quantities that results of several campaigns have in common."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from monitor.cli import output
from monitor.reporting.calibration_messages import steps_between_instruments
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
    """Yield a sentence for each quantity that runs since the last change rest on, with what it makes of the latest
    mean, of the line that is foretold and of the slope of each parameter."""
    of_quantity: dict[RestsOn, list[tuple[str, str, RestsOn]]] = {}
    for name, parameter in answer.parameters.items():
        for each in parameter.rests_on or ():
            key = RestsOn(each.calibrated, each.quantity, each.certificate)
            of_quantity.setdefault(key, []).append((name, parameter.unit, each))
    for quantity, stated in of_quantity.items():
        is_bound = any(each.at_most for _, _, each in stated)
        # A server of an older version says nothing of runs: there all rested on it.
        if is_bound or any(each.runs != each.of_runs for _, _, each in stated):
            yield _of_some(quantity, stated, is_bound)
        else:
            parts = ", ".join(f"{name} {output.two_digits(each.u)} {unit}" for name, unit, each in stated)
            yield (
                f"all runs since the last change rest on {named(quantity)}: u of levels and of what is foretold holds "
                f"it ({parts}), slopes do not"
            )


def _of_some(quantity: RestsOn, stated: list[tuple[str, str, RestsOn]], is_bound: bool) -> str:
    """What runs beside those of other calibrations rest on, or at most."""
    parts = "; ".join(_shares(name, unit, each) for name, unit, each in stated)
    bound = ", of runs that an older version identified at most: type `monitor identify` for their campaigns"
    return (
        f"{named(quantity)} is in u of means and lines with the share of the runs that rest on it"
        f"{bound if is_bound else ''} ({parts})"
    )


def _shares(name: str, unit: str, each: RestsOn) -> str:
    """The shares of one parameter: 'EXX, 12 of 20 runs: latest 0, line 0.5 µm/m, slope 0.3 µm/m a year'."""
    shares = {
        "latest": (each.u, unit),
        "line": (each.u_line, unit),
        "slope": (each.u_slope_per_year, f"{unit} a year"),
    }
    listed = ", ".join(
        f"{what} {output.two_digits(u)} {of}" if u else f"{what} 0"
        for what, (u, of) in shares.items()
        if u is not None
    )
    return f"{name}, {each.runs} of {each.of_runs} runs: {listed}"


def steps_at_once(answer: TrendAnswer) -> Iterator[str]:
    """Yield a sentence for each exchange of instruments at which several parameters step, once for all of them."""
    between = [change.between_instruments for each in answer.parameters.values() for change in each.changes]
    for others in dict.fromkeys(replace(each, u=None, e_n=None) for each in between if each is not None):
        if others.together and others.p_value is not None:
            yield steps_between_instruments(
                others.before,
                others.after,
                others.together,
                others.may_be_all,
                output.stated("p", others.p_value),
            )
