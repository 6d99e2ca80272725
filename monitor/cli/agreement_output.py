"""What `monitor trend` says of two results of one machine that should agree, or should not."""

from __future__ import annotations

from monitor.cli.rests_on_output import left_out
from monitor.reporting.lacks import Undecided
from monitor.workflow.history.agreement import AgreementPair


def agreement_line(pair: AgreementPair) -> str:
    """A pair as a line for people."""
    first, second = pair.campaigns
    errors = {name: abs(result.e_n) for name, result in pair.parameters.items() if result.e_n is not None}
    worst = max(errors, key=errors.__getitem__, default="")
    number = f"; largest |E_n| {errors[worst]:.2g} ({worst})" if errors else ""
    if pair.methods is None:
        subject = f"before and after the {pair.event} ({first}, {second}; {pair.method})"
        return (
            f"{subject}: {_moved(pair)}{number}{_judged_with(pair)}"
            if errors
            else f"{subject}: {Undecided.ONE_DAY_EACH}"
        )
    subject, both = (
        f"{pair.methods[0]} ({first}) and {pair.methods[1]} ({second})",
        left_out(pair.in_common or ()),
    )
    if not pair.disagree:
        return f"{subject} agree within their uncertainties in {', '.join(pair.parameters)}{number}{both}"
    return f"{subject}{_apart(pair.days_apart)} disagree in {', '.join(pair.disagree)}{number}{_meanwhile(pair)}{both}"


def _apart(days: float | None) -> str:
    """How many days lie between two measurements; nothing of the same day."""
    return f", {_days(days)} apart," if days is not None and round(abs(days)) >= 1 else ""


def _meanwhile(pair: AgreementPair) -> str:
    """What a difference of two days holds besides that of the methods."""
    if not _apart(pair.days_apart):
        return ""
    return "; what the machine changed meanwhile is in the difference: measure with both on one day to tell them apart"


def _days(days: float) -> str:
    count = round(abs(days))
    return f"{count} day{'s' if count != 1 else ''}"


def _moved(pair: AgreementPair) -> str:
    """The parameters that moved at an event, from which value to which."""
    moved = [(name, pair.parameters[name]) for name in pair.disagree]
    undecided = any(result.why_not_decided for result in pair.parameters.values())
    drift = " and the drift" if any(result.drift_in_30_days for result in pair.parameters.values()) else ""
    quiet = "nothing decided" if undecided else f"nothing moved beyond the scatter of runs and days{drift}"
    return (
        ", ".join(f"{name} {result.first:.3g} -> {result.second:.3g} {result.unit}" for name, result in moved)
        or quiet
    )


def _judged_with(pair: AgreementPair) -> str:
    """Which other days of the machine said how days differ, and the parameters that nothing is said of."""
    results = pair.parameters.values()
    days = max((result.other_days or 0 for result in results), default=0)
    campaigns = max((result.other_campaigns or 0 for result in results), default=0)
    lean = [f"{count} other {of}" for count, of in ((days, "days"), (campaigns, "campaigns")) if count]
    judged = f"; judged with the scatter of {' and '.join(lean)} of the machine" if lean else ""
    undecided = "".join(
        f"; {', '.join(names)} {reason}"
        for reason in (Undecided.DAYS_MAY_DO, Undecided.DRIFT_MAY_DO, Undecided.ONE_DAY_EACH)
        if (names := [name for name, result in pair.parameters.items() if result.why_not_decided is reason])
    )
    return judged + _drifting(pair) + undecided


def _drifting(pair: AgreementPair) -> str:
    """What the machine drifts by beside the event, where that is seen."""
    drifts = [
        f"{name} {result.drift_in_30_days:+.3g} {result.unit}"
        for name, result in pair.parameters.items()
        if result.drift_in_30_days is not None
    ]
    return f"; beside a drift in 30 days of {', '.join(drifts)}" if drifts else ""
