"""What the parameters of a trend go with, as sentences: conditions, cycles, the warm-up of a campaign."""

from __future__ import annotations

from collections.abc import Iterator

from monitor.cli import output
from monitor.reporting.confounding import whether_with_condition, whether_with_cycle
from monitor.workflow.trend.answer import ConditionEffect, Cycle, ParameterTrend, TrendAnswer, WarmUp

#: Below this false discovery rate over all parameters a dependence, a cycle or a warm-up is stated.
STATED_Q = 0.05


def dependences(answer: TrendAnswer) -> Iterator[str]:
    """Yield what each parameter goes with, and once for all of them what instruments leave undecided."""
    undecided: dict[str, list[str]] = {}
    for name, parameter in answer.parameters.items():
        for what in _undecided(parameter):
            undecided.setdefault(what, []).append(name)
        yield from _of_parameter(name, parameter)
    for what, names in undecided.items():
        yield f"{', '.join(names)}: {what}"


def _undecided(parameter: ParameterTrend) -> Iterator[str]:
    for effect in parameter.conditions:
        if _is_stated(effect.q_value) and effect.not_decided is not None:
            yield whether_with_condition(effect.channel, effect.not_decided)
    for wave in parameter.cycles:
        if _is_stated(wave.q_value) and wave.not_decided is not None:
            yield whether_with_cycle(wave.cycle, wave.not_decided)


def _is_stated(q_value: float | None) -> bool:
    return q_value is not None and q_value < STATED_Q


def _of_parameter(name: str, parameter: ParameterTrend) -> Iterator[str]:
    """What is decided of a parameter."""
    for effect in parameter.conditions:
        if _is_stated(effect.q_value) and effect.not_decided is None:
            yield _condition(name, effect)
    for wave in parameter.cycles:
        if _is_stated(wave.q_value) and wave.not_decided is None:
            yield _cycle(name, wave)
    warmth = parameter.warm_up
    if warmth is not None and _is_stated(warmth.q_value):
        yield _warm_up(name, warmth)


def _condition(name: str, effect: ConditionEffect) -> str:
    inseparable = f"; not told from {', '.join(effect.moves_with)}" if effect.moves_with else ""
    stated = f"{output.with_u(effect.coefficient, effect.u, effect.unit)} with {effect.channel}"
    if effect.within_days is not None and effect.u_within_days is not None:
        within = output.with_u(effect.within_days, effect.u_within_days, effect.unit)
        stated += f" from day to day, within days {within}"
    return f"{name}: {stated}{inseparable}"


def _cycle(name: str, wave: Cycle) -> str:
    return f"{name}: goes up and down by {output.with_u(wave.amplitude, wave.u, wave.unit)} over the {wave.cycle}"


def _warm_up(name: str, warmth: WarmUp) -> str:
    moves, stable = "falls" if warmth.amplitude > 0.0 else "rises", warmth.stable_after_h
    # A server of version 0.2.0 does not say how many hours were recorded.
    recorded = "" if warmth.recorded_h is None else f"{_hours(warmth.recorded_h)} h"
    ends = (
        f"not yet stable after the {recorded or 'hours'} recorded"
        if stable is None or (warmth.recorded_h is not None and stable > warmth.recorded_h)
        else f"stable after {_hours(stable)} h"
    )
    what, constant = (
        ("warms up or drifts", "not determined")
        if warmth.tau_h is None
        else ("warms up", f"{_hours(warmth.tau_h)} h")
    )
    change = f"{moves} by {abs(warmth.amplitude):.3g} {warmth.unit}{recorded and f' within {recorded}'}"
    return f"{name}: {what}: {change}, time constant {constant}; {ends}"


def _hours(hours: float) -> str:
    """Two digits, never in powers of ten."""
    return f"{float(f'{hours:.2g}'):.10g}"
