"""What `monitor trend` says of days that differ and that resemble each other, and of the year."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from monitor.reporting.messages import DRIFT_OR_SEASON, SEASON_NOT_TOLD
from monitor.workflow.history.season import Season, SlopeVerdict
from monitor.workflow.trend.answer import DriftStatement, TrendAnswer

#: Blocks of days up to which nothing is known of how far days resemble each other.
_FEW_BLOCKS = 5
#: From this ratio on it is said that days differ, and from this factor that an interval is wider.
_DAYS_DIFFER, _WIDER = 0.5, 1.1


def resemblance(answer: TrendAnswer) -> Iterator[str]:
    """Yield what the intervals of the slopes assume of days that differ or resemble each other, and of the year."""
    stated = {
        name: parameter.drift for name, parameter in answer.parameters.items() if parameter.drift.resemblance
    }
    allowed = {name: drift.resemblance for name, drift in stated.items() if drift.resemblance is not None}
    if not allowed:
        return
    ratios = {
        name: drift.between_days / drift.within_days
        for name, drift in stated.items()
        if drift.between_days and drift.within_days
    }
    name = max(ratios, key=lambda parameter: ratios[parameter], default="")
    if name and ratios[name] > _DAYS_DIFFER:
        yield f"{name}: days differ by {ratios[name]:.2g} times the scatter of a run; allowed for"
    name = max(allowed, key=lambda parameter: allowed[parameter].widening)
    widest = allowed[name]
    if widest.blocks <= _FEW_BLOCKS:
        days = stated[name].days
        groups = f" in {widest.blocks} groups" if days > widest.blocks else ""
        wide = (
            f"up to {widest.widening:.2g} times as wide as"
            if widest.widening > _WIDER
            else "no narrower than"
        )
        yield (
            f"{days} days{groups} cannot tell how far days resemble each other, nor a drift from days that differ: "
            f"the intervals of the slopes are {wide} with independent days"
        )
    elif widest.widening > _WIDER:
        yield (
            f"{name}: autocorrelation between days {widest.correlation:.2g}, up to {widest.allowed_for:.2g} is allowed "
            f"for: the slope's interval is {widest.widening:.2g} times as wide as with independent days"
        )
    yield from _seasons(stated)


def _seasons(stated: Mapping[str, DriftStatement]) -> Iterator[str]:
    """Yield what answers for the season beside the slopes, and which of them may be nothing else."""
    names = dict.fromkeys(drift.temperature for drift in stated.values() if drift.temperature)
    if names:
        yield f"what goes with {', '.join(names)} is allowed for beside the slopes"
    unsure = [name for name, drift in stated.items() if drift.verdict is SlopeVerdict.DRIFT_OR_SEASON]
    if unsure:
        moves = ", ".join(f"{name} {_direction(stated[name])}" for name in unsure)
        yield f"{moves}; {DRIFT_OR_SEASON}"
    seasons = {drift.season for drift in stated.values()}
    if Season.NOT_TOLD in seasons:
        yield SEASON_NOT_TOLD
    if Season.ALLOWED_FOR in seasons:
        yield "what goes up and down with the year is allowed for beside the slopes"


def _direction(drift: DriftStatement) -> str:
    return "rises" if (drift.slope_per_year or 0.0) > 0.0 else "falls"
